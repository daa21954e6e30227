#include "clients/view/room_files.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "clients/view/bounded_file.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

constexpr std::size_t kMaxVesselBytes = std::size_t{64} << 20U;
constexpr std::size_t kHeadBytes = 4096;  // in which a file says what it is
constexpr std::size_t kTailBytes = 1024;
constexpr std::size_t kStlHeadBytes = 84;  // 80 of any kind, then the number of triangles
constexpr std::size_t kStlTriangleBytes = 50;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::string_view kBlanks = " \t\r\n";

[[noreturn]] void refuse(const std::string& name, const std::string& words) {
  throw std::invalid_argument(printable_text(name) + ": " + words);
}

/// The value of name="value" in a tag, or "".
std::string_view attribute(std::string_view tag, std::string_view name) {
  for (std::size_t at = tag.find(name); at != std::string_view::npos; at = tag.find(name, at + 1)) {
    const std::string_view rest = tag.substr(at + name.size());
    const bool is_word = at > 0 && kBlanks.find(tag[at - 1]) != std::string_view::npos;
    if (!is_word || rest.size() < 2 || rest[0] != '=' || (rest[1] != '"' && rest[1] != '\'')) continue;
    return rest.substr(2, rest.find(rest[1], 2) - 2);
  }
  return {};
}

/// What `begins` with "<" is: VTK's XML of polygons, or refused.
void check_vtk(const std::string& name, std::string_view bytes) {
  const std::string_view head = bytes.substr(0, kHeadBytes);
  const std::size_t begin = head.find("<VTKFile");
  if (begin == std::string_view::npos) {
    refuse(name, "this XML is no VTK file; expected STL or VTK XML PolyData (.vtp)");
  }
  const std::string_view tag = head.substr(begin, head.find('>', begin) - begin);
  const std::string type(attribute(tag, "type"));
  if (type != "PolyData") {
    refuse(name, "it holds " + printable_text(type) +
                     ", expected PolyData: extract its surface and save that as .vtp");
  }
  const std::string_view compressor = attribute(tag, "compressor");
  if (!compressor.empty() && compressor != "vtkZLibDataCompressor") {
    refuse(name, "it is compressed by " + printable_text(compressor) +
                     ", which is not read: save it with zlib or without compression");
  }
  const std::string_view tail = bytes.substr(bytes.size() - std::min(bytes.size(), kTailBytes));
  if (tail.find("</VTKFile") == std::string_view::npos) {
    refuse(name, "it does not end with </VTKFile>; was it cut off while it was written?");
  }
}

/// The size that a binary STL file with this head has.
std::uint64_t stl_size(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kStlHeadBytes - sizeof count, sizeof count);  // little-endian, as we are
  return kStlHeadBytes + std::uint64_t{kStlTriangleBytes} * count;
}

bool is_text_stl(std::string_view text) {
  const std::string_view head = text.substr(0, kHeadBytes);
  return head.starts_with("solid") &&
         (head.find("facet") != std::string_view::npos || head.find("endsolid") != std::string_view::npos);
}

bool is_named_stl(const std::string& name) {
  std::string suffix = std::filesystem::path(name).extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return suffix == ".stl";
}

}  // namespace

std::string kind_of_surface(const std::string& name, std::string_view bytes) {
  std::string_view text = bytes.starts_with(kByteOrderMark) ? bytes.substr(kByteOrderMark.size()) : bytes;
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  if (text.starts_with('<')) {
    check_vtk(name, text);
    return "vtp";
  }
  if (text.starts_with("# vtk DataFile")) {
    refuse(name, "this is VTK's old format; save it as VTK XML PolyData (.vtp)");
  }
  const bool has_head = bytes.size() >= kStlHeadBytes;
  // A file that begins with "solid" may be binary all the same; some programs write more behind the
  // triangles.
  if (has_head && stl_size(bytes) == bytes.size()) return "stl";
  if (is_text_stl(text)) return "stl";
  if (has_head && stl_size(bytes) > kStlHeadBytes && stl_size(bytes) < bytes.size()) return "stl";
  if (has_head && is_named_stl(name)) {
    refuse(name, "as a binary STL file it would have " + std::to_string(stl_size(bytes)) +
                     " bytes, and it has " + std::to_string(bytes.size()) +
                     "; was it cut off while it was written?");
  }
  refuse(name, "this is neither STL nor VTK XML PolyData (.vtp)");
}

std::string read_surface(const std::string& file, VesselNote& note) {
  std::string bytes = content_of(file, kMaxVesselBytes);
  note = {std::filesystem::path(file).filename().string(), kind_of_surface(file, bytes), bytes.size()};
  return bytes;
}

MarkerFile read_points(const std::string& file) {
  try {
    MarkerFile points = read_markers(file);
    if (points.markers.size() > kMaxPoints) {
      refuse(file, "it has " + std::to_string(points.markers.size()) + " points; " +
                       std::to_string(kMaxPoints) + " are shown at most");
    }
    return points;
  } catch (const MarkerFileError& error) {
    throw std::invalid_argument(error.what());
  }
}

}  // namespace tubed
