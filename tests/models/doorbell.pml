/* daemon/pipeline/doorbell.hpp under the C++ memory model of weak_memory.pml: two threads ring, one of them twice, one waits.
 *
 * Before each ring a thread writes something that the waiting thread reads when it was rung: a plain object that it does
 * not touch afterwards, and the stop flag. The kernel compares and goes to sleep under the lock of its queue, and wakes
 * under the same lock; comparing is an ordinary load. Nobody's time runs out but for the first wait, which may end at any
 * time. Sleeping for ever is an invalid end state.
 * Claims: every ring ends a wait or the one that follows; what was written before a ring is seen when it has ended a wait,
 * without a race; so is the stop flag, though its own accesses are relaxed.
 * Negative controls; each takes one thing away that the code relies on, and the checker must then find a counterexample:
 *   NO_ORDER_RING_COUNT     ring() counts with release instead of seq_cst: it may look for sleepers first
 *   NO_ORDER_RING_SLEEPERS  ring() looks for sleepers with acquire
 *   NO_ORDER_SLEEPER        wait_until() announces itself with acq_rel: it may look at the count first
 *   NO_ORDER_COUNT          wait_until() looks at the count with acquire
 *   NO_RELEASE              ring() counts relaxed: what was written before may come later
 *   NO_ACQUIRE_FIRST        the first look at the count is relaxed: what was written before a ring may be missing
 *   NO_ACQUIRE_WOKEN        the same of the look after the kernel has woken the thread
 *   NO_ACQUIRE_LATE         the same of the look after the time has run out
 *   NO_COMPARE              the kernel goes to sleep without comparing
 *   NO_SEEN                 wait_until() compares with the count at its beginning instead of that at its last end
 *
 * MODELS daemon/pipeline/doorbell.cpp Doorbell::ring 04194f5168564bb2
 * MODELS daemon/pipeline/doorbell.cpp Doorbell::wait_until e2a0ce3a7380e280
 * MODELS daemon/pipeline/doorbell.cpp futex_wait 8fbc3e3b85a7c6bd
 * MODELS daemon/pipeline/doorbell.hpp class Doorbell 2d15a7ca66b5966e
 * MODELS daemon/pipeline/doorbell.hpp class StopFlag 1eeb57f8aeee5271
 * MODELS daemon/pipeline/stage_thread.cpp StageThread::request_stop ab6764c83aa539cd
 * MODELS daemon/pipeline/stage_thread.cpp StageThread::start e214d45bf80adc24
 */
#ifndef FIRST_RINGS
#define FIRST_RINGS 2    /* of the first thread that rings; the second rings once */
#endif
#define RINGS (FIRST_RINGS + 1)
#define RINGERS 2
#define THREADS 3
#define OBJECTS 3
#define PLAINS RINGS
#define HISTORY 12
#include "weak_memory.pml"

#define WAITER RINGERS
#define COUNT 0
#define SLEEPERS 1
#define STOP 2

#if defined(NO_ORDER_RING_COUNT)
#define RING_COUNT ACQ_REL
#elif defined(NO_RELEASE)
#define RING_COUNT RELAXED
#else
#define RING_COUNT SEQ_CST
#endif
#ifdef NO_ORDER_RING_SLEEPERS
#define RING_SLEEPERS ACQUIRE
#else
#define RING_SLEEPERS SEQ_CST
#endif
#ifdef NO_ORDER_SLEEPER
#define SLEEPER ACQ_REL
#else
#define SLEEPER SEQ_CST
#endif
#if defined(NO_ORDER_COUNT)
#define FIRST_LOOK ACQUIRE
#elif defined(NO_ACQUIRE_FIRST)
#define FIRST_LOOK RELAXED
#else
#define FIRST_LOOK SEQ_CST
#endif
#ifdef NO_ACQUIRE_WOKEN
#define WOKEN_LOOK RELAXED
#else
#define WOKEN_LOOK ACQUIRE
#endif
#ifdef NO_ACQUIRE_LATE
#define LATE_LOOK RELAXED
#else
#define LATE_LOOK ACQUIRE
#endif

bool asleep = false;
byte rung_by[RINGS + 1];   /* who rang first, second, ...: its thread, plus one */

proctype ringer(byte me) {
  byte round = 0, old, sleepers;
  do
  :: round == (me == 0 -> FIRST_RINGS : 1) -> break
  :: else ->
     plain_write(me, me * FIRST_RINGS + round);
     if
     :: me == 0 && round == FIRST_RINGS - 1 -> atomic_store(me, STOP, 1, RELAXED)
     :: else
     fi;
     atomic {
       atomic_exchange(me, COUNT, old + 1, RING_COUNT, old);
       rung_by[old + 1] = me + 1;
       old = 0
     }
     atomic_load(me, SLEEPERS, RING_SLEEPERS, sleepers);
     if
     :: sleepers != 0 -> atomic { enter_futex_queue(me); asleep = false }
     :: else
     fi;
     sleepers = 0;
     round++
  od
}

/* Reads what was written before the rings number from..to. */
inline take(from, to) {
  number = from;
  do
  :: number > to -> break
  :: else ->
     who = rung_by[number] - 1;
     plain_read(WAITER, who * FIRST_RINGS + taken[who]);
     taken[who] = taken[who] + 1;
     if
     :: who == 0 && taken[who] == FIRST_RINGS -> atomic_load(WAITER, STOP, RELAXED, stop); assert(stop == 1)
     :: else
     fi;
     number++
  od;
  number = 0; who = 0; stop = 0
}

proctype waiter() {
  byte seen = 0, count, compared, old, number, who, stop, taken[RINGERS];
  bool may_run_out = true, ran_out;
  do
  :: seen == RINGS -> break
  :: else ->
     atomic_exchange(WAITER, SLEEPERS, old + 1, SLEEPER, old);
     atomic_load(WAITER, COUNT, FIRST_LOOK, count);
#ifdef NO_SEEN
     seen = count;
#endif
     do
     :: count != seen -> break
     :: else ->
        ran_out = false;
        atomic {
          enter_futex_queue(WAITER);
          atomic_load(WAITER, COUNT, RELAXED, compared);
#ifdef NO_COMPARE
          asleep = true;
#else
          asleep = (compared == seen);
#endif
          compared = 0
        }
        if
        :: !asleep
        :: may_run_out -> asleep = false; ran_out = true
        fi;
        may_run_out = false;
        if
        :: ran_out -> atomic_load(WAITER, COUNT, LATE_LOOK, count); break
        :: else -> atomic_load(WAITER, COUNT, WOKEN_LOOK, count)
        fi
     od;
     atomic_exchange(WAITER, SLEEPERS, old - 1, RELAXED, old);
     old = 0; ran_out = false;
     take(seen + 1, count);
     seen = count;
     count = 0
  od
}

init {
  atomic { run ringer(0); run ringer(1); run waiter() }
}
