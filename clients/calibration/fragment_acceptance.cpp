// Puts a fragment into the text of a configuration: values change where they stand, nothing else does.
#include <toml++/toml.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "clients/calibration/configuration_fragment.hpp"
#include "clients/calibration/fragment_text.hpp"
#include "clients/calibration/value_path.hpp"
#include "daemon/config/load_configuration.hpp"
#include "drivers/interface/toml_nesting.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

namespace {

[[noreturn]] void refuse(const std::string& file, const std::string& words) {
  throw FragmentError(file + ": " + words);
}

toml::table parsed(std::string_view text, const std::string& file) {
  if (line_of_too_many_dots(text)) {
    refuse(file, "cannot be a configuration: tables lie too deep in each other");
  }
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    refuse(file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column),
           "not valid TOML: " + std::string(error.description()));
  }
}

/// The text as lines, and where in it a position of toml++ is, which counts characters and not bytes.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text), begins_{0} {
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] == '\n') {
        begins_.push_back(i + 1);
      }
    }
  }

  [[nodiscard]] std::size_t offset_of(toml::source_position at) const {
    std::size_t offset = begin_of(at.line);
    for (auto column = at.column; column > 1 && offset < text_.size(); --column) {
      do {
        ++offset;
      } while (offset < text_.size() && (static_cast<unsigned char>(text_[offset]) & 0xC0U) == 0x80U);
    }
    return offset;
  }

  /// Of the first character of a line; behind the last line, the end of the text.
  [[nodiscard]] std::size_t begin_of(std::size_t line) const {
    return line <= begins_.size() ? begins_[line - 1] : text_.size();
  }

  /// Without spaces.
  [[nodiscard]] std::string squeezed(std::size_t line) const {
    std::string line_text(text_.substr(begin_of(line), begin_of(line + 1) - begin_of(line)));
    std::erase_if(line_text, [](unsigned char c) { return std::isspace(c) != 0; });
    return line_text;
  }

 private:
  std::string_view text_;
  std::vector<std::size_t> begins_;
};

std::string names_in(const toml::array& list, const std::string& key) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const toml::table* table = list[i].as_table();
    const std::string number = std::to_string(i + 1);
    names.push_back(table == nullptr || key.empty() ? number
                    : table->get(key) == nullptr    ? number
                                                    : table->get(key)->value_or(number));
  }
  return alternatives(names);
}

const toml::table* element_of(const toml::array& list, const PathStep& step) {
  const std::string key = naming_key_of(step.table);
  for (const toml::node& node : list) {
    const toml::table* table = node.as_table();
    if (table != nullptr && !key.empty() && (*table)[key].value_or(std::string()) == *step.element) {
      return table;
    }
  }
  std::size_t number = 0;
  const char* const end = step.element->data() + step.element->size();
  const auto [stopped, error] = std::from_chars(step.element->data(), end, number);
  const bool is_number = error == std::errc{} && stopped == end && number >= 1 && number <= list.size();
  return is_number ? list[number - 1].as_table() : nullptr;
}

/// The table that a path names, as deep as the file has it.
struct FoundTable {
  const toml::table* table = nullptr;
  std::size_t depth = 0;  ///< of the path's tables, that many exist
};

FoundTable find_table(const toml::table& root, const ValuePath& path, const std::string& file) {
  FoundTable found{&root};
  for (const PathStep& step : path.tables) {
    const toml::node* node = found.table->get(step.table);
    if (node == nullptr && !step.element) {
      return found;
    }
    const toml::array* list = node == nullptr ? nullptr : node->as_array();
    const toml::table* next = nullptr;
    if (step.element) {
      next = list == nullptr ? nullptr : element_of(*list, step);
      if (next == nullptr) {
        refuse(file, "has no [[" + step.table + "]] '" + *step.element + "'" +
                         (list == nullptr || list->empty()
                              ? ""
                              : "; it has " + names_in(*list, naming_key_of(step.table))));
      }
    } else {
      next = node->as_table();
      if (next == nullptr) {
        refuse(file, step.table + " is no table");
      }
    }
    found = {next, found.depth + 1};
  }
  return found;
}

/// The last line that belongs to the table itself, not to tables inside of it.
std::size_t last_line_of(const toml::table& table) {
  std::size_t line = table.source().begin.line;
  for (const auto& [key, node] : table) {
    const bool is_list_of_tables = node.is_array() && node.as_array()->is_array_of_tables();
    const bool is_inline = node.is_table() && node.as_table()->is_inline();
    if ((!node.is_table() && !is_list_of_tables) || is_inline) {
      line = std::max<std::size_t>(line, node.source().end.line);
    }
  }
  return line;
}

/// The keys of a camera that this table beside them takes the place of.
std::vector<std::string> keys_replaced_by(const std::string& table) {
  std::vector<std::string> names;
  for (const BoundKey<CameraCalibration>& bound : camera_keys()) {
    if (bound.key.replaced_by == table) {
      names.push_back(bound.key.name);
    }
  }
  return names;
}

void refuse_what_the_c_arm_makes(const toml::table& table, const ValuePath& path, const std::string& file) {
  const toml::node* c_arm = path.tables.back().table == "camera" ? table.get("c_arm") : nullptr;
  const std::vector<std::string> made = keys_replaced_by("c_arm");
  if (c_arm != nullptr && std::find(made.begin(), made.end(), path.key) != made.end()) {
    const std::size_t line = c_arm->source().begin.line;
    const std::size_t last = c_arm->is_table() ? last_line_of(*c_arm->as_table()) : line;
    refuse(file + ":" + std::to_string(line),
           path.key + " follows from [camera.c_arm] there: comment out lines " + std::to_string(line) +
               " to " + std::to_string(last) + " first, or calibrate the C-arm");
  }
}

class Acceptance {
 public:
  Acceptance(std::string_view text, std::string file, const ConfigurationFragment& fragment)
      : text_(text), file_(std::move(file)), comment_(origin_comment(fragment)) {}

  void take(const FoundValue& found) {
    const toml::table root = parsed(text_, file_);
    const ValuePath path = parse_value_path(found.path);
    const FoundTable table = find_table(root, path, file_);
    if (table.depth < path.tables.size()) {
      write_table(*table.table, table.depth, path, found);
    } else if (const toml::node* old = table.table->get(path.key)) {
      replace(*old, path, found);
    } else {
      refuse_what_the_c_arm_makes(*table.table, path, file_);
      add(*table.table, path, found);
    }
  }

  /// A camera's keys that a table which was found takes the place of stay in the file as comments.
  void comment_out_what_it_replaces(const FoundValue& found) {
    const ValuePath path = parse_value_path(found.path);
    if (path.tables.size() < 2 || path.tables.front().table != "camera") {
      return;
    }
    const std::string& table = path.tables[1].table;
    for (const std::string& key : keys_replaced_by(table)) {
      comment_out({{path.tables.front()}, key}, table, found.path.substr(0, found.path.find(']') + 1));
    }
  }

  AcceptedFragment result() { return {std::move(text_), std::move(changes_)}; }

 private:
  void replace(const toml::node& old, const ValuePath& path, const FoundValue& found) {
    const Lines lines(text_);
    const std::size_t begin = lines.offset_of(old.source().begin);
    const std::size_t end = lines.offset_of(old.source().end);
    const std::string before = text_.substr(begin, end - begin);
    if (before == value_text(found.value, 0) || is_same(before, found.value)) {
      return;
    }
    changes_.push_back({found.path, before, value_text(found.value, 0)});
    text_.replace(begin, end - begin, value_text(found.value, path.key.size() + 3));
    comment_above(lines.begin_of(old.source().begin.line));
  }

  // The same number may be written in another way.
  static bool is_same(const std::string& before, const SettingValue& value) {
    const toml::table a = toml::parse("v = " + before);
    const toml::table b = toml::parse("v = " + value_text(value, 0));
    return a == b;
  }

  // A comment of an earlier calibration is replaced.
  void comment_above(std::size_t line_begin) {
    const std::size_t previous = line_begin < 2 ? 0 : text_.rfind('\n', line_begin - 2) + 1;
    const std::string_view above = std::string_view(text_).substr(previous, line_begin - previous);
    const bool is_ours = above.substr(0, 11) == "# found on ";
    text_.replace(is_ours ? previous : line_begin, is_ours ? above.size() : 0, comment_ + "\n");
  }

  void add(const toml::table& table, const ValuePath& path, const FoundValue& found) {
    const Lines lines(text_);
    const std::size_t header_line = table.source().begin.line;
    if (table.is_inline()) {
      refuse(file_ + ":" + std::to_string(header_line),
             path.tables.back().table + " is written in braces: write " + key_line(path.key, found.value) +
                 " there yourself");
    }
    const std::string header = header_of(path, path.tables.size());
    const bool has_header = lines.squeezed(header_line).substr(0, header.size()) == header;
    const bool has_values = last_line_of(table) > header_line;
    if (!has_header && !has_values) {  // it is there only as the outer table of another
      append("\n" + header + "\n" + comment_ + "\n" + key_line(path.key, found.value) + "\n");
    } else {
      insert_before_line(last_line_of(table) + 1, comment_ + "\n" + key_line(path.key, found.value) + "\n");
    }
    changes_.push_back({found.path, "", value_text(found.value, 0)});
  }

  void write_table(const toml::table& outer, std::size_t depth, const ValuePath& path,
                   const FoundValue& found) {
    const std::string written = "\n" + header_of(path, path.tables.size()) + "\n" + comment_ + "\n" +
                                key_line(path.key, found.value) + "\n";
    if (depth == 0) {
      append(written);
    } else {
      insert_before_line(last_line_of(outer) + 1, written + "\n");
    }
    changes_.push_back({found.path, "", value_text(found.value, 0)});
  }

  void comment_out(const ValuePath& path, const std::string& replaced_by, const std::string& camera) {
    const toml::table root = parsed(text_, file_);
    const toml::table& table = *find_table(root, path, file_).table;
    const toml::node* old = table.get(path.key);
    if (old == nullptr) {
      return;
    }
    const Lines lines(text_);
    const auto [begin, end] = std::pair{old->source().begin, old->source().end};
    if (table.is_inline()) {
      refuse(file_ + ":" + std::to_string(begin.line),
             path.key + " is written in braces: take it out there yourself, " + replaced_by + " replaces it");
    }
    const std::size_t offset = lines.offset_of(begin);
    changes_.push_back({camera + "." + path.key, text_.substr(offset, lines.offset_of(end) - offset), "",
                        "[" + path.tables.back().table + "." + replaced_by + "]"});
    for (std::size_t line = end.line; line > begin.line; --line) {
      text_.insert(lines.begin_of(line), "# ");
    }
    const std::size_t line_end = std::min(text_.find_first_of("\r\n", offset), text_.size());
    text_.insert(line_end, "  # replaced by " + replaced_by);
    text_.insert(lines.begin_of(begin.line), "# ");
  }

  void append(const std::string& written) {
    text_ += (text_.empty() || text_.back() == '\n' ? "" : "\n") + written;
  }

  void insert_before_line(std::size_t line, const std::string& written) {
    if (!text_.empty() && text_.back() != '\n') {
      text_ += '\n';
    }
    text_.insert(Lines(text_).begin_of(line), written);
  }

  std::string text_;
  std::string file_;
  std::string comment_;
  std::vector<ChangedValue> changes_;
};

std::string content_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream.is_open() || stream.bad()) {
    refuse(file.string(), "cannot be read");
  }
  return text.str();
}

}  // namespace

AcceptedFragment accept(std::string_view configuration, const std::string& file,
                        const ConfigurationFragment& fragment) {
  Acceptance acceptance(configuration, file, fragment);
  for (const FoundValue& found : fragment.values) {
    acceptance.take(found);
  }
  for (const FoundValue& found : fragment.values) {
    acceptance.comment_out_what_it_replaces(found);
  }
  AcceptedFragment accepted = acceptance.result();
  parsed(accepted.text, file + ", with what was found,");
  return accepted;
}

AcceptedFragment accept_into(const std::filesystem::path& file, const ConfigurationFragment& fragment) {
  AcceptedFragment accepted = accept(content_of(file), file.string(), fragment);
  try {
    parse_configuration(accepted.text, file);
  } catch (const ConfigurationError& error) {
    throw FragmentError("with what was found this would be no configuration: " + std::string(error.what()));
  }
  return accepted;
}

}  // namespace tubed
