/* Shared memory with tubed on the same machine, for C and whatever can call C: images in, shapes out. Needs
 * neither DDS nor a header of the daemon; link libtubed_shm. One thread at a time may use an object. Times
 * are ns of CLOCK_MONOTONIC.
 */
#ifndef TUBED_SHM_H
#define TUBED_SHM_H

#include <stddef.h>
#include <stdint.h>

#include "idl/shm_layout.h"

#ifdef __cplusplus
extern "C" {
#endif

/* CLOCK_MONOTONIC now: the clock of every time here. */
int64_t tubed_monotonic_ns(void);

/* ---- Images in: a frame grabber's program is the writer, the daemon (driver "image_shm") reads. ---- */

typedef struct tubed_image_writer tubed_image_writer;

struct tubed_image_writer_settings {
  const char* socket;      /* path; what `device` of the daemon's [[camera]] says */
  const char* camera;      /* name of that [[camera]] */
  uint32_t max_width;      /* px, the largest image that will come */
  uint32_t max_height;     /* px */
  uint32_t max_depth_bits; /* 8 or 16 */
  int64_t group;           /* id of the group the daemon is a member of; -1: root and this user only */
};

/* NULL when it cannot be: then `why` says so in words, cut to why_bytes. */
tubed_image_writer* tubed_image_writer_open(const struct tubed_image_writer_settings* settings, char* why,
                                            size_t why_bytes);
/* Where the next image's pixels go, row by row without padding, to be filled in place; room for the largest
 * image. */
uint8_t* tubed_image_writer_begin(tubed_image_writer* writer);
/* Publishes what was filled in since begin. False, and nothing is published, when `image` has another depth
 * than 8 or 16, no known origin, or does not fit. Never waits for a reader. */
bool tubed_image_writer_commit(tubed_image_writer* writer, const struct tubed_shm_image* image);
/* The same for pixels that lie somewhere else: copies them, once. With fluoroscopy_on = 0 `pixels` may be
 * NULL. */
bool tubed_image_writer_put(tubed_image_writer* writer, const struct tubed_shm_image* image,
                            const void* pixels);
/* Without an image: shows that the program works, and lets readers in. At least every 100 ms. */
void tubed_image_writer_beat(tubed_image_writer* writer);
/* Says goodbye. NULL is allowed. */
void tubed_image_writer_close(tubed_image_writer* writer);

/* ---- Shapes out: the daemon writes ([shm] of its configuration), anybody of its group reads. ---- */

typedef struct tubed_estimate_reader tubed_estimate_reader;

/* Everything but TUBED_ESTIMATE and TUBED_TIMEOUT means: stop showing the last shape as current. Said once
 * each. */
enum tubed_estimate_event {
  TUBED_TIMEOUT = 0,
  TUBED_ESTIMATE = 1,        /* a new shape; look at its validity */
  TUBED_DEADLINE_MISSED = 2, /* no new shape for 100 ms */
  TUBED_LIVELINESS_LOST = 3, /* no new shape for 250 ms: the daemon hangs or is dead */
  TUBED_WRITER_GONE = 4      /* the daemon said goodbye */
};

/* Connects when it is waited upon, again and again, so that the daemon may start later and more than once.
 * `socket`: path; `instrument_id`: NULL = every instrument. NULL when there is no memory. */
tubed_estimate_reader* tubed_estimate_reader_open(const char* socket, const char* instrument_id);
/* The next thing that happens, at the latest after timeout_ms. `estimate` is written with TUBED_ESTIMATE
 * only. */
enum tubed_estimate_event tubed_estimate_reader_wait(tubed_estimate_reader* reader,
                                                     struct tubed_shm_estimate* estimate, int timeout_ms);
/* Why it is not connected, in words; "" when it is. Valid until the next call. */
const char* tubed_estimate_reader_why(const tubed_estimate_reader* reader);
void tubed_estimate_reader_close(tubed_estimate_reader* reader);

#ifdef __cplusplus
}
#endif

#endif
