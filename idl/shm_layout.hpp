// The layout of the shared memory as C++ sees it: the C structs, with every offset that other languages rely
// on nailed down.
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "idl/shm_layout.h"

namespace tubed {

/// A segment or its socket cannot be made, reached or believed; says what and what to do.
class ShmError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a writer says of itself, once.
struct ShmIdentity {
  std::uint32_t content = 0;  ///< enum tubed_shm_content
  std::uint32_t content_version = 0;
  std::string name;                ///< at most 63 bytes; images: the camera
  std::uint64_t writer_start = 0;  ///< drawn at each start
};

/// How a segment is divided.
struct ShmGeometry {
  std::uint32_t slot_count = 0;
  std::uint64_t payload_bytes = 0;  ///< the most a sample can have

  [[nodiscard]] constexpr std::uint64_t slot_bytes() const {
    return (sizeof(tubed_shm_slot) + payload_bytes + 63) / 64 * 64;
  }
  [[nodiscard]] constexpr std::uint64_t segment_bytes() const {
    return TUBED_SHM_HEADER_BYTES + slot_count * slot_bytes();
  }
};

inline constexpr std::uint32_t kShmMinSlots = 2;
inline constexpr std::uint32_t kShmMaxSlots = 1024;
inline constexpr std::uint64_t kShmMaxPayloadBytes = std::uint64_t{1} << 28U;
inline constexpr std::uint64_t kShmMaxSegmentBytes = std::uint64_t{1} << 30U;  ///< unless a reader says less

static_assert(sizeof(tubed_shm_header) == 320 && sizeof(tubed_shm_header) <= TUBED_SHM_HEADER_BYTES);
static_assert(offsetof(tubed_shm_header, magic) == 0);
static_assert(offsetof(tubed_shm_header, layout_version) == 8);
static_assert(offsetof(tubed_shm_header, content) == 12);
static_assert(offsetof(tubed_shm_header, content_version) == 16);
static_assert(offsetof(tubed_shm_header, slot_count) == 20);
static_assert(offsetof(tubed_shm_header, slot_bytes) == 24);
static_assert(offsetof(tubed_shm_header, payload_bytes) == 32);
static_assert(offsetof(tubed_shm_header, segment_bytes) == 40);
static_assert(offsetof(tubed_shm_header, writer_start) == 48);
static_assert(offsetof(tubed_shm_header, writer_pid) == 56);
static_assert(offsetof(tubed_shm_header, name) == 64);
static_assert(offsetof(tubed_shm_header, wake) == 128);
static_assert(offsetof(tubed_shm_header, newest) == 192);
static_assert(offsetof(tubed_shm_header, heartbeat_ns) == 256);
static_assert(offsetof(tubed_shm_header, writer_state) == 264);

static_assert(sizeof(tubed_shm_slot) == 64);
static_assert(offsetof(tubed_shm_slot, sequence) == 0);
static_assert(offsetof(tubed_shm_slot, payload_bytes) == 8);
static_assert(offsetof(tubed_shm_slot, published_ns) == 16);

static_assert(sizeof(tubed_shm_image) == 128);
static_assert(offsetof(tubed_shm_image, exposure_duration_ns) == 8);
static_assert(offsetof(tubed_shm_image, frame_number) == 16);
static_assert(offsetof(tubed_shm_image, origin) == 20);
static_assert(offsetof(tubed_shm_image, fluoroscopy_on) == 24);
static_assert(offsetof(tubed_shm_image, depth_bits) == 28);
static_assert(offsetof(tubed_shm_image, width) == 32);
static_assert(offsetof(tubed_shm_image, height) == 36);
static_assert(offsetof(tubed_shm_image, geometry) == 40);
static_assert(offsetof(tubed_shm_image, fx) == 44);
static_assert(offsetof(tubed_shm_image, cy) == 56);
static_assert(offsetof(tubed_shm_image, q_camera_world) == 60);
static_assert(offsetof(tubed_shm_image, t_camera_world_mm) == 76);
static_assert(offsetof(tubed_shm_image, sigma_rotation_rad) == 88);
static_assert(offsetof(tubed_shm_image, sigma_translation_mm) == 100);
static_assert(offsetof(tubed_shm_image, pivot_depth_mm) == 112);

static_assert(sizeof(tubed_shm_point) == 64 && sizeof(tubed_shm_coil) == 16 &&
              sizeof(tubed_shm_view) == 200 && sizeof(tubed_shm_stamps) == 72);
static_assert(offsetof(tubed_shm_point, held_by) == 60);
static_assert(offsetof(tubed_shm_view, exposure_monotonic_ns) == 8);
static_assert(offsetof(tubed_shm_view, T_camera_world) == 48);
static_assert(offsetof(tubed_shm_view, sigma_translation_mm) == 188);
static_assert(offsetof(tubed_shm_estimate, sequence_number) == 72);
static_assert(offsetof(tubed_shm_estimate, validity) == 112);
static_assert(offsetof(tubed_shm_estimate, has_image) == 120);
static_assert(offsetof(tubed_shm_estimate, em_age_ns) == 136);
static_assert(offsetof(tubed_shm_estimate, point_count) == 172);
static_assert(offsetof(tubed_shm_estimate, points) == 176);
static_assert(offsetof(tubed_shm_estimate, coefficient_count) == 8368);
static_assert(offsetof(tubed_shm_estimate, coefficients_mm) == 8376);
static_assert(offsetof(tubed_shm_estimate, coil_count) == 9912);
static_assert(offsetof(tubed_shm_estimate, coils) == 9916);
static_assert(offsetof(tubed_shm_estimate, view_count) == 10172);
static_assert(offsetof(tubed_shm_estimate, views) == 10176);
static_assert(offsetof(tubed_shm_estimate, stamps) == 10976);
static_assert(sizeof(tubed_shm_estimate) == 11048);

static_assert(sizeof(tubed_shm_greeting) == 16);

}  // namespace tubed
