#include "daemon/image/ridge_claims.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr int kApart = 15;               // lines; nearer ones are of one stretch
constexpr double kSameRidge_px = 2.0;    // across, from what one line found to what the other did
constexpr double kBeside = 0.75;         // along, of the way from one line to the next
constexpr double kAlongside = 0.94;      // cosine; stretches that cross at more do not share a ridge
constexpr double kExpectedApart_px = 2;  // across; expected nearer they may well lie on one another
constexpr double kClearly_px = 1;        // by how much a ridge has to be nearer to one base than to the other
constexpr double kRidgeFlank_px = 1.5;   // of a ridge beyond the tube's side
constexpr int kAskedNeighbours = 8;      // lines to either side that are asked together

Eigen::Vector2d found_by(const CorrespondenceLine& line) {
  return line.base_px + line.offset_px * line.normal;
}

bool are_alongside(const CorrespondenceLine& a, const CorrespondenceLine& b) {
  return std::abs(a.normal.dot(b.normal)) > kAlongside;
}

/// Where b was expected, across a.
double expected_apart_px(const CorrespondenceLine& a, const CorrespondenceLine& b) {
  return a.normal.dot(b.base_px - a.base_px);
}

/// The greater way to a line next to it; 0: it is alone.
double spacing_of(std::span<const CorrespondenceLine> lines, std::size_t line) {
  double spacing_px = 0;
  for (const std::size_t next : {line + 1, line - 1}) {  // before the first one it wraps around
    if (next < lines.size() && lines[next].in_view) {
      spacing_px = std::max(spacing_px, (lines[next].base_px - lines[line].base_px).norm());
    }
  }
  return spacing_px;
}

}  // namespace

bool RidgeClaims::find(std::span<const CorrespondenceLine> lines, const PerLine& on_ridge) {
  claims_.fill(Claim{});
  collect(lines, on_ridge);
  bool any = false;
  for (const Found& found : std::span(found_).first(static_cast<std::size_t>(count_))) {
    const int rival = rival_of(lines, found);
    if (rival < 0) continue;
    const CorrespondenceLine& line = lines[static_cast<std::size_t>(found.line)];
    const CorrespondenceLine& other = lines[static_cast<std::size_t>(rival)];
    claims_[static_cast<std::size_t>(found.line)] = {
        rival, line.normal.dot(found_by(other) - line.base_px), other.half_width_px + kRidgeFlank_px,
        expected_apart_px(line, other) > 0 ? -1 : 1, Verdict::kOwn};
    any = true;
  }
  return any;
}

void RidgeClaims::collect(std::span<const CorrespondenceLine> lines, const PerLine& on_ridge) {
  count_ = 0;
  max_step_px_ = 1;
  double widest_px = 0;
  for (std::size_t i = 0; i < std::min(lines.size(), found_.size()); ++i) {
    if (!lines[i].in_view || !on_ridge[i]) continue;
    Found& found = found_[static_cast<std::size_t>(count_++)];
    found = {static_cast<int>(i), count_, found_by(lines[i]), spacing_of(lines, i)};
    widest_px = std::max(widest_px, found.spacing_px);
  }
  for (int place = count_ - 2; place >= 0; --place) {
    Found& found = found_[static_cast<std::size_t>(place)];
    const Found& next = found_[static_cast<std::size_t>(place + 1)];
    if (next.line == found.line + 1) {
      found.run_end = next.run_end;
      max_step_px_ = std::max(max_step_px_, (next.p_px - found.p_px).norm());
    }
  }
  near_px_ = std::hypot(kBeside * widest_px, kSameRidge_px);
}

// What is far off is passed over in as many steps as that takes at least, but not across a gap.
int RidgeClaims::step_toward(double distance_px, int place) const {
  const double steps = (distance_px - near_px_) / max_step_px_;
  const int rest = found_[static_cast<std::size_t>(place)].run_end - place;
  return steps > 1 ? static_cast<int>(std::min<double>(steps, rest)) : 1;
}

// The line of another stretch that has found the same ridge beside this one; -1: none.
int RidgeClaims::rival_of(std::span<const CorrespondenceLine> lines, const Found& found) const {
  const CorrespondenceLine& line = lines[static_cast<std::size_t>(found.line)];
  const Eigen::Vector2d along(-line.normal.y(), line.normal.x());
  int rival = -1;
  double nearest_px = near_px_;
  for (int place = 0; place < count_;) {
    const Found& other = found_[static_cast<std::size_t>(place)];
    const int same_stretch = found.line + kApart - other.line;
    if (same_stretch > 0 && same_stretch < 2 * kApart) {
      place += std::min(same_stretch, other.run_end - place);
      continue;
    }
    const Eigen::Vector2d way_px = other.p_px - found.p_px;
    place += step_toward(way_px.norm(), place);
    const double along_px = std::abs(along.dot(way_px));
    const CorrespondenceLine& candidate = lines[static_cast<std::size_t>(other.line)];
    if (along_px < std::min(nearest_px, kBeside * std::max(found.spacing_px, other.spacing_px)) &&
        std::abs(line.normal.dot(way_px)) < kSameRidge_px && are_alongside(line, candidate) &&
        std::abs(expected_apart_px(line, candidate)) > kExpectedApart_px) {
      rival = other.line;
      nearest_px = along_px;
    }
  }
  return rival;
}

// Of the lines around that have a rival: more than half see another ridge.
bool RidgeClaims::mostly(const PerLine& sees_another, int line, int count) const {
  int asked = 0;
  int seeing = 0;
  for (int i = std::max(0, line - kAskedNeighbours); i <= std::min(count - 1, line + kAskedNeighbours); ++i) {
    const auto neighbour = static_cast<std::size_t>(i);
    if (claims_[neighbour].rival < 0) continue;
    ++asked;
    seeing += sees_another[neighbour] ? 1 : 0;
  }
  return 2 * seeing > asked;
}

bool RidgeClaims::settle(std::span<const CorrespondenceLine> lines, const PerLine& sees_another) {
  bool any = false;
  const auto count = static_cast<int>(lines.size());
  for (int i = 0; i < count; ++i) {
    Claim& claim = claims_[static_cast<std::size_t>(i)];
    if (claim.rival < 0) continue;
    const double own_px = std::abs(lines[static_cast<std::size_t>(i)].offset_px);
    const double rivals_px = std::abs(lines[static_cast<std::size_t>(claim.rival)].offset_px);
    const bool could_go = mostly(sees_another, i, count);
    const bool rival_could_go = mostly(sees_another, claim.rival, count);
    const bool is_nearer = own_px < rivals_px - kClearly_px;
    const bool is_further = own_px > rivals_px + kClearly_px;
    if (could_go && (!rival_could_go || is_further)) {
      claim.verdict = Verdict::kOthers;
      any = true;
    } else if (could_go == rival_could_go && (could_go ? !is_nearer : is_further)) {
      claim.verdict = Verdict::kUnsure;
    }
  }
  return any;
}

}  // namespace tubed
