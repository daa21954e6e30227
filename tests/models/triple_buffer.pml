/* daemon/pipeline/triple_buffer.hpp as a Promela model, with weak memory made explicit.
 *
 * A slot's content is two words that the writer sets to the same number. What the other thread sees of them is a copy
 * of its own (a view of memory); a release pushes the writer's pending words into the hand-over, an acquire pulls them
 * in. Without the release the words may arrive late, one by one, or never: exactly what a missing barrier allows.
 *
 * Claims: the reader never sees a torn slot (two different words), never a number older than one it has seen, and
 * writer and reader never own the same slot.
 * Negative controls: -DNO_RELEASE, -DNO_ACQUIRE and -DNO_EXCHANGE each remove one barrier; the checker must then find
 * a counterexample.
 */
#ifndef ROUNDS
#define ROUNDS 4
#endif

#define FRESH 4
#define INDEX(m) ((m) & 3)

byte middle = 1;             /* the atomic word: index, plus FRESH */
byte low[3], high[3];        /* memory as the reader can see it */
byte pending_low[3], pending_high[3];   /* the writer's store buffer */
byte view_low[3], view_high[3];         /* the reader's (possibly stale) copy */
byte writer_owns = 0, reader_owns = 2;
bool writing = false, reading = false;
bool done = false;

/* Words that no release has pushed yet may drain at any moment, in any order. */
active proctype store_buffer() {
  byte i;
  do
  :: done -> break
  :: else ->
     if
     :: i = 0 :: i = 1 :: i = 2
     fi;
     if
     :: low[i] = pending_low[i]
     :: high[i] = pending_high[i]
     :: skip
     fi
  od
}

active proctype writer() {
  byte round = 1, previous;
  do
  :: round > ROUNDS -> break
  :: else ->
     writing = true;
     assert(!(reading && reader_owns == writer_owns));
     pending_low[writer_owns] = round;
     pending_high[writer_owns] = round;
     writing = false;
#ifdef NO_EXCHANGE
     /* load and store instead of one exchange */
     previous = middle;
#ifndef NO_RELEASE
     d_step { low[writer_owns] = pending_low[writer_owns]; high[writer_owns] = pending_high[writer_owns]; }
#endif
     middle = writer_owns | FRESH;
#else
     d_step {
       previous = middle;
#ifndef NO_RELEASE
       low[writer_owns] = pending_low[writer_owns]; high[writer_owns] = pending_high[writer_owns];
#endif
       middle = writer_owns | FRESH
     }
#endif
     writer_owns = INDEX(previous);
     round++
  od;
  done = true
}

active proctype reader() {
  byte newest = 0, a, b, previous;
  do
  :: done && (middle & FRESH) == 0 -> break
  :: (middle & FRESH) != 0 ->
#ifdef NO_EXCHANGE
     previous = middle;
     middle = reader_owns;
#else
     d_step { previous = middle; middle = reader_owns }
#endif
     reader_owns = INDEX(previous);
     reading = true;
     assert(!(writing && reader_owns == writer_owns));
#ifdef NO_ACQUIRE
     /* each word may come from a stale copy */
     if :: view_low[reader_owns] = low[reader_owns] :: skip fi;
     if :: view_high[reader_owns] = high[reader_owns] :: skip fi;
#else
     d_step { view_low[reader_owns] = low[reader_owns]; view_high[reader_owns] = high[reader_owns] }
#endif
     a = view_low[reader_owns];
     b = view_high[reader_owns];
     assert(a == b);
     assert(a > newest);
     newest = a;
     reading = false
  od;
  assert(newest == ROUNDS)
}
