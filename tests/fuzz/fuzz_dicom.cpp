// A file that is taken for a fluoroscopic run. DCMTK itself is Debian's and not instrumented: its allocations
// and what is made of what it gives are watched, its own reads are not.
#include <sys/mman.h>
#include <unistd.h>

#include <string>

#include "clients/dicom/dicom_run.hpp"
#include "tests/fuzz/fuzz_input.hpp"

using namespace tubed;
using namespace tubed::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const int file = memfd_create("tubed-fuzz", MFD_CLOEXEC);
  static const std::string path = "/proc/self/fd/" + std::to_string(file);
  demand(file >= 0 && ftruncate(file, 0) == 0);
  demand(pwrite(file, data, size, 0) == static_cast<ssize_t>(size));
  constexpr std::uintmax_t kMemoryLimit = std::uintmax_t{4} << 20;
  try {
    const DicomRun run = read_dicom_run(path, {.rate_hz = 0, .memory_limit = kMemoryLimit});
    demand(run.width > 0 && run.height > 0 && !run.frames.empty() && run.period_s > 0);
    const std::size_t bytes = static_cast<std::size_t>(run.width) * static_cast<std::size_t>(run.height) *
                              (run.depth == PixelDepth::kGrey8 ? 1 : 2);
    double before_s = 0;
    for (const DicomFrame& frame : run.frames) {
      demand(frame.pixels.size() == bytes);
      demand(frame.t_s >= before_s);
      before_s = frame.t_s;
    }
    demand(bytes * run.frames.size() <= kMemoryLimit);
  } catch (const DicomError& error) {
    demand(std::string_view(error.what()).find(path) == 0);
  }
  return 0;
}
