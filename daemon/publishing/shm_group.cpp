#include "daemon/publishing/shm_group.hpp"

#include <grp.h>

#include <vector>

#include "idl/shm_layout.hpp"

namespace tubed {

std::optional<gid_t> group_of(const std::string& name) {
  if (name.empty()) {
    return {};
  }
  group entry{};
  group* found = nullptr;
  std::vector<char> words(std::size_t{1} << 16U);
  if (getgrnam_r(name.c_str(), &entry, words.data(), words.size(), &found) != 0 || found == nullptr) {
    throw ShmError("shm.group: this system has no group '" + name + "'");
  }
  return entry.gr_gid;
}

}  // namespace tubed
