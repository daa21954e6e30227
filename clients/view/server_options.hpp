// Where a page is served and who may read it, from the command line.
#pragma once

#include <string>
#include <vector>

#include "clients/view/web_server.hpp"
#include "idl/command_line/command_line.hpp"

namespace tubed {

struct ServerOptions {
  std::string listen = "127.0.0.1:8080";
  std::vector<std::string> hosts;
  std::string token_file;
  std::string vessel;
  std::string points;
  std::string touched;
};

/// Adds --listen, --host, --token-file and those of add_room_files(). `options` outlives the parsing.
void add_server_options(CommandLine& app, ServerOptions& options);
/// Adds --vessel, --points and --touched.
void add_room_files(CommandLine& app, ServerOptions& options);

/// Throws std::invalid_argument for files that cannot be read, and for what would let in everybody.
WebServerSettings server_settings(const ServerOptions& options);

/// What to type into a browser.
std::string address_of(const ServerOptions& options);

}  // namespace tubed
