// Nothing allocates once a source is made: not while its card is looked for, set up, delivers, decodes,
// fails, or is found anew.
#include <gtest/gtest.h>

#include "tests/drivers/v4l2/picture_bench.hpp"
#include "tests/drivers/v4l2/source_bench.hpp"
#include "tests/support/counted_allocations.hpp"

// libjpeg takes memory by malloc; the sanitizers have a malloc of their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  tubed::allocations += tubed::counting ? 1 : 0;
  return __libc_malloc(size);
}
#endif

namespace tubed {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// The fake card allocates; the source does not.
class UncountedDevice final : public VideoDevice {
  template <typename Call>
  auto uncounted(Call call) {
    const bool before = std::exchange(counting, false);
    const auto result = call();
    counting = before;
    return result;
  }

 public:
  explicit UncountedDevice(FakeCard& card) : device_(card) {}
  int open(const char* path) noexcept override {
    return uncounted([&] { return device_.open(path); });
  }
  void close() noexcept override {
    uncounted([&] { return device_.close(), 0; });
  }
  int control(unsigned long request, void* argument) noexcept override {
    return uncounted([&] { return device_.control(request, argument); });
  }
  std::span<const std::uint8_t> map(std::size_t bytes, std::uint32_t offset) noexcept override {
    return uncounted([&] { return device_.map(bytes, offset); });
  }
  void unmap(std::span<const std::uint8_t> buffer) noexcept override {
    uncounted([&] { return device_.unmap(buffer), 0; });
  }
  void wait(MonotonicTime deadline) noexcept override {
    uncounted([&] { return device_.wait(deadline), 0; });
  }
  void sleep(MonotonicTime deadline) noexcept override {
    uncounted([&] { return device_.sleep(deadline), 0; });
  }
  [[nodiscard]] MonotonicTime now() noexcept override { return device_.now(); }

 private:
  FakeVideoDevice device_;
};

TEST(NoAllocation, IsSeenByThisTest) {
  counting = true;
  allocations = 0;
  const std::vector<int> numbers(100);
  counting = false;
  EXPECT_GT(allocations, 0);
}

TEST(NoAllocation, HappensInASourceWhateverHappensToItsCard) {
  counting = false;
  SourceBench bench;
  bench.settings.coding.is_limited = true;
  bench.frame.reserve(bench.camera.width, bench.camera.height);
  V4l2ImageSource source(bench.camera, bench.settings, std::make_unique<UncountedDevice>(bench.card));
  source.open();
  allocations = 0;
  int frames = 0;
  const auto run_for = [&](std::chrono::nanoseconds time) {
    const MonotonicTime end = bench.card.time + time;
    counting = true;
    while (bench.card.time < end) {
      frames += source.read(bench.frame) == ReadOutcome::kFrame ? 1 : 0;
      static_cast<void>(source.condition());
      source.wait(std::min(end, bench.card.time + milliseconds(50)));
    }
    counting = false;
  };
  run_for(seconds(2));
  bench.card.is_plugged = false;
  run_for(seconds(2));
  bench.card.is_plugged = true;
  run_for(seconds(2));
  bench.card.hangs = true;
  run_for(seconds(3));
  bench.card.hangs = false;
  bench.card.open_error = EBUSY;
  run_for(seconds(3));
  bench.card.open_error = 0;
  run_for(seconds(5));

  EXPECT_EQ(allocations, 0);
  EXPECT_GT(frames, 100);
  EXPECT_GE(source.counts().starts, 3U);
}

TEST(NoAllocation, HappensWhileMotionJpegIsDecoded) {
  counting = false;
  const CardBuffer good = jpeg_picture(smooth_picture({320, 240}, 1));
  CardBuffer bad = good;
  bad.bytes.resize(bad.bytes.size() / 2);
  GreyConverter converter({}, {});
  std::vector<std::uint8_t> pixels(320 * 240);
  ASSERT_TRUE(converter.begin(good.picture));
  allocations = 0;
  counting = true;
  int decoded = 0;
  for (int picture = 0; picture < 10; ++picture) {
    decoded += converter.convert(good.bytes, pixels) ? 1 : 0;
    decoded += converter.convert(bad.bytes, pixels) ? 100 : 0;
  }
  counting = false;

  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(decoded, 10);
}

}  // namespace
}  // namespace tubed
