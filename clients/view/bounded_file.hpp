// A small file as a whole.
#pragma once

#include <cstddef>
#include <string>

namespace tubed {

/// The bytes of a file. Throws std::invalid_argument when it cannot be read, is empty or has more bytes than
/// that.
std::string content_of(const std::string& file, std::size_t max_bytes);

}  // namespace tubed
