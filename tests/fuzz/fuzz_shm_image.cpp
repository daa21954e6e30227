// The daemon's reader of images in shared memory against a frame grabber that does anything to its memory: a
// first byte of flags, perhaps a greeting, then steps, each a byte and what it needs.
#include <algorithm>
#include <array>

#include "drivers/image_shm/shm_image_source.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "idl/geometry/camera.hpp"
#include "tests/fuzz/foreign_writer.hpp"

using namespace tubed;
using namespace tubed::fuzz;

namespace {

constexpr int kWidth = 8;
constexpr int kHeight = 4;
constexpr std::size_t kPayload = sizeof(tubed_shm_image) + 2 * kWidth * kHeight + 16;

CameraCalibration small_camera() {
  CameraCalibration camera;
  camera.name = "A";
  camera.width = kWidth;
  camera.height = kHeight;
  camera.T_camera_world.translation().z() = 1000;
  return camera;
}

/// A proper image of now, with what the input changes of it.
void publish(ForeignSegment& segment, FuzzInput& input) {
  const std::int64_t now_ns = to_ns(monotonic_now());
  std::array<std::byte, kPayload> payload{};
  tubed_shm_image image{};
  image.exposure_ns = now_ns;
  image.origin = TUBED_SHM_DEVICE;
  image.fluoroscopy_on = 1;
  image.depth_bits = 16;
  image.width = kWidth;
  image.height = kHeight;
  const std::uint8_t kind = input.take<std::uint8_t>();
  image.geometry = kind >> 7U;
  image.fx = image.fy = 2000;
  image.q_camera_world[0] = 1;
  image.t_camera_world_mm[2] = 1000;
  for (int changes = kind % 8; changes > 0; --changes) {
    const std::size_t offset = input.take<std::uint8_t>() % sizeof(image);
    input.take_into(std::as_writable_bytes(std::span(&image, 1))
                        .subspan(offset, std::min<std::size_t>(8, sizeof(image) - offset)));
  }
  std::memcpy(payload.data(), &image, sizeof(image));
  const std::size_t bytes = input.take<std::uint8_t>() % (kPayload + 1);
  segment.ring().begin();
  segment.ring().write(0, std::span<const std::byte>(payload));
  segment.ring().commit(bytes == 0 ? kPayload : bytes, now_ns);
}

/// A geometry that is not refused makes a camera that projects or says that it does not.
void check_geometry(const ViewGeometry& geometry) {
  if (refusal_of(geometry, small_camera()) != nullptr) {
    return;
  }
  Camera camera(small_camera());
  camera.look_from(geometry);
  const Eigen::Matrix3d R = camera.calibration().T_camera_world.linear();
  demand((R.transpose() * R).isIdentity(1e-9));
  const auto seen = camera.project({1, 2, 3});
  demand(!seen || (seen->p_image_px.allFinite() && seen->depth_mm > 0));
}

/// A frame that was handed on holds what ImageSource promises.
void check(const ImageFrame& frame, MonotonicTime last_exposure) {
  demand(frame.origin == Origin::kDevice || frame.origin == Origin::kSimulated ||
         frame.origin == Origin::kReplayed);
  demand(frame.depth == PixelDepth::kGrey8 || frame.depth == PixelDepth::kGrey16);
  demand(frame.width >= 0 && frame.width <= 1 << 15 && frame.height >= 0 && frame.height <= 1 << 15);
  demand(frame.exposure > last_exposure && frame.exposure <= frame.received + std::chrono::milliseconds(5));
  demand(frame.pixels.size() == std::size_t{2} * kWidth * kHeight);
  if (frame.geometry) {
    check_geometry(*frame.geometry);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static ForeignDoor door("image");
  FuzzInput input(data, size);
  const std::uint8_t flags = input.take<std::uint8_t>();
  const std::uint32_t slots = 2 + (flags >> 6U);
  ForeignSegment segment({slots, kPayload}, {TUBED_SHM_IMAGES, TUBED_SHM_IMAGES_VERSION, "A", 1},
                         to_ns(monotonic_now()));
  door.hand_out((flags & 2U) != 0 ? -1 : segment.descriptor(), greeting_of(input, (flags & 1U) == 0));
  for (int pokes = flags >> 2U & 15U; pokes > 0; --pokes) {
    segment.poke(input);
  }
  ShmImageSource source(small_camera(), door.path(), {});
  ImageFrame frame;
  frame.reserve(kWidth, kHeight);
  MonotonicTime last_exposure{};
  const OpenResult opened = source.open();
  demand(opened.ok || !opened.why.empty());
  for (int steps = 0; steps < 64 && !input.empty(); ++steps) {
    const std::uint8_t step = input.take<std::uint8_t>();
    if (step % 4 == 0) {
      segment.poke(input);
    } else if (step % 4 == 1) {
      publish(segment, input);
    } else if (source.read(frame) == ReadOutcome::kFrame) {
      check(frame, last_exposure);
      last_exposure = frame.exposure;
    }
  }
  return 0;
}
