// The processes around a contestant: the source of the images, and the subscribers.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>

#include "bench/session/session.hpp"
#include "bench/support/child_process.hpp"

namespace tubed {

using IsOver = std::function<bool()>;

/// A frame grabber's program: exposure k at start_ns + k / rate, `count` of them, every camera.
void grab_images(const Scene& scene, const std::filesystem::path& folder, std::int64_t start_ns,
                 std::int64_t count, SharedLog<InjectedImage>& log);

/// Both receive all that comes and note the first instrument's. `pause_ms` > 0: they look so rarely only.
void listen_to_dds(int domain, int pause_ms, const IsOver& is_over, SharedLog<ReceivedEstimate>& log);
void listen_to_shm(const std::filesystem::path& folder, const IsOver& is_over,
                   SharedLog<ReceivedEstimate>& log);

/// Allocations of one stage's thread since the daemon's start.
struct StageAllocations {
  std::int64_t received_ns;
  std::array<char, 32> stage;
  std::uint64_t allocations;
};
void listen_to_health(int domain, const IsOver& is_over, SharedLog<StageAllocations>& log);

/// Computes until the end.
void hog_cpu(const IsOver& is_over);

}  // namespace tubed
