// A key of the configuration file bound to the member of a struct that it sets. Beside each struct of
// settings stands the list of its keys: a key is described there and nowhere else, and used where the struct
// is.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "idl/settings/key_description.hpp"

namespace tubed {

/// A key, and how its value gets into the struct. `set` is empty where reading the value takes more than
/// copying it: then the configuration's assembly asks for the key by name.
template <typename Settings>
struct BoundKey {
  KeyDescription key;
  std::function<void(Settings&, const SettingValue&)> set{};
};

template <typename Settings>
using BoundKeys = std::vector<BoundKey<Settings>>;

/// A value of a member, and the word of the file for it.
template <typename Value>
struct NamedValue {
  Value value;
  std::string_view word;
};

namespace key {

/// What a member is in the file: the conversion of its type there and back.
template <typename Value>
struct InFile {
  using Type = Value;
  static const Value& from(const Type& value) { return value; }
  static const Type& to(const Value& value) { return value; }
};
template <>
struct InFile<int> {
  using Type = std::int64_t;
  static int from(std::int64_t value) { return static_cast<int>(value); }
  static std::int64_t to(int value) { return value; }
};
template <>
struct InFile<std::vector<int>> {
  using Type = std::vector<std::int64_t>;
  static std::vector<int> from(const Type& list) {
    std::vector<int> values;
    for (const std::int64_t value : list) {
      values.push_back(static_cast<int>(value));
    }
    return values;
  }
  static Type to(const std::vector<int>& list) { return {list.begin(), list.end()}; }
};
template <std::size_t size>
struct InFile<std::array<double, size>> {
  using Type = std::vector<double>;
  static std::array<double, size> from(const Type& list) {
    std::array<double, size> values{};
    std::copy_n(list.begin(), std::min(list.size(), size), values.begin());
    return values;
  }
  static Type to(const std::array<double, size>& values) { return {values.begin(), values.end()}; }
};
template <typename Value>
struct InFile<std::optional<Value>> {
  using Type = typename InFile<Value>::Type;
  static std::optional<Value> from(const Type& value) { return InFile<Value>::from(value); }
  static Type to(const std::optional<Value>& value) { return InFile<Value>::to(value.value_or(Value{})); }
};

/// Binds `description`, whose default is the member's own unless the key has none.
template <typename Settings, typename Value>
BoundKey<Settings> bound(Value Settings::*member, KeyDescription description) {
  using Type = typename InFile<Value>::Type;
  if (description.presence == Presence::kDefault) {
    description.default_value = Type(InFile<Value>::to(Settings{}.*member));
  }
  return {std::move(description), [member](Settings& settings, const SettingValue& value) {
            settings.*member = InFile<Value>::from(std::get<Type>(value));
          }};
}

/// A number, or a list of numbers, with its range.
template <typename Settings, typename Value>
BoundKey<Settings> number(std::string name, Value Settings::*member, std::string unit, KeyRange range,
                          std::string meaning) {
  return bound(member, {.name = std::move(name),
                        .unit = std::move(unit),
                        .minimum = range.minimum,
                        .maximum = range.maximum,
                        .meaning = std::move(meaning)});
}

/// The same for a list of so many numbers.
template <typename Settings, typename Value>
BoundKey<Settings> numbers(std::string name, Value Settings::*member, std::string unit, KeyRange range,
                           std::pair<std::size_t, std::size_t> count, std::string meaning) {
  BoundKey<Settings> list = number(std::move(name), member, std::move(unit), range, std::move(meaning));
  list.key.minimum_count = count.first;
  list.key.maximum_count = count.second;
  return list;
}

template <typename Settings>
BoundKey<Settings> flag(std::string name, bool Settings::*member, std::string meaning) {
  return bound(member, {.name = std::move(name), .meaning = std::move(meaning)});
}

template <typename Settings>
BoundKey<Settings> text(std::string name, std::string Settings::*member, TextRule rule, std::string meaning) {
  return bound(member, {.name = std::move(name), .text = std::move(rule), .meaning = std::move(meaning)});
}

/// One of several values by its word; the words are in the order in which messages name them.
template <typename Settings, typename Value>
BoundKey<Settings> word(std::string name, Value Settings::*member,
                        std::vector<NamedValue<std::type_identity_t<Value>>> values, std::string meaning) {
  std::vector<std::string> words;
  std::string usual;
  for (const auto& [value, word] : values) {
    words.emplace_back(word);
    usual = value == Settings{}.*member ? std::string(word) : usual;
  }
  return {word(std::move(name), std::move(usual), std::move(words), std::move(meaning)),
          [member, values = std::move(values)](Settings& settings, const SettingValue& value) {
            for (const auto& named : values) {
              if (named.word == std::get<std::string>(value)) {
                settings.*member = named.value;
              }
            }
          }};
}

/// The same key without a default.
template <typename Settings>
BoundKey<Settings> required(BoundKey<Settings> key, std::string example) {
  key.key = required(std::move(key.key), std::move(example));
  return key;
}

/// The same key, which leaves the member alone when it is left out. `shown`: what the sample file shows.
template <typename Settings>
BoundKey<Settings> optional(BoundKey<Settings> key, SettingValue shown) {
  key.key = optional(std::move(key.key));
  key.key.default_value = std::move(shown);
  return key;
}

}  // namespace key

/// The descriptions alone.
template <typename Settings>
std::vector<KeyDescription> descriptions(const BoundKeys<Settings>& keys) {
  std::vector<KeyDescription> all;
  for (const BoundKey<Settings>& bound : keys) {
    all.push_back(bound.key);
  }
  return all;
}

}  // namespace tubed
