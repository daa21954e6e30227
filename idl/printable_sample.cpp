#include "idl/printable_sample.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "idl/printable_text.hpp"

namespace tubed {
namespace {

template <std::size_t size>
void clean(char (&text)[size]) noexcept {
  std::array<char, size> shown{};
  copy_printable(std::string_view(text, static_cast<std::size_t>(std::find(text, text + size, '\0') - text)),
                 shown);
  std::copy(shown.begin(), shown.end(), text);
}

template <typename Stage, std::size_t size>
void clean_names(Stage (&stages)[size]) noexcept {
  for (Stage& stage : stages) clean(stage.name);
}

}  // namespace

void make_printable(tubed_TubeEstimate& sample) noexcept { clean(sample.instrument_id); }

void make_printable(tubed_EmSamples& sample) noexcept { clean(sample.instrument_id); }

void make_printable(tubed_TubeStatus& sample) noexcept {
  clean(sample.instrument_id);
  clean_names(sample.stages);
  for (tubed_StageStatus& stage : sample.stages) clean(stage.why);
}

void make_printable(tubed_TubeIdentity& sample) noexcept {
  clean(sample.instrument_id);
  clean(sample.software_version);
  clean(sample.configuration_digest);
  clean(sample.mode);
  clean(sample.world_frame);
  clean(sample.world_axes);
  clean_names(sample.cameras);
  clean(sample.tracker.firmware);
  clean(sample.tracker.api_revision);
  clean(sample.tracker.control_unit_serial);
  clean(sample.tracker.field_generator);
  for (tubed_ToolIdentity& tool : sample.tracker.tools) clean(tool.part_number);
}

void make_printable(tubed_TubeHealth& sample) noexcept {
  clean(sample.instrument_id);
  clean_names(sample.stages);
}

}  // namespace tubed
