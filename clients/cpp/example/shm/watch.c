/* Prints the tip from shared memory and, as loudly, when it is not known. usage: watch SOCKET [EVENTS] */
#include <clients/cpp/tubed_shm.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char** argv) {
  static struct tubed_shm_estimate tube;
  tubed_estimate_reader* reader = argc > 1 ? tubed_estimate_reader_open(argv[1], NULL) : NULL;
  if (reader == NULL) return fprintf(stderr, "usage: watch SOCKET [EVENTS]\n"), 64;
  for (long left = argc > 2 ? atol(argv[2]) : -1; left != 0; --left) {
    const enum tubed_estimate_event event = tubed_estimate_reader_wait(reader, &tube, 1000);
    if (event != TUBED_ESTIMATE) {
      printf("NO SHAPE: event %d %s\n", (int)event, tubed_estimate_reader_why(reader)); /* hide the old one */
      continue;
    }
    const double* tip = tube.points[0].p_world_mm;
    printf("%s %llu %s tip %.1f %.1f %.1f mm\n", tube.instrument_id, (unsigned long long)tube.sequence_number,
           tube.validity == 1 ? "VALID" : "NOT TO BE TRUSTED", tip[0], tip[1], tip[2]);
  }
  tubed_estimate_reader_close(reader);
  return 0;
}
