#include "clients/cpp/estimate_connection.hpp"

#include <algorithm>
#include <cstring>

#include "clients/cpp/participant.hpp"
#include "idl/dds_contract.hpp"

namespace tubed {
namespace {

constexpr int kHistoryDepth = 32;
constexpr std::size_t kMaxKnown = 64;

/// 128 bits to 64: prefix and entity of a GUID. An attacker who can choose a colliding GUID can as well take
/// this one.
std::uint64_t number_of(const dds_guid_t& guid) {
  std::uint64_t halves[2];
  static_assert(sizeof halves == sizeof guid.v);
  std::memcpy(halves, guid.v, sizeof halves);
  return halves[0] ^ (halves[1] * 0x9E3779B97F4A7C15U);
}

}  // namespace

EstimateConnection::EstimateConnection(const Subscription& subscription, InstrumentGate& gate,
                                       DomainUse domain) {
  const TopicContract& topic = contract_of<tubed_TubeEstimate>();
  if (domain == DomainUse::kShared) {
    participant_ = join(subscription, topic.name);
  } else {
    separate_.emplace(join_separately(subscription, topic.name));
  }
  reader_ = make_reader(separate_ ? separate_->participant() : participant_, topic, subscription.partition,
                        kHistoryDepth, {.wants = &is_admitted<tubed_TubeEstimate>, .state = &gate});
  const std::uint32_t wakes =
      DDS_DATA_AVAILABLE_STATUS | DDS_LIVELINESS_CHANGED_STATUS | DDS_SUBSCRIPTION_MATCHED_STATUS;
  require_dds(dds_set_status_mask(reader_.get(), wakes), "choose what wakes the subscriber");
}

std::uint64_t EstimateConnection::writer_of(dds_instance_handle_t handle) {
  const auto known =
      std::find_if(known_.begin(), known_.end(), [&](const auto& pair) { return pair.first == handle; });
  if (known != known_.end()) return known->second;
  dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader_.get(), handle);
  if (endpoint == nullptr) return handle;  // it has gone meanwhile
  const std::uint64_t writer = number_of(endpoint->key);
  dds_builtintopic_free_endpoint(endpoint);
  known_.emplace_back(handle, writer);
  return writer;
}

std::optional<dds_instance_handle_t> EstimateConnection::handle_of(std::uint64_t writer) const {
  const auto known =
      std::find_if(known_.begin(), known_.end(), [&](const auto& pair) { return pair.second == writer; });
  return known == known_.end() ? std::nullopt : std::optional(known->first);
}

std::optional<std::span<const std::uint64_t>> EstimateConnection::matched_writers() {
  const dds_return_t count = dds_get_matched_publications(reader_.get(), nullptr, 0);
  handles_.resize(static_cast<std::size_t>(std::max(count, 0)));
  const dds_return_t read = dds_get_matched_publications(reader_.get(), handles_.data(), handles_.size());
  if (read < 0 || static_cast<std::size_t>(read) > handles_.size()) return std::nullopt;
  handles_.resize(static_cast<std::size_t>(read));
  // Samples of a writer that has gone may still wait to be taken.
  if (known_.size() > kMaxKnown) {
    std::erase_if(known_, [&](const auto& pair) {
      return std::find(handles_.begin(), handles_.end(), pair.first) == handles_.end();
    });
  }
  matched_.clear();
  for (const dds_instance_handle_t handle : handles_) matched_.push_back(writer_of(handle));
  return matched_;
}

}  // namespace tubed
