/* daemon/pipeline/spsc_ring.hpp, that is boost::lockfree::spsc_queue, under the C++ memory model of weak_memory.pml.
 *
 * A ring for two values has three places, which are plain objects. A full ring refuses, as push() does; the producer of
 * the model tries the same value again, so that all values arrive in order.
 * Claims: no access to a place races with one of the other thread, values are popped in the order in which they were
 * pushed, none twice, none left out.
 * Negative controls; each takes one thing away that the code relies on, and the checker must then find a counterexample:
 *   NO_PUSH_RELEASE  the value may become visible after the index that announces it
 *   NO_POP_ACQUIRE   the value may be read before the index that announces it
 *   NO_POP_RELEASE   the place may still be read after it was given back
 *   NO_PUSH_ACQUIRE  the place may be written before it was given back
 *   NO_GAP           the ring uses its last place too: full looks like empty
 *
 * MODELS daemon/pipeline/spsc_ring.hpp class SpscRing d202bc6e63253955
 * MODELS /usr/include/boost/lockfree/spsc_queue.hpp push(T const & t, T * buffer, size_t max_size) 11895108f1ec9ad0
 * MODELS /usr/include/boost/lockfree/spsc_queue.hpp consume_one(Functor const & functor, T * buffer, size_t max_size) 2aa677efacdd6d7b
 * MODELS /usr/include/boost/lockfree/spsc_queue.hpp consume_one(Functor & functor, T * buffer, size_t max_size) 48b32fe2129c9566
 * MODELS /usr/include/boost/lockfree/spsc_queue.hpp next_index 476b5df71ff3a129
 * MODELS /usr/include/boost/lockfree/spsc_queue.hpp pop(U & ret) bf1b6fef60e9b473
 */
#ifndef VALUES
#define VALUES 5
#endif
#define PLACES 3
#define THREADS 2
#define OBJECTS 2
#define PLAINS PLACES
#define HISTORY (VALUES + 2)
#include "weak_memory.pml"

#define PRODUCER 0
#define CONSUMER 1
#define WRITE_INDEX 0
#define READ_INDEX 1
#define NEXT(index) (((index) + 1) % PLACES)

#ifdef NO_PUSH_RELEASE
#define PUSH_STORE RELAXED
#else
#define PUSH_STORE RELEASE
#endif
#ifdef NO_PUSH_ACQUIRE
#define PUSH_LOAD RELAXED
#else
#define PUSH_LOAD ACQUIRE
#endif
#ifdef NO_POP_RELEASE
#define POP_STORE RELAXED
#else
#define POP_STORE RELEASE
#endif
#ifdef NO_POP_ACQUIRE
#define POP_LOAD RELAXED
#else
#define POP_LOAD ACQUIRE
#endif

byte content[PLACES];

active proctype producer() {
  byte next_value = 1, own, other;
  do
  :: next_value > VALUES -> break
  :: else ->
     atomic_load(PRODUCER, WRITE_INDEX, RELAXED, own);
     atomic_load(PRODUCER, READ_INDEX, PUSH_LOAD, other);
     if
#ifdef NO_GAP
     :: false
#else
     :: NEXT(own) == other   /* refused */
#endif
     :: else ->
        plain_write(PRODUCER, own);
        content[own] = next_value;
        atomic_store(PRODUCER, WRITE_INDEX, NEXT(own), PUSH_STORE);
        next_value++
     fi
  od
}

active proctype consumer() {
  byte popped = 0, own, other;
  do
  :: popped == VALUES -> break
  :: else ->
     atomic_load(CONSUMER, WRITE_INDEX, POP_LOAD, other);
     atomic_load(CONSUMER, READ_INDEX, RELAXED, own);
     if
     :: own == other   /* empty */
     :: else ->
        plain_read(CONSUMER, own);
        assert(content[own] == popped + 1);
        popped = content[own];
        atomic_store(CONSUMER, READ_INDEX, NEXT(own), POP_STORE)
     fi
  od
}
