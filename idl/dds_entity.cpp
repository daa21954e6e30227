#include "idl/dds_entity.hpp"

#include <arpa/inet.h>
#include <dds/ddsrt/log.h>

#include <array>
#include <string_view>
#include <utility>

namespace tubed {
namespace {

constexpr int kLargestDomain = 230;  // the ports of larger ones are out of range, RTPS 2.2 Sec. 9.6.1.1

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

void configure_domain(int domain, const std::string& network_interface) {
  const std::string configuration = domain_configuration(network_interface);
  const CapturedLog log;
  const dds_entity_t created = dds_create_domain(static_cast<dds_domainid_t>(domain), configuration.c_str());
  if (created < 0 && created != DDS_RETCODE_PRECONDITION_NOT_MET) {  // that one: configured already
    throw DdsError("cannot set up DDS domain " + std::to_string(domain) + " on network interface '" +
                   network_interface + "': " + dds_strretcode(created) + " (" + log.words() +
                   "). Check that `ip address` lists the interface and that it is up");
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
