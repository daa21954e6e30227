// The subscriber's reader of estimates in shared memory against a writer that does anything to its memory.
#include <array>
#include <cmath>

#include "clients/cpp/shm_tube_reader.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "tests/fuzz/foreign_writer.hpp"

using namespace tubed;
using namespace tubed::fuzz;

namespace {

/// A small proper estimate of now, with what the input changes of it.
void publish(ForeignSegment& segment, FuzzInput& input) {
  static tubed_shm_estimate estimate;
  estimate = {};
  estimate.instrument_id[0] = 'c';
  estimate.sequence_number = 1;
  estimate.point_count = 3;
  estimate.coefficient_count = 5;
  estimate.coil_count = 2;
  const auto bytes = std::as_writable_bytes(std::span(&estimate, 1));
  for (int changes = input.take<std::uint8_t>() % 8; changes > 0; --changes) {
    const std::size_t offset = input.take<std::uint16_t>() % sizeof(estimate);
    input.take_into(bytes.subspan(offset, std::min<std::size_t>(8, sizeof(estimate) - offset)));
  }
  segment.ring().publish(bytes, to_ns(monotonic_now()));
}

/// Everything that a C program would do with it stays within its arrays.
void check(const tubed_shm_estimate& estimate) {
  demand(std::memchr(estimate.instrument_id, '\0', sizeof(estimate.instrument_id)) != nullptr);
  demand(estimate.point_count <= std::size(estimate.points));
  demand(estimate.coefficient_count <= std::size(estimate.coefficients_mm));
  demand(estimate.coil_count <= std::size(estimate.coils));
  demand(estimate.view_count <= std::size(estimate.views));
  const bool both = estimate.has_image && estimate.is_image_instant &&
                    estimate.views[0].has_own_geometry;  // reads them as bool
  static_cast<void>(both);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static ForeignDoor door("estimate");
  FuzzInput input(data, size);
  const std::uint8_t flags = input.take<std::uint8_t>();
  const std::uint32_t slots = 2U + (flags >> 6U);
  ForeignSegment segment({slots, sizeof(tubed_shm_estimate)},
                         {TUBED_SHM_ESTIMATES, TUBED_SHM_ESTIMATES_VERSION, "tubed", 1},
                         to_ns(monotonic_now()));
  door.hand_out(segment.descriptor(), greeting_of(input, (flags & 1U) == 0));
  for (int pokes = flags >> 2U & 15U; pokes > 0; --pokes) {
    segment.poke(input);
  }
  ShmTubeReader reader({.socket = door.path(),
                        .instrument_id = "",
                        .delivery = (flags & 2U) != 0 ? ShmDelivery::kEvery : ShmDelivery::kNewest,
                        .trusted = {}});
  static_cast<void>(reader.wait_for(std::chrono::milliseconds(1)));
  for (int steps = 0; steps < 64 && !input.empty(); ++steps) {
    const std::uint8_t step = input.take<std::uint8_t>();
    if (step % 4 == 0) {
      segment.poke(input);
    } else if (step % 4 == 1) {
      publish(segment, input);
    } else {
      const ShmTubeNews news = reader.wait_for(std::chrono::milliseconds(0));
      demand((news.event == ShmTubeEvent::kEstimate) == (news.estimate != nullptr));
      if (news.estimate != nullptr) {
        check(*news.estimate);
      }
    }
  }
  return 0;
}
