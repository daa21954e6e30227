#include "daemon/publishing/shm_image_publisher.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <thread>

#include "idl/shm_reader.hpp"
#include "tests/idl/shm_bed.hpp"

namespace tubed {
namespace {

std::string folder_of(const ShmFolder& folder) {
  return std::filesystem::path(folder.socket()).parent_path().string();
}

TEST(ShmImagePublisher, AnImageIsFoundUnderTheNameOfItsCamera) {
  const ShmFolder folder;
  ShmSettings settings;
  settings.preview_folder = folder_of(folder);
  ShmImagePublisher publisher(settings, {"A", 4, 2}, 1);
  std::atomic<bool> done{false};
  std::thread daemon([&] {
    while (!done) publisher.beat(1);  // also what lets readers in
  });
  ShmReader reader({.path = settings.preview_folder + "/preview-A.sock",
                    .content = TUBED_SHM_IMAGES,
                    .content_version = TUBED_SHM_IMAGES_VERSION,
                    .timeout_ms = 5000,
                    .trusted = {}});
  done = true;
  daemon.join();
  EXPECT_EQ(reader.identity().name, "A");
  tubed_shm_image image{};
  image.frame_number = 9;
  image.width = 4;
  image.height = 2;
  image.depth_bits = 8;
  const std::array<std::byte, 8> pixels{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}};

  publisher.publish(image, pixels, 2);

  ASSERT_EQ(reader.news(2), ShmNews::kSample);
  const ShmSample sample = reader.take_newest();
  tubed_shm_image got{};
  std::array<std::byte, 8> got_pixels{};
  ASSERT_TRUE(sample.copy(0, std::as_writable_bytes(std::span(&got, 1))));
  ASSERT_TRUE(sample.copy(sizeof(got), got_pixels) && sample.whole());
  EXPECT_EQ(got.frame_number, 9U);
  EXPECT_EQ(got_pixels, pixels);
}

TEST(ShmImagePublisher, AnImageThatIsLargerThanTheCamerasIsLeftOut) {
  const ShmFolder folder;
  ShmSettings settings;
  settings.preview_folder = folder_of(folder);
  ShmImagePublisher publisher(settings, {"A", 4, 2}, 1);
  const std::vector<std::byte> pixels(100);
  publisher.publish({}, pixels, 2);  // would write beyond its slot
}

TEST(ShmImagePublisher, AFolderThatIsNotThereIsAnError) {
  ShmSettings settings;
  settings.preview_folder = "/nonexistent";
  EXPECT_THROW(ShmImagePublisher(settings, {"A", 4, 2}, 1), ShmError);
}

}  // namespace
}  // namespace tubed
