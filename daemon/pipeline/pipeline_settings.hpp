// What can be set about threads and timing.
#pragma once

#include <chrono>
#include <vector>

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
  ThreadSettings optimizer;
  ThreadSettings publisher;
};

}  // namespace tubed
