#include "clients/tubectl/check/doctor_keys.hpp"

#include <unistd.h>

#include <cerrno>
#include <string>

#include "daemon/config/check_keys.hpp"
#include "idl/key_folder.hpp"

namespace tubed {
namespace {

constexpr const char* kMakeKeys = "`tubectl keys make-room FOLDER` makes keys and says where they go";

Finding without_security(const std::string& network_interface) {
  if (network_interface == "lo") {
    return {Verdict::kNote, "DDS Security is off: any program on this machine can publish false shapes",
            std::string("shared memory tells readers by user and group; or ") + kMakeKeys};
  }
  return {Verdict::kAdvice,
          "DDS Security is off: any host on " + network_interface + " can publish false shapes", kMakeKeys};
}

Finding of_valid_keys(const KeyHolder& holder, const std::string& folder, std::int64_t now_s) {
  const std::string found = "DDS Security is on: " + holder.name + " (" + holder.role + ") of " +
                            holder.room + ", " + folder + ", " + validity_words(holder, now_s);
  if (days_left(holder, now_s) < kKeysEndSoonDays) {
    return {Verdict::kAdvice, found,
            "`tubectl keys renew` where the room was made, copy the folder, systemctl restart tubed"};
  }
  return {Verdict::kGood, found, ""};
}

}  // namespace

NamedFinding examine_security(const Configuration& configuration, std::int64_t now_s) {
  const std::string& folder = configuration.dds.security;
  if (folder.empty()) return {"security", without_security(configuration.dds.network_interface)};
  if (::access(folder.c_str(), R_OK | X_OK) != 0 && errno == EACCES) {
    return {"security",
            {Verdict::kNote, "DDS Security is on; root alone sees its keys: sudo tubectl doctor", ""}};
  }
  try {
    check_keys(configuration, now_s);
    return {"security", of_valid_keys(*examine_keys(folder, now_s).holder, folder, now_s)};
  } catch (const ConfigurationError& error) {
    return {"security", {Verdict::kWrong, "DDS Security is on and its keys cannot be used", error.what()}};
  }
}

}  // namespace tubed
