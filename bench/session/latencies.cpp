#include "bench/session/latencies.hpp"

#include <algorithm>
#include <map>

namespace tubed {

namespace {

double ms(std::int64_t ns) { return static_cast<double>(ns) / 1e6; }

/// Exposures that count, by frame number.
std::map<std::uint32_t, std::int64_t> exposures_of(const SessionRecord& record) {
  std::map<std::uint32_t, std::int64_t> exposures;
  for (const InjectedImage& image : record.images) exposures.emplace(image.frame, image.exposure_ns);
  return exposures;
}

/// Estimates of the first instrument made from an image that counts.
std::vector<WrittenEstimate> image_estimates(const SessionRecord& record) {
  const auto exposures = exposures_of(record);
  std::vector<WrittenEstimate> kept;
  for (const WrittenEstimate& written : record.written) {
    if (written.instrument == 1 && written.has_image != 0 && exposures.contains(written.image_frame)) {
      kept.push_back(written);
    }
  }
  return kept;
}

void add(TimedValues& values, const SessionRecord& record, std::int64_t when_ns, double value) {
  values.values.push_back(value);
  values.t_s.push_back(static_cast<double>(when_ns - record.start_ns) / 1e9);
}

}  // namespace

void TimedValues::append(const TimedValues& later, double shift_s) {
  values.insert(values.end(), later.values.begin(), later.values.end());
  for (const double t : later.t_s) t_s.push_back(t + shift_s);
}

TimedValues exposure_to_written(const SessionRecord& record) {
  const auto exposures = exposures_of(record);
  TimedValues values;
  for (const WrittenEstimate& written : image_estimates(record)) {
    const std::int64_t exposure_ns = exposures.at(written.image_frame);
    add(values, record, exposure_ns, ms(written.write_returned_ns - exposure_ns));
  }
  return values;
}

TimedValues exposure_to_received(const SessionRecord& record, const std::vector<ReceivedEstimate>& received) {
  const auto exposures = exposures_of(record);
  TimedValues values;
  for (const ReceivedEstimate& estimate : received) {
    const auto exposure = exposures.find(estimate.image_frame);
    if (estimate.has_image != 0 && exposure != exposures.end()) {
      add(values, record, exposure->second, ms(estimate.received_ns - exposure->second));
    }
  }
  return values;
}

TimedValues exposure_to_newer_shape(const SessionRecord& record) {
  TimedValues values;
  const std::vector<WrittenEstimate> estimates = image_estimates(record);
  auto estimate = estimates.begin();
  for (const InjectedImage& image : record.images) {
    while (estimate != estimates.end() && estimate->image_frame < image.frame) ++estimate;
    if (estimate == estimates.end()) break;
    add(values, record, image.exposure_ns, ms(estimate->write_returned_ns - image.exposure_ns));
  }
  return values;
}

std::vector<StageTimes> stage_times(const SessionRecord& record) {
  using Stamp = std::int64_t WrittenEstimate::*;
  struct Stage {
    const char* name;
    Stamp from;
    Stamp to;
  };
  constexpr Stage kStages[] = {
      {"grab", &WrittenEstimate::exposure_ns, &WrittenEstimate::image_grabbed_ns},
      {"wake frangi", &WrittenEstimate::image_grabbed_ns, &WrittenEstimate::frangi_started_ns},
      {"frangi", &WrittenEstimate::frangi_started_ns, &WrittenEstimate::frangi_finished_ns},
      {"wake optimizer", &WrittenEstimate::frangi_finished_ns, &WrittenEstimate::optimizer_started_ns},
      {"optimizer", &WrittenEstimate::optimizer_started_ns, &WrittenEstimate::optimizer_finished_ns},
      {"wake publisher", &WrittenEstimate::optimizer_finished_ns, &WrittenEstimate::write_called_ns},
      {"dds_write", &WrittenEstimate::write_called_ns, &WrittenEstimate::write_returned_ns}};
  std::vector<StageTimes> all;
  for (const Stage& stage : kStages) {
    StageTimes times{stage.name, {}};
    for (const WrittenEstimate& written : image_estimates(record)) {
      add(times.times, record, written.exposure_ns, ms(written.*stage.to - written.*stage.from));
    }
    all.push_back(std::move(times));
  }
  return all;
}

ImageCounts count_images(const SessionRecord& record, double period_ms) {
  ImageCounts counts;
  counts.injected = static_cast<double>(record.images.size());
  const TimedValues written = exposure_to_written(record);
  counts.used = static_cast<double>(written.values.size());
  counts.superseded = counts.injected - counts.used;
  counts.late = static_cast<double>(std::count_if(written.values.begin(), written.values.end(),
                                                  [=](double value) { return value > period_ms; }));
  return counts;
}

double lost_of(const std::vector<ReceivedEstimate>& received) {
  double lost = 0;
  for (std::size_t i = 1; i < received.size(); ++i) lost += static_cast<double>(received[i].lost_before);
  return lost;
}

TimedValues cpu_percent(const SessionRecord& record) {
  TimedValues values;
  for (std::size_t i = 1; i < record.costs.size(); ++i) {
    const ProcessCosts& before = record.costs[i - 1];
    const ProcessCosts& now = record.costs[i];
    values.values.push_back(100 * (now.cpu_s - before.cpu_s) / (now.t_s - before.t_s));
    values.t_s.push_back(now.t_s);
  }
  return values;
}

TimedValues cpu_ms_a_shape(const SessionRecord& record) {
  TimedValues values;
  const std::size_t shapes = image_estimates(record).size();
  if (shapes > 0 && record.costs.size() > 1) {
    const double spent_s = record.costs.back().cpu_s - record.costs.front().cpu_s;
    values.values.push_back(1000 * spent_s / static_cast<double>(shapes));
    values.t_s.push_back(0);
  }
  return values;
}

TimedValues resident_mb(const SessionRecord& record) {
  TimedValues values;
  for (const ProcessCosts& costs : record.costs) {
    values.values.push_back(costs.resident_mb);
    values.t_s.push_back(costs.t_s);
  }
  return values;
}

}  // namespace tubed
