// Mode "filter": what was known of the tube a moment ago, moved on, with the coils and image lines of now.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "daemon/estimator/coil_error_scale.hpp"
#include "daemon/estimator/coil_faults.hpp"
#include "daemon/estimator/coil_image_agreement.hpp"
#include "daemon/estimator/coil_noise.hpp"
#include "daemon/estimator/coil_update.hpp"
#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/learnt_bending.hpp"
#include "daemon/estimator/report.hpp"
#include "daemon/estimator/single_frame_solver.hpp"
#include "daemon/estimator/tube_motion.hpp"

namespace tubed {

/// See Estimator for thread and promises. State: the coefficients, for each coil an error of its position and
/// its tangent that stays, the velocities of the drift and the speed, together a Gaussian. Every EM
/// measurement is an update in the order of time, every image another one; an image that arrives after
/// younger EM measurements is taken into the state of its own time, and the next estimate goes through those
/// measurements again. Begins, and begins again after a loss, from SingleFrameSolver.
class RecursiveEstimator final : public RestShapedEstimator {
 public:
  RecursiveEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                     const RoomDescription& room);

  /// How far to either side of the prediction an image is searched first.
  static constexpr int kFirstReach_px = 10;

  void estimate(const Observation& observation, TubeEstimate& estimate) noexcept override;
  void reset() noexcept override;
  void set_rest(RestHook* hook) noexcept override;
  [[nodiscard]] ImageNeed image_need() const noexcept override;
  [[nodiscard]] bool describe_disagreement(std::span<char> words) const noexcept override;

 private:
  /// Of strain. Every instant adds its stiffness afresh, and images fix the outline; where the spline cannot
  /// bend as the tube does, the printed weight of strain then turns the error into depth.
  static constexpr double kStrainSlack = 4.5;

  /// How far a coil is believed that was left out before, or named by the coils of one measurement.
  static constexpr double kBeliefOfDoubted = 0.1;

  /// Sum of weight[k] times column[k] of the state: a point of the curve, and a coil's error.
  struct ColumnSum {
    explicit ColumnSum(const CubicBasis& basis);
    std::array<Eigen::Index, 5> column{};
    std::array<double, 5> weight{};
  };

  /// A coil that is less likely right than wrong.
  struct DoubtedCoil {
    bool is_out = false;                    ///< of the newest measurement
    MonotonicTime since{};                  ///< steadily
    bool alone_as_well = false;             ///< the coils of an instant alone contradict it, too
    int cleared_times = 0;                  ///< in a row that they were asked and did not
    std::optional<Eigen::Vector3d> off_mm;  ///< the shape, the last time; world
    bool contradicts_itself = false;        ///< it said something else the time before
    bool jumped = false;  ///< it went wrong from one measurement to the next, and no other did
  };

  /// How far measurements mostly are off the prediction, see freedom_for().
  struct UsualSurprise {
    double mean = 1;  ///< geometric, of the newest
    int count = 0;    ///< that it is the mean of
  };

  /// All that is known at a time; copied without allocating.
  struct State {
    State(int column_count, Eigen::Index bending_node_count, const EstimatorSettings& settings);
    bool begun = false;
    MonotonicTime time{};
    MonotonicTime newest_em{};  ///< measurement time of the newest EM frame used
    Eigen::Matrix3Xd C;         ///< the shape with stiffness: coefficients, errors of coils, drift, speed
    Eigen::Matrix3Xd m;         ///< mean of what was measured, without stiffness; columns as in C
    Eigen::MatrixXd P;          ///< covariance of m; mm^2 and what the other columns' units make of it
    CoilNoise noise;
    CoilErrorScale error_scale;
    bool began_with_known_noise = false;
    double lasting_position_mm = 0;
    double lasting_tangent = 0;
    double min_lasting_position_mm = 0;  ///< since it began
    double min_lasting_tangent = 0;
    std::array<Eigen::Vector3d, kMaxCoils> coil_places_mm{};  ///< on the tube, when errors last aged
    CoilBeliefs beliefs{};
    std::array<DoubtedCoil, kMaxCoils> doubted{};
    MonotonicTime began{};  ///< EM frame of the beginning
    MonotonicTime asked{};  ///< EM frame whose coils alone were last asked who is wrong
    bool disowned = false;  ///< they said: the shape
    double freedom = 1;     ///< of the sideways motion, learnt from how far updates pull
    TubeMotion::DriftVariances drift;
    Eigen::VectorXd bending;         ///< how much the tube bends, as TubeMap::set_bending() takes it
    Eigen::Matrix3Xd rival;          ///< MirrorTest::rival() of the newest image that showed the tube
    bool is_ambiguous = false;       ///< the same of MirrorTest::is_ambiguous()
    MonotonicTime bending_learnt{};  ///< when it was last learnt
    double last_freedom = 1;         ///< that of the newest EM measurement
    UsualSurprise usual;
    int images_without_tube = 0;
    int images_with_tube = 0;    ///< in a row, as many as confirm a short piece at most
    bool tip_is_missed = false;  ///< the newest image that showed the tube did not show its tip there
    int doubted_times = 0;       ///< in a row that a shape of the instant alone knew better
    MonotonicTime doubted_em{};  ///< newest EM frame at the last of them
    bool contradicted = false;   ///< the newest image pulled the shape further off the coils than they err
    MonotonicTime confirmed{};   ///< newest image that showed the tube where it was expected
  };

  CoilObservations observe(const EmFrame* frame, const EmHistory& history) const;
  void go_back(MonotonicTime time);
  void remember();
  bool initialise(const Observation& observation, CoilObservations& coils, const EmFrame& frame,
                  TubeEstimate& estimate);
  void forget_doubts();
  void suppose_coil_errors();
  bool begin_with(const CoilObservations& coils, std::span<const ViewConstraints> lines,
                  TubeEstimate& estimate);
  void advance(const Observation& observation, const EmFrame& newest, CoilObservations& coils,
               TubeEstimate& estimate);
  bool began_too_sure();
  void update_coils(const EmFrame& frame, const EmHistory& history, double interval_s,
                    TubeEstimate& estimate);
  void update_image(const Observation& observation, const CoilObservations& coils, TubeEstimate& estimate);
  void leave_out_image(MonotonicTime instant, TubeEstimate& estimate);
  [[nodiscard]] double distance_from_coils(const CoilObservations& coils, const Eigen::Matrix3Xd& C) const;
  [[nodiscard]] Eigen::Vector3d off_coil_mm(const CoilObservation& coil, const Eigen::Matrix3Xd& C) const;
  int coils_of_a_snap(const Observation& observation, const CoilObservations& coils,
                      const TubeEstimate& estimate);
  bool better_alone(const Observation& observation, const CoilObservations& coils, double distance,
                    const TubeEstimate& estimate);
  bool is_caught(const Observation& observation, const CoilObservations& coils, double distance,
                 const TubeEstimate& estimate);
  [[nodiscard]] bool is_seen_well(MonotonicTime instant) const;
  [[nodiscard]] bool is_seen_elsewhere_alone(const Observation& observation,
                                             const CoilObservations& coils) const;
  [[nodiscard]] bool is_elsewhere_alone(const Camera& camera, const CoilObservations& coils) const;
  void doubt(int witnesses);
  void judge_shape(const Observation& observation, const CoilObservations& coils,
                   const TubeEstimate& estimate);
  bool settle(Eigen::Matrix3Xd& C, TubeEstimate& estimate);
  void refine(std::span<const ViewConstraints> lines, TubeEstimate& estimate);
  void follow(Eigen::Matrix3Xd& C);
  void know_covariance(std::span<const ViewConstraints> lines);
  bool take_lines(std::span<const ViewConstraints> lines);
  void depart(const Eigen::Matrix3Xd& C);
  void predict(MonotonicTime time, double freedom);
  void place_coils();
  void age_coil_errors(double dt_s);
  void tighten(int column, double variance);
  bool refresh_information();
  [[nodiscard]] double pull(const Eigen::Matrix3Xd& C);
  [[nodiscard]] double lasting_share() const;
  [[nodiscard]] double min_freedom() const;
  [[nodiscard]] double sideways_freedom(double learnt) const;
  void learn_drift(double interval_s);
  void learn_bending(const Eigen::Matrix3Xd& C);
  void learn_bending_from_coils(TubeEstimate& estimate);
  [[nodiscard]] double variance_factor() const;
  void adapt_freedom(double pulled, double expected, double interval_s);
  [[nodiscard]] bool tip_is_out_of_reach() const;
  void trace_tip(const Observation& observation, double loose_mm, TubeEstimate& estimate);
  void test_mirrored(std::span<const ViewConstraints> lines, const CoilObservations& coils,
                     TubeEstimate& estimate);
  static constexpr int kConfirming = 3;  ///< images in a row, for a short piece that was not seen before
  bool shows_tube(MonotonicTime instant, const TubeEstimate& estimate);
  double judge_coils(CoilObservations& coils, MonotonicTime time, double interval_s);
  void measure_innovations(const CoilObservations& coils);
  [[nodiscard]] Eigen::Matrix3d covariance_of(const ColumnSum& a, const ColumnSum& b) const;
  [[nodiscard]] bool jumped_alone(int coil, const Eigen::Vector3d& off_mm) const;
  [[nodiscard]] bool others_are_calm(int coil) const;
  [[nodiscard]] double surprise() const;
  double freedom_for(double surprise);
  [[nodiscard]] bool most_are_out() const;
  [[nodiscard]] bool is_lost() const;
  void ask_alone(const EmFrame& frame, const EmHistory& history, double interval_s);
  void leave_out_as_found(const CoilObservations& coils);
  void leave_out_doubted(CoilObservations& coils) const;
  void leave_out_erratic(CoilObservations& coils) const;

  EstimatorSettings settings_;
  InstrumentDescription instrument_;
  RigidTransform T_world_em_;
  bool registered_;
  bool has_cameras_;
  std::vector<CameraCalibration> cameras_;
  SingleFrameSolver start_;
  TubeMap map_;
  TubeMap image_map_;  ///< of the coefficients alone
  TubeViews views_;
  TubeViews second_look_;  ///< of a shape of the instant alone
  std::unique_ptr<TubeEstimate> second_opinion_;
  TubeMotion motion_;
  LearntBending learnt_bending_;
  MirrorTest mirror_test_;
  CoilUpdate coil_update_;
  CoilFaults coil_faults_;
  CoilInnovations innovations_;
  State state_;
  State before_update_;
  static constexpr std::size_t kPastStates = 8;
  std::array<State, kPastStates> past_;  ///< ring of the states after each update, for late images
  std::size_t next_past_ = 0;
  GaussianPrior prior_;              ///< of all columns, to begin with
  Eigen::Matrix3Xd coefficients_;    ///< of the shape that is being solved for
  GaussianPrior coefficient_prior_;  ///< their m and P before the image, as the solver wants them
  DenseCholesky coefficient_cholesky_;
  Eigen::MatrixXd following_;  ///< P_ec P_cc^-1: how the further columns follow the coefficients
  Eigen::MatrixXd following_covariance_;
  Eigen::Matrix3Xd C_before_;  ///< the shape before the images of this instant
  Eigen::Matrix3Xd shape_;     ///< the one published
  Eigen::MatrixXd scratch_;
  Eigen::VectorXd departure_;
  Eigen::VectorXd information_times_departure_;
  ImageVerdict images_ = ImageVerdict::kNone;  ///< of this instant
  LostTube lost_tube_;
  CoilImageAgreement agreement_;
  RestHook* rest_ = nullptr;             ///< nullptr: the tip is straight while nothing bends it
  const TubeMap* covariance_ = nullptr;  ///< that knows the covariance of shape_; nullptr: nobody
  bool converged_ = true;
  MonotonicTime shape_time_{};
};

}  // namespace tubed
