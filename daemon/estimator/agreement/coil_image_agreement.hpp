// Do coils and images agree, and if not, what explains it best?
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "daemon/estimator/agreement/coil_image_evidence.hpp"
#include "daemon/estimator/agreement/room_errors.hpp"
#include "idl/estimate.hpp"

namespace tubed {

/// Which mistake explains best, for one instrument, how coils lie beside the tube that images show
/// (CoilImageEvidence)? Whatever may be wrong in a room is an unknown of one linear model (CoilImageModel).
/// Explanations are compared by their evidence, of all images, every 0.1 s: "as stated" allows RoomErrors and
/// what the tracker may be wrong by; each of the others allows one part much more and is a hundred times less
/// likely before anything was seen. Each of them stands for two: a registration as far off as is stated, and
/// one a fifth as far. Across one view three of the registration's six numbers show; what does not show keeps
/// its prior. What is published (doubt()) has the wider prior of what was never checked: that all is right
/// across a view says nothing of its depth, which poses of cameras know least, and where a mistake of 6 mm
/// stays unnoticed. Where images hold the shape it also has what lies between them and the coils, as far as
/// it may be the views' poses that are wrong. Called by the optimizer thread; memory is taken in the
/// constructor.
class CoilImageAgreement {
 public:
  CoilImageAgreement(const RoomErrors& errors, const InstrumentDescription& instrument, int view_count);

  /// Takes the coils of that instant. Of a coil and an axis `noise_mm` is new with every measurement and
  /// `lasting_mm` is what else the tracker may be wrong by. Instants do not go back.
  void observe(const CoilObservations& coils, const ConfirmedShape& shape, double noise_mm,
               double lasting_mm);

  /// What explains everything best.
  struct Verdict {
    Discord explanation = Discord::kNone;
    int index = 0;           ///< of the coil (kCoil, kCoilArcLength) or of the view (kMagnification)
    double probability = 0;  ///< of that explanation
    double as_stated = 1;    ///< probability that everything is as stated
    Eigen::Vector3d shift_mm =
        Eigen::Vector3d::Zero();  ///< of the registration, in the middle of the tube; world
    Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  ///< of the registration, rotation vector; world
    Eigen::Vector3d coil_mm = Eigen::Vector3d::Zero();   ///< of the coil at `index`, across the tube; world
    /// By which the stated arc lengths are too large; of kCoil and kCoilArcLength that of the coil at
    /// `index`.
    double arc_length_mm = 0;
    double clock_s = 0;  ///< by which images are stamped too late
    double magnification =
        0;              ///< by which the stated focal length of the view at `index` is too large, relative
    double end_mm = 0;  ///< by which the tube ends further out in the image than coils and arc lengths say
  };
  [[nodiscard]] const Verdict& verdict() const { return verdict_; }

  /// Is "as stated" the less likely, or does the tube end elsewhere in the image than the shape does? With
  /// hysteresis, so that the word does not flicker.
  [[nodiscard]] bool disagree() const { return disagree_ || end_contradicts_; }

  /// Both for those outside. Nothing was compared before the first shape that images confirmed.
  [[nodiscard]] EmImageAgreement summary() const;

  /// A point of the tube.
  struct Place {
    double s_mm;  ///< from the tip
    Eigen::Vector3d p_world_mm;
    Eigen::Vector3d tangent_world;  ///< unit
    /// What else may be off there of what coils say, mm^2, world.
    Eigen::Matrix3d coils_mm2 = Eigen::Matrix3d::Zero();
  };
  /// What has to be added to the covariance (mm^2, world) there, for a shape that knows of none of this.
  /// Before the first shape that images confirmed, the registration's shift alone. What images held across
  /// themselves within the last second is not doubted there, as far as they held it (HeldAcross).
  [[nodiscard]] Eigen::Matrix3d doubt(const Place& place, MonotonicTime now) const;

  /// Where images held the shape it no longer lies: until they hold it again all of it is doubted.
  void forget_held() { seen_.forget_held(); }

  void reset();

 private:
  struct Explanation {
    Discord discord = Discord::kNone;
    int index = 0;
    double registration_share = 1;  ///< of what may be wrong with it in this room
    double log_evidence = 0;
    double end_mm = 0;
    double arc_length_mm = 0;
    double clock_s = 0;
    std::array<double, kMaxCameras> magnification{};
    std::array<double, kMaxCameras> magnification_variance{};
    Eigen::Vector3d coil_mm = Eigen::Vector3d::Zero();
    Eigen::Matrix<double, 6, 1> registration = Eigen::Matrix<double, 6, 1>::Zero();
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();

    double probability = 0;

    /// Is it "as stated" with such a registration, with some unknowns that are allowed more?
    [[nodiscard]] bool widens_base() const { return discord != Discord::kField; }
    [[nodiscard]] bool is_as(const Explanation& other) const {
      return discord == other.discord && index == other.index;
    }
  };

  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  struct RegistrationError {
    Eigen::Matrix<double, 6, 1> mean;
    Matrix6 covariance;
  };

  static constexpr double kWrongField_mm = 4;  ///< standard deviation of each coil's own, of kField

  void suppose();
  void allow(const Explanation& explanation, double lasting_mm);
  double log_evidence(const Explanation& explanation);
  void judge(double lasting_mm);
  void compare(double registration_share, double lasting_mm);
  void remember(Explanation& explanation);
  void conclude();
  [[nodiscard]] RegistrationError registration_error(const Explanation& explanation) const;
  [[nodiscard]] double magnification_square(const Explanation& explanation, std::size_t view) const;
  void take_moments();
  void doubt_poses();
  void name(const Explanation& explanation);

  RoomErrors errors_;
  CoilImageEvidence seen_;
  Eigen::VectorXd D_;
  std::vector<Explanation> explanations_;
  std::optional<MonotonicTime> judged_;  ///< image of the newest verdict
  Verdict verdict_;
  bool disagree_ = false;
  bool end_contradicts_ = false;
  // Mean squares over all explanations.
  Matrix6 registration_square_;
  Matrix6 pose_square_ = Matrix6::Zero();  ///< of the views' poses, as far as it is seen
  double field_square_mm2_ = 0;
  std::array<double, kMaxCameras> magnification_square_{};
};

}  // namespace tubed
