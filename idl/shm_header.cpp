#include "idl/shm_header.hpp"

#include <string>

namespace tubed {

void check_geometry(const ShmGeometry& geometry) {
  if (geometry.slot_count < kShmMinSlots || geometry.slot_count > kShmMaxSlots) {
    throw ShmError("a shared memory ring has 2 to 1024 slots, not " + std::to_string(geometry.slot_count));
  }
  if (geometry.payload_bytes == 0 || geometry.payload_bytes > kShmMaxPayloadBytes) {
    throw ShmError("a sample in shared memory has 1 byte to 256 MiB, not " +
                   std::to_string(geometry.payload_bytes));
  }
}

ShmGeometry checked_geometry(const tubed_shm_header& header, std::size_t bytes) {
  if (header.magic != TUBED_SHM_MAGIC) {
    throw ShmError("the shared memory is none of tubed's");
  }
  if (header.layout_version != TUBED_SHM_LAYOUT_VERSION) {
    throw ShmError("the writer lays shared memory out by version " + std::to_string(header.layout_version) +
                   ", this program knows " + std::to_string(TUBED_SHM_LAYOUT_VERSION) +
                   ": install the same tubed for both");
  }
  const ShmGeometry geometry{header.slot_count, header.payload_bytes};
  check_geometry(geometry);
  if (header.slot_bytes != geometry.slot_bytes() || bytes < geometry.segment_bytes()) {
    throw ShmError("the shared memory is smaller than its header says");
  }
  return geometry;
}

}  // namespace tubed
