#include "clients/tubectl/calibrate/live_probe.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

namespace {

constexpr std::uint32_t kOk = 1;  // EmCoil::status

}  // namespace

ProbePose probe_pose(const tubed_EmSamples& sample, int coil) {
  if (coil < 1 || static_cast<std::uint32_t>(coil) > sample.coil_count) {
    throw std::runtime_error("instrument " + std::string(sample.instrument_id) + " has " +
                             std::to_string(sample.coil_count) + " coils, there is no coil " +
                             std::to_string(coil));
  }
  const tubed_EmCoil& measured = sample.coils[coil - 1];
  const Eigen::Vector3d axis(measured.tangent_em[0], measured.tangent_em[1], measured.tangent_em[2]);
  ProbePose pose;
  pose.frame = sample.tracker_frame;
  pose.p_em_mm = {measured.p_em_mm[0], measured.p_em_mm[1], measured.p_em_mm[2]};
  pose.is_seen = measured.status == kOk && pose.p_em_mm.allFinite() && axis.norm() > 0.5;
  if (pose.is_seen) pose.q_em_probe = rotation_from_z_to(axis);
  return pose;
}

std::optional<ProbePose> LiveProbe::wait_for(std::chrono::milliseconds timeout) {
  const tubed_EmSamples* const sample = reader_.wait_for(timeout);
  if (sample == nullptr) return std::nullopt;
  const std::string id = sample->instrument_id;
  if (instrument_id_.empty()) instrument_id_ = id;
  if (id != instrument_id_) {
    throw std::runtime_error("instruments " + instrument_id_ + " and " + id +
                             " are published: choose the probe with --instrument");
  }
  return probe_pose(*sample, coil_);
}

std::optional<std::string> TypedLines::next() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  std::array<char, 256> bytes{};
  while (is_open_ && typed_.find('\n') == std::string::npos && ::poll(&input, 1, 0) == 1) {
    const ssize_t count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    is_open_ = count > 0;
    if (is_open_) typed_.append(bytes.data(), static_cast<std::size_t>(count));
  }
  const std::size_t end = typed_.find('\n');
  if (end == std::string::npos) {
    return is_open_ ? std::nullopt : std::optional<std::string>("q");
  }
  std::string line = typed_.substr(0, end);
  typed_.erase(0, end + 1);
  if (line.ends_with('\r')) line.pop_back();
  return line;
}

}  // namespace tubed
