// Move-only owners of what Cyclone's C API hands out. Errors are exceptions, at construction only.
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

namespace tubed {

/// Why the DDS side cannot start: what was tried, Cyclone's own words, what to do about it.
class DdsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A participant, topic, writer, reader or wait set; deleted with everything made from it. Any thread may
/// move it, one at a time.
class DdsEntity {
 public:
  DdsEntity() = default;
  /// Owns `created`, the return value of a dds_create_ function.
  /// Throws DdsError ("cannot create <what>: ...") when that is an error code.
  DdsEntity(dds_entity_t created, const std::string& what);
  ~DdsEntity();
  DdsEntity(DdsEntity&& other) noexcept;
  DdsEntity& operator=(DdsEntity&& other) noexcept;
  DdsEntity(const DdsEntity&) = delete;
  DdsEntity& operator=(const DdsEntity&) = delete;

  [[nodiscard]] dds_entity_t get() const { return handle_; }

 private:
  dds_entity_t handle_ = 0;
};

struct DdsQosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using DdsQos = std::unique_ptr<dds_qos_t, DdsQosDeleter>;

/// Throws DdsError "cannot <what>: <Cyclone's words>" when `code` is an error.
void require_dds(dds_return_t code, const std::string& what);

/// A participant in `domain` (0 .. 230) that uses only `network_interface` (a name such as "lo" or an
/// address) and neither iceoryx nor the environment's CYCLONEDDS_URI. Domains belong to the process: the
/// first participant of a domain decides its interface, and it stays configured until the process ends.
/// Packets of other interfaces are dropped by the kernel from the return of the first call on; before that,
/// for the milliseconds in which Cyclone makes its threads, its sockets are open. One call at a time. Throws
/// DdsError, e.g. when there is no such interface or the sockets cannot be closed to the others.
DdsEntity join_domain(int domain, const std::string& network_interface);

}  // namespace tubed
