// What was seen of coils beside the tube that images show, for CoilImageAgreement.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "daemon/estimator/agreement/coil_image_model.hpp"
#include "daemon/estimator/agreement/held_across.hpp"
#include "daemon/estimator/algebra/linear_evidence.hpp"

namespace tubed {

/// Collects, for one instrument, residuals of CoilImageModel: how coils lie across the tube wherever one is
/// in view, along it against the tube's end in the image, and along it against each other, because the tube
/// does not stretch. What was seen is forgotten over kMemory_s, or when the tube has moved elsewhere in the
/// field; what a coil said, also when it comes back into the gate. Called by the optimizer thread; memory is
/// taken in the constructor.
class CoilImageEvidence {
 public:
  CoilImageEvidence(const InstrumentDescription& instrument, int view_count);

  /// Takes the coils of that instant. Of a coil and an axis `noise_mm` is new with every measurement.
  /// Instants do not go back.
  void observe(const CoilObservations& coils, const ConfirmedShape& shape, double noise_mm);

  /// No view has held the shape where it is now.
  void forget_held();
  void reset();

  [[nodiscard]] const CoilImageModel& model() const { return model_; }
  [[nodiscard]] LinearEvidence& linear() { return linear_; }

  struct SeenView {
    const Camera* camera = nullptr;
    MonotonicTime confirmed{};
    HeldAcross held;  ///< by its newest image
  };
  /// In the model's order; those that were not seen yet are last, without a camera.
  [[nodiscard]] std::span<const SeenView> views() const { return views_; }

  /// Of the newest end of the tube that was seen.
  [[nodiscard]] const Eigen::VectorXd& end_row() const { return end_row_; }
  /// How far further out than the shape's the images have the end of the tube, in the mean over two seconds.
  [[nodiscard]] double beyond_tip_mm() const { return beyond_tip_mm_; }

  static constexpr double kMemory_s = 6;

 private:
  /// What each coil said, in LinearEvidence: within the gate in the last second and in the one before, and
  /// outside of it. What they said of each other is a part by itself.
  enum Part : std::size_t { kNewest, kOlder, kOut, kParts };
  [[nodiscard]] std::size_t coil_part(std::size_t coil, Part part) const { return kParts * coil + part; }
  [[nodiscard]] std::size_t along_part() const { return coil_part(coil_count(), kNewest); }
  [[nodiscard]] std::size_t coil_count() const { return static_cast<std::size_t>(model_.coil_count()); }

  void forget(const ConfirmedShape& shape, double dt_s);
  void retract(std::size_t coil);
  void keep_older();
  /// An image of a view: of which, and how much of it is new, 0 .. 1.
  struct Sight {
    int index = 0;
    double news = 1;
  };
  std::optional<Sight> look(const ViewConstraints& of, const ConfirmedShape& shape);
  void add_room_along(const ConfirmedShape& shape, double from_mm, double to_mm);
  void observe_across(const CoilObservations& coils, const ConfirmedShape& shape, const ViewConstraints& view,
                      const Sight& sight, double noise_mm);
  void observe_end(const CoilObservations& coils, const ConfirmedShape& shape, const ViewConstraints& view,
                   const Sight& sight, double noise_mm, double dt_s);
  void observe_along(const CoilObservations& coils, const ConfirmedShape& shape, double news,
                     double noise_mm);

  CoilImageModel model_;
  LinearEvidence linear_;
  Eigen::VectorXd row_;
  Eigen::VectorXd end_row_;
  Eigen::VectorXd room_row_;  ///< along the tube, of what is wrong with all coils or images
  Eigen::VectorXd sum_row_;   ///< of the coils before, along the tube
  Eigen::VectorXd contrast_;
  std::array<bool, kMaxCoils> is_out_{};  ///< coils that the gate left out when they were last seen
  MonotonicTime kept_{};                  ///< when the older second was last kept for good
  std::vector<SeenView> views_;
  MonotonicTime newest_{};
  Eigen::Vector3d place_mm_ = Eigen::Vector3d::Zero();  ///< of the middle of the newest shape
  double beyond_tip_mm_ = 0;
};

}  // namespace tubed
