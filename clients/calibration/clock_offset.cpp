#include "clients/calibration/clock_offset.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace tubed {

namespace {

constexpr std::size_t kMinNumbers = 40;
constexpr int kMinBlocks = 6;
constexpr int kMaxBlocks = 20;
constexpr double kMinBlock_s = 2;
constexpr double kScanStep_s = 0.01;
constexpr double kNeighbour_s = 0.12;  // offsets nearer than this are one peak
constexpr int kLasting = 7;            // 1, x, y, x^2, x y, y^2, time
constexpr double kLasting_px = 20;     // how large each of them may be
constexpr double kLeft_s = 0.0005;     // what interpolation between measurements leaves
constexpr double kMinScale_px = 0.1;   // of the residuals

using Unknowns = Eigen::Matrix<double, kLasting + 1, 1>;  // lasting errors, then the offset
using Square = Eigen::Matrix<double, kLasting + 1, kLasting + 1>;

/// One number at one offset.
struct Row {
  std::size_t channel;
  double t_s;
  double residual_px;
  double slope_px_s;       ///< of the residual by the offset
  double instrument_px_s;  ///< the same with other noise
  Eigen::Vector2d p_image_px;
  double weight = 1;
  Unknowns at = Unknowns::Zero();          ///< what each unknown adds to the residual
  Unknowns instrument = Unknowns::Zero();  ///< the same, the offset's by the instrument
};

/// Is the offset an unknown, or taken as it is?
enum class Offset { kFound, kTaken };

std::vector<Row> rows_at(const std::vector<SeenNumber>& numbers, double offset_s) {
  std::vector<Row> rows;
  for (const SeenNumber& number : numbers) {
    if (const auto here = number.against(number.t_s - offset_s)) {
      rows.push_back({number.channel, number.t_s, here->residual_px, here->speed_px_s, here->other_speed_px_s,
                      here->p_image_px});
    }
  }
  return rows;
}

std::map<std::size_t, std::vector<Row*>> by_channel(std::vector<Row>& rows) {
  std::map<std::size_t, std::vector<Row*>> channels;
  for (Row& row : rows) channels[row.channel].push_back(&row);
  return channels;
}

/// Places and time of each channel about their means, in standard deviations.
void set_lasting(std::vector<Row>& rows) {
  for (auto& [channel, of] : by_channel(rows)) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), square = Eigen::Vector3d::Zero();
    const auto numbers = [](const Row& row) {
      return Eigen::Vector3d(row.p_image_px.x(), row.p_image_px.y(), row.t_s);
    };
    for (const Row* row : of) mean += numbers(*row) / static_cast<double>(of.size());
    for (const Row* row : of) square += (numbers(*row) - mean).cwiseAbs2() / static_cast<double>(of.size());
    const Eigen::Vector3d scale = square.cwiseSqrt().cwiseMax(Eigen::Vector3d(1, 1, 0.1));
    for (Row* row : of) {
      const Eigen::Vector3d x = (numbers(*row) - mean).cwiseQuotient(scale);
      row->at << 1, x.x(), x.y(), x.x() * x.x(), x.x() * x.y(), x.y() * x.y(), x.z(), row->slope_px_s;
      row->instrument = row->at;
      row->instrument(kLasting) = row->instrument_px_s;
    }
  }
}

/// Normal equations of one channel in one block.
struct Sums {
  Square squares = Square::Zero();      ///< instruments times what unknowns add
  Square instruments = Square::Zero();  ///< instruments times themselves
  Unknowns right = Unknowns::Zero();
  void add(const Row& row, double sign = 1) {
    squares += sign * row.weight * row.instrument * row.at.transpose();
    right -= sign * row.weight * row.residual_px * row.instrument;
    instruments += sign * row.weight * row.instrument * row.instrument.transpose();
  }
};

/// What one channel says of the offset when its lasting errors have been taken out.
struct Information {
  double about = 0;                            ///< instrument times slope, 1 / s^2 in scales of the residuals
  double offset = 0;                           ///< of the offset times that
  double variance = 0;                         ///< of the latter if errors were independent
  Eigen::Matrix<double, kLasting, 1> lasting;  ///< at offset 0
  Eigen::Matrix<double, kLasting, 1> by_offset;
};

Information information_of(const Sums& sums) {
  using Lasting = Eigen::Matrix<double, kLasting, kLasting>;
  const Lasting with_prior =
      sums.squares.topLeftCorner<kLasting, kLasting>() + Lasting::Identity() / (kLasting_px * kLasting_px);
  const Eigen::LLT<Lasting> solver(with_prior);
  Information all;
  all.lasting = solver.solve(sums.right.head<kLasting>());
  all.by_offset = solver.solve(sums.squares.topRightCorner<kLasting, 1>());
  const auto across = sums.squares.bottomLeftCorner<1, kLasting>();
  all.about = sums.squares(kLasting, kLasting) - (across * all.by_offset).value();
  all.offset = sums.right(kLasting) - (across * all.lasting).value();
  const auto instrument_across = sums.instruments.topRightCorner<kLasting, 1>();
  all.variance =
      sums.instruments(kLasting, kLasting) - instrument_across.dot(solver.solve(instrument_across.eval()));
  return all;
}

/// Numbers with their weights around one offset, and the step from there.
class Linearised {
 public:
  Linearised(const std::vector<SeenNumber>& numbers, double offset_s, Offset offset)
      : offset_(offset), rows_(rows_at(numbers, offset_s)) {
    set_lasting(rows_);
    for (int round = 0; round < kRounds; ++round) {
      solve();
      weigh();
    }
    solve();
  }

  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  [[nodiscard]] double step_s() const { return step_s_; }
  /// Standard deviation of the step if errors were independent.
  [[nodiscard]] double white_sigma_s() const { return sigma_s_; }
  [[nodiscard]] double rms_px() const { return rms_px_; }
  [[nodiscard]] double log_likelihood() const { return log_likelihood_; }
  /// RMS slope after the lasting errors were taken out.
  [[nodiscard]] double motion_px_s() const;

  /// The standard deviation of the step from the steps with one block of time left out.
  struct Jackknife {
    int blocks = 0;
    double sigma_s = std::numeric_limits<double>::infinity();
  };
  [[nodiscard]] Jackknife jackknife(int blocks) const;
  /// The larger one of blocks of 2 s and more, and of twice that: each is drawn itself.
  [[nodiscard]] Jackknife jackknife() const;

 private:
  static constexpr int kRounds = 6;
  static constexpr double kCauchy = 2.4;

  void solve();
  void weigh();
  [[nodiscard]] double spans_s() const;

  Offset offset_;
  std::vector<Row> rows_;
  std::map<std::size_t, Sums> sums_;
  double step_s_ = 0;
  double about_ = 0;
  double sigma_s_ = 0;
  double rms_px_ = 0;
  double log_likelihood_ = 0;
};

/// The offset that the channels together ask for.
struct Step {
  double step_s = 0;
  double about = 0;
  double sigma_s = std::numeric_limits<double>::infinity();  ///< if errors were independent
};
Step step_of(const std::map<std::size_t, Sums>& channels) {
  double offset = 0, variance = 0;
  Step found;
  for (const auto& [channel, sums] : channels) {
    const Information all = information_of(sums);
    found.about += all.about;
    offset += all.offset;
    variance += all.variance;
  }
  if (found.about > 0) {
    found.step_s = offset / found.about;
    found.sigma_s = std::sqrt(variance) / found.about;
  }
  return found;
}

void Linearised::solve() {
  sums_.clear();
  for (const Row& row : rows_) sums_[row.channel].add(row);
  const Step found = step_of(sums_);
  about_ = found.about;
  sigma_s_ = found.sigma_s;
  step_s_ = offset_ == Offset::kFound ? found.step_s : 0;
}

// By what is left, with a scale a channel.
void Linearised::weigh() {
  double squares = 0, weights = 0;
  log_likelihood_ = 0;
  for (auto& [channel, of] : by_channel(rows_)) {
    const Information all = information_of(sums_[channel]);
    Unknowns solution;
    solution << all.lasting - step_s_ * all.by_offset, step_s_;
    std::vector<double> left;
    for (const Row* row : of) left.push_back(std::abs(row->residual_px + row->at.dot(solution)));
    std::vector<double> sorted = left;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double scale_px = std::max(kMinScale_px, 1.4826 * *middle);
    double channel_squares = 0, channel_weights = 0;
    for (std::size_t i = 0; i < of.size(); ++i) {
      const double in_scales = left[i] / scale_px;
      const double robust = 1 / (1 + in_scales * in_scales / (kCauchy * kCauchy));
      of[i]->weight = robust / (scale_px * scale_px);
      channel_squares += robust * left[i] * left[i];
      channel_weights += robust;
    }
    const double rms_px =
        std::max(kMinScale_px, std::sqrt(channel_squares / std::max(channel_weights, 1e-9)));
    log_likelihood_ -= static_cast<double>(of.size()) * std::log(rms_px);
    squares += channel_squares;
    weights += channel_weights;
  }
  rms_px_ = weights > 0 ? std::sqrt(squares / weights) : 0;
}

double Linearised::spans_s() const {
  const auto [first, last] = std::minmax_element(rows_.begin(), rows_.end(),
                                                 [](const Row& a, const Row& b) { return a.t_s < b.t_s; });
  return rows_.empty() ? 0 : last->t_s - first->t_s;
}

Linearised::Jackknife Linearised::jackknife() const {
  const int count = std::min(kMaxBlocks, static_cast<int>(spans_s() / kMinBlock_s));
  Jackknife found = jackknife(count);
  const Jackknife longer = jackknife(std::max(kMinBlocks, count / 2));
  if (longer.blocks >= kMinBlocks && found.blocks >= kMinBlocks) {
    found.sigma_s = std::max(found.sigma_s, longer.sigma_s);
  }
  return found;
}

Linearised::Jackknife Linearised::jackknife(int count) const {
  Jackknife found;
  const double first_s = rows_.empty() ? 0 : rows_.front().t_s;
  const double block_s = (spans_s() + 1e-9) / std::max(count, 1);
  std::vector<double> steps_s;
  for (int block = 0; block < count; ++block) {
    std::map<std::size_t, Sums> sums = sums_;
    std::size_t left_out = 0;
    for (const Row& row : rows_) {
      if (static_cast<int>((row.t_s - first_s) / block_s) != block) continue;
      sums[row.channel].add(row, -1);
      ++left_out;
    }
    if (left_out == 0) continue;
    const Step found_without = step_of(sums);
    if (found_without.about > 0) steps_s.push_back(found_without.step_s);
  }
  found.blocks = static_cast<int>(steps_s.size());
  if (found.blocks < kMinBlocks) return found;
  double mean_s = 0, squares_s2 = 0;
  for (const double step_s : steps_s) mean_s += step_s / found.blocks;
  double neighbours_s2 = 0;
  for (std::size_t i = 0; i < steps_s.size(); ++i) {
    squares_s2 += (steps_s[i] - mean_s) * (steps_s[i] - mean_s);
    if (i > 0) neighbours_s2 += (steps_s[i] - mean_s) * (steps_s[i - 1] - mean_s);
  }
  // Errors that last go on from one block to the next (Newey and West, Econometrica 55, 1987).
  squares_s2 += 2 * std::max(0.0, neighbours_s2);
  // Of Student's t with blocks - 1 degrees of freedom.
  const double widened = (found.blocks - 1.0) / (found.blocks - 3.0);
  found.sigma_s = std::sqrt(widened * (found.blocks - 1.0) / found.blocks * squares_s2);
  return found;
}

double Linearised::motion_px_s() const {
  double weights = 0;
  for (const Row& row : rows_) weights += row.weight;
  return weights > 0 && about_ > 0 ? std::sqrt(about_ / weights) : 0;
}

/// Where the numbers are likeliest of all offsets within reach.
void scan(const std::vector<SeenNumber>& numbers, const ClockSearch& search, ClockOffset& found) {
  const int steps = static_cast<int>(std::lround(search.reach_s / kScanStep_s));
  for (int step = -steps; step <= steps; ++step) {
    const double offset_s = search.around_s + step * kScanStep_s;
    const Linearised tried(numbers, offset_s, Offset::kTaken);
    if (tried.size() >= kMinNumbers) {
      // A mean over the numbers: where the recording ends, late offsets have fewer.
      const double mean = tried.log_likelihood() / static_cast<double>(tried.size());
      found.curve.push_back({offset_s, tried.rms_px(), mean * static_cast<double>(numbers.size())});
    }
  }
  if (found.curve.empty()) return;
  const auto best =
      std::max_element(found.curve.begin(), found.curve.end(),
                       [](const auto& a, const auto& b) { return a.log_likelihood < b.log_likelihood; });
  found.offset_s = best->offset_s;
  found.is_at_border = best == found.curve.begin() || best + 1 == found.curve.end();
}

/// How much likelier the best offset is than any that is not its neighbour.
double peak_in_sigmas(const ClockOffset& found) {
  double best = -std::numeric_limits<double>::infinity();
  double other = best;
  for (const ClockOffset::Tried& tried : found.curve) {
    const bool is_near = std::abs(tried.offset_s - found.offset_s) < kNeighbour_s;
    (is_near ? best : other) = std::max(is_near ? best : other, tried.log_likelihood);
  }
  // Errors that last count for fewer numbers than there are.
  const double inflation = std::max(1.0, std::pow(found.sigma_s / found.white_sigma_s, 2));
  return best > other ? std::sqrt(2 * (best - other) / inflation) : 0;
}

}  // namespace

std::optional<ClockOffset> find_clock_offset(const std::vector<SeenNumber>& numbers,
                                             const ClockSearch& search) {
  ClockOffset found;
  scan(numbers, search, found);
  if (found.curve.empty()) return std::nullopt;
  constexpr int kMaxSteps = 10;
  constexpr double kSettled_s = 2e-5;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Linearised here(numbers, found.offset_s, Offset::kFound);
    const auto jackknife = here.jackknife();
    if (here.size() < kMinNumbers || jackknife.blocks < kMinBlocks) return std::nullopt;
    found.blocks = jackknife.blocks;
    found.white_sigma_s = here.white_sigma_s();
    found.sigma_s = std::hypot(kLeft_s, std::max(jackknife.sigma_s, found.white_sigma_s));
    found.count = here.size();
    found.rms_px = here.rms_px();
    found.motion_px_s = here.motion_px_s();
    const double step_s = std::clamp(here.step_s(), -kNeighbour_s / 2, kNeighbour_s / 2);
    found.offset_s = std::clamp(found.offset_s + step_s, search.around_s - search.reach_s,
                                search.around_s + search.reach_s);
    if (std::abs(step_s) < kSettled_s) break;
  }
  found.peak_in_sigmas = peak_in_sigmas(found);
  return found;
}

}  // namespace tubed
