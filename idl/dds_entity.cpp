#include "idl/dds_entity.hpp"

#include <arpa/inet.h>
#include <dds/ddsrt/log.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "idl/interface_filter.hpp"

namespace tubed {
namespace {

// Ports of a domain, RTPS 2.2 Sec. 9.6.1.1; those of larger domains are out of range.
constexpr int kLargestDomain = 230;
constexpr int kFirstPort = 7400;
constexpr int kPortsOfADomain = 250;

/// Collects what Cyclone writes to its log while the object lives; its error codes alone say little.
class CapturedLog {
 public:
  CapturedLog() { dds_set_log_sink(append, &words_); }
  ~CapturedLog() { dds_set_log_sink(nullptr, nullptr); }
  CapturedLog(const CapturedLog&) = delete;
  CapturedLog& operator=(const CapturedLog&) = delete;
  [[nodiscard]] const std::string& words() const { return words_; }

 private:
  static void append(void* words, const dds_log_data_t* line) {
    static_cast<std::string*>(words)->append(line->message, line->size);
  }
  std::string words_;
};

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

std::string domain_configuration(const std::string& network_interface) {
  // Without multicast (lo has none) participants find each other by trying ports in turn, 10 by default.
  const std::string peers = network_interface == "lo" ? "<Peers><Peer address=\"127.0.0.1\"/></Peers>" : "";
  return "<CycloneDDS><Domain><General><Interfaces>" + interface_element(network_interface) +
         "</Interfaces></General><SharedMemory><Enable>false</Enable></SharedMemory>"
         "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
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

void configure_domain(int domain, const std::string& network_interface) {
  const std::string configuration = domain_configuration(network_interface);
  const CapturedLog log;
  const std::vector<int> sockets_before = sockets_of(domain);
  const dds_entity_t created = dds_create_domain(static_cast<dds_domainid_t>(domain), configuration.c_str());
  if (created == DDS_RETCODE_PRECONDITION_NOT_MET) {  // configured already
    return;
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
    throw DdsError("cannot " + what + ": " + dds_strretcode(code));
  }
}

DdsEntity join_domain(int domain, const std::string& network_interface) {
  if (domain < 0 || domain > kLargestDomain) {
    throw DdsError("DDS domain " + std::to_string(domain) + " is not in 0 .. " +
                   std::to_string(kLargestDomain));
  }
  configure_domain(domain, network_interface);
  const dds_entity_t created = dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
  return {created, "a participant of DDS domain " + std::to_string(domain)};
}

}  // namespace tubed
