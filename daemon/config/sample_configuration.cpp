#include "daemon/config/sample_configuration.hpp"

#include <algorithm>
#include <map>

#include "daemon/config/schema.hpp"

namespace tubed {

namespace {

/// What the sample says where the schema has no default, by dotted path.
const std::map<std::string, std::string>& examples() {
  static const std::map<std::string, std::string> values = {
      {"em.driver", "\"simulation\""},
      {"em.T_world_em", "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"},
      {"em.registration_residual_mm", "1.0"},
      {"camera.name", "\"A\""},
      {"camera.width", "400"},
      {"camera.height", "600"},
      {"camera.fx", "2000.0"},
      {"camera.fy", "2000.0"},
      {"camera.cx", "200.0"},
      {"camera.cy", "300.0"},
      {"camera.T_camera_world", "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1200], [0, 0, 0, 1]]"},
      {"camera.driver", "\"simulation\""},
      {"instrument.id", "\"cath-1\""},
      {"instrument.mode", "\"filter\""},
      {"replay.folder", "\"/path/to/a/sequence\""}};
  return values;
}

/// Optional keys that the sample does give.
bool is_given(const std::string& path) { return path == "em.T_world_em"; }

/// The sample's sources are all of one driver.
bool is_used(const TableDescription& driver) { return examples().at("em.driver") == '"' + driver.name + '"'; }

class SampleWriter {
 public:
  std::string text() && { return std::move(text_); }

  void table(const TableDescription& table, const std::string& parent, bool commented) {
    const std::string path = parent.empty() ? table.name : parent + "." + table.name;
    const char* open = table.shape == TableShape::kMany ? "[[" : "[";
    const char* close = table.shape == TableShape::kMany ? "]]" : "]";
    const bool is_comment = commented || (table.only_when_used && !is_used(table));
    text_ += "\n# " + table.meaning + (is_comment ? " (when a source uses it)" : "") + "\n";
    text_ += (is_comment ? "# " : "") + (open + path) + close + "\n";
    for (const KeyDescription& key : table.keys) {
      this->key(key, path, is_comment);
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

  void key(const KeyDescription& key, const std::string& path, bool commented) {
    const std::string full = path + "." + key.name;
    const auto example = examples().find(full);
    const bool has_default = key.presence == Presence::kDefault;
    const std::string value =
        example != examples().end() && !has_default ? example->second : to_toml(key.default_value);
    const bool is_comment = commented || (key.presence == Presence::kOptional && !is_given(full));
    const std::string assignment = (is_comment ? "# " : "") + key.name + " = " + value;
    text_ += "# " + key.meaning + "; " + takes(key) +
             (has_default ? "" : (key.presence == Presence::kRequired ? "; required" : "; may be left out"));
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

  std::string text_;
};

}  // namespace

std::string sample_configuration(const std::vector<DriverDescription>& available) {
  SampleWriter writer;
  for (const TableDescription& table : configuration_schema(available).tables) {
    writer.table(table, "", false);
  }
  return "# tubed's configuration: every key, with what it takes and its default. Runs as it is, without "
         "hardware.\n"
         "# Check a file with `tubed --check FILE`; `tubed --sample` prints this one.\n" +
         std::move(writer).text();
}

}  // namespace tubed
