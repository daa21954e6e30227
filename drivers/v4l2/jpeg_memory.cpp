#include "drivers/v4l2/jpeg_memory.hpp"

#include <jerror.h>

#include <memory>

namespace tubed {

namespace {

constexpr std::size_t kAlignment = 64;  // rows are read and written by vector instructions

constexpr std::size_t rounded_up(std::size_t bytes) { return (bytes + kAlignment - 1) & ~(kAlignment - 1); }

}  // namespace

JpegMemory::JpegMemory(std::size_t lasting_bytes, std::size_t picture_bytes) {
  lasting_.room.resize((lasting_bytes + kAlignment) / sizeof(std::max_align_t));
  picture_.room.resize((picture_bytes + kAlignment) / sizeof(std::max_align_t));
}

void JpegMemory::serve(jpeg_decompress_struct& decoder) noexcept {
  decoder.client_data = this;
  jpeg_memory_mgr& memory = *decoder.mem;
  memory.alloc_small =
      memory.alloc_large = [](j_common_ptr of, int pool, std::size_t bytes) { return take(of, pool, bytes); };
  memory.alloc_sarray = [](j_common_ptr of, int pool, JDIMENSION samples, JDIMENSION rows) {
    return take_rows<JSAMPROW>(of, pool, samples * sizeof(JSAMPLE), rows);
  };
  memory.alloc_barray = [](j_common_ptr of, int pool, JDIMENSION blocks, JDIMENSION rows) {
    return take_rows<JBLOCKROW>(of, pool, blocks * sizeof(JBLOCK), rows);
  };
  memory.free_pool = [](j_common_ptr of, int pool) { empty(of, pool); };
}

void* JpegMemory::Block::take(std::size_t bytes) noexcept {
  void* at = room.data();
  std::size_t left = room.size() * sizeof(std::max_align_t);
  if (std::align(kAlignment, 0, at, left) == nullptr || bytes > left || rounded_up(bytes) > left - used) {
    return nullptr;
  }
  void* const piece = static_cast<std::byte*>(at) + used;
  used += rounded_up(bytes);
  return piece;
}

JpegMemory& JpegMemory::of(j_common_ptr decoder) noexcept {
  return *static_cast<JpegMemory*>(decoder->client_data);
}

void* JpegMemory::take(j_common_ptr decoder, int pool, std::size_t bytes) {
  Block& block = pool == JPOOL_PERMANENT ? of(decoder).lasting_ : of(decoder).picture_;
  void* const piece = block.take(bytes);
  if (piece == nullptr) {
    ERREXIT1(decoder, JERR_OUT_OF_MEMORY, 0);
  }
  return piece;
}

template <typename Row>
Row* JpegMemory::take_rows(j_common_ptr decoder, int pool, std::size_t row_bytes, JDIMENSION count) {
  auto* const rows = static_cast<Row*>(take(decoder, pool, count * sizeof(Row)));
  for (JDIMENSION row = 0; row < count; ++row) {
    rows[row] = static_cast<Row>(take(decoder, pool, row_bytes + kAlignment));  // vectors read beyond the end
  }
  return rows;
}

void JpegMemory::empty(j_common_ptr decoder, int pool) {
  if (pool == JPOOL_IMAGE) {
    of(decoder).picture_.used = 0;
  }
}

}  // namespace tubed
