// Publishes the distinct values on all five topics, 30 times a second, for at most 30 s.
#include <chrono>
#include <thread>

#include "daemon/publishing/dds_publisher.hpp"
#include "tests/daemon/publishing/distinct_values.hpp"

int main() {
  tubed::DdsPublisher publisher({}, {tubed::distinct_identity("catheter")});
  const tubed::NamedStageReport stage = tubed::distinct_stage();
  const tubed::ClockPair now{.monotonic_ns = 1'000'000, .realtime_ns = 5'000'000};
  for (int i = 0; i < 900; ++i) {
    publisher.publish(tubed::distinct_estimate(), now);
    publisher.publish_em(0, tubed::distinct_em_samples(), now);
    publisher.publish_status(0, tubed::distinct_status(), {&stage, 1}, now);
    publisher.publish_health(0, tubed::distinct_health(), {&stage, 1}, now);
    std::this_thread::sleep_for(std::chrono::milliseconds(33));
  }
}
