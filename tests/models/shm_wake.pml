/* How a sleeping reader of idl/shm_ring.hpp is woken: no sample is slept through, though readers write nothing that the
 * writer could see.
 *
 * The writer stores `newest`, then adds one to `wake`, then tells the kernel. The reader loads `wake`, looks at
 * `newest`, and asks the kernel to sleep unless `wake` has changed (FUTEX_WAIT compares and goes to sleep as one).
 * Claim: the reader has every sample in the end; a lost wake is an invalid end state (it would cost the time limit of
 * a sleep, not for ever).
 * Negative controls: WAKE_FIRST (the word is changed before `newest`), LOOK_FIRST (the reader looks at `newest` before
 * it loads the word), NO_COMPARE (the kernel does not compare).
 */
#ifndef SAMPLES
#define SAMPLES 4
#endif

byte newest = 0, wake = 0;
bool sleeping = false;

active proctype writer() {
  byte n = 1;
  do
  :: n > SAMPLES -> break
  :: else ->
#ifdef WAKE_FIRST
     wake++;
     sleeping = false;
     newest = n;
#else
     newest = n;
     wake++;
     sleeping = false;   /* FUTEX_WAKE */
#endif
     n++
  od
}

active proctype reader() {
  byte seen = 0, rung, found;
  do
  :: seen == SAMPLES -> break
  :: else ->
#ifdef LOOK_FIRST
     found = newest;
     rung = wake;
#else
     rung = wake;
     found = newest;
#endif
     if
     :: found != seen -> seen = found
     :: else ->
#ifdef NO_COMPARE
        sleeping = true;
#else
        if
        :: atomic { wake == rung -> sleeping = true }
        :: wake != rung -> skip
        fi;
#endif
        !sleeping
     fi
  od
}
