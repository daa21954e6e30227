// A real tubed process, fed with images at fixed instants through shared memory and with coils by the replay
// driver, and listened to by other processes. Everything is stamped on CLOCK_MONOTONIC of one machine.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bench/session/process_costs.hpp"
#include "bench/session/scene.hpp"
#include "bench/session/written_estimates.hpp"

namespace tubed {

/// What turns images and coils into estimates.
enum class Contestant {
  kDaemon,     ///< the program tubed
  kPaperLoop,  ///< the paper's loop: one thread that grabs, filters with OpenCV, solves as printed, publishes
};

struct SessionPlan {
  Contestant contestant = Contestant::kDaemon;
  double warm_up_s = 2;
  double seconds = 10;  ///< that count
  int dds_subscribers = 1;
  int shm_subscribers = 1;
  int slow_subscribers = 0;     ///< look once in 500 ms only
  int hogs = 0;                 ///< processes that do nothing but compute
  bool watches_health = false;  ///< one more process, which reads TubeHealth once a second
  bool keep_to_one_cpu = true;  ///< the contestant; everybody else is kept off it where there are more
};

/// One image as the grabber's process gave it. The instant of exposure is the intended one, whenever the
/// grabber really came to it: what made it late counts too.
struct InjectedImage {
  std::uint32_t frame;
  std::int64_t exposure_ns;
  std::int64_t put_started_ns;
  std::int64_t put_finished_ns;
};

/// One estimate of the first instrument as a subscriber had it.
struct ReceivedEstimate {
  std::uint64_t sequence_number;
  std::uint32_t image_frame;
  std::uint32_t has_image;
  std::int64_t received_ns;
  std::uint64_t lost_before;
};

/// What happened, only of the time that counts.
struct SessionRecord {
  std::int64_t start_ns = 0;  ///< when the counting begins
  std::vector<InjectedImage> images;
  std::vector<WrittenEstimate> written;                 ///< of all instruments
  std::vector<std::vector<ReceivedEstimate>> over_dds;  ///< one a subscriber
  std::vector<std::vector<ReceivedEstimate>> over_shm;
  std::vector<ProcessCosts> costs;                   ///< of the contestant, once a second
  std::map<std::string, double> thread_allocations;  ///< by stage, from TubeHealth, when watched
};

/// Runs one session; forks, so call it in a process without threads and DDS, in a network of its own. Throws
/// std::runtime_error with the daemon's log when it ends before its time.
SessionRecord run_session(const Scene& scene, const SessionPlan& plan);

}  // namespace tubed
