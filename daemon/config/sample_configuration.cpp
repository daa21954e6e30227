#include "daemon/config/sample_configuration.hpp"

#include <algorithm>
#include <utility>

#include "daemon/config/schema.hpp"

namespace tubed {

namespace {

class SampleWriter {
 public:
  /// The sample's sources are all of driver `used`, as it stands in the file.
  explicit SampleWriter(std::string used) : used_(std::move(used)) {}

  std::string text() && { return std::move(text_); }

  void table(const TableDescription& table, const std::string& parent, bool commented) {
    const std::string path = parent.empty() ? table.name : parent + "." + table.name;
    const char* open = table.shape == TableShape::kMany ? "[[" : "[";
    const char* close = table.shape == TableShape::kMany ? "]]" : "]";
    const bool is_unused = table.only_when_used && used_ != '"' + table.name + '"';
    const bool is_comment = commented || is_unused || table.is_alternative;
    text_ += "\n# " + table.meaning + (is_unused ? " (when a source uses it)" : "") + "\n";
    text_ += (is_comment ? "# " : "") + (open + path) + close + "\n";
    for (const KeyDescription& key : table.keys) {
      this->key(key, is_comment);
    }
    for (const TableDescription& inner : table.tables) {
      if (path + "." + inner.name == "instrument.coil") {
        coils(inner);
      } else {
        this->table(inner, path, is_comment);
      }
    }
  }

 private:
  /// What the key takes; how many CPUs this machine has is no matter of the sample's.
  static std::string takes(const KeyDescription& key) {
    return key.name == "cpus" ? "a list of integers" : expectation(key);
  }

  /// An optional key stands as a comment, unless it has an example.
  void key(const KeyDescription& key, bool commented) {
    const bool has_default = key.presence == Presence::kDefault;
    const std::string value = key.example.empty() ? to_toml(key.default_value) : key.example;
    const bool is_comment = commented || (key.presence == Presence::kOptional && key.example.empty());
    const std::string assignment = (is_comment ? "# " : "") + key.name + " = " + value;
    text_ += "# " + key.meaning + "; " + takes(key) +
             (has_default ? "" : (key.presence == Presence::kRequired ? "; required" : "; may be left out")) +
             (key.replaced_by.empty() ? "" : " unless there is [camera." + key.replaced_by + "]");
    text_ += "\n" + assignment + "\n";
  }

  /// The five coils of Sec. 3.1, each key explained at the first.
  void coils(const TableDescription& coil) {
    int sensor = 0;
    for (const char* offset : {"10.0", "90.0", "170.0", "270.0", "370.0"}) {
      ++sensor;
      text_ += sensor == 1 ? "\n# " + coil.meaning + "\n[[instrument.coil]]\n" : "\n[[instrument.coil]]\n";
      for (const KeyDescription& key : coil.keys) {
        if (sensor == 1) {
          text_ += "# " + key.meaning + "; " + expectation(key) + "\n";
        }
        if (key.name == "sensor") {
          text_ += "sensor = " + std::to_string(sensor) + "\n";
        } else if (key.name == "offset_from_tip_mm") {
          text_ += std::string("offset_from_tip_mm = ") + offset + "\n";
        } else if (sensor == 1) {
          const bool is_comment = key.presence == Presence::kOptional;
          text_ += (is_comment ? "# " : "") + key.name + " = " + to_toml(key.default_value) + "\n";
        }
      }
    }
  }

  std::string used_;
  std::string text_;
};

const KeyDescription& em_driver(const TableDescription& file) {
  const auto named = [](const char* name) { return [name](const auto& one) { return one.name == name; }; };
  const auto em = std::find_if(file.tables.begin(), file.tables.end(), named("em"));
  return *std::find_if(em->keys.begin(), em->keys.end(), named("driver"));
}

}  // namespace

std::string sample_configuration(const std::vector<DriverDescription>& available) {
  const TableDescription file = configuration_schema(available);
  SampleWriter writer(em_driver(file).example);
  for (const TableDescription& table : file.tables) {
    writer.table(table, "", false);
  }
  return "# tubed's configuration: every key, with what it takes and its default. Runs as it is, without "
         "hardware.\n"
         "# Check a file with `tubed --check FILE`; `tubed --sample` prints this one.\n" +
         std::move(writer).text();
}

}  // namespace tubed
