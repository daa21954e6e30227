// Samples as a forger makes them through everything that a subscriber does with one: the guards, the
// centreline, the words and the JSON. DDS's decoder has made sure of the types: texts end and booleans are 0
// or 1.
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/cpp/centreline.hpp"
#include "clients/cpp/delay_guard.hpp"
#include "clients/cpp/instrument_gate.hpp"
#include "clients/cpp/writer_choice.hpp"
#include "clients/evaluation/latency_statistics.hpp"
#include "clients/tubectl/watch/sample_text.hpp"
#include "clients/tubectl/watch/status_line.hpp"
#include "clients/tubectl/watch/stream_statistics.hpp"
#include "tests/fuzz/fuzz_input.hpp"

using namespace tubed;
using namespace tubed::fuzz;

namespace {

/// As idlc's decoder leaves it.
void make_decoded(tubed_TubeEstimate& estimate) {
  estimate.instrument_id[sizeof(estimate.instrument_id) - 1] = '\0';
  const auto make_bool = [](bool& flag) {
    std::uint8_t byte = 0;
    std::memcpy(&byte, &flag, 1);
    flag = (byte & 1U) != 0;
  };
  make_bool(estimate.has_image);
  make_bool(estimate.is_image_instant);
  for (tubed_ViewUsed& view : estimate.views) make_bool(view.has_own_geometry);
}

void check_shape(const tubed_TubeEstimate& estimate, double s_mm) {
  const Vector3 point = point_at(estimate, s_mm);
  const Vector3 tangent = tangent_at(estimate, s_mm);
  const double sigma_mm = sigma_mm_at(estimate, s_mm);
  if (!has_shape(estimate)) {
    demand(std::isnan(point[0]) && std::isnan(tangent[0]) && std::isnan(sigma_mm));
  }
}

/// One instrument's guards, as TubeSubscriber has them.
struct Guards {
  WriterChoice choice{120};
  DelayGuard delay{200'000'000};
  InstrumentGate gate{"", 4};

  void judge(const tubed_TubeEstimate& estimate, std::uint64_t writer, std::int64_t now_ns) {
    using Time = InstrumentGate::Time;
    if (!gate.admits(estimate.instrument_id, Time(std::chrono::nanoseconds(now_ns)))) {
      return;
    }
    const SampleOrigin origin{estimate.daemon_start, estimate.sequence_number,
                              estimate.stamps.publish_started_monotonic_ns, writer};
    const Ruling ruling = choice.judge(origin, now_ns);
    if (is_delivered(ruling) &&
        delay.judge(origin.daemon_start, origin.publish_monotonic_ns, now_ns) == Delay::kUsual) {
      choice.accept(origin, ruling, now_ns);
    }
    static_cast<void>(choice.rival(now_ns));
  }
};

/// What tubectl latency, stat and status make of samples.
struct Statistics {
  LatencyStatistics latency;
  StreamStatistics stream;
  StatusLine status;

  void add(const tubed_TubeEstimate& estimate, std::int64_t now_ns) {
    static TubeSample sample;
    sample.estimate = estimate;
    sample.received_monotonic_ns = now_ns;
    latency.add(sample, {});
    stream.add(sample);
    status.add(sample);
  }
  void print() const {
    if (!latency.is_empty()) {
      demand(!latency.table(50).empty() && !latency.to_json(50).dump().empty());
      demand(!stream.table().empty() && !stream.to_json().dump().empty());
      demand(!status.text("c").empty() && !status.to_json("c").dump().empty());
    }
  }
};

}  // namespace

// A sequence of samples: each is the one before with some of its bytes replaced.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static tubed_TubeEstimate estimate;
  estimate = {};
  estimate.point_count = 3;
  estimate.coefficient_count = 5;
  estimate.coefficient_spacing_mm = 10;
  estimate.length_mm = 20;
  FuzzInput input(data, size);
  Guards guards;
  Statistics statistics;
  std::int64_t now_ns = 1'000'000'000'000;
  int printed = 0;
  for (int samples = 0; samples < 40 && !input.empty(); ++samples) {
    const std::uint8_t steps = input.take<std::uint8_t>();
    for (int changes = steps % 8; changes > 0; --changes) {
      const std::size_t offset = input.take<std::uint16_t>() % sizeof(estimate);
      input.take_into(std::as_writable_bytes(std::span(&estimate, 1))
                          .subspan(offset, std::min<std::size_t>(8, sizeof(estimate) - offset)));
    }
    make_decoded(estimate);
    now_ns += std::int64_t{input.take<std::uint8_t>()} * 1'000'000;
    guards.judge(estimate, steps >> 3U & 3U, now_ns);
    statistics.add(estimate, now_ns);
    check_shape(estimate, input.take<float>());
    if ((steps & 128U) != 0 && ++printed <= 2) {  // what takes longest
      demand(!to_json(estimate).dump(-1, ' ', false, nlohmann::json::error_handler_t::strict).empty());
      demand(!line_of(estimate, now_ns).empty());
    }
  }
  statistics.print();
  return 0;
}
