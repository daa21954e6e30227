#include "drivers/aurora_serial/tool_folder.hpp"

#include <fstream>
#include <stdexcept>
#include <string>

namespace tubed {

namespace {

constexpr int kPorts = 16;
constexpr std::size_t kMaxTool = aurora::ToolDefinition::kSize;

std::vector<std::uint8_t> read_tool(const std::filesystem::path& file, std::string_view setting) {
  std::ifstream stream(file, std::ios::binary);
  std::vector<std::uint8_t> bytes(kMaxTool + 1);  // no more is read, be it a device or a wrong file
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  if (!stream.is_open() || bytes.empty() || bytes.size() > kMaxTool) {
    throw std::runtime_error("tool definition file " + file.string() +
                             " cannot be read or is no file of 1 to " + std::to_string(kMaxTool) +
                             " bytes; see " + std::string(setting));
  }
  return bytes;
}

}  // namespace

ToolFolder::ToolFolder(const std::filesystem::path& folder, std::string_view setting) {
  bytes_.reserve(kPorts);
  for (int port = 1; port <= kPorts && !folder.empty(); ++port) {
    const auto file = folder / ("port-" + std::to_string(port) + ".rom");
    if (std::filesystem::exists(file)) {
      bytes_.push_back(read_tool(file, setting));
      tools_.push_back({port, bytes_.back()});
    }
  }
}

}  // namespace tubed
