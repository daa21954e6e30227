#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>

#include "clients/tubectl/watch/sample_text.hpp"
#include "idl/printable_text.hpp"
#include "idl/validity.hpp"
#include "idl/wire_fields.h"

namespace tubed {
namespace {

using nlohmann::json;

// A value of the wire as JSON. A text is made printable, a struct is an object with every field under its
// name in the .idl file, by the tables that are made from these files.
template <typename Value>
json json_of(const Value& value) {
  return value;
}
template <std::size_t size>
json json_of(const char (&text)[size]) {
  return printable_text(text);
}

#define TUBED_STRUCT_JSON(type) json json_of(const tubed_##type& value);
TUBED_STRUCTS(TUBED_STRUCT_JSON)
#undef TUBED_STRUCT_JSON

/// The elements of a wire array that its count says are there.
template <typename Element, std::size_t size>
json json_of_used(const Element (&array)[size], std::uint32_t count) {
  json list = json::array();
  for (const Element& element : std::span(array, std::min<std::size_t>(count, size))) {
    list.push_back(json_of(element));
  }
  return list;
}

#define TUBED_FIELD_JSON(field) {#field, json_of(value.field)},
#define TUBED_LIST_JSON(list, count) {#list, json_of_used(value.list, value.count)},
#define TUBED_STRUCT_JSON(type)                                         \
  json json_of(const tubed_##type& value) {                             \
    return {TUBED_FIELDS_OF_##type(TUBED_FIELD_JSON, TUBED_LIST_JSON)}; \
  }
TUBED_STRUCTS(TUBED_STRUCT_JSON)
#undef TUBED_FIELD_JSON
#undef TUBED_LIST_JSON
#undef TUBED_STRUCT_JSON

/// The same with the names of validity and reasons.
template <typename Sample>
json with_names(const Sample& sample) {
  json object = json_of(sample);
  object["validity_name"] = name_of(static_cast<Validity>(sample.validity));
  object["reason_names"] = names_of(Reasons(sample.reasons));
  return object;
}

}  // namespace

json to_json(const tubed_TubeEstimate& estimate) { return with_names(estimate); }
json to_json(const tubed_EmSamples& samples) { return json_of(samples); }
json to_json(const tubed_TubeStatus& status) { return with_names(status); }
json to_json(const tubed_TubeIdentity& identity) { return json_of(identity); }
json to_json(const tubed_TubeHealth& health) { return json_of(health); }

}  // namespace tubed
