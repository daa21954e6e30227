// The files of clients/view/page, compiled in: the program is one file, and shows its own version of the
// page.
#pragma once

#include <span>
#include <string_view>

namespace tubed {

struct PageFile {
  std::string_view path;  ///< "/index.html", "/view.js"
  std::string_view type;  ///< Content-Type
  std::string_view body;
};

/// All of them; made by embed.py when the project is built.
std::span<const PageFile> page_files();
/// The file of a path, "/" is /index.html; null when there is none.
const PageFile* find_page_file(std::string_view path);

}  // namespace tubed
