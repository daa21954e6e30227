// What a sequence folder that cannot be used is refused with.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace tubed {

/// A place in a text file; line and column count from 1, 0 means the file as a whole.
struct SequencePosition {
  std::filesystem::path file;
  int line = 0;
  int column = 0;  ///< byte of the line at which the key or field starts
};

/// A sequence folder was refused. what() reads "file:line:column: what is wrong; what to do".
class SequenceError : public std::runtime_error {
 public:
  SequenceError(SequencePosition position, const std::string& what_is_wrong);

  [[nodiscard]] const SequencePosition& position() const { return position_; }

 private:
  SequencePosition position_;
};

/// 'text', for messages.
std::string in_quotes(std::string_view text);

/// The whole of a file as bytes. Throws SequenceError when it cannot be read.
std::string read_whole_file(const std::filesystem::path& file);

}  // namespace tubed
