// Do coils and images agree, and if not, what explains it best?
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "daemon/estimator/coil_observation.hpp"
#include "daemon/estimator/linear_evidence.hpp"
#include "daemon/estimator/room_errors.hpp"
#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// What may explain that coils and images contradict each other.
enum class Discord : std::uint32_t {
  kNone = 0,           ///< nothing has to be explained
  kRegistration = 1,   ///< all coils are off together: registration, table or the camera's pose
  kArcLengths = 2,     ///< the tube ends elsewhere in the image than the coils' arc lengths say
  kClock = 3,          ///< images are stamped too late or too early
  kMagnification = 4,  ///< the image is larger or smaller than its focal length and distance say
  kField = 5,          ///< coils are off, each in its own way: metal near the tracker, another field
  kCoil = 6,           ///< one coil is off: bent, or measured wrong
  kCoilArcLength = 7,  ///< one coil lies elsewhere along the tube than its arc length says
};

/// Collects, for one instrument, how coils lie beside the tube that images show: across it wherever a coil is
/// in view, along it where the tube's end is, and along it against each other, because the tube does not
/// stretch. Whatever may be wrong in a room is an unknown of one linear model (LinearEvidence): the
/// registration's shift and turn; an offset along the tube that all coils share, and one of each coil;
/// the clock; each view's magnification; three numbers a coil of its own, and three that it shares with its
/// neighbours, as a smooth field does. What was seen is forgotten over kMemory_s, or when the tube has moved
/// elsewhere in the field; what a coil said, also when it comes back into the gate. Explanations are compared
/// by their evidence: "as stated" allows RoomErrors and what the tracker may be wrong by; each of the others
/// allows one part much more and is a hundred times less likely before anything was seen. Across one view
/// three of the registration's six numbers show; what does not show keeps its prior, so that doubt() is large
/// in depth where much is wrong across. Called by the optimizer thread; memory is taken in the constructor.
class CoilImageAgreement {
 public:
  CoilImageAgreement(const RoomErrors& errors, const InstrumentDescription& instrument, int view_count);

  /// A shape that the images of one instant have confirmed, with what confirmed it.
  struct Confirmed {
    MonotonicTime instant;
    const UniformCubicBSpline& spline;
    const Eigen::Matrix3Xd& C;
    std::span<const ViewConstraints> views;  ///< their cameras stay where they are in memory
  };

  /// Takes the coils of that instant. Of a coil and an axis `noise_mm` is new with every measurement and
  /// `lasting_mm` is what else the tracker may be wrong by. Instants do not go back.
  void observe(const CoilObservations& coils, const Confirmed& shape, double noise_mm, double lasting_mm);

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

  /// What has to be added to the covariance (mm^2, world) of the tube's point p with the unit tangent t, for
  /// a shape that knows of none of this. What images held across themselves within the last second is not
  /// doubted there.
  [[nodiscard]] Eigen::Matrix3d doubt(const Eigen::Vector3d& p_world_mm, const Eigen::Vector3d& tangent_world,
                                      MonotonicTime now) const;

  void reset();

  static constexpr double kMemory_s = 6;

 private:
  struct Explanation {
    Discord discord = Discord::kNone;
    int index = 0;
    double log_evidence = 0;
    double end_mm = 0;
    double arc_length_mm = 0;
    double clock_s = 0;
    double magnification = 0;
    Eigen::Vector3d coil_mm = Eigen::Vector3d::Zero();
    Eigen::Matrix<double, 6, 1> registration = Eigen::Matrix<double, 6, 1>::Zero();
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  };
  struct SeenView {
    const Camera* camera = nullptr;
    MonotonicTime confirmed{};
    double magnification_square = 0;  ///< mean of the square, over all explanations
  };
  static constexpr int kPlaces = 5;  ///< images between which velocities are taken
  struct Places {
    MonotonicTime instant{};
    std::array<Eigen::Vector3d, kMaxCoils> p_world_mm{};
  };

  static constexpr Eigen::Index kTurn = 3;
  static constexpr Eigen::Index kArcLength = 6;
  static constexpr Eigen::Index kClockColumn = 7;
  static constexpr Eigen::Index kViews = 8;
  [[nodiscard]] Eigen::Index own_column(int coil) const { return kViews + view_count_ + 3 * coil; }
  [[nodiscard]] Eigen::Index shared_column(int coil) const { return own_column(coil_count() + coil); }
  [[nodiscard]] Eigen::Index arc_length_column(int coil) const {
    return kViews + view_count_ + 6 * coil_count() + coil;
  }
  [[nodiscard]] int coil_count() const { return static_cast<int>(places_mm_.size()); }

  /// What each coil said, in LinearEvidence: within the gate in the last second and in the one before, and
  /// outside of it. What they said of each other is a part by itself.
  enum Part : std::size_t { kNewest, kOlder, kOut, kParts };
  [[nodiscard]] std::size_t along_part() const { return kParts * places_mm_.size(); }

  void forget(const Confirmed& shape, double dt_s);
  void retract(std::size_t coil);
  void keep_older();
  void remember_places(const Confirmed& shape);
  [[nodiscard]] Eigen::Vector3d velocity_mm_s(int coil) const;
  /// An image of a view: of which, and how much of it is new, 0 .. 1.
  struct Sight {
    int index = 0;
    double news = 1;
  };
  std::optional<Sight> look(const Camera& camera, MonotonicTime instant);
  static Eigen::Vector3d lateral_mm(const Camera& camera, const Eigen::Vector3d& p_world_mm);
  void add_registration(const Eigen::Vector3d& p_mm, const Eigen::Vector3d& side, double weight,
                        Eigen::VectorXd& row) const;
  void add_shared_errors(int coil, const Eigen::Vector3d& side, double weight);
  void add_errors_along(int coil, const Eigen::Vector3d& toward_tip, double weight);
  void add_room_along(const Confirmed& shape, double from_mm, double to_mm);
  void observe_across(const CoilObservations& coils, const Confirmed& shape, const ViewConstraints& view,
                      const Sight& sight, double noise_mm);
  void observe_end(const CoilObservations& coils, const Confirmed& shape, const ViewConstraints& view,
                   const Sight& sight, double noise_mm, double dt_s);
  void observe_along(const CoilObservations& coils, const Confirmed& shape, double news, double noise_mm);
  void allow(const Explanation& explanation, double lasting_mm);
  void remember(Explanation& explanation);
  void judge_next();
  void conclude();

  RoomErrors errors_;
  std::vector<double> places_mm_;  ///< of the coils, along the tube
  int view_count_;
  Eigen::MatrixXd neighbours_;  ///< Cholesky factor of how coils share what they are off by
  LinearEvidence evidence_;
  Eigen::VectorXd row_;
  Eigen::VectorXd end_row_;   ///< of the newest end that was seen
  Eigen::VectorXd room_row_;  ///< along the tube, of what is wrong with all coils or images
  Eigen::VectorXd sum_row_;   ///< of the coils before, along the tube
  Eigen::VectorXd contrast_;
  Eigen::VectorXd D_;
  std::array<bool, kMaxCoils> is_out_{};  ///< coils that the gate left out when they were last seen
  MonotonicTime kept_{};                  ///< when the older second was last kept for good
  std::vector<Explanation> explanations_;
  std::size_t next_ = 0;  ///< explanation to be judged
  double lasting_mm_ = 0;
  std::array<SeenView, kMaxCameras> views_{};
  std::array<Places, kPlaces> past_{};
  int past_count_ = 0;
  MonotonicTime newest_{};
  Eigen::Vector3d centre_mm_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d place_mm_ = Eigen::Vector3d::Zero();
  Verdict verdict_;
  bool disagree_ = false;
  bool end_contradicts_ = false;
  Eigen::Matrix<double, 6, 6> registration_square_ = Eigen::Matrix<double, 6, 6>::Zero();
  double field_square_mm2_ = 0;
  double beyond_tip_mm_ = 0;  ///< of the images' end of the tube, from the shape's; mean over kEndMemory_s
};

}  // namespace tubed
