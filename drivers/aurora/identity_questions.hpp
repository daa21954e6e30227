// What the tracker and its tools say of themselves: which questions, and what the answers mean.
#pragma once

#include <optional>

#include "drivers/aurora/command.hpp"
#include "drivers/aurora/port_setup.hpp"
#include "drivers/aurora/reply.hpp"
#include "drivers/interface/tracker_identity.hpp"

namespace tubed::aurora {

/// APIREV, then VER for firmware, field generator and control unit. Nothing depends on an answer, so that a
/// tracker that does not say is no trouble. One thread; no allocation.
class IdentityQuestions {
 public:
  /// From the first question on.
  void begin() noexcept { question_ = 0; }
  [[nodiscard]] CommandLine command() const noexcept;
  /// The reply to command(); nullptr: there was none. True: it was the last question.
  bool take(const Reply* reply) noexcept;
  /// All were asked once, whatever came back.
  [[nodiscard]] bool asked() const noexcept { return asked_; }

  /// The tools, as the look at the ports found them.
  void take_tools(const PortSetup& ports) noexcept;

  [[nodiscard]] const TrackerIdentity& learnt() const noexcept { return learnt_; }
  [[nodiscard]] const std::optional<ApiRevision>& api_revision() const noexcept { return api_revision_; }

 private:
  std::size_t question_ = 0;
  bool asked_ = false;
  std::optional<ApiRevision> api_revision_;
  TrackerIdentity learnt_;
};

}  // namespace tubed::aurora
