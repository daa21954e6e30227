// Loaded in front of the C library (LD_PRELOAD): the wall clock of one process, shifted by the number of
// nanoseconds that stand in the file SHIFTED_CLOCK, which may change while the process runs. CLOCK_MONOTONIC
// is left alone: it never jumps.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>

#include <cstdint>
#include <cstdlib>

namespace {

using GetTime = int (*)(clockid_t, timespec*);

GetTime real_clock_gettime() {
  static const auto real = reinterpret_cast<GetTime>(dlsym(RTLD_NEXT, "clock_gettime"));
  return real;
}

const volatile std::int64_t* mapped_shift() {
  static constexpr std::int64_t kNone = 0;
  const char* file = std::getenv("SHIFTED_CLOCK");
  const int descriptor = file == nullptr ? -1 : open(file, O_RDONLY | O_CLOEXEC);
  void* memory =
      descriptor < 0 ? MAP_FAILED : mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, descriptor, 0);
  return memory == MAP_FAILED ? &kNone : static_cast<const volatile std::int64_t*>(memory);
}

std::int64_t shift_ns() {
  static const volatile std::int64_t* const shift = mapped_shift();
  return *shift;
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const int result = real_clock_gettime()(clock, time);
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    const std::int64_t now_ns = time->tv_sec * kSecond_ns + time->tv_nsec + shift_ns();
    time->tv_sec = now_ns / kSecond_ns;
    time->tv_nsec = now_ns % kSecond_ns;
  }
  return result;
}

extern "C" int gettimeofday(timeval* time, void*) noexcept {
  timespec now{};
  const int result = clock_gettime(CLOCK_REALTIME, &now);
  time->tv_sec = now.tv_sec;
  time->tv_usec = now.tv_nsec / 1000;
  return result;
}

extern "C" time_t time(time_t* out) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (out != nullptr) *out = now.tv_sec;
  return now.tv_sec;
}
