#include "bench/peers/fastdds_peers.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <memory>
#include <stdexcept>

#include "FixedBlockPubSubTypes.h"

namespace tubed {

namespace {

namespace fast = eprosima::fastdds::dds;

constexpr std::uint32_t kDomain = 43;

enum class Transport { kAsItComes, kUdp };

/// A participant with the topic; ends everything made from it.
class Participant {
 public:
  explicit Participant(Transport transport) : transport_(transport) {
    fast::DomainParticipantQos qos;
    if (transport == Transport::kUdp) {
      qos.transport().use_builtin_transports = false;
      qos.transport().user_transports.push_back(
          std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>());
    }
    const auto domain = kDomain + (transport == Transport::kUdp ? 1U : 0U);
    participant_ = fast::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    if (participant_ == nullptr) throw std::runtime_error("Fast DDS gives no participant");
    type_.register_type(participant_);
    topic_ = participant_->create_topic("FixedBlock", type_.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  }
  ~Participant() {
    participant_->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  fast::DataWriter* make_writer() {
    fast::DataWriterQos qos;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = fast::VOLATILE_DURABILITY_QOS;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 1;
    if (transport_ == Transport::kUdp) qos.data_sharing().off();
    return participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT)->create_datawriter(topic_, qos);
  }
  fast::DataReader* make_reader(fast::DataReaderListener& listener) {
    fast::DataReaderQos qos;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = fast::VOLATILE_DURABILITY_QOS;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 1;
    if (transport_ == Transport::kUdp) qos.data_sharing().off();
    return participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)
        ->create_datareader(topic_, qos, &listener);
  }

 private:
  Transport transport_;
  fast::TypeSupport type_{new FixedBlockPubSubType()};
  fast::DomainParticipant* participant_ = nullptr;
  fast::Topic* topic_ = nullptr;
};

class FastSender final : public Sender {
 public:
  explicit FastSender(Transport transport) : participant_(transport), writer_(participant_.make_writer()) {
    if (writer_ == nullptr) throw std::runtime_error("Fast DDS gives no writer");
  }
  void send(std::uint32_t number) override {
    block_.number(number);
    writer_->write(&block_);
  }

 private:
  FixedBlock block_;
  Participant participant_;
  fast::DataWriter* writer_;
};

class FastReceiver final : public Receiver, private fast::DataReaderListener {
 public:
  explicit FastReceiver(Transport transport) : participant_(std::make_unique<Participant>(transport)) {}

  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    arrived_ = &arrived;
    if (participant_->make_reader(*this) == nullptr) throw std::runtime_error("Fast DDS gives no reader");
    while (!is_over()) sleep_until_ns(monotonic_ns() + 50'000'000);
    participant_.reset();  // no call of the listener any more
  }

 private:
  void on_data_available(fast::DataReader* reader) override {
    fast::SampleInfo about;
    while (reader->take_next_sample(&block_, &about) == ReturnCode_t::RETCODE_OK) {
      if (about.valid_data) (*arrived_)(block_.number(), monotonic_ns());
    }
  }

  FixedBlock block_;
  const Arrived* arrived_ = nullptr;
  std::unique_ptr<Participant> participant_;
};

Route route(const char* name, Transport transport) {
  return {name, Placement::kProcesses, [=] { return std::make_unique<FastSender>(transport); },
          [=] { return std::make_unique<FastReceiver>(transport); }};
}

}  // namespace

Route fastdds_as_it_comes() { return route("fastdds-shm", Transport::kAsItComes); }

Route fastdds_udp() { return route("fastdds-udp", Transport::kUdp); }

}  // namespace tubed
