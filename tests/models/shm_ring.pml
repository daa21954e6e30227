/* idl/shm_ring.hpp under the C++ memory model of weak_memory.pml: a ring of two slots, a writer that may be killed at any
 * instant, and a reader (readers write nothing, so that one stands for all; killing one changes nothing).
 *
 * A sample is one word of the payload and the word in the slot that says how long it is, both set to the sample's number.
 * A publication is five stores: mark (odd sequence), word, length, completion (even sequence), `newest`. The reader takes
 * the sample that `newest` names, or asks for any other number; it loads the sequence, length, word and the sequence again.
 *
 * Claims: a sample that the reader takes for whole has both words of its number; `newest` only grows; the sample that it
 * names is complete, or overwritten, but not still to come; and it can be read when the writer rests, also when it was
 * killed in the middle of the next one.
 * Negative controls; each takes one thing away that the code relies on, and the checker must then find a counterexample:
 *   NO_MARK                the writer does not mark the slot
 *   NO_RELEASE_WORD        write(): the word may become visible before the mark
 *   NO_RELEASE_LENGTH      commit(): the same of the length
 *   NO_RELEASE_COMPLETION  commit(): the even sequence may become visible before the words
 *   NO_RELEASE_NEWEST      commit(): `newest` may become visible before the even sequence
 *   NO_ACQUIRE_NEWEST      newest(): what it names may be looked at before
 *   NO_ACQUIRE_LOOK        ShmSample(): the words may be loaded before the first look at the sequence
 *   NO_ACQUIRE_LENGTH      ShmSample(): the second look may happen before the length is loaded
 *   NO_ACQUIRE_WORD        copy(): the second look may happen before the word is loaded
 *   NO_SECOND_LOOK         the reader does not look again
 *   ONE_SLOT               the newest sample lies where the next one is written
 * With IN_PLACE the word is stored relaxed, as a grabber does that fills the slot between begin() and commit(); its control:
 *   IN_PLACE,NO_FENCE      begin() has no fence behind the mark
 *
 * MODELS idl/shm_ring.cpp ShmRingWriter::begin d37219e43854c31e
 * MODELS idl/shm_ring.cpp ShmRingWriter::write 85fbe2b07c1f1fd3
 * MODELS idl/shm_ring.cpp ShmRingWriter::commit 78f9506ccdbbd938
 * MODELS idl/shm_ring.cpp ShmRingWriter::publish ec0d6c103b8dbd47
 * MODELS idl/shm_ring.cpp ShmRingWriter::slot_of b1a07b780a3381c2
 * MODELS idl/shm_ring.cpp keep_behind_the_mark 71bce37d9c93f4a6
 * MODELS idl/shm_ring.cpp ShmSample::ShmSample a3cedcf59c1341c6
 * MODELS idl/shm_ring.cpp ShmSample::copy c0bc4671382e0a87
 * MODELS idl/shm_ring.cpp ShmSample::whole c7f462f4c4dd1874
 * MODELS idl/shm_ring.cpp ShmRingReader::newest 201f910f5a6b2533
 * MODELS idl/shm_ring.cpp ShmRingReader::look 9d3258eff23d8b52
 * MODELS idl/shm_reader.cpp ShmReader::oldest 4d99948a411a4f0b
 * MODELS idl/shm_reader.cpp ShmReader::take 56151d41471e5789
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
#define SEQUENCE(n) (SLOT(n))
#define WORD(n) (2 + SLOT(n))
#define LENGTH(n) (4 + SLOT(n))
#define NEWEST 6

#define THREADS 2
#define OBJECTS 7
#define PLAINS 0
#define HISTORY (2 * SAMPLES + 2)
#include "weak_memory.pml"

#define WRITER 0
#define READER 1

#if defined(NO_RELEASE_WORD) || defined(IN_PLACE)
#define WORD_STORE RELAXED
#else
#define WORD_STORE RELEASE
#endif
#ifdef NO_RELEASE_LENGTH
#define LENGTH_STORE RELAXED
#else
#define LENGTH_STORE RELEASE
#endif
#ifdef NO_RELEASE_COMPLETION
#define COMPLETION_STORE RELAXED
#else
#define COMPLETION_STORE RELEASE
#endif
#ifdef NO_RELEASE_NEWEST
#define NEWEST_STORE RELAXED
#else
#define NEWEST_STORE RELEASE
#endif
#ifdef NO_ACQUIRE_NEWEST
#define NEWEST_LOAD RELAXED
#else
#define NEWEST_LOAD ACQUIRE
#endif
#ifdef NO_ACQUIRE_LOOK
#define FIRST_LOOK RELAXED
#else
#define FIRST_LOOK ACQUIRE
#endif
#ifdef NO_ACQUIRE_LENGTH
#define LENGTH_LOAD RELAXED
#else
#define LENGTH_LOAD ACQUIRE
#endif
#ifdef NO_ACQUIRE_WORD
#define WORD_LOAD RELAXED
#else
#define WORD_LOAD ACQUIRE
#endif

bool rests = false;   /* the writer has ended or was killed, and time has passed: all its stores have arrived */

active proctype writer() {
  byte n = 1;
  do
  :: n > SAMPLES -> break
  :: true -> break   /* killed between two samples */
  :: n <= SAMPLES ->
#ifndef NO_MARK
     /* Relaxed is enough here: what puts the mark before the words is their own release, or the fence. */
     atomic_store(WRITER, SEQUENCE(n), 2 * n - 1, RELAXED);
#endif
#ifndef NO_FENCE
#ifdef IN_PLACE
     release_fence(WRITER);
#endif
#endif
     if :: true -> break :: true fi;
     atomic_store(WRITER, WORD(n), n, WORD_STORE);
     if :: true -> break :: true fi;
     atomic_store(WRITER, LENGTH(n), n, LENGTH_STORE);
     if :: true -> break :: true fi;
     atomic_store(WRITER, SEQUENCE(n), 2 * n, COMPLETION_STORE);
     if :: true -> break :: true fi;
     atomic_store(WRITER, NEWEST, n, NEWEST_STORE);
     n++
  od;
  rests = true
}

active proctype reader() {
  byte n = 0, sequence, word, length, again, last = 0;
  bool rested, named;
end_reading:
  do
  :: true ->
     atomic {
       rested = rests;
       if
       :: rested -> d_step { JOIN(view, READER * CLOCKS, newest_store, 0) }
       :: else
       fi
     }
     atomic_load(READER, NEWEST, NEWEST_LOAD, n);
     assert(n >= last);
     last = n;
     named = true;
     if
     :: true
     :: !rested -> named = false; select(n : 1 .. SAMPLES)   /* any number, also one to come */
     fi;
     if
     :: n != 0 ->
        atomic_load(READER, SEQUENCE(n), FIRST_LOOK, sequence);
        assert(!named || sequence >= 2 * n);
        atomic_load(READER, LENGTH(n), LENGTH_LOAD, length);
        if
        :: sequence == 2 * n ->
           atomic_load(READER, WORD(n), WORD_LOAD, word);
#ifdef NO_SECOND_LOOK
           again = 2 * n;
#else
           atomic_load(READER, SEQUENCE(n), RELAXED, again);
#endif
           assert(again != 2 * n || (word == n && length == n));
           assert(!(rested && named) || again == 2 * n)   /* what a dead writer left last is there */
        :: else -> assert(!(rested && named))
        fi
     :: else
     fi;
     sequence = 0; word = 0; length = 0; again = 0; n = 0; named = false;
     if
     :: rested -> break
     :: else
     fi
  od
}
