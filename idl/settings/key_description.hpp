// One key of the configuration file, described once: what reads and checks a file, its messages, the sample
// file and the manual page are made from this. Of the daemon and of drivers alike.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

namespace tubed {

/// A value of the file, by the type its key asks for.
using SettingValue = std::variant<bool, std::int64_t, double, std::string, std::vector<std::int64_t>,
                                  std::vector<double>, Eigen::Matrix4d>;

enum class Presence {
  kDefault,   ///< may be left out: then it is the default
  kRequired,  ///< has no default
  kOptional,  ///< may be left out: then it is not known
};

/// When a changed value counts after the file was read again (SIGHUP).
enum class TakesEffect {
  kWithARestart,  ///< it is part of what the pipeline is built from
  kAtOnce,        ///< whoever uses it asks for it again: see daemon/reload.hpp
};

/// What a text may consist of, beside the rule that no text has control characters.
struct TextRule {
  std::size_t minimum_bytes = 0;
  std::size_t maximum_bytes = 4096;
  bool ascii_only = false;
  std::string forbidden{};  ///< characters it must not contain
  bool is_user = false;     ///< the name of a user of this system, or empty
};

/// Least and greatest value of a number.
struct KeyRange {
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
};

/// One key: the alternative held by `default_value` is its type.
struct KeyDescription {
  std::string name{};
  SettingValue default_value{};  ///< an empty value of the type when there is no default
  Presence presence = Presence::kDefault;
  std::string unit{};                                         ///< "mm", "px", ...; empty = none
  double minimum = -std::numeric_limits<double>::infinity();  ///< of a number, or of each number of a list
  double maximum = std::numeric_limits<double>::infinity();
  std::size_t minimum_count = 0;  ///< of the numbers of a list
  std::size_t maximum_count = std::numeric_limits<std::size_t>::max();
  std::vector<std::string> choices{};  ///< of a text: the only ones allowed; empty = any
  TextRule text{};
  std::string meaning{};  ///< one line for a person
  std::string example{};  ///< what the sample file says where there is no default, as it stands there
  TakesEffect takes_effect = TakesEffect::kWithARestart;
  std::string replaced_by{};  ///< a table beside it that says the same: no longer required then, nor allowed
};

/// The descriptions of the usual types of keys.
namespace key {

KeyDescription real(std::string name, double value, std::string unit, KeyRange range, std::string meaning);
KeyDescription integer(std::string name, std::int64_t value, std::string unit, KeyRange range,
                       std::string meaning);
KeyDescription boolean(std::string name, bool value, std::string meaning);
KeyDescription text(std::string name, std::string value, TextRule rule, std::string meaning);
/// A text that is one of `choices`.
KeyDescription word(std::string name, std::string value, std::vector<std::string> choices,
                    std::string meaning);
/// A rigid transform, 4 x 4, whose translation is in mm.
KeyDescription transform(std::string name, std::string meaning);

/// The same without a default; the sample file says `example`. A text must not be empty then.
KeyDescription required(KeyDescription key, std::string example);
/// The same, but not known when it is left out; the sample file shows `example`, or the default value.
KeyDescription optional(KeyDescription key, std::string example = "");

/// A name that others see: a DDS key, a label in a report, part of a path.
TextRule published_name(std::size_t maximum_bytes);

}  // namespace key

/// "an integer from 1 to 16", "a real number from 0 to 5000 ms", "em or joint": what a key takes, in words.
std::string expectation(const KeyDescription& key);

/// A value as it stands in the file: 30.0, "lo", [1.0, 1.5].
std::string to_toml(const SettingValue& value);

/// "a", "a or b", "a, b or c".
std::string alternatives(const std::vector<std::string>& words);

}  // namespace tubed
