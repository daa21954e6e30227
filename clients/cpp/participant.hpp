// A subscriber's entrance to DDS.
#pragma once

#include <string>

#include "clients/cpp/subscription.hpp"
#include "idl/dds_entity.hpp"

namespace tubed {

/// A participant of the domain and interface that `subscription` names; with DDS Security when it names keys,
/// which have to let it read `topic` in its partition. Throws DdsError: no such network interface, domain out
/// of range, keys that are missing, expired, not valid yet, of another room or for another partition.
DdsEntity join(const Subscription& subscription, const std::string& topic);

/// The same in a DDS domain of its own inside this process (join_domain_separately()).
SeparateParticipant join_separately(const Subscription& subscription, const std::string& topic);

}  // namespace tubed
