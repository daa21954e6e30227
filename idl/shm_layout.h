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

#define TUBED_SHM_MAGIC 0x314d485344425554ULL /* "TUBDSHM1" as little-endian bytes */
#define TUBED_SHM_LAYOUT_VERSION 1u
#define TUBED_SHM_HEADER_BYTES 4096u
#define TUBED_SHM_SILENCE_NS 200000000LL /* a heartbeat older than this: the writer hangs or is dead */

enum tubed_shm_content { TUBED_SHM_ESTIMATES = 1, TUBED_SHM_IMAGES = 2 };
#define TUBED_SHM_ESTIMATES_VERSION 1u
#define TUBED_SHM_IMAGES_VERSION 1u

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
  uint64_t reserved[11];        /* to 128 bytes: pixels begin on a cache line */
};

/* Payload of a sample of estimates: TubeEstimate as TubeEstimate.idl describes it, field by field. */
struct tubed_shm_point {
  double p_world_mm[3];
  float tangent_world[3];  /* unit vector toward the tip */
  float covariance_mm2[6]; /* xx xy xz yy yz zz */
};

struct tubed_shm_coil {
  uint32_t state; /* 0 missing 1 used 2 out of volume 3 disabled 4 outlier 5 stuck */
  float offset_from_tip_mm;
  float position_mm; /* NaN: the coil gave nothing */
  float angle_rad;
};

struct tubed_shm_stamps { /* CLOCK_MONOTONIC; 0: took no part */
  int64_t exposure_monotonic_ns;
  int64_t image_grabbed_monotonic_ns;
  int64_t frangi_started_monotonic_ns;
  int64_t frangi_finished_monotonic_ns;
  int64_t em_measured_monotonic_ns;
  int64_t em_received_monotonic_ns;
  int64_t optimizer_started_monotonic_ns;
  int64_t optimizer_finished_monotonic_ns;
  int64_t publish_started_monotonic_ns;
};

struct tubed_shm_estimate {
  char instrument_id[65];
  uint64_t sequence_number;
  uint64_t daemon_start;
  int64_t valid_time_ns; /* CLOCK_REALTIME */
  int64_t valid_time_monotonic_ns;
  int64_t publish_time_ns; /* CLOCK_REALTIME */
  uint32_t validity;       /* 0 NOT_AVAILABLE 1 VALID 2 QUESTIONABLE 3 INVALID */
  uint32_t reasons;        /* bit mask, REASON_... of TubeEstimate.idl */
  bool has_image;
  bool is_image_instant;
  uint32_t image_frame;
  uint32_t em_frame;
  int64_t em_age_ns;
  int64_t image_age_ns;
  float radius_mm;
  float length_mm;
  float image_inlier_ratio;
  float in_view_ratio;
  uint32_t iterations;
  uint32_t point_count;
  struct tubed_shm_point points[128]; /* tip first, uniform in arc length from 0 to length_mm */
  uint32_t coefficient_count;
  float coefficient_spacing_mm;
  double coefficients_mm[64][3];
  uint32_t coil_count;
  struct tubed_shm_coil coils[16];
  struct tubed_shm_stamps stamps;
};

/* What the writer answers on its socket (SOCK_SEQPACKET); with TUBED_SHM_WELCOME comes the descriptor
 * (SCM_RIGHTS). */
enum tubed_shm_answer { TUBED_SHM_WELCOME = 1, TUBED_SHM_NOT_ALLOWED = 2, TUBED_SHM_TOO_OFTEN = 3 };
struct tubed_shm_greeting {
  uint64_t magic;
  uint32_t layout_version;
  uint32_t answer;
};

#endif
