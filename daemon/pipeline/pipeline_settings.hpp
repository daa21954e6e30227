// What can be set about threads and timing, and the keys that set it.
#pragma once

#include <chrono>
#include <vector>

#include "idl/settings/bound_key.hpp"

namespace tubed {

/// Scheduling of one kind of stage.
struct ThreadSettings {
  int fifo_priority = 0;  ///< SCHED_FIFO priority 1 .. 99; 0 = leave the default scheduling
  std::vector<int> cpus;  ///< CPUs it may run on; empty = all
};

struct PipelineSettings {
  double rate_hz = 30;              ///< estimates a second, whatever happens
  double tick_grace_ms = 10;        ///< how long a slot waits for its image before the clock fills it
  double image_stale_ms = 500;      ///< images are stale after two of their periods, at the latest after this
  double em_stale_ms = 150;         ///< of the estimators: an estimate is due when measurements become stale
  double reconnect_first_ms = 100;  ///< back-off after a source is lost, doubled up to ..
  double reconnect_last_ms = 2000;  ///< .. this
  bool scheduling_optional = true;  ///< true: refused scheduling is reported, false: it is a start-up error
  ThreadSettings em_acquisition;
  ThreadSettings image_grab;
  ThreadSettings frangi;
  ThreadSettings view;
  ThreadSettings optimizer;
  ThreadSettings publisher;
};

/// Keys of [daemon].
inline BoundKeys<PipelineSettings> rate_keys() {
  using S = PipelineSettings;
  return {key::number("rate_hz", &S::rate_hz, "Hz", {1, 120},
                      "estimates a second, whatever happens; of faster images the newest are used"),
          key::number("tick_grace_ms", &S::tick_grace_ms, "ms", {0, 500},
                      "how long a slot waits for its image before the clock fills it")};
}

/// Keys of [em].
inline BoundKeys<PipelineSettings> back_off_keys() {
  using S = PipelineSettings;
  return {key::number("reconnect_first_ms", &S::reconnect_first_ms, "ms", {10, 60000},
                      "back-off after a source is lost, doubled up to reconnect_last_ms; images too"),
          key::number("reconnect_last_ms", &S::reconnect_last_ms, "ms", {10, 60000}, "longest back-off")};
}

/// Keys of [estimator].
inline BoundKeys<PipelineSettings> image_timeout_keys() {
  return {key::number("image_stale_ms", &PipelineSettings::image_stale_ms, "ms", {20, 5000},
                      "IMAGE_STALE after two image periods without one, at the latest after this")};
}

/// Keys of [realtime].
inline BoundKeys<PipelineSettings> scheduling_keys() {
  return {key::word("scheduling", &PipelineSettings::scheduling_optional,
                    {{true, "optional"}, {false, "required"}},
                    "whether the daemon starts when the system refuses a priority or CPU set")};
}

/// Keys of each table below [realtime]; `last_cpu` of this machine, counted from 0.
inline BoundKeys<ThreadSettings> thread_keys(double last_cpu) {
  using S = ThreadSettings;
  constexpr std::size_t kMaxCpus = 1024;
  return {key::number("priority", &S::fifo_priority, "", {0, 99},
                      "SCHED_FIFO priority; 0 = leave the default scheduling"),
          key::numbers("cpus", &S::cpus, "", {0, last_cpu}, {0, kMaxCpus},
                       "CPUs it may run on, counted from 0; empty = all")};
}

/// The tables below [realtime]: name, whose scheduling, meaning.
struct StageTable {
  const char* name;
  ThreadSettings PipelineSettings::*stage;
  const char* meaning;
};
inline constexpr std::array<StageTable, 6> kStageTables{
    {{"em_acquisition", &PipelineSettings::em_acquisition, "the thread that reads the EM tracker"},
     {"image_grab", &PipelineSettings::image_grab, "the threads that read the fluoroscope, one a camera"},
     {"frangi", &PipelineSettings::frangi, "the threads that filter images, one a camera"},
     {"view", &PipelineSettings::view, "the threads that watch whether a view has moved, one a camera"},
     {"optimizer", &PipelineSettings::optimizer, "the thread that solves for the shapes"},
     {"publisher", &PipelineSettings::publisher, "the thread that publishes"}}};

}  // namespace tubed
