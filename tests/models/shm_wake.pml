/* How sleeping readers of idl/shm_ring.hpp are woken, under the C++ memory model of weak_memory.pml: no sample is slept
 * through, though readers write nothing that the writer could see, and none is left when the writer says that it ends.
 *
 * The writer stores `newest`, then adds one to `wake`, then tells the kernel to wake one reader (kMaxWoken of the code, in
 * which it is more); when it has woken as many, more may be asleep, and another thread is told to wake them, one after the
 * other until a call has woken none. The writer may stop for ever after any sample, or say that it ends, which it does the
 * same way with its state, and then wakes all itself. Which of the sleepers the kernel wakes is left open. A reader loads
 * `wake`, looks at `newest` and the state, and asks the kernel to sleep unless `wake` has changed (FUTEX_WAIT compares and
 * goes to sleep as one). News are asked for as in ShmReader::news(): newest, then the state, and when that says that the
 * writer has ended, newest once more.
 * Two readers; -DREADERS=3 -DSAMPLES=1 passes too, in a minute and 23 million states.
 * Claims: each reader comes to know of the last sample and of the end; a lost wake is an invalid end state (it would cost
 * the time limit of a sleep, not for ever). Who knows of the end knows of the last sample.
 * Negative controls; each takes one thing away that the code relies on, and the checker must then find a counterexample:
 *   WAKE_FIRST         the word is changed before `newest`
 *   LOOK_FIRST         the reader looks at `newest` before it loads the word
 *   NO_COMPARE         the kernel does not compare
 *   NO_RELEASE_WAKE    the word may become visible before `newest` or the state
 *   NO_ACQUIRE_WAKE    `newest` and the state may be looked at before the word
 *   NO_RELEASE_STATE   the end may become visible before the last sample
 *   NO_ACQUIRE_STATE   the second look at `newest` may happen before the look at the state
 *   NO_SECOND_LOOK     news() says that the writer has ended without looking for a last sample
 *   NO_WAKER           nobody wakes those whom commit() has left asleep
 *   ONE_PORTION        the other thread stops after one call though that one was full
 *
 * MODELS idl/shm_ring.cpp ShmRingWriter::commit 78f9506ccdbbd938
 * MODELS idl/shm_ring.cpp ShmRingWriter::end fd63c0436a8b2528
 * MODELS idl/shm_ring.cpp ShmRingWriter::ring c82a43ec2f040b32
 * MODELS idl/shm_ring.cpp ShmRingWriter::wake_some d3bb82dc976e1473
 * MODELS idl/shm_ring.cpp ShmRingWriter::wake_sleepers 866ab5be6a221a82
 * MODELS idl/shm_writer.cpp ShmWriter::commit f00bd869061107dd
 * MODELS idl/shm_ring.cpp ShmRingReader::newest 201f910f5a6b2533
 * MODELS idl/shm_ring.cpp ShmRingReader::has_ended e467f9554c8068df
 * MODELS idl/shm_ring.cpp ShmRingReader::wait 8dafdb47e0649188
 * MODELS idl/shm_ring.cpp futex 94b225a92b884029
 * MODELS idl/shm_reader.cpp ShmReader::news b9ab038f3daae234
 */
#ifndef SAMPLES
#define SAMPLES 2
#endif
#ifndef READERS
#define READERS 2
#endif
#define NEWEST 0
#define STATE 1
#define WAKE 2

#define THREADS (READERS + 1)
#define OBJECTS 3
#define PLAINS 0
#define HISTORY (SAMPLES + 3)
#include "weak_memory.pml"

#define WRITER READERS
#ifdef NO_WAKER
#define FIRST_READER 1   /* _pid of the first one: processes count from 0 in the order of this file */
#else
#define FIRST_READER 2
#endif

#ifdef NO_RELEASE_WAKE
#define WAKE_STORE RELAXED
#else
#define WAKE_STORE RELEASE
#endif
#ifdef NO_ACQUIRE_WAKE
#define WAKE_LOAD RELAXED
#else
#define WAKE_LOAD ACQUIRE
#endif
#ifdef NO_RELEASE_STATE
#define STATE_STORE RELAXED
#else
#define STATE_STORE RELEASE
#endif
#ifdef NO_ACQUIRE_STATE
#define STATE_LOAD RELAXED
#else
#define STATE_LOAD ACQUIRE
#endif

bool sleeping[3];   /* two or three readers */
bool rests = false;   /* the writer does nothing more, and has not said so */
bool asked = false;   /* the other thread is asked to go on; a doorbell, see doorbell.pml */

/* FUTEX_WAKE of one: any of those who sleep. */
#define WAKE_ONE(woken)                                                   \
  atomic {                                                                \
    if                                                                    \
    :: sleeping[0] -> sleeping[0] = false; woken = true                   \
    :: sleeping[1] -> sleeping[1] = false; woken = true                   \
    :: sleeping[2] -> sleeping[2] = false; woken = true                   \
    :: else -> woken = false                                              \
    fi                                                                    \
  }

#define RING                                        \
  wakes++;                                          \
  atomic_store(WRITER, WAKE, wakes, WAKE_STORE)

#define TELL_THE_KERNEL(woken)                      \
  d_step { enter_futex_queue(WRITER) };             \
  WAKE_ONE(woken)

active proctype writer() {
  byte n = 1, wakes = 0;
  bool woken;
  do
  :: n > SAMPLES -> break
  :: n > 1 -> rests = true; goto at_rest
  :: n <= SAMPLES ->
#ifdef WAKE_FIRST
     RING;
     TELL_THE_KERNEL(woken);
     atomic_store(WRITER, NEWEST, n, RELEASE);
#else
     atomic_store(WRITER, NEWEST, n, RELEASE);
     RING;
     TELL_THE_KERNEL(woken);
#endif
     if
     :: woken -> asked = true   /* leaves_sleepers() */
     :: else
     fi;
     woken = false;
     n++
  od;
  if
  :: true -> rests = true   /* for ever, without a word */
  :: atomic_store(WRITER, STATE, 1, STATE_STORE);
     RING;
     do
     :: TELL_THE_KERNEL(woken);
        if
        :: !woken -> break
        :: else
        fi
     od
  fi;
at_rest:
  skip
}

#ifndef NO_WAKER
/* wake_sleepers() of the other thread: it calls the kernel only. */
active proctype waker() {
  bool woken;
end_waiting:
  do
  :: atomic { asked -> asked = false };
     do
     :: WAKE_ONE(woken);
        if
        :: !woken -> break
#ifdef ONE_PORTION
        :: woken -> woken = false; break
#else
        :: woken -> woken = false
#endif
        fi
     od
  od
}
#endif

active [READERS] proctype reader() {
  byte me, taken = 0, rung, found, ended, word;
  d_step { me = _pid - FIRST_READER };
  do
  :: true ->
     /* news() */
     atomic_load(me, NEWEST, ACQUIRE, found);
     if
     :: found > taken -> taken = found; found = 0; goto next
     :: else ->
        atomic_load(me, STATE, STATE_LOAD, ended);
        if
        :: ended ->
#ifndef NO_SECOND_LOOK
           atomic_load(me, NEWEST, ACQUIRE, found);
           taken = found;
#endif
           break
        :: else
        fi
     fi;
     /* wait() */
#ifdef LOOK_FIRST
     atomic_load(me, NEWEST, ACQUIRE, found);
     atomic_load(me, STATE, STATE_LOAD, ended);
     atomic_load(me, WAKE, WAKE_LOAD, rung);
#else
     atomic_load(me, WAKE, WAKE_LOAD, rung);
     atomic_load(me, NEWEST, ACQUIRE, found);
     atomic_load(me, STATE, STATE_LOAD, ended);
#endif
     if
     :: found > taken || ended
     :: else ->
        atomic {
          enter_futex_queue(me);
          atomic_load(me, WAKE, RELAXED, word);
#ifdef NO_COMPARE
          sleeping[me] = true;
#else
          sleeping[me] = (word == rung);
#endif
          word = 0
        }
        if
        :: !sleeping[me]
        :: rests && taken == value[STORE_OF(NEWEST, newest_store[NEWEST])] -> goto done
        fi
     fi;
     rung = 0; found = 0; ended = 0;
next:
     skip
  od;
  assert(taken == value[STORE_OF(NEWEST, newest_store[NEWEST])]);
done:
  skip
}
