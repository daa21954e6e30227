/* idl/shm_ring.hpp as a Promela model, with weak memory made explicit: a ring of two slots, a writer that may be killed
 * at any instant, and a reader (readers write nothing, so that one stands for all; killing one changes nothing).
 *
 * A sample is two words that the writer sets to the sample's number. A publication is five stores: mark (odd sequence),
 * two words, completion (even sequence), `newest`. They wait in a store buffer and reach memory in any order that
 * their releases allow. The reader loads the sequence, the two words and the sequence again; the three later loads
 * happen in any order that the acquires allow.
 *
 * Claims: a sample that the reader takes for whole has both words of its number; `newest` only grows; the newest
 * sample can always be read when the writer rests, also when it was killed in the middle of the next one.
 * Negative controls; each removes one thing that the code relies on, and the checker must then find a counterexample:
 *   NO_MARK         the writer does not mark the slot
 *   NO_RELEASE      words may become visible before the mark
 *   NO_COMPLETION   neither the even sequence nor `newest` waits for the words (each alone would be enough)
 *   NO_ACQUIRE      the second look at the sequence may happen before the words are loaded
 *   NO_SECOND_LOOK  the reader does not look again
 *   ONE_SLOT        the newest sample lies where the next one is written
 */
#ifndef SAMPLES
#define SAMPLES 4
#endif
#ifdef ONE_SLOT
#define SLOTS 1
#else
#define SLOTS 2
#endif
#define SLOT(n) ((n) % SLOTS)

byte sequence[2], low[2], high[2];   /* memory as everybody sees it */
byte newest = 0;
bool rests = false;                  /* the writer has ended or was killed */

active proctype writer() {
  byte n = 1;
  bool mark, a, b, completion, told;  /* stores that have reached memory */
  do
  :: n > SAMPLES -> break
  :: true -> break                   /* killed between two samples */
  :: n <= SAMPLES ->
#ifdef NO_MARK
     mark = true;
#else
     mark = false;
#endif
     a = false; b = false; completion = false; told = false;
     do
     :: told -> n++; break
     :: true -> goto killed
     :: !mark -> atomic { sequence[SLOT(n)] = 2 * n - 1; mark = true }
#ifdef NO_RELEASE
     :: !a -> atomic { low[SLOT(n)] = n; a = true }
     :: !b -> atomic { high[SLOT(n)] = n; b = true }
#else
     :: !a && mark -> atomic { low[SLOT(n)] = n; a = true }
     :: !b && mark -> atomic { high[SLOT(n)] = n; b = true }
#endif
#ifdef NO_COMPLETION
     :: !completion && mark -> atomic { sequence[SLOT(n)] = 2 * n; completion = true }
#else
     :: !completion && mark && a && b -> atomic { sequence[SLOT(n)] = 2 * n; completion = true }
#endif
#ifdef NO_COMPLETION
     :: !told && completion -> atomic { newest = n; told = true }
#else
     :: !told && completion && a && b -> atomic { assert(newest < n); newest = n; told = true }
#endif
     od
  od;
killed:
  rests = true
}

active proctype reader() {
  byte n, x, y, last;
  bool rested, has_x, has_y, looked, whole;
end_reading:
  do
  :: atomic { rests -> rested = true } ; goto last_read
  :: newest != 0 -> rested = false;
last_read:
     n = newest;
     if
     :: n == 0 -> goto done
     :: else
     fi;
     if
     :: sequence[SLOT(n)] != 2 * n -> whole = false
     :: else ->
        whole = true;
        has_x = false; has_y = false; looked = false;
#ifdef NO_SECOND_LOOK
        looked = true;
#endif
        do
        :: has_x && has_y && looked -> break
        :: !has_x -> atomic { x = low[SLOT(n)]; has_x = true }
        :: !has_y -> atomic { y = high[SLOT(n)]; has_y = true }
#ifdef NO_ACQUIRE
        :: !looked -> atomic { whole = (sequence[SLOT(n)] == 2 * n); looked = true }
#else
        :: !looked && has_x && has_y -> atomic { whole = (sequence[SLOT(n)] == 2 * n); looked = true }
#endif
        od;
        assert(!whole || (x == n && y == n));
        assert(!whole || n >= last);
        last = (whole -> n : last)
     fi;
     assert(!rested || whole);   /* what a dead writer left last is there */
     if
     :: rested -> goto done
     :: else
     fi
  od;
done: skip
}
