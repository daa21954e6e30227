#include "clients/tubectl/run/room_documents.hpp"

#include "idl/dds_contract.hpp"
#include "idl/utc_time.hpp"

namespace tubed {
namespace {

constexpr const char* kSchemas = "http://www.omg.org/spec/DDS-SECURITY/20170901/";
// Those that Cyclone has ports for; permissions hold in all of them, the partition tells rooms apart.
constexpr const char* kAllDomains = "<domains><id_range><min>0</min><max>230</max></id_range></domains>";

std::string document(const std::string& schema, const std::string& content) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<dds xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:noNamespaceSchemaLocation=\"" +
         std::string(kSchemas) + schema + "\">\n" + content + "</dds>\n";
}

std::string rule(const std::string& verb, const std::string& partition) {
  std::string text = "        <" + verb + ">\n          <topics>\n";
  for (const std::string& topic : topic_names()) {
    text += "            <topic>" + topic + "</topic>\n";
  }
  // The default partition is named too: without a name Fast DDS and Cyclone understand different things.
  return text + "          </topics>\n          <partitions><partition>" + partition +
         "</partition></partitions>\n        </" + verb + ">\n";
}

/// DDS Security has no zone here: UTC.
std::string time_element(const std::string& name, std::int64_t time_s) {
  return "<" + name + ">" + utc_text(time_s) + "</" + name + ">";
}

}  // namespace

std::string_view name_of(Role role) { return role == Role::kDaemon ? "daemon" : "subscriber"; }

std::optional<Role> role_named(std::string_view name) {
  for (const Role role : {Role::kDaemon, Role::kSubscriber}) {
    if (name_of(role) == name) return role;
  }
  return std::nullopt;
}

std::string governance_document() {
  return document("omg_shared_ca_governance.xsd", std::string(R"(  <domain_access_rules>
    <domain_rule>
      )") + kAllDomains + R"(
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT_WITH_ORIGIN_AUTHENTICATION</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT_WITH_ORIGIN_AUTHENTICATION</liveliness_protection_kind>
      <rtps_protection_kind>SIGN_WITH_ORIGIN_AUTHENTICATION</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>SIGN_WITH_ORIGIN_AUTHENTICATION</metadata_protection_kind>
          <data_protection_kind>ENCRYPT</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
)");
}

std::string permissions_document(Role role, const std::string& subject, const std::string& partition,
                                 const Period& period) {
  // A daemon reads too: it watches for a second one that publishes its instruments.
  const std::string may =
      (role == Role::kDaemon ? rule("publish", partition) : "") + rule("subscribe", partition);
  return document("omg_shared_ca_permissions.xsd",
                  "  <permissions>\n    <grant name=\"" + std::string(name_of(role)) +
                      "\">\n      <subject_name>" + subject + "</subject_name>\n      <validity>" +
                      time_element("not_before", period.from_s) + time_element("not_after", period.until_s) +
                      "</validity>\n      <allow_rule>\n        " + kAllDomains + "\n" + may +
                      "      </allow_rule>\n      <default>DENY</default>\n    </grant>\n  </permissions>\n");
}

}  // namespace tubed
