// tubed_shm.h on top of the C++ classes: no exception leaves it.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <exception>
#include <limits>
#include <string>

#include "clients/cpp/shm_image_writer.hpp"
#include "clients/cpp/shm_tube_reader.hpp"
#include "clients/cpp/tubed_shm.h"

// The names of the C header.
struct tubed_image_writer {  // NOLINT(readability-identifier-naming)
  tubed::ShmImageWriter writer;
};
struct tubed_estimate_reader {  // NOLINT(readability-identifier-naming)
  tubed::ShmTubeReader reader;
};

namespace {

tubed::ShmImageWriterSettings checked(const tubed_image_writer_settings* settings) {
  if (settings == nullptr || settings->socket == nullptr || settings->camera == nullptr) {
    throw tubed::ShmError("socket and camera have to be given");
  }
  tubed::ShmImageWriterSettings result{settings->socket,     settings->camera,         settings->max_width,
                                       settings->max_height, settings->max_depth_bits, {}};
  if (settings->group > std::numeric_limits<gid_t>::max()) {
    throw tubed::ShmError("there is no group " + std::to_string(settings->group));
  }
  if (settings->group >= 0) {
    result.group = static_cast<gid_t>(settings->group);
  }
  return result;
}

static_assert(TUBED_TIMEOUT == static_cast<int>(tubed::ShmTubeEvent::kTimeout));
static_assert(TUBED_ESTIMATE == static_cast<int>(tubed::ShmTubeEvent::kEstimate));
static_assert(TUBED_DEADLINE_MISSED == static_cast<int>(tubed::ShmTubeEvent::kDeadlineMissed));
static_assert(TUBED_LIVELINESS_LOST == static_cast<int>(tubed::ShmTubeEvent::kLivelinessLost));
static_assert(TUBED_WRITER_GONE == static_cast<int>(tubed::ShmTubeEvent::kWriterGone));

}  // namespace

int64_t tubed_monotonic_ns(void) {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

tubed_image_writer* tubed_image_writer_open(const tubed_image_writer_settings* settings, char* why,
                                            size_t why_bytes) {
  try {
    return new tubed_image_writer{tubed::ShmImageWriter(checked(settings))};
  } catch (const std::exception& error) {
    if (why != nullptr && why_bytes > 0) {
      std::snprintf(why, why_bytes, "%s", error.what());
    }
    return nullptr;
  }
}

uint8_t* tubed_image_writer_begin(tubed_image_writer* writer) { return writer->writer.begin(); }

bool tubed_image_writer_commit(tubed_image_writer* writer, const tubed_shm_image* image) {
  return writer->writer.commit(*image);
}

bool tubed_image_writer_put(tubed_image_writer* writer, const tubed_shm_image* image, const void* pixels) {
  return writer->writer.put(*image, pixels);
}

void tubed_image_writer_beat(tubed_image_writer* writer) { writer->writer.beat(); }

void tubed_image_writer_close(tubed_image_writer* writer) { delete writer; }

tubed_estimate_reader* tubed_estimate_reader_open(const char* socket, const char* instrument_id) {
  try {
    return new tubed_estimate_reader{
        tubed::ShmTubeReader({.socket = socket == nullptr ? "" : socket,
                              .instrument_id = instrument_id == nullptr ? "" : instrument_id,
                              .delivery = tubed::ShmDelivery::kNewest,
                              .trusted = {}})};
  } catch (const std::exception&) {
    return nullptr;
  }
}

tubed_estimate_event tubed_estimate_reader_wait(tubed_estimate_reader* reader, tubed_shm_estimate* estimate,
                                                int timeout_ms) {
  const tubed::ShmTubeNews news = reader->reader.wait_for(std::chrono::milliseconds(std::max(timeout_ms, 0)));
  if (news.estimate != nullptr) {
    *estimate = *news.estimate;
  }
  return static_cast<tubed_estimate_event>(news.event);
}

const char* tubed_estimate_reader_why(const tubed_estimate_reader* reader) {
  return reader->reader.why().c_str();
}

void tubed_estimate_reader_close(tubed_estimate_reader* reader) { delete reader; }
