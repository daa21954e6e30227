#include "clients/view/server_options.hpp"

#include <stdexcept>

#include "clients/view/bounded_file.hpp"

namespace tubed {

namespace {

constexpr std::size_t kMinTokenLetters = 16;

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
  if (!options.vessel.empty()) server.vessel = read_surface(options.vessel, server.files.vessel);
  if (!options.points.empty()) server.files.points = read_points(options.points);
  if (!options.touched.empty()) server.files.touched = along(read_points(options.touched), MarkerAxes::kRas);
  return server;
}

void add_server_options(CommandLine& app, ServerOptions& options) {
  app.add_option("--listen", options.listen, "ADDRESS:PORT or unix:/PATH to serve the page at")
      .capture_default_str();
  app.add_option("--host", options.hosts,
                 "further name, with its port, under which browsers may ask: that of a proxy");
  app.add_option("--token-file", options.token_file, "file with the token that /?token=TOKEN has to name");
  add_room_files(app, options);
}

void add_room_files(CommandLine& app, ServerOptions& options) {
  app.add_option("--vessel", options.vessel, "surface of the vessel, STL or VTK XML (.vtp): world frame, mm");
  Argument points =
      app.add_option("--points", options.points,
                     "registration points, world frame, mm: CSV (name,x,y,z), .mrk.json or .fcsv");
  app.add_option("--touched", options.touched,
                 "the same points as `tubectl register` was given them, touched in the tracker's frame")
      .needs(points);
}

std::string address_of(const ServerOptions& options) {
  return (options.listen.starts_with("unix:") ? "" : "http://") + options.listen;
}

}  // namespace tubed
