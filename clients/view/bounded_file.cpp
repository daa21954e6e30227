#include "clients/view/bounded_file.hpp"

#include <fstream>
#include <stdexcept>

namespace tubed {

std::string content_of(const std::string& file, std::size_t max_bytes) {
  std::ifstream in(file, std::ios::binary);
  std::string content(max_bytes + 1, '\0');
  in.read(content.data(), static_cast<std::streamsize>(content.size()));
  content.resize(static_cast<std::size_t>(in.gcount()));
  if (content.empty()) throw std::invalid_argument("cannot read " + file + ", or it is empty");
  if (content.size() > max_bytes) {
    throw std::invalid_argument(file + " has more than " + std::to_string(max_bytes) + " bytes");
  }
  content.shrink_to_fit();
  return content;
}

}  // namespace tubed
