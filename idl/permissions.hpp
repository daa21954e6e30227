// What a permissions document lets an identity do: DDS Security 1.1 Sec. 9.4.1.3, as far as tubed writes it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tubed {

enum class Access { kPublish, kSubscribe };

/// One <publish> or <subscribe> of an <allow_rule>. Names may have the wildcards of fnmatch(3).
struct AllowedAccess {
  Access access = Access::kSubscribe;
  std::vector<std::string> topics;
  std::vector<std::string> partitions;  ///< one empty name: the default partition
};

/// The grant of one subject.
struct Grant {
  std::optional<std::int64_t> valid_from_s;  ///< seconds since 1970, UTC; nothing: in a form not known here
  std::optional<std::int64_t> valid_until_s;
  std::vector<AllowedAccess> allowed;
};

/// The grant of `subject` (RFC 2253) in a permissions document; nothing when it has none. Understands
/// documents of the form that tubectl writes: what DDS Security allows beside it (deny rules, other time
/// zones) is left to the DDS.
std::optional<Grant> grant_of(const std::string& document, const std::string& subject);

bool allows(const Grant& grant, Access access, const std::string& topic, const std::string& partition);

}  // namespace tubed
