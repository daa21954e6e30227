#include "clients/view/page_files.hpp"

#include <algorithm>

namespace tubed {

const PageFile* find_page_file(std::string_view path) {
  const std::string_view wanted = path == "/" ? std::string_view("/index.html") : path;
  const auto files = page_files();
  const auto found =
      std::find_if(files.begin(), files.end(), [&](const PageFile& file) { return file.path == wanted; });
  return found == files.end() ? nullptr : &*found;
}

}  // namespace tubed
