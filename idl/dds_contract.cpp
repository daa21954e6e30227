#include "idl/dds_contract.hpp"

namespace tubed {
namespace {

constexpr std::chrono::milliseconds kNone{0};

constexpr TopicContract kTubeEstimate{"TubeEstimate",    &tubed_TubeEstimate_desc, DDS_DURABILITY_VOLATILE, 1,
                                      kEstimateDeadline, kEstimateLiveliness,      kEstimateLifespan};
constexpr TopicContract kEmSamples{
    "EmSamples", &tubed_EmSamples_desc, DDS_DURABILITY_VOLATILE, 16, kNone, kNone, kEmLifespan};
constexpr TopicContract kTubeStatus{
    "TubeStatus", &tubed_TubeStatus_desc, DDS_DURABILITY_TRANSIENT_LOCAL, 1, kNone, kNone, kNone};
constexpr TopicContract kTubeIdentity{
    "TubeIdentity", &tubed_TubeIdentity_desc, DDS_DURABILITY_TRANSIENT_LOCAL, 1, kNone, kNone, kNone};
constexpr TopicContract kTubeHealth{
    "TubeHealth", &tubed_TubeHealth_desc, DDS_DURABILITY_VOLATILE, 1, kNone, kNone, kNone};

constexpr dds_duration_t duration(std::chrono::milliseconds value) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(value).count();
}

/// What writer and reader must agree on.
DdsQos common_qos(const TopicContract& topic) {
  DdsQos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, duration(kMaxWrite));
  dds_qset_durability(qos.get(), topic.durability);
  if (topic.deadline > kNone) {
    dds_qset_deadline(qos.get(), duration(topic.deadline));
  }
  if (topic.liveliness > kNone) {
    // AUTOMATIC would be asserted by Cyclone's own thread while ours hangs.
    dds_qset_liveliness(qos.get(), DDS_LIVELINESS_MANUAL_BY_TOPIC, duration(topic.liveliness));
  }
  return qos;
}

/// Publishers and subscribers carry the partition; entities below them inherit their lifetime.
DdsQos group_qos(const std::string& partition) {
  DdsQos qos(dds_create_qos());
  dds_qset_partition1(qos.get(), partition.c_str());
  return qos;
}

dds_entity_t make_topic(const DdsEntity& participant, const TopicContract& topic) {
  const dds_entity_t created = dds_create_topic(participant.get(), topic.type, topic.name, nullptr, nullptr);
  require_dds(created, std::string("create topic ") + topic.name);
  return created;
}

}  // namespace

template <>
const TopicContract& contract_of<tubed_TubeEstimate>() {
  return kTubeEstimate;
}
template <>
const TopicContract& contract_of<tubed_EmSamples>() {
  return kEmSamples;
}
template <>
const TopicContract& contract_of<tubed_TubeStatus>() {
  return kTubeStatus;
}
template <>
const TopicContract& contract_of<tubed_TubeIdentity>() {
  return kTubeIdentity;
}
template <>
const TopicContract& contract_of<tubed_TubeHealth>() {
  return kTubeHealth;
}

std::vector<std::string> topic_names() {
  return {kTubeEstimate.name, kEmSamples.name, kTubeStatus.name, kTubeIdentity.name, kTubeHealth.name};
}

DdsEntity make_writer(const DdsEntity& participant, const TopicContract& topic,
                      const std::string& partition) {
  const DdsQos qos = common_qos(topic);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, topic.history_depth);
  if (topic.lifespan > kNone) {
    dds_qset_lifespan(qos.get(), duration(topic.lifespan));
  }
  // Other vendors of Debian 12 do not read XCDR2.
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos.get(), 1, &xcdr1);
  const DdsQos group = group_qos(partition);
  const dds_entity_t publisher = dds_create_publisher(participant.get(), group.get(), nullptr);
  require_dds(publisher, std::string("create the publisher of ") + topic.name);
  const dds_entity_t created =
      dds_create_writer(publisher, make_topic(participant, topic), qos.get(), nullptr);
  return {created, std::string("the writer of ") + topic.name};
}

DdsEntity make_reader(const DdsEntity& participant, const TopicContract& topic, const std::string& partition,
                      int history_depth, SampleFilter filter, OwnWriters own) {
  const DdsQos qos = common_qos(topic);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, history_depth);
  if (own == OwnWriters::kIgnored) {
    dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  }
  const DdsQos group = group_qos(partition);
  const dds_entity_t subscriber = dds_create_subscriber(participant.get(), group.get(), nullptr);
  require_dds(subscriber, std::string("create the subscriber of ") + topic.name);
  const dds_entity_t filtered = make_topic(participant, topic);
  if (filter.wants != nullptr) {
    const dds_topic_filter wanted{
        .mode = DDS_TOPIC_FILTER_SAMPLE_ARG, .f = {.sample_arg = filter.wants}, .arg = filter.state};
    require_dds(dds_set_topic_filter_extended(filtered, &wanted),
                std::string("choose what is read of ") + topic.name);
  }
  const dds_entity_t created = dds_create_reader(subscriber, filtered, qos.get(), nullptr);
  return {created, std::string("the reader of ") + topic.name};
}

}  // namespace tubed
