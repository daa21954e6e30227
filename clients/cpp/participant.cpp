#include "clients/cpp/participant.hpp"

#include <ctime>

#include "idl/dds_security.hpp"

namespace tubed {
namespace {

/// Null without DDS Security. Throws DdsError when the keys do not let it read `topic`.
DdsQos qos_of(const Subscription& subscription, const std::string& topic) {
  if (subscription.security.empty()) return nullptr;
  require_keys(subscription.security, std::time(nullptr), Access::kSubscribe, {topic},
               subscription.partition);
  return secured_participant_qos(subscription.security);
}

}  // namespace

DdsEntity join(const Subscription& subscription, const std::string& topic) {
  const DdsQos qos = qos_of(subscription, topic);
  return join_domain(subscription.domain, subscription.network_interface, qos.get());
}

SeparateParticipant join_separately(const Subscription& subscription, const std::string& topic) {
  const DdsQos qos = qos_of(subscription, topic);
  return join_domain_separately(subscription.domain, subscription.network_interface, qos.get());
}

}  // namespace tubed
