#include "idl/dds_security.hpp"

#include <string>

#include "idl/key_folder.hpp"

namespace tubed {
namespace {

// Where Cyclone's plug-ins are was found when this was configured; empty when there were none.
constexpr const char* kAuthentication = TUBED_DDS_SECURITY_AUTH;
constexpr const char* kAccessControl = TUBED_DDS_SECURITY_AC;
constexpr const char* kCryptography = TUBED_DDS_SECURITY_CRYPTO;

void set_plug_in(dds_qos_t* qos, const std::string& what, const char* library, const std::string& suffix) {
  dds_qset_prop(qos, ("dds.sec." + what + ".library.path").c_str(), library);
  dds_qset_prop(qos, ("dds.sec." + what + ".library.init").c_str(), ("init_" + suffix).c_str());
  dds_qset_prop(qos, ("dds.sec." + what + ".library.finalize").c_str(), ("finalize_" + suffix).c_str());
}

}  // namespace

KeyHolder require_keys(const std::filesystem::path& folder, std::int64_t now_s, Access access,
                       const std::vector<std::string>& topics, const std::string& partition) {
  KeyExamination found = examine_keys(folder, now_s);
  if (found.problems.empty()) {
    const std::string refusal = refusal_of(*found.holder, folder, access, topics, partition);
    if (!refusal.empty()) found.problems.push_back(refusal);
  }
  if (found.problems.empty()) return *found.holder;
  std::string words = "DDS Security cannot be switched on:";
  for (const std::string& problem : found.problems) words += "\n  " + problem;
  throw DdsError(words);
}

DdsQos secured_participant_qos(const std::filesystem::path& folder) {
  if (*kAuthentication == '\0' || *kAccessControl == '\0' || *kCryptography == '\0') {
    throw DdsError(
        "this tubed was built with a Cyclone DDS without security plug-ins: build it on Debian 12");
  }
  DdsQos qos(dds_create_qos());
  set_plug_in(qos.get(), "auth", kAuthentication, "authentication");
  set_plug_in(qos.get(), "access", kAccessControl, "access_control");
  set_plug_in(qos.get(), "crypto", kCryptography, "crypto");
  const auto set_file = [&](const char* property, const char* file) {
    dds_qset_prop(qos.get(), property, ("file:" + (folder / file).string()).c_str());
  };
  set_file("dds.sec.auth.identity_ca", kIdentityCaFile);
  set_file("dds.sec.auth.identity_certificate", kCertificateFile);
  set_file("dds.sec.auth.private_key", kPrivateKeyFile);
  set_file("dds.sec.access.permissions_ca", kPermissionsCaFile);
  set_file("dds.sec.access.governance", kGovernanceFile);
  set_file("dds.sec.access.permissions", kPermissionsFile);
  return qos;
}

}  // namespace tubed
