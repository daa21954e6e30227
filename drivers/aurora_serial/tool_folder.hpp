// Definitions of tools without a programmed memory, from files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/aurora/port_setup.hpp"

namespace tubed {

/// The files port-1.rom to port-16.rom of a folder, as many as are there. Made before the session that writes
/// them, which it has to outlive; nothing changes afterwards.
class ToolFolder {
 public:
  /// An empty path is no folder and has no tools. Throws std::runtime_error, with the name of the file and of
  /// `setting`, which named the folder, when one cannot be read or has not 1 to 4096 bytes.
  ToolFolder(const std::filesystem::path& folder, std::string_view setting);
  ToolFolder(const ToolFolder&) = delete;
  ToolFolder& operator=(const ToolFolder&) = delete;

  [[nodiscard]] std::span<const aurora::ToolDefinition> tools() const noexcept { return tools_; }

 private:
  std::vector<std::vector<std::uint8_t>> bytes_;
  std::vector<aurora::ToolDefinition> tools_;
};

}  // namespace tubed
