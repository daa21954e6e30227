#include "daemon/config/check_keys.hpp"

#include <string>
#include <vector>

#include "idl/dds_contract.hpp"
#include "idl/key_folder.hpp"

namespace tubed {

void check_keys(const Configuration& configuration, std::int64_t now_s) {
  const DdsSettings& dds = configuration.dds;
  if (dds.security.empty()) return;
  KeyExamination found = examine_keys(dds.security, now_s);
  if (found.problems.empty()) {
    for (const Access access : {Access::kPublish, Access::kSubscribe}) {
      const std::string refusal =
          refusal_of(*found.holder, dds.security, access, topic_names(), dds.partition);
      if (!refusal.empty()) found.problems.push_back(refusal);
    }
  }
  std::vector<ConfigurationProblem> problems;
  for (const std::string& problem : found.problems) {
    problems.push_back({configuration.security_position, "dds.security", problem});
  }
  if (!problems.empty()) {
    throw ConfigurationError(configuration.file.string(), std::move(problems));
  }
}

}  // namespace tubed
