// What coils and images say of a room, part by part.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "idl/estimate.hpp"

namespace tubed {

struct RecordingFinding;

/// One thing that may be wrong, as the agreement tells it.
struct AgreementPart {
  std::string what;
  std::vector<Discord> named;  ///< the explanations that mean it
  std::string evidence;        ///< what was seen of it, with numbers

  [[nodiscard]] bool is_named_by(Discord explanation) const;
};

/// Registration, arc lengths, clock, focal length, coils and field.
std::vector<AgreementPart> parts_of(const EmImageAgreement& agreement);

/// The agreement over a whole recording. Of one thread.
class RecordedAgreement {
 public:
  /// The next instant. One before anything was compared counts for nothing.
  void add(const TubeEstimate& estimate);

  /// The medians of all numbers.
  [[nodiscard]] EmImageAgreement medians() const;

  /// Each part with its medians. WRONG is what explains best in most of the instants, if in more than
  /// `seldom` of them; then the others are not judged. Nothing when nothing was compared.
  [[nodiscard]] std::vector<RecordingFinding> findings(double seldom) const;

 private:
  [[nodiscard]] double share_named(const AgreementPart& part) const;

  std::vector<EmImageAgreement> compared_;
  std::map<Discord, int> named_;
  std::optional<Eigen::Vector3d> first_sight_world_;
  bool two_sides_ = false;
};

}  // namespace tubed
