#include "idl/permissions.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <sstream>

#include "idl/utc_time.hpp"

namespace tubed {
namespace {

/// What stands between <name> or <name attribute="..."> and </name>, each time.
std::vector<std::string> elements(const std::string& text, const std::string& name) {
  std::vector<std::string> found;
  std::size_t at = 0;
  while ((at = text.find("<" + name, at)) != std::string::npos) {
    const char after = at + name.size() + 1 < text.size() ? text[at + name.size() + 1] : '\0';
    const std::size_t begin = text.find('>', at);
    const std::size_t end = text.find("</" + name + ">", at);
    if (begin == std::string::npos || end == std::string::npos) break;
    if (after == '>' || after == ' ') found.push_back(text.substr(begin + 1, end - begin - 1));
    at = begin;
  }
  return found;
}

std::string first_of(const std::vector<std::string>& found) { return found.empty() ? "" : found.front(); }

/// The parts of a name, in an order of their own: CN=a,O=b names the same subject as O=b, CN=a.
std::vector<std::string> parts_of(const std::string& subject) {
  std::vector<std::string> parts;
  std::istringstream stream(subject);
  for (std::string part; std::getline(stream, part, ',');) {
    part.erase(0, part.find_first_not_of(" \t\r\n"));
    part.erase(part.find_last_not_of(" \t\r\n") + 1);
    parts.push_back(part);
  }
  std::sort(parts.begin(), parts.end());
  return parts;
}

AllowedAccess access_of(Access access, const std::string& rule) {
  AllowedAccess allowed{access, elements(first_of(elements(rule, "topics")), "topic"),
                        elements(first_of(elements(rule, "partitions")), "partition")};
  if (allowed.partitions.empty()) allowed.partitions.emplace_back();
  return allowed;
}

Grant grant_from(const std::string& text) {
  Grant grant;
  grant.valid_from_s = utc_from_text(first_of(elements(text, "not_before")));
  grant.valid_until_s = utc_from_text(first_of(elements(text, "not_after")));
  for (const std::string& rule : elements(text, "allow_rule")) {
    for (const std::string& publish : elements(rule, "publish")) {
      grant.allowed.push_back(access_of(Access::kPublish, publish));
    }
    for (const std::string& subscribe : elements(rule, "subscribe")) {
      grant.allowed.push_back(access_of(Access::kSubscribe, subscribe));
    }
  }
  return grant;
}

bool matches_any(const std::vector<std::string>& patterns, const std::string& name) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
  });
}

}  // namespace

std::optional<Grant> grant_of(const std::string& document, const std::string& subject) {
  for (const std::string& text : elements(document, "grant")) {
    if (parts_of(first_of(elements(text, "subject_name"))) == parts_of(subject)) {
      return grant_from(text);
    }
  }
  return std::nullopt;
}

bool allows(const Grant& grant, Access access, const std::string& topic, const std::string& partition) {
  return std::any_of(grant.allowed.begin(), grant.allowed.end(), [&](const AllowedAccess& allowed) {
    return allowed.access == access && matches_any(allowed.topics, topic) &&
           matches_any(allowed.partitions, partition);
  });
}

}  // namespace tubed
