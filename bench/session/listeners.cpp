#include "bench/session/listeners.hpp"

#include <algorithm>
#include <cstring>
#include <memory>

#include "bench/support/exchange.hpp"
#include "clients/cpp/shm_image_writer.hpp"
#include "clients/cpp/shm_tube_reader.hpp"
#include "clients/cpp/topic_reader.hpp"
#include "clients/cpp/tube_subscriber.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kTimeout{50};
constexpr std::int64_t kBeatNs = 50'000'000;

bool is_first_instrument(const char* id) { return std::strcmp(id, "cath-1") == 0; }

template <typename Estimate>
ReceivedEstimate noted(const Estimate& estimate, std::int64_t received_ns, std::uint64_t lost_before) {
  return {estimate.sequence_number, estimate.image_frame, estimate.has_image ? 1U : 0U, received_ns,
          lost_before};
}

}  // namespace

void grab_images(const Scene& scene, const std::filesystem::path& folder, std::int64_t start_ns,
                 std::int64_t count, SharedLog<InjectedImage>& log) {
  std::vector<std::unique_ptr<ShmImageWriter>> writers;
  for (const CameraCalibration& camera : scene.room().cameras) {
    writers.push_back(
        std::make_unique<ShmImageWriter>(ShmImageWriterSettings{image_socket(folder, camera),
                                                                camera.name,
                                                                static_cast<std::uint32_t>(camera.width),
                                                                static_cast<std::uint32_t>(camera.height),
                                                                8,
                                                                {}}));
  }
  while (monotonic_ns() + kBeatNs < start_ns) {
    for (const auto& writer : writers) writer->beat();
    sleep_until_ns(monotonic_ns() + kBeatNs);
  }
  tubed_shm_image image{};
  image.origin = TUBED_SHM_SIMULATED;
  image.fluoroscopy_on = 1;
  image.depth_bits = 8;
  image.width = static_cast<std::uint32_t>(scene.settings().width);
  image.height = static_cast<std::uint32_t>(scene.settings().height);
  for (std::int64_t k = 0; k < count; ++k) {
    image.exposure_ns =
        start_ns + static_cast<std::int64_t>(static_cast<double>(k) * 1e9 / scene.settings().rate_hz);
    image.frame_number = static_cast<std::uint32_t>(k + 1);
    sleep_until_ns(image.exposure_ns);
    const std::int64_t started_ns = monotonic_ns();
    for (std::size_t i = 0; i < writers.size(); ++i) {
      writers[i]->put(image, scene.picture(static_cast<int>(i), k).data());
    }
    log.add({image.frame_number, image.exposure_ns, started_ns, monotonic_ns()});
  }
}

void listen_to_dds(int domain, int pause_ms, const IsOver& is_over, SharedLog<ReceivedEstimate>& log) {
  Subscription subscription;
  subscription.domain = domain;
  TubeSubscriber subscriber(subscription, Delivery::kEvery);
  while (!is_over()) {
    if (pause_ms > 0) sleep_until_ns(monotonic_ns() + pause_ms * std::int64_t{1'000'000});
    const TubeNews news = subscriber.wait_for(kTimeout);
    if (news.sample != nullptr && is_first_instrument(news.sample->estimate.instrument_id)) {
      log.add(noted(news.sample->estimate, news.sample->received_monotonic_ns, news.sample->lost_before));
    }
  }
}

void listen_to_shm(const std::filesystem::path& folder, const IsOver& is_over,
                   SharedLog<ReceivedEstimate>& log) {
  ShmTubeReader reader({estimates_socket(folder), "", ShmDelivery::kEvery, {}});
  while (!is_over()) {
    const ShmTubeNews news = reader.wait_for(kTimeout);
    if (news.estimate != nullptr && is_first_instrument(news.estimate->instrument_id)) {
      log.add(noted(*news.estimate, news.received_monotonic_ns, news.lost_before));
    }
  }
}

void listen_to_health(int domain, const IsOver& is_over, SharedLog<StageAllocations>& log) {
  Subscription subscription;
  subscription.domain = domain;
  subscription.instrument_id = "cath-1";
  TopicReader<tubed_TubeHealth> reader(subscription);
  while (!is_over()) {
    const tubed_TubeHealth* health = reader.wait_for(kTimeout);
    if (health == nullptr) continue;
    for (std::uint32_t i = 0; i < health->stage_count; ++i) {
      const tubed_StageHealth& stage = health->stages[i];
      if (!stage.allocations_counted) continue;
      StageAllocations entry{monotonic_ns(), {}, stage.allocations};
      std::strncpy(entry.stage.data(), stage.name, entry.stage.size() - 1);
      log.add(entry);
    }
  }
}

void hog_cpu(const IsOver& is_over) {
  volatile double sum = 0;
  while (!is_over()) {
    for (int i = 0; i < 1'000'000; ++i) sum = sum + 1e-9 * i;
  }
}

}  // namespace tubed
