// Comma separated values as sequence folders use them: one header line, no quoting, a dot in numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/csv/sequence_error.hpp"

namespace tubed {

/// Walks through the rows of one file. Columns are asked for by their place in the list of required names,
/// whatever their order in the file; further columns are passed over. Lines may end in CRLF; empty lines are
/// passed over. Everything that cannot be used throws SequenceError with its line and column.
class CsvReader {
 public:
  /// The numbers of `optional_columns` go on after those of the required ones.
  CsvReader(const std::filesystem::path& file, std::initializer_list<std::string_view> required_columns,
            std::initializer_list<std::string_view> optional_columns = {});

  /// Always true of a required column.
  [[nodiscard]] bool has(std::size_t column) const { return places_[column] != kNowhere; }

  /// Goes on to the next row; false after the last. A row with another number of fields than the header is
  /// refused.
  bool next_row();

  /// The field as text, without blanks around it.
  [[nodiscard]] std::string_view text(std::size_t column) const;
  [[nodiscard]] bool is_empty(std::size_t column) const { return text(column).empty(); }
  /// The field as a finite number.
  [[nodiscard]] double number(std::size_t column) const;
  /// The same, or "inf".
  [[nodiscard]] double number_or_infinity(std::size_t column) const;
  /// The field as a whole number 0 .. 2^32 - 1.
  [[nodiscard]] std::uint32_t count(std::size_t column) const;

  /// Where the field stands in the file.
  [[nodiscard]] SequencePosition position(std::size_t column) const;
  /// Throws SequenceError at the field.
  [[noreturn]] void refuse(std::size_t column, const std::string& what_is_wrong) const;

 private:
  struct Field {
    std::string_view text;
    int column = 0;
  };

  bool next_line();
  void split_line();
  void find_column(std::string_view name, bool is_required);

  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

  std::filesystem::path file_;
  std::string bytes_;
  std::string_view rest_;
  std::string_view line_text_;
  int line_ = 0;
  std::size_t header_fields_ = 0;
  std::vector<Field> fields_;        ///< of the current line, in the file's order
  std::vector<std::size_t> places_;  ///< column -> field
  std::vector<std::string> names_;   ///< of the columns
};

}  // namespace tubed
