/* What lies in the shared memory, for any language: one writer, any number of readers that can only read.
 *
 * A segment is a header of one page, then slot_count slots of slot_bytes each. Sample n (from 1) lies in slot
 * n % slot_count. A slot's `sequence` is 2 n when sample n is complete, 2 n - 1 while it is being written.
 *
 * To read sample n = header.newest: load slot.sequence (acquire), it has to be 2 n; copy, every 8-byte word
 * with a load-acquire; load slot.sequence again: still 2 n, or what was copied is thrown away. To sleep: load
 * `wake` (acquire), look at `newest`, then FUTEX_WAIT on `wake` (not FUTEX_PRIVATE_FLAG; it works on a
 * read-only mapping). Always with a time limit: a dead writer wakes nobody.
 *
 * All numbers are of this machine's byte order; times are ns of CLOCK_MONOTONIC unless a name says otherwise.
 */
#ifndef TUBED_SHM_LAYOUT_H
#define TUBED_SHM_LAYOUT_H

#include <stdbool.h>
#include <stdint.h>

#include "idl/shm_estimate.h"

#define TUBED_SHM_MAGIC 0x314d485344425554ULL /* "TUBDSHM1" as little-endian bytes */
#define TUBED_SHM_LAYOUT_VERSION 1u
#define TUBED_SHM_HEADER_BYTES 4096u
#define TUBED_SHM_SILENCE_NS 200000000LL /* a heartbeat older than this: the writer hangs or is dead */

enum tubed_shm_content { TUBED_SHM_ESTIMATES = 1, TUBED_SHM_IMAGES = 2 };
#define TUBED_SHM_IMAGES_VERSION 2u        /* of what a writer writes; 1 had no geometry */
#define TUBED_SHM_OLDEST_IMAGES_VERSION 1u /* that the daemon reads */

enum tubed_shm_writer_state { TUBED_SHM_WRITING = 1, TUBED_SHM_ENDED = 2 };

/* At the start of the segment. The first 128 bytes never change after the segment was handed out. */
struct tubed_shm_header {
  uint64_t magic;
  uint32_t layout_version;
  uint32_t content; /* enum tubed_shm_content */
  uint32_t content_version;
  uint32_t slot_count;
  uint64_t slot_bytes;    /* from one slot to the next: a multiple of 64 */
  uint64_t payload_bytes; /* the most a sample can have */
  uint64_t segment_bytes;
  uint64_t writer_start; /* drawn at each start of the writer: tells a restart */
  uint32_t writer_pid;
  uint32_t reserved;
  char name[64]; /* zero-terminated; images: the camera */
  /* Each on a cache line of its own. */
  uint32_t wake; /* futex: + 1 a sample */
  uint32_t reserved_wake[15];
  uint64_t newest; /* number of the newest complete sample; 0: none yet */
  uint64_t reserved_newest[7];
  int64_t heartbeat_ns; /* when the writer last showed that it works */
  uint32_t writer_state;
  uint32_t reserved_heartbeat[13];
};

/* At the start of every slot; the payload follows. */
struct tubed_shm_slot {
  uint64_t sequence;
  uint64_t payload_bytes; /* of this sample */
  int64_t published_ns;
  uint64_t reserved[5];
};

/* Where an image comes from. Estimates made from anything but a device say so. */
enum tubed_shm_origin { TUBED_SHM_DEVICE = 1, TUBED_SHM_SIMULATED = 2, TUBED_SHM_REPLAYED = 3 };

/* Whether an image says how its view stood. */
enum tubed_shm_geometry { TUBED_SHM_NO_GEOMETRY = 0, TUBED_SHM_GEOMETRY = 1 };

/* Payload of a sample of images: this, then height rows of width pixels, no padding, 16 bit in host order. */
struct tubed_shm_image {
  int64_t exposure_ns;          /* the middle of the exposure */
  int64_t exposure_duration_ns; /* 0: not known */
  uint32_t frame_number;        /* the source's own count */
  uint32_t origin;              /* enum tubed_shm_origin */
  uint32_t fluoroscopy_on;      /* 0: an instant without radiation, and no pixels */
  uint32_t depth_bits;          /* 8 or 16 */
  uint32_t width;               /* px */
  uint32_t height;              /* px */
  /* With TUBED_SHM_GEOMETRY, what holds for this image instead of the daemon's configuration: a C-arm that
   * has turned, a table that has moved, a field of view that has changed. Camera frame: x right, y down, z
   * along the view. The daemon refuses an image whose geometry cannot be, and says why. */
  uint32_t geometry; /* enum tubed_shm_geometry */
  float fx;          /* focal lengths, px */
  float fy;
  float cx; /* principal point, px; the centre of the first pixel is 0 */
  float cy;
  float q_camera_world[4]; /* w x y z, of length 1: p_camera = R(q) p_world + t */
  float t_camera_world_mm[3];
  /* Standard deviations of the pose; all 0: it is taken for exact. The true p_camera' = p_camera +
   * w x (p_camera - (0, 0, pivot_depth_mm)) + v, the components of w and v along the camera's axes. */
  float sigma_rotation_rad[3];   /* of w */
  float sigma_translation_mm[3]; /* of v */
  float pivot_depth_mm;          /* of a C-arm, whose angles err: its source-isocentre distance */
  uint32_t reserved[3];          /* to 128 bytes: pixels begin on a cache line */
};

/* Payload of a sample of estimates: struct tubed_shm_estimate of shm_estimate.h, TubeEstimate.idl field by
 * field. */

/* What the writer answers on its socket (SOCK_SEQPACKET); with TUBED_SHM_WELCOME comes the descriptor
 * (SCM_RIGHTS). */
enum tubed_shm_answer { TUBED_SHM_WELCOME = 1, TUBED_SHM_NOT_ALLOWED = 2, TUBED_SHM_TOO_OFTEN = 3 };
struct tubed_shm_greeting {
  uint64_t magic;
  uint32_t layout_version;
  uint32_t answer;
};

#endif
