#include "idl/writer_description.hpp"

#include <array>
#include <cstdio>
#include <optional>

#include "idl/printable_text.hpp"

namespace tubed {
namespace {

constexpr std::size_t kMaxBytes = 64;

std::string hexadecimal(const dds_guid_t& guid) {
  std::string text;
  for (const unsigned char byte : guid.v) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02x", byte);
    text += digits.data();
  }
  return text;
}

/// A property that Cyclone's participants announce of themselves.
std::optional<std::string> property(const dds_qos_t* qos, const char* name) {
  char* value = nullptr;
  if (!dds_qget_prop(qos, name, &value) || value == nullptr) return std::nullopt;
  std::string text = printable_text(value, kMaxBytes);
  dds_free(value);
  return text;
}

std::string description_of_participant(const DdsEntity& reader, dds_instance_handle_t participant) {
  const DdsEntity everybody(dds_create_reader(dds_get_participant(reader.get()),
                                              DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
                            "a reader of participants");
  void* sample = nullptr;
  dds_sample_info_t about{};
  if (dds_read_instance(everybody.get(), &sample, &about, 1, 1, participant) <= 0) return "";
  std::string text;
  if (about.valid_data) {
    const dds_qos_t* const qos = static_cast<const dds_builtintopic_participant*>(sample)->qos;
    const auto program = property(qos, "__ProcessName");
    const auto process = property(qos, "__Pid");
    const auto host = property(qos, "__Hostname");
    if (program) text += *program + ", ";
    if (process) text += "process " + *process + " ";
    if (host) text += "on host " + *host + ", ";
  }
  dds_return_loan(everybody.get(), &sample, 1);
  return text;
}

}  // namespace

std::string description_of_writer(const DdsEntity& reader, dds_instance_handle_t writer) {
  dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader.get(), writer);
  if (endpoint == nullptr) return "a DDS writer that has gone";
  const dds_instance_handle_t participant = endpoint->participant_instance_handle;
  const std::string guid = hexadecimal(endpoint->key);
  dds_builtintopic_free_endpoint(endpoint);
  try {
    return description_of_participant(reader, participant) + "DDS writer " + guid;
  } catch (const DdsError&) {
    return "DDS writer " + guid;
  }
}

}  // namespace tubed
