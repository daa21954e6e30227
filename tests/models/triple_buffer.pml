/* daemon/pipeline/triple_buffer.hpp under the C++ memory model of weak_memory.pml.
 *
 * The contents of the three slots are plain objects; a slot's number is what the writer wrote there last.
 * Claims: no access to a slot races with one of the other thread (so nothing is torn), the reader's numbers grow, and
 * the last number reaches the reader.
 * Negative controls; each takes one thing away that the code relies on, and the checker must then find a counterexample:
 *   NO_PUBLISH_RELEASE  the content may become visible after the exchange in publish()
 *   NO_FETCH_ACQUIRE    the reader may look at the content before its exchange in fetch()
 *   NO_FETCH_RELEASE    the reader may still look at the old slot after its exchange
 *   NO_PUBLISH_ACQUIRE  the writer may write into the slot it gets back before its exchange
 *   NO_EXCHANGE         load and store instead of one exchange
 *
 * MODELS daemon/pipeline/triple_buffer.hpp class TripleBuffer d22ec4e1ea40e756
 */
#ifndef ROUNDS
#define ROUNDS 4
#endif
#define THREADS 2
#define OBJECTS 1
#define PLAINS 3
#define HISTORY (2 * ROUNDS + 2)
#include "weak_memory.pml"

#define WRITER 0
#define READER 1
#define MIDDLE 0
#define FRESH 4
#define INDEX(m) ((m) & 3)

#if defined(NO_PUBLISH_RELEASE)
#define PUBLISH_ORDER ACQUIRE
#elif defined(NO_PUBLISH_ACQUIRE)
#define PUBLISH_ORDER RELEASE
#else
#define PUBLISH_ORDER ACQ_REL
#endif
#if defined(NO_FETCH_RELEASE)
#define FETCH_ORDER ACQUIRE
#elif defined(NO_FETCH_ACQUIRE)
#define FETCH_ORDER RELEASE
#else
#define FETCH_ORDER ACQ_REL
#endif

byte content[3];

#ifdef NO_EXCHANGE
#define EXCHANGE(thread, number, order, old) atomic_load(thread, MIDDLE, order, old); atomic_store(thread, MIDDLE, number, order)
#else
#define EXCHANGE(thread, number, order, old) atomic_exchange(thread, MIDDLE, number, order, old)
#endif

proctype writer() {
  byte round = 1, back = 0, previous;
  do
  :: round > ROUNDS -> break
  :: else ->
     plain_write(WRITER, back);
     content[back] = round;
     EXCHANGE(WRITER, back | FRESH, PUBLISH_ORDER, previous);
     back = INDEX(previous);
     round++
  od
}

proctype reader() {
  byte newest = 0, front = 2, previous;
  do
  :: newest == ROUNDS -> break
  :: else ->
     atomic_load(READER, MIDDLE, RELAXED, previous);
     if
     :: (previous & FRESH) == 0
     :: else ->
        EXCHANGE(READER, front, FETCH_ORDER, previous);
        front = INDEX(previous);
        plain_read(READER, front);
        assert(content[front] > newest);
        newest = content[front];
        plain_read(READER, front)   /* front() may be read until the next fetch() */
     fi
  od
}

init {
  atomic { value[MIDDLE] = 1; run writer(); run reader() }
}
