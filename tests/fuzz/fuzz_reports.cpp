// The other topics as a forger makes them: words, JSON and the exporter's metrics of any reports. DDS's
// decoder has made sure of the types: texts end and booleans are 0 or 1.
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/exporter/metrics_text.hpp"
#include "clients/tubectl/watch/sample_text.hpp"
#include "tests/fuzz/fuzz_input.hpp"

using namespace tubed;
using namespace tubed::fuzz;

namespace {

template <std::size_t Size>
void end_text(char (&text)[Size]) {
  text[Size - 1] = '\0';
}

void make_decoded(tubed_EmSamples& samples) { end_text(samples.instrument_id); }

void make_decoded(tubed_TubeStatus& status) {
  end_text(status.instrument_id);
  for (tubed_StageStatus& stage : status.stages) {
    end_text(stage.name);
    end_text(stage.why);
  }
}

void make_boolean(bool& value) {
  std::uint8_t byte = 0;
  std::memcpy(&byte, &value, 1);
  value = (byte & 1U) != 0;
}

void make_decoded(tubed_TubeHealth& health) {
  end_text(health.instrument_id);
  make_boolean(health.agreement.disagree);
  for (tubed_StageHealth& stage : health.stages) {
    end_text(stage.name);
    make_boolean(stage.allocations_counted);
  }
}

void make_decoded(tubed_TubeIdentity& identity) {
  end_text(identity.instrument_id);
  end_text(identity.software_version);
  end_text(identity.configuration_digest);
  end_text(identity.mode);
  end_text(identity.world_frame);
  end_text(identity.world_axes);
  for (tubed_CameraIdentity& camera : identity.cameras) {
    end_text(camera.name);
  }
  end_text(identity.tracker.firmware);
  end_text(identity.tracker.api_revision);
  end_text(identity.tracker.control_unit_serial);
  end_text(identity.tracker.field_generator);
  for (tubed_ToolIdentity& tool : identity.tracker.tools) {
    end_text(tool.part_number);
  }
}

template <typename Sample>
Sample drawn(FuzzInput& input) {
  Sample sample{};
  const auto bytes = std::as_writable_bytes(std::span(&sample, 1));
  for (int changes = input.take<std::uint8_t>() % 32; changes > 0; --changes) {
    const std::size_t offset = input.take<std::uint16_t>() % sizeof(sample);
    input.take_into(bytes.subspan(offset, std::min<std::size_t>(8, sizeof(sample) - offset)));
  }
  make_decoded(sample);
  return sample;
}

template <typename Sample>
void print(const Sample& sample) {
  demand(!to_json(sample).dump(-1, ' ', false, nlohmann::json::error_handler_t::strict).empty());
  demand(!line_of(sample).empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzInput input(data, size);
  const std::uint8_t which = input.take<std::uint8_t>() % 3;
  if (which == 0) {
    print(drawn<tubed_EmSamples>(input));
  } else if (which == 1) {
    print(drawn<tubed_TubeIdentity>(input));
  } else {
    static InstrumentReports reports;
    reports = {drawn<tubed_TubeStatus>(input), drawn<tubed_TubeHealth>(input), input.take<std::int64_t>(),
               input.take<std::int64_t>()};
    print(reports.status);
    print(reports.health);
    const std::map<std::string, InstrumentReports> instruments{{reports.status.instrument_id, reports}};
    demand(!metrics_text(instruments, 1'000'000'000'000).empty());
  }
  return 0;
}
