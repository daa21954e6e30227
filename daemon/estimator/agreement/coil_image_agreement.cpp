#include "daemon/estimator/agreement/coil_image_agreement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();
constexpr double kEndContradicts_mm = 3;  // the shape is seen to end elsewhere, whatever explains it
constexpr double kEndAgrees_mm = 2;
constexpr double kJudgeEvery_s = 0.1;        // images closer together bring little news: CoilImageEvidence
constexpr double kSharedShare = 0.7;         // of what stays of a coil's error, its neighbours' share
constexpr double kBetterTracker = 0.5;       // of what stays, as likely as all of what the settings say
constexpr double kBetterRegistration = 0.2;  // of what is stated, as likely as all of it
constexpr double kPriorOdds =
    1e-2;  // of each explanation that is not "as stated": a mistake in a hundred procedures
constexpr double kFieldOdds = 1e-3;  // of coils that are off each in its own way, which explains anything
constexpr double kMagnificationOdds =
    1e-3;                         // of a view: found when it is set up, and shown to be wrong for hours
constexpr double kCertain = 0.8;  // of "as stated", to take back that they disagree

// Standard deviations where an explanation holds.
constexpr double kWrongShift_mm = 8;
constexpr double kWrongTurn_rad = 0.06;
constexpr double kWrongArcLength_mm = 10;
constexpr double kBeside_mm = 0.8;  // a coil 8 mm further along a bend of radius 40 mm: 8^2 / (2 40)
constexpr double kWrongClock_s = 0.15;
constexpr double kWrongMagnification = 0.08;
constexpr double kWrongCoil_mm = 20;

// Against "as stated", before anything was seen.
double prior_odds(Discord discord) {
  switch (discord) {
    case Discord::kNone:
      return 1;
    case Discord::kField:
      return kFieldOdds;
    case Discord::kMagnification:
      return kMagnificationOdds;
    default:
      return kPriorOdds;
  }
}

// log(exp(a) + exp(b)).
double log_sum(double a, double b) {
  const double larger = std::max(a, b);
  return larger == kNever ? kNever : larger + std::log1p(std::exp(std::min(a, b) - larger));
}

}  // namespace

CoilImageAgreement::CoilImageAgreement(const RoomErrors& errors, const InstrumentDescription& instrument,
                                       int view_count)
    : errors_(errors), seen_(instrument, view_count), D_(Eigen::VectorXd::Zero(seen_.model().unknowns())) {
  using enum Discord;
  for (const double registration_share : {1.0, kBetterRegistration}) {
    const auto may_be = [this, registration_share](Discord discord, int index = 0) {
      explanations_.push_back({.discord = discord, .index = index, .registration_share = registration_share});
    };
    for (const Discord discord : {kNone, kRegistration, kArcLengths, kClock}) may_be(discord);
    for (int view = 0; view < view_count; ++view) may_be(kMagnification, view);
    for (int coil = 0; coil < seen_.model().coil_count(); ++coil) {
      may_be(kCoil, coil);
      may_be(kCoilArcLength, coil);
    }
    may_be(kField);
  }
  suppose();
}

// Before anything was seen nothing of the registration was checked.
void CoilImageAgreement::suppose() {
  registration_square_.setZero();
  registration_square_.diagonal().head<3>().setConstant(squared(errors_.unchecked_shift_mm));
  registration_square_.diagonal().tail<3>().setConstant(squared(errors_.unchecked_turn_rad));
}

void CoilImageAgreement::reset() {
  seen_.reset();
  judged_.reset();
  verdict_ = Verdict{};
  disagree_ = false;
  end_contradicts_ = false;
  field_square_mm2_ = 0;
  magnification_square_ = {};
  pose_square_.setZero();
  suppose();
}

void CoilImageAgreement::observe(const CoilObservations& coils, const ConfirmedShape& shape, double noise_mm,
                                 double lasting_mm) {
  seen_.observe(coils, shape, noise_mm);
  const bool is_soon = judged_ && std::abs(seconds_between(*judged_, shape.instant)) < kJudgeEvery_s;
  if (is_soon) return;
  judged_ = shape.instant;
  judge(std::max(lasting_mm, errors_.coil_mm));
  conclude();
}

// D of LinearEvidence: of everything as stated, of a better registration, or of another field.
void CoilImageAgreement::allow(const Explanation& explanation, double lasting_mm) {
  const CoilImageModel& model = seen_.model();
  const int coils = model.coil_count();
  const bool is_field = explanation.discord == Discord::kField;
  D_.segment<3>(0).setConstant(explanation.registration_share * errors_.shift_mm);
  D_.segment<3>(CoilImageModel::kTurn).setConstant(explanation.registration_share * errors_.turn_rad);
  D_[CoilImageModel::kArcLength] = errors_.arc_length_mm;
  D_[CoilImageModel::kClock] = errors_.clock_s;
  D_.segment(CoilImageModel::kViews, model.view_count()).setConstant(errors_.magnification);
  const double own_mm = std::hypot(lasting_mm * std::sqrt(1 - kSharedShare), is_field ? kWrongField_mm : 0);
  D_.segment(model.own_column(0), 3 * coils).setConstant(own_mm);
  D_.segment(model.shared_column(0), 3 * coils).setConstant(lasting_mm * std::sqrt(kSharedShare));
  D_.tail(coils).setConstant(std::hypot(errors_.arc_length_mm, own_mm));
}

// log p of what was seen, where everything else is as D_ says.
double CoilImageAgreement::log_evidence(const Explanation& explanation) {
  const CoilImageModel& model = seen_.model();
  const Eigen::Index own = model.own_column(explanation.index);
  const Eigen::Index along = model.arc_length_column(explanation.index);
  std::array<LinearEvidence::Widened, LinearEvidence::kMaxWidened> widened{};
  std::size_t count = 0;
  const auto widen = [&widened, &count](Eigen::Index first, Eigen::Index size, double sigma) {
    for (Eigen::Index i = 0; i < size; ++i) widened[count++] = {first + i, sigma};
  };
  if (!explanation.widens_base()) {
    return seen_.linear().explain(D_);
  }
  switch (explanation.discord) {
    case Discord::kNone:
    case Discord::kField:
    case Discord::kNegative:  // MisreadImages compares those
    case Discord::kMirrored:
      break;
    case Discord::kRegistration:
      widen(0, 3, kWrongShift_mm);
      widen(CoilImageModel::kTurn, 3, kWrongTurn_rad);
      break;
    case Discord::kArcLengths:
      widen(CoilImageModel::kArcLength, 1, kWrongArcLength_mm);
      break;
    case Discord::kClock:
      widen(CoilImageModel::kClock, 1, kWrongClock_s);
      break;
    case Discord::kMagnification:
      widen(CoilImageModel::kViews + explanation.index, 1, kWrongMagnification);
      break;
    case Discord::kCoil:
      widen(own, 3, kWrongCoil_mm);
      widen(along, 1, kWrongCoil_mm);
      break;
    case Discord::kCoilArcLength:
      widen(own, 3, std::hypot(D_[own], kBeside_mm));
      widen(along, 1, kWrongArcLength_mm);
      break;
  }
  return seen_.linear().widened({widened.data(), count});
}

// All explanations, with what stays of coils' errors as the settings have it and as a better tracker has it.
// Where a matrix is not positive definite, what was concluded before stays.
void CoilImageAgreement::judge(double lasting_mm) {
  seen_.linear().freeze();
  for (Explanation& explanation : explanations_) {
    explanation.log_evidence = kNever;
  }
  for (const double tracker_share : {1.0, kBetterTracker}) {
    for (const double registration_share : {1.0, kBetterRegistration}) {
      compare(registration_share, tracker_share * lasting_mm);
    }
  }
}

// Those of that room, with so much that stays of coils' errors.
void CoilImageAgreement::compare(double registration_share, double lasting_mm) {
  allow({.registration_share = registration_share}, lasting_mm);
  seen_.linear().explain(D_);
  if (!seen_.linear().take_as_base()) {
    return;
  }
  for (Explanation& explanation : explanations_) {
    if (explanation.registration_share != registration_share) continue;
    allow(explanation, lasting_mm);
    const double log_p = log_evidence(explanation) + std::log(prior_odds(explanation.discord));
    if (log_p > explanation.log_evidence) remember(explanation);
    explanation.log_evidence = log_sum(explanation.log_evidence, log_p);
  }
}

// What the newest explanation of LinearEvidence makes of it.
void CoilImageAgreement::remember(Explanation& explanation) {
  const CoilImageModel& model = seen_.model();
  const Eigen::VectorXd& mean = seen_.linear().mean();
  explanation.end_mm = seen_.end_row().dot(mean);
  explanation.registration = mean.head<6>();
  const int index = explanation.index;
  const bool of_a_coil =
      explanation.discord == Discord::kCoil || explanation.discord == Discord::kCoilArcLength;
  explanation.arc_length_mm = mean[of_a_coil ? model.arc_length_column(index) : CoilImageModel::kArcLength];
  explanation.clock_s = mean[CoilImageModel::kClock];
  explanation.coil_mm = mean.segment<3>(model.own_column(explanation.discord == Discord::kCoil ? index : 0));
  const bool widens = explanation.widens_base();
  if (widens) {
    explanation.covariance = seen_.linear().covariance_of_first();
  } else {
    explanation.covariance = D_.head<6>().cwiseAbs2().asDiagonal();  // at most
  }
  for (int view = 0; view < model.view_count(); ++view) {
    const Eigen::Index column = CoilImageModel::kViews + view;
    const auto i = static_cast<std::size_t>(view);
    explanation.magnification[i] = mean[column];
    explanation.magnification_variance[i] = widens ? seen_.linear().variance_of(column) : squared(D_[column]);
  }
}

void CoilImageAgreement::conclude() {
  const auto likelier = [](const Explanation& a, const Explanation& b) {
    return a.log_evidence < b.log_evidence;
  };
  const auto likeliest = std::max_element(explanations_.begin(), explanations_.end(), likelier);
  if (!std::isfinite(likeliest->log_evidence)) {
    return;
  }
  const double most = likeliest->log_evidence;
  double sum = 0;
  for (const Explanation& explanation : explanations_) {
    sum += std::exp(explanation.log_evidence - most);
  }
  verdict_.as_stated = 0;
  const Explanation* mistake = nullptr;
  for (Explanation& explanation : explanations_) {
    explanation.probability = std::exp(explanation.log_evidence - most) / sum;
    if (explanation.discord == Discord::kNone) {
      verdict_.as_stated += explanation.probability;
    } else if (mistake == nullptr || likelier(*mistake, explanation)) {
      mistake = &explanation;
    }
  }
  take_moments();
  disagree_ = verdict_.as_stated < (disagree_ ? kCertain : 0.5);
  // Of the two that are "as stated" the first holds less firmly to it and shows more of what was seen.
  name(disagree_ ? *mistake : explanations_.front());
  const double beyond_tip_mm = seen_.beyond_tip_mm();
  const double contradicts_mm = end_contradicts_ ? kEndAgrees_mm : kEndContradicts_mm;
  end_contradicts_ = std::abs(beyond_tip_mm) > contradicts_mm;
  if (end_contradicts_ && verdict_.explanation == Discord::kNone) {
    verdict_.explanation = Discord::kArcLengths;
    verdict_.probability = 0;
    for (const Explanation& explanation : explanations_) {
      if (explanation.discord == Discord::kArcLengths) verdict_.probability += explanation.probability;
    }
    verdict_.end_mm = beyond_tip_mm;
  }
}

// Fills the verdict with that explanation, in whichever room.
void CoilImageAgreement::name(const Explanation& explanation) {
  verdict_.explanation = explanation.discord;
  verdict_.index = explanation.index;
  verdict_.probability = 0;
  for (const Explanation& other : explanations_) {
    if (other.is_as(explanation)) verdict_.probability += other.probability;
  }
  verdict_.shift_mm = explanation.registration.head<3>();
  verdict_.turn_rad = explanation.registration.tail<3>();
  verdict_.coil_mm = explanation.coil_mm;
  verdict_.arc_length_mm = explanation.arc_length_mm;
  verdict_.clock_s = explanation.clock_s;
  verdict_.magnification = explanation.magnification[explanation.discord == Discord::kMagnification
                                                         ? static_cast<std::size_t>(explanation.index)
                                                         : 0];
  verdict_.end_mm = explanation.end_mm;
}

EmImageAgreement CoilImageAgreement::summary() const {
  EmImageAgreement summary{.disagree = disagree(),
                           .explanation = verdict_.explanation,
                           .index = static_cast<std::uint32_t>(verdict_.index)};
  if (!seen_.model().has_centre()) {
    return summary;
  }
  // Above zero says that something was compared.
  summary.probability = std::max(static_cast<float>(verdict_.probability), std::numeric_limits<float>::min());
  summary.as_stated = static_cast<float>(verdict_.as_stated);
  Eigen::Map<Eigen::Vector3f>(summary.shift_mm.data()) = verdict_.shift_mm.cast<float>();
  Eigen::Map<Eigen::Vector3f>(summary.turn_rad.data()) = verdict_.turn_rad.cast<float>();
  summary.unsure_mm = static_cast<float>(std::sqrt(registration_square_.diagonal().head<3>().sum()));
  summary.unsure_rad = static_cast<float>(std::sqrt(registration_square_.diagonal().tail<3>().sum()));
  Eigen::Map<Eigen::Vector3f>(summary.coil_mm.data()) = verdict_.coil_mm.cast<float>();
  summary.arc_length_mm = static_cast<float>(verdict_.arc_length_mm);
  summary.end_mm = static_cast<float>(verdict_.end_mm);
  summary.clock_s = static_cast<float>(verdict_.clock_s);
  summary.magnification = static_cast<float>(verdict_.magnification);
  return summary;
}

}  // namespace tubed
