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
  /// Nobody deletes it any more but the end of the process.
  void release() { handle_ = 0; }

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
/// for the milliseconds in which Cyclone makes its threads, its sockets are open. Any thread. Throws
/// DdsError, e.g. when there is no such interface or the sockets cannot be closed to the others.
/// `participant_qos` switches DDS Security on (dds_security.hpp); all participants of a process and domain
/// have the same.
DdsEntity join_domain(int domain, const std::string& network_interface,
                      const dds_qos_t* participant_qos = nullptr);

/// A participant that shares nothing with the others of this process: what Cyclone has remembered of other
/// programs' writers, it does not know.
class SeparateParticipant {
 public:
  /// `domain`: of this process, with threads and sockets of its own; `participant`: made in it.
  SeparateParticipant(DdsEntity domain, DdsEntity participant);
  /// Waits while another thread joins a domain: sockets that close meanwhile would be taken for its new ones.
  ~SeparateParticipant();
  SeparateParticipant(SeparateParticipant&&) noexcept = default;
  SeparateParticipant& operator=(SeparateParticipant&&) = delete;
  SeparateParticipant(const SeparateParticipant&) = delete;
  SeparateParticipant& operator=(const SeparateParticipant&) = delete;

  [[nodiscard]] const DdsEntity& participant() const { return participant_; }

 private:
  DdsEntity domain_;
  DdsEntity participant_;
};

/// As join_domain(), in a domain of its own inside this process. Takes some milliseconds.
SeparateParticipant join_domain_separately(int domain, const std::string& network_interface,
                                           const dds_qos_t* participant_qos = nullptr);

}  // namespace tubed
