#include "bench/peers/cyclone_peers.hpp"

#include <dds/ddsc/dds_loan_api.h>
#include <dds/ddsrt/log.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "FixedBlock.h"
#include "bench/peers/sample_estimate.hpp"
#include "idl/dds_contract.hpp"

namespace tubed {

namespace {

constexpr int kUdpDomain = 41;
constexpr int kSharedMemoryDomain = 42;

/// Only what a network without multicast needs to find each other, and whether iceoryx is used.
DdsEntity join_bare_domain(int domain, const std::string& shared_memory) {
  const std::string configuration =
      "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>"
      "<SharedMemory><Enable>" +
      shared_memory +
      "</Enable><LogLevel>error</LogLevel></SharedMemory>"
      "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60</"
      "MaxAutoParticipantIndex>"
      "<Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>";
  // It says at every start that lo has no multicast: known, and why there are peers.
  dds_set_log_sink([](void*, const dds_log_data_t*) {}, nullptr);
  require_dds(dds_create_domain(static_cast<dds_domainid_t>(domain), configuration.c_str()),
              "set up a bare domain");
  dds_set_log_sink(nullptr, nullptr);
  return {dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr), "a participant"};
}

DdsQos bare_qos() {
  DdsQos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_MSECS(2));
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  return qos;
}

dds_entity_t bare_topic(const DdsEntity& participant) {
  const dds_entity_t topic =
      dds_create_topic(participant.get(), &tubed_TubeEstimate_desc, "BareTubeEstimate", nullptr, nullptr);
  require_dds(topic, "create the topic");
  return topic;
}

dds_entity_t block_topic(const DdsEntity& participant) {
  const dds_entity_t topic =
      dds_create_topic(participant.get(), &tubed_FixedBlock_desc, "FixedBlock", nullptr, nullptr);
  require_dds(topic, "create the topic");
  return topic;
}

class UdpSender final : public Sender {
 public:
  UdpSender()
      : participant_(join_bare_domain(kUdpDomain, "false")),
        writer_(dds_create_writer(participant_.get(), bare_topic(participant_), bare_qos().get(), nullptr),
                "a writer") {
    fill(sample_);
  }
  void send(std::uint32_t number) override {
    sample_.image_frame = number;
    require_dds(dds_write(writer_.get(), &sample_), "write");
  }

 private:
  tubed_TubeEstimate sample_{};
  DdsEntity participant_;
  DdsEntity writer_;
};

class UdpReceiver final : public Receiver {
 public:
  UdpReceiver()
      : participant_(join_bare_domain(kUdpDomain, "false")),
        reader_(dds_create_reader(participant_.get(), bare_topic(participant_), bare_qos().get(), nullptr),
                "a reader"),
        waitset_(dds_create_waitset(participant_.get()), "a wait set") {
    require_dds(dds_set_status_mask(reader_.get(), DDS_DATA_AVAILABLE_STATUS), "choose what wakes");
    require_dds(dds_waitset_attach(waitset_.get(), reader_.get(), 0), "wait for the reader");
  }
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    while (!is_over()) {
      dds_waitset_wait(waitset_.get(), nullptr, 0, DDS_MSECS(50));
      dds_sample_info_t about{};
      void* sample = &sample_;
      while (dds_take(reader_.get(), &sample, &about, 1, 1) > 0) {
        if (about.valid_data) arrived(sample_.image_frame, monotonic_ns());
      }
    }
  }

 private:
  tubed_TubeEstimate sample_{};
  DdsEntity participant_;
  DdsEntity reader_;
  DdsEntity waitset_;
};

/// Writes a sample of ours, which Cyclone puts into shared memory as it would on the wire.
class SerialisedSender final : public Sender {
 public:
  SerialisedSender()
      : participant_(join_bare_domain(kSharedMemoryDomain, "true")),
        writer_(dds_create_writer(participant_.get(), bare_topic(participant_), bare_qos().get(), nullptr),
                "a writer") {
    if (!dds_is_shared_memory_available(writer_.get())) throw DdsError("Cyclone has no shared memory");
    fill(sample_);
  }
  void send(std::uint32_t number) override {
    sample_.image_frame = number;
    require_dds(dds_write(writer_.get(), &sample_), "write");
  }

 private:
  tubed_TubeEstimate sample_{};
  DdsEntity participant_;
  DdsEntity writer_;
};

/// Fills what Cyclone lends.
class LoanSender final : public Sender {
 public:
  LoanSender()
      : participant_(join_bare_domain(kSharedMemoryDomain, "true")),
        writer_(dds_create_writer(participant_.get(), block_topic(participant_), bare_qos().get(), nullptr),
                "a writer") {
    if (!dds_is_loan_available(writer_.get())) throw DdsError("Cyclone lends no memory");
  }
  void send(std::uint32_t number) override {
    void* loan = nullptr;
    block_.number = number;
    require_dds(dds_loan_sample(writer_.get(), &loan), "get a loan");
    std::memcpy(loan, &block_, sizeof block_);
    require_dds(dds_write(writer_.get(), loan), "write a loan");
  }

 private:
  tubed_FixedBlock block_{};
  DdsEntity participant_;
  DdsEntity writer_;
};

/// Takes loans in a listener and copies them, as our reader does.
template <typename Sample>
class ListeningReceiver final : public Receiver {
 public:
  ListeningReceiver(dds_entity_t (*make_topic)(const DdsEntity&), std::uint32_t Sample::*number)
      : make_topic_(make_topic),
        number_(number),
        participant_(join_bare_domain(kSharedMemoryDomain, "true")) {}

  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    arrived_ = &arrived;
    dds_listener_t* listener = dds_create_listener(this);
    dds_lset_data_available(listener, [](dds_entity_t reader, void* self) {
      static_cast<ListeningReceiver*>(self)->take(reader);
    });
    const DdsEntity reader(
        dds_create_reader(participant_.get(), make_topic_(participant_), bare_qos().get(), listener),
        "a reader");
    dds_delete_listener(listener);
    while (!is_over()) sleep_until_ns(monotonic_ns() + 50'000'000);
  }

 private:
  void take(dds_entity_t reader) {
    dds_sample_info_t about{};
    void* loan = nullptr;
    while (dds_take(reader, &loan, &about, 1, 1) > 0) {
      if (about.valid_data) {
        std::memcpy(&sample_, loan, sizeof sample_);
        (*arrived_)(sample_.*number_, monotonic_ns());
      }
      dds_return_loan(reader, &loan, 1);
      loan = nullptr;
    }
  }

  dds_entity_t (*make_topic_)(const DdsEntity&);
  std::uint32_t Sample::*number_;
  const Arrived* arrived_ = nullptr;
  Sample sample_{};
  DdsEntity participant_;
};

std::string words_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

Route cyclone_udp() {
  return {"cyclone-udp", Placement::kProcesses, [] { return std::make_unique<UdpSender>(); },
          [] { return std::make_unique<UdpReceiver>(); }};
}

Route cyclone_shared_memory() {
  return {"cyclone-shm", Placement::kProcesses, [] { return std::make_unique<SerialisedSender>(); },
          [] {
            return std::make_unique<ListeningReceiver<tubed_TubeEstimate>>(bare_topic,
                                                                           &tubed_TubeEstimate::image_frame);
          }};
}

Route cyclone_loans() {
  return {"cyclone-shm-loan", Placement::kProcesses, [] { return std::make_unique<LoanSender>(); },
          [] {
            return std::make_unique<ListeningReceiver<tubed_FixedBlock>>(block_topic,
                                                                         &tubed_FixedBlock::number);
          }};
}

bool has_roudi() { return std::system("command -v iox-roudi > /dev/null 2>&1") == 0; }

ChildProcess start_roudi(const std::filesystem::path& folder) {
  const std::filesystem::path settings = folder / "roudi.toml";
  const std::filesystem::path log = folder / "roudi.log";
  std::ofstream(settings)
      << "[general]\nversion = 1\n\n[[segment]]\n\n[[segment.mempool]]\nsize = 1024\ncount = 2000\n\n"
         "[[segment.mempool]]\nsize = 16384\ncount = 1000\n";
  ChildProcess roudi({"iox-roudi", "-m", "off", "-c", settings.string()}, log);
  for (int tries = 0; tries < 100; ++tries) {
    sleep_until_ns(monotonic_ns() + 100'000'000);
    if (words_of(log).find("ready") != std::string::npos) return roudi;
    if (!roudi.is_running()) break;
  }
  throw std::runtime_error("iox-roudi did not start: " + words_of(log));
}

}  // namespace tubed
