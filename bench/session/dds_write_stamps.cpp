// Loaded with LD_PRELOAD: takes the time before and after dds_write of a TubeEstimate. See
// written_estimates.hpp.
#include <dds/dds.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <ctime>

#include "TubeEstimate.h"
#include "bench/session/written_estimates.hpp"

namespace {

using tubed::WrittenEstimate;
using tubed::WrittenEstimatesHead;
using Write = dds_return_t (*)(dds_entity_t, const void*);

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

WrittenEstimatesHead* open_file() {
  const char* path = std::getenv(tubed::kWrittenEstimatesVariable);
  const int file = path != nullptr ? open(path, O_RDWR | O_CLOEXEC) : -1;
  struct stat about {};
  if (file < 0 || fstat(file, &about) != 0) return nullptr;
  void* memory = mmap(nullptr, static_cast<std::size_t>(about.st_size), PROT_READ | PROT_WRITE,
                      MAP_SHARED | MAP_POPULATE, file, 0);
  close(file);
  return memory == MAP_FAILED ? nullptr : static_cast<WrittenEstimatesHead*>(memory);
}

bool writes_estimates(dds_entity_t writer) {
  char name[64] = {};
  return dds_get_name(dds_get_topic(writer), name, sizeof name) > 0 && std::strcmp(name, "TubeEstimate") == 0;
}

void note(WrittenEstimatesHead* head, const tubed_TubeEstimate& estimate, std::int64_t called_ns,
          std::int64_t returned_ns) {
  if (head->count >= head->most) return;
  const char* dash = std::strrchr(estimate.instrument_id, '-');
  const tubed_StageStamps& stamps = estimate.stamps;
  reinterpret_cast<WrittenEstimate*>(head + 1)[head->count] = {
      estimate.sequence_number,
      dash != nullptr ? static_cast<std::uint32_t>(std::atoi(dash + 1)) : 0,
      estimate.image_frame,
      estimate.validity,
      estimate.has_image ? 1U : 0U,
      stamps.exposure_monotonic_ns,
      stamps.image_grabbed_monotonic_ns,
      stamps.frangi_started_monotonic_ns,
      stamps.frangi_finished_monotonic_ns,
      stamps.em_measured_monotonic_ns,
      stamps.optimizer_started_monotonic_ns,
      stamps.optimizer_finished_monotonic_ns,
      stamps.publish_started_monotonic_ns,
      called_ns,
      returned_ns};
  // release: a reader of the count reads whole entries.
  __atomic_store_n(&head->count, head->count + 1, __ATOMIC_RELEASE);
}

}  // namespace

extern "C" dds_return_t dds_write(dds_entity_t writer, const void* sample) {
  static const auto real = reinterpret_cast<Write>(dlsym(RTLD_NEXT, "dds_write"));
  static WrittenEstimatesHead* const head = open_file();
  static dds_entity_t estimate_writer = 0;  // the daemon has one, and one thread that publishes
  if (estimate_writer == 0 && writes_estimates(writer)) estimate_writer = writer;
  if (head == nullptr || writer != estimate_writer) return real(writer, sample);
  const std::int64_t called_ns = monotonic_ns();
  const dds_return_t result = real(writer, sample);
  note(head, *static_cast<const tubed_TubeEstimate*>(sample), called_ns, monotonic_ns());
  return result;
}
