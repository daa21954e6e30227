// The five topics and the QoS writers and readers agree on: one table for both sides, so that they always
// match.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "EmSamples.h"
#include "TubeEstimate.h"
#include "TubeHealth.h"
#include "TubeIdentity.h"
#include "TubeStatus.h"
#include "idl/dds_entity.hpp"

namespace tubed {

inline constexpr std::chrono::milliseconds kEstimateDeadline{100};    ///< an estimate at least this often
inline constexpr std::chrono::milliseconds kEstimateLiveliness{250};  ///< silence that means: hung or dead
inline constexpr std::chrono::milliseconds kEstimateLifespan{200};    ///< older ones are not delivered
inline constexpr std::chrono::milliseconds kEmLifespan{1000};
inline constexpr std::chrono::milliseconds kMaxWrite{2};  ///< a writer gives up rather than wait longer

/// What distinguishes one topic from another; zero durations mean "none".
struct TopicContract {
  const char* name;
  const dds_topic_descriptor_t* type;
  dds_durability_kind_t durability;
  int history_depth;
  std::chrono::milliseconds deadline;
  std::chrono::milliseconds liveliness;  ///< MANUAL_BY_TOPIC
  std::chrono::milliseconds lifespan;
};

/// The contract of the topic that carries `Sample`, one of the five generated structs.
template <typename Sample>
const TopicContract& contract_of();
template <>
const TopicContract& contract_of<tubed_TubeEstimate>();
template <>
const TopicContract& contract_of<tubed_EmSamples>();
template <>
const TopicContract& contract_of<tubed_TubeStatus>();
template <>
const TopicContract& contract_of<tubed_TubeIdentity>();
template <>
const TopicContract& contract_of<tubed_TubeHealth>();

/// The names of all of them: what keys are made for.
std::vector<std::string> topic_names();

/// Writer of a topic in `partition` (empty: the default partition), data representation XCDR1.
/// Throws DdsError. The topic entity belongs to the participant.
DdsEntity make_writer(const DdsEntity& participant, const TopicContract& topic, const std::string& partition);

/// Decides, before a sample is stored, whether a reader wants it. Called on Cyclone's receiving thread with a
/// sample of the topic's type and `state`, which outlives the reader.
struct SampleFilter {
  bool (*wants)(const void* sample, void* state) = nullptr;  ///< null: everything is stored
  void* state = nullptr;
};

/// Whether a reader hears writers of its own participant.
enum class OwnWriters { kHeard, kIgnored };

/// Reader of a topic that keeps up to `history_depth` samples an instrument. Throws DdsError.
DdsEntity make_reader(const DdsEntity& participant, const TopicContract& topic, const std::string& partition,
                      int history_depth, SampleFilter filter = {}, OwnWriters own = OwnWriters::kHeard);

}  // namespace tubed
