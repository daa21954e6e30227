#include "idl/settings/key_description.hpp"

#include <algorithm>
#include <utility>

namespace tubed::key {

KeyDescription real(std::string name, double value, std::string unit, KeyRange range, std::string meaning) {
  return {.name = std::move(name),
          .default_value = value,
          .unit = std::move(unit),
          .minimum = range.minimum,
          .maximum = range.maximum,
          .meaning = std::move(meaning)};
}

KeyDescription integer(std::string name, std::int64_t value, std::string unit, KeyRange range,
                       std::string meaning) {
  return {.name = std::move(name),
          .default_value = value,
          .unit = std::move(unit),
          .minimum = range.minimum,
          .maximum = range.maximum,
          .meaning = std::move(meaning)};
}

KeyDescription boolean(std::string name, bool value, std::string meaning) {
  return {.name = std::move(name), .default_value = value, .meaning = std::move(meaning)};
}

KeyDescription text(std::string name, std::string value, TextRule rule, std::string meaning) {
  return {.name = std::move(name),
          .default_value = std::move(value),
          .text = std::move(rule),
          .meaning = std::move(meaning)};
}

KeyDescription word(std::string name, std::string value, std::vector<std::string> choices,
                    std::string meaning) {
  return {.name = std::move(name),
          .default_value = std::move(value),
          .choices = std::move(choices),
          .meaning = std::move(meaning)};
}

KeyDescription transform(std::string name, std::string meaning) {
  constexpr double kMaxElement = 1e5;
  return {.name = std::move(name),
          .default_value = Eigen::Matrix4d{Eigen::Matrix4d::Identity()},
          .unit = "mm",
          .minimum = -kMaxElement,
          .maximum = kMaxElement,
          .meaning = std::move(meaning)};
}

KeyDescription required(KeyDescription key, std::string example) {
  key.presence = Presence::kRequired;
  key.text.minimum_bytes = std::max<std::size_t>(key.text.minimum_bytes, 1);
  key.example = std::move(example);
  return key;
}

KeyDescription optional(KeyDescription key, std::string example) {
  key.presence = Presence::kOptional;
  key.example = std::move(example);
  return key;
}

TextRule published_name(std::size_t maximum_bytes) {
  return {.minimum_bytes = 1, .maximum_bytes = maximum_bytes, .ascii_only = true, .forbidden = "/"};
}

}  // namespace tubed::key
