#include "drivers/csv/sequence_error.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

namespace tubed {

namespace {

std::string in_words(const SequencePosition& position, const std::string& what_is_wrong) {
  std::ostringstream text;
  text << position.file.string();
  if (position.line > 0) {
    text << ':' << position.line << ':' << position.column;
  }
  text << ": " << what_is_wrong;
  return text.str();
}

}  // namespace

SequenceError::SequenceError(SequencePosition position, const std::string& what_is_wrong)
    : std::runtime_error(in_words(position, what_is_wrong)), position_(std::move(position)) {}

std::string in_quotes(std::string_view text) {
  std::string words(text);
  words.insert(words.begin(), '\'');
  words.push_back('\'');
  return words;
}

std::string read_whole_file(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) {
    throw SequenceError(
        {file}, "there is no such file; a sequence folder holds sequence.toml, frames.csv and em.csv");
  }
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) {
    throw SequenceError({file},
                        std::string("cannot be read: ") + std::strerror(errno) + "; check its permissions");
  }
  return std::move(text).str();
}

}  // namespace tubed
