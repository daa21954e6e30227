/* A frame grabber's program: hands every exposure to tubed through shared memory. Replace the three functions
 * of the vendor by those of your grabber. usage: grabber SOCKET CAMERA [FRAMES] */
#include <clients/cpp/tubed_shm.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { WIDTH = 400, HEIGHT = 600, EXPOSURE_MS = 8, PERIOD_MS = 33 };

static void vendor_wait(int ms) { nanosleep(&(struct timespec){.tv_nsec = ms * 1000000L}, NULL); }
static bool vendor_pedal_is_down(void) { return true; }
static void vendor_read_into(uint8_t* pixels, uint32_t frame) {
  memset(pixels, (int)(frame % 200), WIDTH * HEIGHT);
}

int main(int argc, char** argv) {
  if (argc < 3) return fprintf(stderr, "usage: grabber SOCKET CAMERA [FRAMES]\n"), 64;
  char why[256];
  const struct tubed_image_writer_settings settings = {argv[1], argv[2], WIDTH, HEIGHT, 8, -1};
  tubed_image_writer* writer = tubed_image_writer_open(&settings, why, sizeof why);
  if (writer == NULL) return fprintf(stderr, "grabber: %s\n", why), 69;
  const uint32_t frames = argc > 3 ? (uint32_t)atoi(argv[3]) : UINT32_MAX;
  for (uint32_t frame = 1; frame <= frames; ++frame) {
    vendor_wait(PERIOD_MS); /* never longer than 100 ms without a call of tubed_image_writer_... */
    struct tubed_shm_image image = {.width = WIDTH, .height = HEIGHT, .depth_bits = 8, .frame_number = frame};
    image.exposure_ns = tubed_monotonic_ns() - EXPOSURE_MS * 500000LL; /* its middle, and no later */
    image.exposure_duration_ns = EXPOSURE_MS * 1000000LL;
    image.origin = TUBED_SHM_DEVICE;
    image.fluoroscopy_on = vendor_pedal_is_down();
    uint8_t* pixels = tubed_image_writer_begin(writer); /* in place: no copy of ours */
    if (image.fluoroscopy_on) vendor_read_into(pixels, frame);
    tubed_image_writer_commit(writer, &image);
  }
  tubed_image_writer_close(writer); /* says goodbye; a crash is noticed after 200 ms */
  return 0;
}
