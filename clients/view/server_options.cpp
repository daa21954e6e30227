#include "clients/view/server_options.hpp"

#include <fstream>
#include <stdexcept>

namespace tubed {

namespace {

constexpr std::size_t kMaxVesselBytes = std::size_t{64} << 20U;
constexpr std::size_t kMinTokenLetters = 16;

std::string content_of(const std::string& file, std::size_t max_bytes) {
  std::ifstream in(file, std::ios::binary);
  std::string content(max_bytes + 1, '\0');
  in.read(content.data(), static_cast<std::streamsize>(content.size()));
  content.resize(static_cast<std::size_t>(in.gcount()));
  if (content.empty()) throw std::invalid_argument("cannot read " + file + ", or it is empty");
  if (content.size() > max_bytes) {
    throw std::invalid_argument(file + " has more than " + std::to_string(max_bytes) + " bytes");
  }
  return content;
}

std::string read_token(const std::string& file) {
  std::string token = content_of(file, 256);
  token.erase(token.find_last_not_of(" \r\n") + 1);
  const bool is_plain =
      token.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_") ==
      std::string::npos;
  if (token.size() < kMinTokenLetters || !is_plain) {
    throw std::invalid_argument(
        file + " has no token: at least 16 letters, digits, - or _; openssl rand -hex 16 makes one");
  }
  return token;
}

}  // namespace

WebServerSettings server_settings(const ServerOptions& options) {
  WebServerSettings server;
  server.where = parse_listen_address(options.listen);
  server.access.hosts = server.where.host_names();
  for (const std::string& host : options.hosts) server.access.hosts.push_back(host);
  if (!options.token_file.empty()) server.access.token = read_token(options.token_file);
  if (!server.where.is_loopback() && server.access.token.empty()) {
    throw std::invalid_argument(
        "--listen " + options.listen +
        " can be reached from other machines: give --token-file FILE, or listen on 127.0.0.1 or on "
        "unix:/PATH behind a proxy");
  }
  if (!options.vessel.empty()) server.vessel = content_of(options.vessel, kMaxVesselBytes);
  return server;
}

void add_server_options(CommandLine& app, ServerOptions& options) {
  app.add_option("--listen", options.listen, "ADDRESS:PORT or unix:/PATH to serve the page at")
      .capture_default_str();
  app.add_option("--host", options.hosts,
                 "further name, with its port, under which browsers may ask: that of a proxy");
  app.add_option("--token-file", options.token_file, "file with the token that /?token=TOKEN has to name");
  app.add_option("--vessel", options.vessel, "STL file of the vessel, world frame, mm");
}

std::string address_of(const ServerOptions& options) {
  return (options.listen.starts_with("unix:") ? "" : "http://") + options.listen;
}

}  // namespace tubed
