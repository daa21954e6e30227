#include "drivers/csv/csv_reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

namespace tubed {

namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// What spreadsheets write instead of commas; empty: nothing of it.
std::string other_separator(std::string_view header) {
  const std::size_t at = header.find_first_of(";\t");
  if (at == std::string_view::npos || header.find(',') != std::string_view::npos) return "";
  return std::string("; its fields are separated by ") + (header[at] == ';' ? "';'" : "tabs") +
         ": save it with commas, and with a dot in numbers";
}

bool is_utf16(std::string_view bytes) {
  return bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF");
}

template <typename Number>
bool parse_all(std::string_view text, Number& value) {
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  return error == std::errc{} && stopped == end;
}

}  // namespace

CsvReader::CsvReader(const std::filesystem::path& file,
                     std::initializer_list<std::string_view> required_columns,
                     std::initializer_list<std::string_view> optional_columns)
    : file_(file), bytes_(read_whole_file(file)), rest_(bytes_) {
  if (rest_.starts_with(kByteOrderMark)) {
    rest_.remove_prefix(kByteOrderMark.size());
  }
  if (is_utf16(rest_)) {
    throw SequenceError({file_, 1, 1}, "the file is UTF-16 text: save it as UTF-8");
  }
  if (!next_line()) {
    throw SequenceError({file_, 1, 1}, "the file is empty; its first line has to name the columns");
  }
  header_fields_ = fields_.size();
  for (const std::string_view name : required_columns) find_column(name, true);
  for (const std::string_view name : optional_columns) find_column(name, false);
}

bool CsvReader::next_row() {
  if (!next_line()) {
    return false;
  }
  if (fields_.size() != header_fields_) {
    throw SequenceError({file_, line_, fields_.back().column},
                        "the row has " + std::to_string(fields_.size()) + " fields, the header " +
                            std::to_string(header_fields_) +
                            (fields_.size() > header_fields_
                                 ? "; are numbers written with a comma? Expected a dot, like -12.5"
                                 : "; was the file cut off while it was written?"));
  }
  return true;
}

std::string_view CsvReader::text(std::size_t column) const { return fields_[places_[column]].text; }

double CsvReader::number_or_infinity(std::size_t column) const {
  return text(column) == "inf" ? std::numeric_limits<double>::infinity() : number(column);
}

double CsvReader::number(std::size_t column) const {
  double value = 0;
  if (!parse_all(text(column), value)) {
    refuse(column, in_quotes(text(column)) + " is not a number; write it with a dot, like -12.5");
  }
  if (!std::isfinite(value)) {
    refuse(column, in_quotes(text(column)) + " is not finite; leave out what was not measured");
  }
  return value;
}

std::uint32_t CsvReader::count(std::size_t column) const {
  std::uint32_t value = 0;
  if (!parse_all(text(column), value)) {
    refuse(column, in_quotes(text(column)) + " is not a whole number from 0 to 4294967295");
  }
  return value;
}

SequencePosition CsvReader::position(std::size_t column) const {
  return {file_, line_, fields_[places_[column]].column};
}

void CsvReader::refuse(std::size_t column, const std::string& what_is_wrong) const {
  throw SequenceError(position(column), names_[column] + ": " + what_is_wrong);
}

bool CsvReader::next_line() {
  do {
    if (rest_.empty()) {
      return false;
    }
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line_text_ = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++line_;
    if (line_text_.ends_with('\r')) {
      line_text_.remove_suffix(1);
    }
  } while (line_text_.empty());
  split_line();
  return true;
}

void CsvReader::split_line() {
  fields_.clear();
  std::size_t start = 0;
  while (true) {
    const std::size_t comma = std::min(line_text_.find(',', start), line_text_.size());
    std::string_view field = line_text_.substr(start, comma - start);
    std::size_t blanks = std::min(field.find_first_not_of(" \t"), field.size());
    field.remove_prefix(blanks);
    field = field.substr(0, field.find_last_not_of(" \t") + 1);
    fields_.push_back({field, static_cast<int>(start + blanks) + 1});
    if (comma == line_text_.size()) {
      return;
    }
    start = comma + 1;
  }
}

void CsvReader::find_column(std::string_view name, bool is_required) {
  const auto is_name = [&](const Field& field) { return field.text == name; };
  const auto found = std::find_if(fields_.begin(), fields_.end(), is_name);
  if (found == fields_.end() && is_required) {
    throw SequenceError({file_, line_, 1}, "the column '" + std::string(name) +
                                               "' is missing; the header is " + in_quotes(line_text_) +
                                               other_separator(line_text_));
  }
  const bool is_there = found != fields_.end();
  const auto again = is_there ? std::find_if(found + 1, fields_.end(), is_name) : found;
  if (again != fields_.end()) {
    throw SequenceError({file_, line_, again->column},
                        "the column '" + std::string(name) + "' is there twice");
  }
  places_.push_back(is_there ? static_cast<std::size_t>(found - fields_.begin()) : kNowhere);
  names_.emplace_back(name);
}

}  // namespace tubed
