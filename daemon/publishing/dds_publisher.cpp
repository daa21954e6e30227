#include "daemon/publishing/dds_publisher.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <random>
#include <stdexcept>
#include <string>

#include "daemon/publishing/wire_conversion.hpp"
#include "idl/dds_contract.hpp"
#include "idl/dds_security.hpp"
#include "idl/printable_text.hpp"

namespace tubed {
namespace {

using InstrumentId = std::array<char, kInstrumentIdLength + 1>;

std::uint64_t draw_daemon_start() {
  std::random_device entropy;
  const std::uint64_t drawn = (static_cast<std::uint64_t>(entropy()) << 32U) | entropy();
  return std::max<std::uint64_t>(drawn, 1);
}

std::vector<InstrumentId> checked_instrument_ids(const std::vector<TubeIdentityValues>& identities) {
  if (identities.size() > static_cast<std::size_t>(kMaxInstruments)) {
    throw std::invalid_argument("more than " + std::to_string(kMaxInstruments) + " instruments");
  }
  std::vector<InstrumentId> ids;
  for (const TubeIdentityValues& identity : identities) {
    const std::string& id = identity.instrument_id;
    if (id.empty() || id.size() > static_cast<std::size_t>(kInstrumentIdLength)) {
      throw std::invalid_argument("instrument id '" + id + "' must have 1 to 64 characters");
    }
    InstrumentId text{};
    std::copy(id.begin(), id.end(), text.begin());
    if (std::find(ids.begin(), ids.end(), text) != ids.end()) {
      throw std::invalid_argument("instrument id '" + id + "' is given twice");
    }
    ids.push_back(text);
  }
  return ids;
}

DdsEntity join(const DdsSettings& dds) {
  if (dds.security.empty()) {
    return join_domain(dds.domain, dds.network_interface);
  }
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  require_keys(dds.security, std::chrono::duration_cast<std::chrono::seconds>(now).count(), Access::kPublish,
               topic_names(), dds.partition);
  const DdsQos qos = secured_participant_qos(dds.security);
  return join_domain(dds.domain, dds.network_interface, qos.get());
}

}  // namespace

struct DdsPublisher::Writers {
  Writers(const DdsSettings& dds, std::vector<InstrumentId> ids)
      : settings(dds),
        instrument_ids(std::move(ids)),
        participant(join(dds)),
        estimate_writer(make_writer(participant, contract_of<tubed_TubeEstimate>(), dds.partition)),
        em_writer(make_writer(participant, contract_of<tubed_EmSamples>(), dds.partition)),
        status_writer(make_writer(participant, contract_of<tubed_TubeStatus>(), dds.partition)),
        identity_writer(make_writer(participant, contract_of<tubed_TubeIdentity>(), dds.partition)),
        health_writer(make_writer(participant, contract_of<tubed_TubeHealth>(), dds.partition)) {}

  template <typename Sample>
  PublishResult write(const DdsEntity& writer, std::uint32_t instrument, Sample& sample) noexcept {
    if (instrument >= instrument_ids.size()) {
      ++counters.failed;
      return PublishResult::kFailed;
    }
    std::memcpy(sample.instrument_id, instrument_ids[instrument].data(), sizeof(sample.instrument_id));
    sample.daemon_start = daemon_start;
    return counted(dds_write(writer.get(), &sample));
  }

  PublishResult counted(dds_return_t code) noexcept {
    if (code == DDS_RETCODE_OK) {
      ++counters.written;
      return PublishResult::kWritten;
    }
    if (code == DDS_RETCODE_TIMEOUT) {
      ++counters.timed_out;
      return PublishResult::kTimedOut;
    }
    ++counters.failed;
    return PublishResult::kFailed;
  }

  DdsSettings settings;
  std::vector<InstrumentId> instrument_ids;
  std::uint64_t daemon_start = draw_daemon_start();
  PublishCounters counters;
  // Preallocated: 8 KB each is too much for a stack of a small thread. Zero from the start, so that what lies
  // beyond the counts is never somebody's memory.
  tubed_TubeEstimate estimate{};
  tubed_EmSamples em_samples{};
  tubed_TubeStatus status{};
  tubed_TubeIdentity identity{};
  tubed_TubeHealth health{};
  DdsEntity participant;  // after it only what it contains: destroyed last
  DdsEntity estimate_writer;
  DdsEntity em_writer;
  DdsEntity status_writer;
  DdsEntity identity_writer;
  DdsEntity health_writer;
};

DdsPublisher::DdsPublisher(const DdsSettings& settings, const std::vector<TubeIdentityValues>& identities)
    : writers_(std::make_unique<Writers>(settings, checked_instrument_ids(identities))) {
  for (std::uint32_t instrument = 0; instrument < identities.size(); ++instrument) {
    if (publish_identity(instrument, identities[instrument]) != PublishResult::kWritten) {
      throw DdsError("cannot write the identity of instrument '" + identities[instrument].instrument_id +
                     "'");
    }
  }
}

DdsPublisher::~DdsPublisher() = default;
DdsPublisher::DdsPublisher(DdsPublisher&&) noexcept = default;
DdsPublisher& DdsPublisher::operator=(DdsPublisher&&) noexcept = default;

PublishResult DdsPublisher::publish(const TubeEstimate& estimate, const ClockPair& now) noexcept {
  to_wire(estimate, now, writers_->estimate);
  return writers_->write(writers_->estimate_writer, estimate.instrument, writers_->estimate);
}

PublishResult DdsPublisher::publish_em(std::uint32_t instrument, const EmSamplesValues& samples,
                                       const ClockPair& now) noexcept {
  to_wire(samples, now, writers_->em_samples);
  return writers_->write(writers_->em_writer, instrument, writers_->em_samples);
}

PublishResult DdsPublisher::publish_status(std::uint32_t instrument, const InstrumentStatus& status,
                                           std::span<const NamedStageReport> stages,
                                           const ClockPair& now) noexcept {
  to_wire(status, stages, now, writers_->status);
  return writers_->write(writers_->status_writer, instrument, writers_->status);
}

PublishResult DdsPublisher::publish_health(std::uint32_t instrument, const InstrumentHealthValues& health,
                                           std::span<const NamedStageReport> stages,
                                           const ClockPair& now) noexcept {
  to_wire(health, stages, now, writers_->health);
  return writers_->write(writers_->health_writer, instrument, writers_->health);
}

PublishResult DdsPublisher::publish_identity(std::uint32_t instrument,
                                             const TubeIdentityValues& identity) noexcept {
  to_wire(identity, writers_->identity);
  if (identity.world_frame.empty()) {
    copy_printable(writers_->settings.world_frame, writers_->identity.world_frame);
  }
  if (identity.world_axes.empty()) {
    copy_printable(writers_->settings.world_axes, writers_->identity.world_axes);
  }
  return writers_->write(writers_->identity_writer, instrument, writers_->identity);
}

std::uint64_t DdsPublisher::daemon_start() const { return writers_->daemon_start; }

const PublishCounters& DdsPublisher::counters() const { return writers_->counters; }

const DdsEntity& DdsPublisher::participant() const { return writers_->participant; }

}  // namespace tubed
