// Receives one of the slow topics: EmSamples, TubeStatus, TubeIdentity, TubeHealth. For the shape use
// TubeSubscriber, which also tells when there is none.
#pragma once

#include <chrono>

#include "clients/cpp/instrument_gate.hpp"
#include "clients/cpp/participant.hpp"
#include "clients/cpp/subscription.hpp"
#include "idl/dds_contract.hpp"
#include "idl/printable_sample.hpp"

namespace tubed {

/// Samples of one topic in the order they came, their texts as they may be shown (printable_text.hpp), of
/// Subscription::max_instruments instruments at most: instrument_gate.hpp. One thread at a time.
template <typename Sample>
class TopicReader {
 public:
  /// Throws DdsError: no such network interface, domain out of range, keys that cannot be used.
  explicit TopicReader(const Subscription& subscription)
      : gate_(subscription.instrument_id, subscription.max_instruments, kTimeouts),
        participant_(join(subscription, contract_of<Sample>().name)),
        reader_(make_reader(participant_, contract_of<Sample>(), subscription.partition,
                            contract_of<Sample>().history_depth,
                            {.wants = &is_admitted<Sample>, .state = &gate_})),
        waitset_(dds_create_waitset(participant_.get()), "a wait set") {
    require_dds(dds_set_status_mask(reader_.get(), DDS_DATA_AVAILABLE_STATUS),
                "choose what wakes the reader");
    require_dds(dds_waitset_attach(waitset_.get(), reader_.get(), 0), "wait for the reader");
  }

  /// The next sample, null if none came within `timeout`. Points into the reader, until its next call.
  const Sample* wait_for(std::chrono::milliseconds timeout) {
    const auto until = std::chrono::steady_clock::now() + timeout;
    while (true) {
      if (const Sample* sample = take()) {
        return sample;
      }
      const std::chrono::nanoseconds left = until - std::chrono::steady_clock::now();
      if (left.count() <= 0) {
        return nullptr;
      }
      dds_waitset_wait(waitset_.get(), nullptr, 0, left.count());
    }
  }

  /// The next sample that is there already, or null.
  const Sample* take() {
    dds_sample_info_t about{};
    void* buffer = &sample_;
    while (dds_take(reader_.get(), &buffer, &about, 1, 1) > 0) {
      if (about.valid_data) {
        make_printable(sample_);
        return &sample_;
      }
    }
    return nullptr;
  }

  /// Whether the instrument still has its place among those that are remembered: a caller that keeps samples
  /// by instrument drops the others.
  [[nodiscard]] bool has(std::string_view instrument_id) const { return gate_.has(instrument_id); }

 private:
  // These topics come once a second: three of them may be lost.
  static constexpr GateTimeouts kTimeouts{.unknown = std::chrono::milliseconds{3500}};

  InstrumentGate gate_;  // the reader's filter asks it
  DdsEntity participant_;
  DdsEntity reader_;
  DdsEntity waitset_;
  Sample sample_{};
};

}  // namespace tubed
