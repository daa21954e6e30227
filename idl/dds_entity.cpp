#include "idl/dds_entity.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <mutex>
#include <string_view>
#include <utility>
#include <vector>

#include "idl/cyclone_log.hpp"
#include "idl/interface_filter.hpp"

namespace tubed {
namespace {

// Ports of a domain, RTPS 2.2 Sec. 9.6.1.1; those of larger domains are out of range.
constexpr int kMaxDomain = 230;
constexpr int kFirstPort = 7400;
constexpr int kPortsOfADomain = 250;

bool is_address(const std::string& text) {
  std::array<unsigned char, sizeof(in6_addr)> parsed{};
  return inet_pton(AF_INET, text.c_str(), parsed.data()) == 1 ||
         inet_pton(AF_INET6, text.c_str(), parsed.data()) == 1;
}

std::string interface_element(const std::string& network_interface) {
  // Names go into XML; nothing a kernel would accept as a name and mean seriously needs escaping.
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.:_@-";
  if (network_interface.empty() || network_interface.find_first_not_of(kPlain) != std::string::npos) {
    throw DdsError("network interface '" + network_interface +
                   "' is neither a name nor an address: give one that `ip address` lists, e.g. lo");
  }
  const std::string attribute = is_address(network_interface) ? "address" : "name";
  return "<NetworkInterface " + attribute + "=\"" + network_interface + "\"/>";
}

// A lost sample is sent again only while it is the newest, 33 ms at 30 Hz; Cyclone's defaults of 100 ms each
// never repair one.
constexpr const char* kRepairInTime =
    "<HeartbeatInterval min=\"5 ms\" minsched=\"5 ms\" max=\"1 s\">10 ms</HeartbeatInterval>"
    "<NackDelay>0 ms</NackDelay>";

// What Cyclone receives fills a buffer of this size from end to end before its memory is used again. A daemon
// receives little: in the default one of 1 MiB it would take more and more memory for half an hour.
constexpr const char* kReceiveBuffer = "<Sizing><ReceiveBufferSize>256 KiB</ReceiveBufferSize></Sizing>";

std::string domain_configuration(int domain, const std::string& network_interface) {
  // Without multicast (lo has none) participants find each other by trying ports in turn, 10 by default.
  const std::string peers = network_interface == "lo" ? "<Peers><Peer address=\"127.0.0.1\"/></Peers>" : "";
  return "<CycloneDDS><Domain><General><Interfaces>" + interface_element(network_interface) +
         "</Interfaces></General><SharedMemory><Enable>false</Enable></SharedMemory>" + kReceiveBuffer +
         "<Discovery><ExternalDomainId>" + std::to_string(domain) +
         "</ExternalDomainId><ParticipantIndex>auto</ParticipantIndex>"
         "<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>" +
         peers + "</Discovery><Internal><MultipleReceiveThreads>false</MultipleReceiveThreads>" +
         kRepairInTime + "</Internal></Domain></CycloneDDS>";
}

/// Descriptors of the sockets that Cyclone may have made for a domain: those it listens at have the domain's
/// ports, those it sends from are bound to the address of the interface.
std::vector<int> sockets_of(int domain) {
  const int first = kFirstPort + kPortsOfADomain * domain;
  std::vector<int> descriptors;
  try {
    for (const BoundUdpSocket& bound : bound_udp_sockets()) {
      if (!bound.is_everywhere || (bound.port >= first && bound.port < first + kPortsOfADomain)) {
        descriptors.push_back(bound.descriptor);
      }
    }
  } catch (const std::runtime_error& error) {
    throw DdsError(error.what());
  }
  return descriptors;
}

/// Cyclone makes its sockets together with the domain, and no other later.
void close_to_other_interfaces(const std::string& network_interface, const std::vector<int>& before,
                               const std::vector<int>& after) {
  const AllowedInterfaces allowed = allowed_interfaces(network_interface);
  std::vector<int> made;
  std::set_difference(after.begin(), after.end(), before.begin(), before.end(), std::back_inserter(made));
  if (made.empty()) {
    throw std::runtime_error("they are not found in /proc/self/fd");
  }
  for (const int udp_socket : made) {
    receive_only_from(udp_socket, allowed);
  }
}

/// The domain `local_id` of this process, which on the network is `domain`; none when it is configured
/// already.
DdsEntity configure_domain(dds_domainid_t local_id, int domain, const std::string& network_interface) {
  const std::string configuration = domain_configuration(domain, network_interface);
  const CapturedCycloneLog log;
  const std::vector<int> sockets_before = sockets_of(domain);
  const dds_entity_t created = dds_create_domain(local_id, configuration.c_str());
  if (created == DDS_RETCODE_PRECONDITION_NOT_MET) {
    return {};
  }
  if (created < 0) {
    throw DdsError("cannot set up DDS domain " + std::to_string(domain) + " on network interface '" +
                   network_interface + "': " + dds_strretcode(created) + " (" + log.words() +
                   "). Check that `ip address` lists the interface and that it is up");
  }
  try {
    close_to_other_interfaces(network_interface, sockets_before, sockets_of(domain));
  } catch (const std::runtime_error& error) {
    dds_delete(created);  // an open domain is worse than none
    throw DdsError("cannot close the sockets of DDS domain " + std::to_string(domain) +
                   " to all network interfaces but '" + network_interface + "': " + error.what());
  }
  return {created, "a DDS domain"};
}

DdsEntity participant_in(dds_domainid_t local_id, int domain, const dds_qos_t* qos) {
  const std::string what = "a participant of DDS domain " + std::to_string(domain);
  if (qos == nullptr) {
    return {dds_create_participant(local_id, nullptr, nullptr), what};
  }
  const CapturedCycloneLog log;  // a code alone does not say which file of the keys it is
  const dds_entity_t created = dds_create_participant(local_id, qos, nullptr);
  if (created < 0) {
    throw DdsError("cannot create " + what + " with DDS Security: " + dds_strretcode(created) + " (" +
                   log.words() + ")");
  }
  return {created, what};
}

void require_domain(int domain) {
  if (domain < 0 || domain > kMaxDomain) {
    throw DdsError("DDS domain " + std::to_string(domain) + " is not in 0 .. " + std::to_string(kMaxDomain));
  }
}

/// What finds new sockets and captures Cyclone's log looks at the whole process.
std::mutex& one_at_a_time() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

DdsEntity::DdsEntity(dds_entity_t created, const std::string& what) : handle_(created) {
  require_dds(created, "create " + what);
}

DdsEntity::~DdsEntity() {
  if (handle_ > 0) {
    dds_delete(handle_);
  }
}

DdsEntity::DdsEntity(DdsEntity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}

DdsEntity& DdsEntity::operator=(DdsEntity&& other) noexcept {
  std::swap(handle_, other.handle_);
  return *this;
}

void require_dds(dds_return_t code, const std::string& what) {
  if (code < 0) {
    const char* const advice =
        code == DDS_RETCODE_NOT_ALLOWED_BY_SECURITY
            ? ": the permissions of these keys do not cover it; `tubectl keys show` says what they are for"
            : "";
    throw DdsError("cannot " + what + ": " + dds_strretcode(code) + advice);
  }
}

DdsEntity join_domain(int domain, const std::string& network_interface, const dds_qos_t* participant_qos) {
  require_domain(domain);
  const std::scoped_lock lock(one_at_a_time());
  const auto local_id = static_cast<dds_domainid_t>(domain);
  configure_domain(local_id, domain, network_interface).release();  // it stays until the process ends
  return participant_in(local_id, domain, participant_qos);
}

SeparateParticipant::SeparateParticipant(DdsEntity domain, DdsEntity participant)
    : domain_(std::move(domain)), participant_(std::move(participant)) {}

SeparateParticipant::~SeparateParticipant() {
  if (domain_.get() == 0) return;
  const std::scoped_lock lock(one_at_a_time());
  participant_ = DdsEntity();
  domain_ = DdsEntity();
}

SeparateParticipant join_domain_separately(int domain, const std::string& network_interface,
                                           const dds_qos_t* participant_qos) {
  require_domain(domain);
  const std::scoped_lock lock(one_at_a_time());
  static dds_domainid_t last_id = kMaxDomain;  // those that nobody can ask for
  const dds_domainid_t local_id = ++last_id;
  DdsEntity own_domain = configure_domain(local_id, domain, network_interface);
  return {std::move(own_domain), participant_in(local_id, domain, participant_qos)};
}

}  // namespace tubed
