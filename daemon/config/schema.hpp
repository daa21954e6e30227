// Every table and key of the configuration file, described once. Checks, defaults, messages, the sample file
// and the documentation all come from these rows.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "drivers/driver_registry/driver_registry.hpp"

namespace tubed {

/// A value of the file, by the type its key asks for.
using ConfigurationValue = std::variant<bool, std::int64_t, double, std::string, std::vector<std::int64_t>,
                                        std::vector<double>, Eigen::Matrix4d>;

enum class Presence {
  kDefault,   ///< may be left out: then it is the default
  kRequired,  ///< has no default
  kOptional,  ///< may be left out: then it is not known
};

/// What a text may consist of, beside the rule that no text has control characters.
struct TextRule {
  std::size_t minimum_bytes = 0;
  std::size_t maximum_bytes = 4096;
  bool ascii_only = false;
  std::string forbidden{};  ///< characters it must not contain
};

/// One key: the alternative held by `default_value` is its type.
struct KeyDescription {
  std::string name{};
  ConfigurationValue default_value{};  ///< an empty value of the type when there is no default
  Presence presence = Presence::kDefault;
  std::string unit{};                                         ///< "mm", "px", ...; empty = none
  double minimum = -std::numeric_limits<double>::infinity();  ///< of a number, or of each number of a list
  double maximum = std::numeric_limits<double>::infinity();
  std::size_t minimum_count = 0;  ///< of the numbers of a list
  std::size_t maximum_count = std::numeric_limits<std::size_t>::max();
  std::vector<std::string> choices{};  ///< of a text: the only ones allowed; empty = any
  TextRule text{};
  std::string meaning{};  ///< one line for a person
};

enum class TableShape {
  kOne,   ///< [name]
  kMany,  ///< [[name]], any number of times
};

struct TableDescription {
  std::string name{};  ///< of this level only: "coil" of [[instrument.coil]]
  TableShape shape = TableShape::kOne;
  std::size_t minimum_count = 0;  ///< of kMany; of kOne: 1 = has to be there
  std::size_t maximum_count = 1;
  std::string meaning{};
  std::vector<KeyDescription> keys{};
  std::vector<TableDescription> tables{};
  bool only_when_used =
      false;  ///< required keys may be missing (a driver's table without a source that uses it)
};

/// The file as a whole: a table without a name. The tables of `available` drivers are part of it.
TableDescription configuration_schema(const std::vector<DriverDescription>& available);

/// "an integer from 1 to 16", "a real number from 0 to 5000 ms", "em or joint": what a key takes, in words.
std::string expectation(const KeyDescription& key);

/// A value as it stands in the file: 30.0, "lo", [1.0, 1.5].
std::string to_toml(const ConfigurationValue& value);

}  // namespace tubed
