// A program that can reach the network and knows the topics: a writer that is no tubed.
// clang-format off: a list
//   forger PARTITION huge INSTRUMENT START COUNT      samples with the number 2^60 under that daemon's start
//   forger PARTITION invented COUNT                   one sample each of COUNT invented instruments
//   forger PARTITION reports COUNT                    a status and a health each of COUNT invented
//   instruments forger PARTITION words SECONDS                    an instrument whose every text is one that
//   harms a terminal forger PARTITION shapes INSTRUMENT COUNT [KEYS [ACCESS_PLUG_IN]]
//                                                     VALID shapes, with keys when a folder is given, and
//                                                     with another plug-in that judges what this program may
//                                                     do
//   forger PARTITION deafen COUNT                     RTPS packets under the GUID of the daemon's writer,
//   numbers from 2^40 on
// clang-format on
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "idl/dds_contract.hpp"
#include "idl/dds_security.hpp"

namespace {

constexpr const char* kHarm =
    "\nFORGED all is VALID\r\x1b[2J\x1b]0;x\a\xC2\x9B\xFF\xC3\xE2\x80\xAE\xED\xA0\x80\xC0\xAF";

template <std::size_t size>
void fill(char (&text)[size], const std::string& words) {
  text[words.copy(text, size - 1)] = '\0';  // cut anywhere, also within a character
}

void wait_for_a_reader(const tubed::DdsEntity& writer) {
  dds_publication_matched_status_t matched{};
  while (matched.current_count == 0) {
    dds_sleepfor(DDS_MSECS(10));
    dds_get_publication_matched_status(writer.get(), &matched);
  }
}

constexpr std::uint64_t kHuge = std::uint64_t{1} << 60U;
constexpr int kTimeout = 300;  // of 10 ms

std::unique_ptr<tubed_TubeEstimate> lie(const std::string& instrument, std::uint64_t start,
                                        std::uint64_t number) {
  auto sample = std::make_unique<tubed_TubeEstimate>();
  fill(sample->instrument_id, instrument);
  sample->daemon_start = start;
  sample->sequence_number = number;
  sample->validity = tubed_VALIDITY_VALID;
  sample->publish_time_ns = sample->stamps.publish_started_monotonic_ns = dds_time();
  return sample;
}

/// Two of the slow topics.
class Reporter {
 public:
  Reporter(const tubed::DdsEntity& participant, const char* partition)
      : status_writer_(tubed::make_writer(participant, tubed::contract_of<tubed_TubeStatus>(), partition)),
        health_writer_(tubed::make_writer(participant, tubed::contract_of<tubed_TubeHealth>(), partition)) {}

  void wait_for_readers() const {
    wait_for_a_reader(status_writer_);
    wait_for_a_reader(health_writer_);
  }

  void report(const std::string& instrument, const std::string& stage, const std::string& why) {
    fill(status_->instrument_id, instrument);
    fill(health_->instrument_id, instrument);
    fill(status_->stages[0].name, stage);
    fill(health_->stages[0].name, stage);
    fill(status_->stages[0].why, why);
    status_->stage_count = health_->stage_count = 1;
    status_->time_ns = health_->time_ns = dds_time();
    status_->stages[0].state = 5;
    dds_write(status_writer_.get(), status_.get());
    dds_write(health_writer_.get(), health_.get());
  }

 private:
  tubed::DdsEntity status_writer_;
  tubed::DdsEntity health_writer_;
  std::unique_ptr<tubed_TubeStatus> status_ = std::make_unique<tubed_TubeStatus>();
  std::unique_ptr<tubed_TubeHealth> health_ = std::make_unique<tubed_TubeHealth>();
};

void report_invented(const tubed::DdsEntity& participant, const char* partition, int count) {
  Reporter reporter(participant, partition);
  reporter.wait_for_readers();
  for (int k = 0; k < count; ++k) {
    reporter.report("invented-" + std::to_string(k), "em", "");
    dds_sleepfor(DDS_USECS(200));
  }
}

void identify_with_harm(const tubed::DdsEntity& writer) {
  auto identity = std::make_unique<tubed_TubeIdentity>();
  fill(identity->instrument_id, std::string("evil") + kHarm);
  fill(identity->software_version, kHarm);
  fill(identity->mode, kHarm);
  fill(identity->world_frame, kHarm);
  fill(identity->tracker.firmware, kHarm);
  fill(identity->tracker.field_generator, kHarm);
  identity->camera_count = 1;
  fill(identity->cameras[0].name, kHarm);
  identity->tracker.tool_count = 1;
  fill(identity->tracker.tools[0].part_number, kHarm);
  dds_write(writer.get(), identity.get());
}

void speak_harm(const tubed::DdsEntity& participant, const char* partition, int seconds) {
  const tubed::DdsEntity estimates =
      tubed::make_writer(participant, tubed::contract_of<tubed_TubeEstimate>(), partition);
  const tubed::DdsEntity identities =
      tubed::make_writer(participant, tubed::contract_of<tubed_TubeIdentity>(), partition);
  Reporter reporter(participant, partition);
  for (int k = 0; k < 30 * seconds; ++k) {
    const auto sample = lie(std::string("evil") + kHarm, 7, static_cast<std::uint64_t>(k) + 1);
    dds_write(estimates.get(), sample.get());
    if (k % 15 == 0) reporter.report(std::string("evil") + kHarm, std::string("em") + kHarm, kHarm);
    if (k % 15 == 0) identify_with_harm(identities);
    dds_sleepfor(DDS_MSECS(33));
  }
}

void estimate_forged(const tubed::DdsEntity& participant, char** arguments, int argument_count) {
  const tubed::DdsEntity writer =
      tubed::make_writer(participant, tubed::contract_of<tubed_TubeEstimate>(), arguments[1]);
  wait_for_a_reader(writer);
  const bool is_huge = std::strcmp(arguments[2], "huge") == 0;
  const int count = std::atoi(arguments[argument_count - 1]);
  for (int k = 0; k < count; ++k) {
    const auto sample = is_huge ? lie(arguments[3], std::strtoull(arguments[4], nullptr, 10), kHuge)
                                : lie("invented-" + std::to_string(k), 7, 1);
    dds_write(writer.get(), sample.get());
    dds_sleepfor(is_huge ? DDS_MSECS(33) : DDS_USECS(200));
  }
}

tubed::DdsEntity join(const char* keys, const char* access_plug_in) {
  if (keys == nullptr) return tubed::join_domain(0, "lo");
  const tubed::DdsQos qos = tubed::secured_participant_qos(keys);
  if (access_plug_in != nullptr) dds_qset_prop(qos.get(), "dds.sec.access.library.path", access_plug_in);
  return tubed::join_domain(0, "lo", qos.get());
}

std::uint32_t matched_readers(const tubed::DdsEntity& writer) {
  dds_publication_matched_status_t matched{};
  dds_get_publication_matched_status(writer.get(), &matched);
  return matched.current_count;
}

/// Without keys it waits in vain for readers, and writes all the same. Returns the most readers at a
/// time.
std::uint32_t show_shapes(const tubed::DdsEntity& participant, const char* partition,
                          const std::string& instrument, int count) {
  const tubed::DdsEntity writer =
      tubed::make_writer(participant, tubed::contract_of<tubed_TubeEstimate>(), partition);
  for (int i = 0; matched_readers(writer) == 0 && i < kTimeout; ++i) dds_sleepfor(DDS_MSECS(10));
  std::uint32_t max_readers = 0;
  for (int k = 0; k < count; ++k) {
    const auto sample = lie(instrument, 7, static_cast<std::uint64_t>(k) + 1);
    dds_write(writer.get(), sample.get());
    max_readers = std::max(max_readers, matched_readers(writer));
    dds_sleepfor(DDS_MSECS(33));
  }
  return max_readers;
}

/// The GUID of the first writer of estimates that is found.
dds_guid_t guid_of_the_daemon(const tubed::DdsEntity& participant, const char* partition) {
  const tubed::DdsEntity reader =
      tubed::make_reader(participant, tubed::contract_of<tubed_TubeEstimate>(), partition, 1);
  dds_instance_handle_t writer = 0;
  while (dds_get_matched_publications(reader.get(), &writer, 1) <= 0) dds_sleepfor(DDS_MSECS(10));
  dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader.get(), writer);
  const dds_guid_t guid = endpoint->key;
  dds_builtintopic_free_endpoint(endpoint);
  return guid;
}

void append(std::vector<unsigned char>& packet, std::initializer_list<unsigned> bytes) {
  for (const unsigned byte : bytes) packet.push_back(static_cast<unsigned char>(byte));
}

void append_number(std::vector<unsigned char>& packet, std::uint32_t number) {
  append(packet, {number & 255U, (number >> 8U) & 255U, (number >> 16U) & 255U, number >> 24U});
}

/// An RTPS 2.2 HEARTBEAT submessage (Sec. 9.4.5.7) to every reader, under a writer's own GUID: what is older
/// than `number` does not exist any more.
std::vector<unsigned char> heartbeat_packet(const dds_guid_t& guid, std::uint64_t number) {
  constexpr std::uint32_t kCount = std::uint32_t{1} << 30U;  // above the real one's, which is ignored then
  std::vector<unsigned char> packet;
  append(packet, {'R', 'T', 'P', 'S', 2, 2, 1, 16});
  packet.insert(packet.end(), guid.v, guid.v + 12);
  append(packet, {0x07, 0x03, 28, 0, 0, 0, 0, 0});
  packet.insert(packet.end(), guid.v + 12, guid.v + 16);
  for (int end = 0; end < 2; ++end) {
    append_number(packet, static_cast<std::uint32_t>(number >> 32U));
    append_number(packet, static_cast<std::uint32_t>(number));
  }
  append_number(packet, kCount + static_cast<std::uint32_t>(number));
  return packet;
}

void deafen(const dds_guid_t& guid, int count) {
  constexpr int kFirstPort = 7400;  // of domain 0
  constexpr int kPorts = 250;
  const int udp_socket = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (int k = 0; k < count; ++k) {
    const auto packet = heartbeat_packet(guid, (std::uint64_t{1} << 40U) + static_cast<std::uint64_t>(k));
    for (int port = kFirstPort; port < kFirstPort + kPorts; ++port) {
      to.sin_port = htons(static_cast<std::uint16_t>(port));
      sendto(udp_socket, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    }
  }
  close(udp_socket);
}

int forge(int argc, char** argv) {
  const std::string what = argv[2];
  if (what == "shapes") {
    const tubed::DdsEntity participant = join(argc > 5 ? argv[5] : nullptr, argc > 6 ? argv[6] : nullptr);
    std::printf("done, %u readers\n", show_shapes(participant, argv[1], argv[3], std::atoi(argv[4])));
    return 0;
  }
  const tubed::DdsEntity participant = tubed::join_domain(0, "lo");
  if (what == "reports") {
    report_invented(participant, argv[1], std::atoi(argv[3]));
  } else if (what == "deafen") {
    deafen(guid_of_the_daemon(participant, argv[1]), std::atoi(argv[3]));
  } else if (what == "words") {
    speak_harm(participant, argv[1], std::atoi(argv[3]));
  } else {
    estimate_forged(participant, argv, argc);
  }
  std::puts("done");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 64;
  try {
    return forge(argc, argv);
  } catch (const tubed::DdsError& error) {
    std::printf("%s\n", error.what());
    return 1;
  }
}
