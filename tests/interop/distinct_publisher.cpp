// Publishes the distinct values on all five topics, 30 times a second, for at most 30 s; with DDS Security
// when a folder of keys is given.
#include <chrono>
#include <thread>

#include "daemon/publishing/dds_publisher.hpp"
#include "tests/daemon/publishing/distinct_values.hpp"

int main(int argc, char** argv) {
  tubed::DdsSettings settings;
  if (argc > 1) settings.security = argv[1];
  tubed::DdsPublisher publisher(settings, {tubed::distinct_identity("catheter")});
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
