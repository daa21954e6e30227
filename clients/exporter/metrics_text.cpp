#include "clients/exporter/metrics_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iterator>
#include <string_view>
#include <vector>

#include "idl/printable_text.hpp"
#include "idl/validity.hpp"

namespace tubed {

namespace {

// Both reports come once a second, the status sooner when something is wrong: its age is what up depends on.
constexpr std::int64_t kStatusSilence_ns = 1'500'000'000;
constexpr std::int64_t kHealthSilence_ns = 3'000'000'000;
// Of the 96 quarter octaves every fourth edge is exported: 2, 4, 8 us ...
constexpr std::size_t kEdgeStep = 4;

using Alive = std::vector<const InstrumentReports*>;

/// Prometheus takes labels of UTF-8 only; a line break in one would be another metric.
std::string escaped(std::string_view text) {
  std::string escaped;
  for (const char letter : printable_text(text)) {
    if (letter == '\\' || letter == '"') escaped += '\\';
    escaped += letter;
  }
  return escaped;
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

std::string label(std::string_view name, std::string_view value) {
  return std::string(name) + "=\"" + escaped(value) + "\"";
}

std::string without_numbers(std::string_view words) {
  std::string text;
  for (const char letter : words) {
    const bool is_digit = letter >= '0' && letter <= '9';
    if (!is_digit || text.empty() || text.back() != '#') text += is_digit ? '#' : letter;
  }
  return text;
}

/// One family of metrics, written line by line.
class Family {
 public:
  Family(std::string& text, std::string name, std::string_view type, std::string_view help)
      : text_(text), name_(std::move(name)) {
    text_ +=
        "# HELP " + name_ + " " + std::string(help) + "\n# TYPE " + name_ + " " + std::string(type) + "\n";
  }

  void add(const std::string& labels, double value) { line("", labels, value); }

  void add(const std::string& labels, const tubed_LatencyHistogram& histogram) {
    double counted = 0;
    double seconds = 0;
    for (std::size_t i = 0; i < std::size(histogram.buckets); ++i) {
      const double edge_s = 1e-6 * std::exp2((static_cast<double>(i) + 1) / 4);
      counted += histogram.buckets[i];
      seconds += histogram.buckets[i] * edge_s * std::exp2(-1.0 / 8);  // the middle of the bucket, by ratio
      const bool is_last = i + 1 == std::size(histogram.buckets);
      if ((i + 1) % kEdgeStep == 0 && !is_last) {
        line("_bucket", labels + "," + label("le", number(edge_s)), counted);
      }
    }
    line("_bucket", labels + "," + label("le", "+Inf"), counted);
    line("_sum", labels, seconds);
    line("_count", labels, counted);
  }

 private:
  void line(std::string_view suffix, const std::string& labels, double value) {
    text_ += name_ + std::string(suffix) + "{" + labels + "} " + number(value) + "\n";
  }

  std::string& text_;
  std::string name_;
};

std::string labels_of(const InstrumentReports& reports) {
  return label("instrument", reports.health.instrument_id);
}

std::string labels_of(const InstrumentReports& reports, std::string_view stage) {
  return labels_of(reports) + "," + label("stage", stage);
}

void write_validity(std::string& text, const Alive& alive) {
  Family validity(
      text, "tubed_validity", "gauge",
      "1 for the validity of the newest estimate, 0 for the others; NOT_AVAILABLE when that is old.");
  for (const InstrumentReports* reports : alive) {
    for (std::uint32_t word = 0; word < 4; ++word) {
      validity.add(labels_of(*reports) + "," + label("validity", name_of(static_cast<Validity>(word))),
                   reports->status.validity == word ? 1 : 0);
    }
  }
  Family age(
      text, "tubed_estimate_age_seconds", "gauge",
      "Age of the newest estimate that was written, when the daemon last reported; none before the first.");
  for (const InstrumentReports* reports : alive) {
    if (reports->status.estimate_age_ns >= 0) {
      age.add(labels_of(*reports), static_cast<double>(reports->status.estimate_age_ns) * 1e-9);
    }
  }
  Family reason(text, "tubed_reason", "gauge", "1 for each reason of the newest estimate, 0 for the others.");
  for (const InstrumentReports* reports : alive) {
    for (int bit = 0; bit < kReasonCount; ++bit) {
      const auto each = static_cast<Reason>(1U << static_cast<unsigned>(bit));
      reason.add(labels_of(*reports) + "," + label("reason", name_of(each)),
                 Reasons(reports->status.reasons).has(each) ? 1 : 0);
    }
  }
}

void write_estimates(std::string& text, const Alive& alive) {
  Family estimates(text, "tubed_estimates_total", "counter", "Estimates published, by validity.");
  for (const InstrumentReports* reports : alive) {
    for (std::uint32_t word = 0; word < 4; ++word) {
      estimates.add(labels_of(*reports) + "," + label("validity", name_of(static_cast<Validity>(word))),
                    reports->health.validity_counts[word]);
    }
  }
  Family latency(
      text, "tubed_exposure_to_publish_seconds", "histogram",
      "From mid exposure to publishing, of estimates with an image; the sum is of the buckets' middles.");
  for (const InstrumentReports* reports : alive) {
    latency.add(labels_of(*reports), reports->health.exposure_to_publish);
  }
}

// Nothing of it before coils and images were compared.
void write_agreement(std::string& text, const Alive& alive) {
  constexpr std::string_view kExplanations[]{
      "none",  "registration", "arc lengths",          "clock",    "magnification",
      "field", "coil",         "arc length of a coil", "negative", "mirrored"};
  Alive compared;
  std::copy_if(alive.begin(), alive.end(), std::back_inserter(compared),
               [](const InstrumentReports* reports) { return reports->health.agreement.probability > 0; });
  const auto gauge = [&](const char* name, const char* help, const auto& value_of) {
    Family family(text, name, "gauge", help);
    for (const InstrumentReports* reports : compared) {
      family.add(labels_of(*reports), value_of(reports->health.agreement));
    }
  };
  const auto length = [](const float(&v)[3]) { return static_cast<double>(std::hypot(v[0], v[1], v[2])); };
  using Agreement = tubed_EmImageAgreement;
  gauge("tubed_em_image_as_stated_ratio", "Probability that coils and images are as the configuration says.",
        [](const Agreement& a) { return static_cast<double>(a.as_stated); });
  gauge("tubed_em_image_shift_meters", "How far all coils are seen off together, in the middle of the tube.",
        [&](const Agreement& a) { return 1e-3 * length(a.shift_mm); });
  gauge("tubed_em_image_turn_radians", "How far all coils are seen turned together.",
        [&](const Agreement& a) { return length(a.turn_rad); });
  gauge("tubed_em_image_unsure_meters",
        "How far all coils may still be off together, root mean square; one view sees no depth.",
        [](const Agreement& a) { return 1e-3 * static_cast<double>(a.unsure_mm); });
  gauge("tubed_em_image_tube_end_meters", "The tube ends further out in the image than arc lengths say.",
        [](const Agreement& a) { return 1e-3 * static_cast<double>(a.end_mm); });
  gauge("tubed_em_image_clock_seconds", "Images are stamped too late by this, as seen.",
        [](const Agreement& a) { return static_cast<double>(a.clock_s); });
  Family explanation(text, "tubed_em_image_explanation", "gauge",
                     "1 for what explains best how coils and images lie to each other, 0 for the others.");
  for (const InstrumentReports* reports : compared) {
    for (std::uint32_t i = 0; i < std::size(kExplanations); ++i) {
      explanation.add(labels_of(*reports) + "," + label("explanation", kExplanations[i]),
                      reports->health.agreement.explanation == i ? 1 : 0);
    }
  }
}

void write_stage_ages(std::string& text, const Alive& alive) {
  Family age(text, "tubed_stage_age_seconds", "gauge",
             "Time since a stage gave a sign of life, when the daemon last reported; none before the first.");
  for (const InstrumentReports* reports : alive) {
    const std::size_t count =
        std::min<std::size_t>(reports->status.stage_count, std::size(reports->status.stages));
    for (std::size_t i = 0; i < count; ++i) {
      const tubed_StageStatus& stage = reports->status.stages[i];
      if (stage.age_ns >= 0) {
        age.add(labels_of(*reports, stage.name), static_cast<double>(stage.age_ns) * 1e-9);
      }
    }
  }
}

void write_states(std::string& text, const Alive& alive) {
  constexpr std::string_view kStates[]{"starting", "running", "degraded", "reconnecting", "ended", "failed"};
  Family state(text, "tubed_stage_state", "gauge", "1 for the state a stage is in, 0 for the others.");
  for (const InstrumentReports* reports : alive) {
    const std::size_t count =
        std::min<std::size_t>(reports->status.stage_count, std::size(reports->status.stages));
    for (std::size_t i = 0; i < count; ++i) {
      const tubed_StageStatus& stage = reports->status.stages[i];
      for (std::uint32_t word = 0; word < std::size(kStates); ++word) {
        state.add(labels_of(*reports, stage.name) + "," + label("state", kStates[word]),
                  stage.state == word ? 1 : 0);
      }
    }
  }
}

// TubeHealth carries what no stage counts as if it were one; see idl/README.md.
constexpr std::string_view kDds = "dds";
constexpr std::string_view kShmDoor = "shm-door";

using Visit = std::function<void(const InstrumentReports&, const tubed_StageHealth&)>;

void for_each_entry(const Alive& alive, const Visit& visit) {
  for (const InstrumentReports* reports : alive) {
    const std::size_t count =
        std::min<std::size_t>(reports->health.stage_count, std::size(reports->health.stages));
    for (std::size_t i = 0; i < count; ++i) visit(*reports, reports->health.stages[i]);
  }
}

void for_each_stage(const Alive& alive,
                    const std::function<void(const std::string&, const tubed_StageHealth&)>& visit) {
  for_each_entry(alive, [&](const InstrumentReports& reports, const tubed_StageHealth& stage) {
    if (stage.name != kDds && stage.name != kShmDoor) visit(labels_of(reports, stage.name), stage);
  });
}

/// Of the entry with that name, where there is one.
void for_entry(std::string_view name, const Alive& alive, const Visit& visit) {
  for_each_entry(alive, [&](const InstrumentReports& reports, const tubed_StageHealth& entry) {
    if (entry.name == name) visit(reports, entry);
  });
}

/// What the outside does: another writer, readers of shared memory, packets.
void write_edges(std::string& text, const Alive& alive) {
  Family rival(text, "tubed_rival_writer", "gauge", "1 while somebody else publishes this instrument too.");
  for (const InstrumentReports* reports : alive) {
    rival.add(labels_of(*reports), Reasons(reports->status.reasons).has(Reason::kRivalWriter) ? 1 : 0);
  }
  Family malformed(text, "tubed_malformed_packets_total", "counter", "Packets that DDS could not read.");
  for_entry(kDds, alive, [&](const InstrumentReports& reports, const tubed_StageHealth& dds) {
    malformed.add(labels_of(reports), static_cast<double>(dds.refused));
  });
  Family writes(text, "tubed_dds_writes_total", "counter",
                "Samples given to DDS, of all topics, by outcome.");
  for_entry(kDds, alive, [&](const InstrumentReports& reports, const tubed_StageHealth& dds) {
    writes.add(labels_of(reports) + "," + label("outcome", "written"), static_cast<double>(dds.outputs));
    writes.add(labels_of(reports) + "," + label("outcome", "refused"), static_cast<double>(dds.dropped));
  });
  Family readers(text, "tubed_shm_readers_total", "counter",
                 "Programs that asked for the shared memory, by outcome; throttled: they came too often.");
  for_entry(kShmDoor, alive, [&](const InstrumentReports& reports, const tubed_StageHealth& door) {
    readers.add(labels_of(reports) + "," + label("outcome", "admitted"), static_cast<double>(door.outputs));
    readers.add(labels_of(reports) + "," + label("outcome", "refused"), static_cast<double>(door.refused));
    readers.add(labels_of(reports) + "," + label("outcome", "throttled"), static_cast<double>(door.dropped));
  });
}

/// Of what is not well; numbers in the words become #, so that an age does not make a new series every
/// second.
void write_whys(std::string& text, const Alive& alive) {
  Family why(text, "tubed_stage_why", "gauge",
             "1 for a stage with something to say: an image refused, a source lost.");
  for (const InstrumentReports* reports : alive) {
    const std::size_t count =
        std::min<std::size_t>(reports->status.stage_count, std::size(reports->status.stages));
    for (std::size_t i = 0; i < count; ++i) {
      const tubed_StageStatus& stage = reports->status.stages[i];
      if (stage.why[0] == '\0') continue;
      why.add(labels_of(*reports, stage.name) + "," + label("why", without_numbers(stage.why)), 1);
    }
  }
}

void write_stages(std::string& text, const Alive& alive) {
  struct Counter {
    const char* name;
    const char* help;
    std::uint64_t tubed_StageHealth::*value;
    bool is_counted_only;  ///< where the daemon could not count, there is no sample
  };
  const Counter counters[]{
      {"steps", "Steps a stage has done.", &tubed_StageHealth::steps, false},
      {"outputs", "What a stage has handed on.", &tubed_StageHealth::outputs, false},
      {"dropped", "Superseded before use, or no room.", &tubed_StageHealth::dropped, false},
      {"refused", "Bad input, not used.", &tubed_StageHealth::refused, false},
      {"reconnects", "Reconnections of a source.", &tubed_StageHealth::reconnects, false},
      {"allocations", "Allocations of a stage's thread.", &tubed_StageHealth::allocations, true},
      {"locks", "Mutexes a stage's thread has taken.", &tubed_StageHealth::locks, true},
      {"exceptions", "Exceptions a stage's thread has thrown.", &tubed_StageHealth::exceptions, true},
  };
  for (const Counter& counter : counters) {
    Family family(text, "tubed_stage_" + std::string(counter.name) + "_total", "counter", counter.help);
    for_each_stage(alive, [&](const std::string& labels, const tubed_StageHealth& stage) {
      if (!counter.is_counted_only || stage.allocations_counted) {
        family.add(labels, static_cast<double>(stage.*counter.value));
      }
    });
  }
  Family busy(text, "tubed_stage_busy_seconds", "histogram",
              "How long a stage's steps took; the sum is of the buckets' middles.");
  for_each_stage(alive, [&](const std::string& labels, const tubed_StageHealth& stage) {
    busy.add(labels, stage.busy);
  });
}

}  // namespace

std::string metrics_text(const std::map<std::string, InstrumentReports>& instruments, std::int64_t now_ns) {
  std::string text;
  Alive alive;
  Family up(text, "tubed_up", "gauge", "Whether the daemon has reported on this instrument within 1.5 s.");
  for (const auto& [id, reports] : instruments) {
    const bool is_alive =
        reports.health_received_ns > 0 && now_ns - reports.health_received_ns <= kHealthSilence_ns &&
        reports.status_received_ns > 0 && now_ns - reports.status_received_ns <= kStatusSilence_ns;
    up.add(label("instrument", id), is_alive ? 1 : 0);
    if (is_alive) {
      alive.push_back(&reports);
    }
  }
  write_validity(text, alive);
  write_agreement(text, alive);
  write_estimates(text, alive);
  write_states(text, alive);
  write_stage_ages(text, alive);
  write_stages(text, alive);
  write_whys(text, alive);
  write_edges(text, alive);
  return text;
}

}  // namespace tubed
