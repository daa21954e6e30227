/* The C++20 memory model, as much of it as the hand-overs of this project use, for the models beside this file.
 *
 * Atomic objects. Every store to an object stays in its history, numbered in modification order. A thread's view says of
 * each object which store it knows at least; a load may return that one or any later one, chosen by the checker: this is
 * how stale values, late stores and reordered loads show. A release store carries the view of its thread, an acquire load
 * adds the view that is carried by the store it reads; a relaxed store carries what was known at the thread's last release
 * fence. A read-modify-write reads the last store, and what that one carried it carries on (release sequence). A seq_cst
 * access takes its place in one total order: a seq_cst load returns nothing older than what seq_cst accesses before it
 * stored or returned.
 *
 * Plain objects. A view also says which accesses to a plain object happened before. A write that did not happen after all
 * accesses of the others, or a read that did not happen after all their writes, is a data race, which ends the check.
 *
 * Not covered: a load that returns a store that is later in the program of its own thread by way of another thread (load
 * buffering; C++20 allows it for relaxed accesses only, no compiler or processor does it for those modelled here), and two
 * threads that both store to one object without read-modify-write (none does).
 *
 * Before it is included: THREADS, OBJECTS (atomic), PLAINS, HISTORY (the most stores to one object, with the initial one).
 */
#define RELAXED 0
#define ACQUIRE 1
#define RELEASE 2
#define ACQ_REL 3
#define SEQ_CST 7

#define HAS_ACQUIRE(order) (((order) & ACQUIRE) != 0)
#define HAS_RELEASE(order) (((order) & RELEASE) != 0)
#define HAS_TOTAL_ORDER(order) ((order) == SEQ_CST)

/* One entry of a view for each atomic object, for the writes and for the reads of each plain object. */
#define CLOCKS (OBJECTS + 2 * PLAINS)
#define WRITES(p) (OBJECTS + (p))
#define READS(p) (OBJECTS + PLAINS + (p))

byte value[OBJECTS * HISTORY];
byte newest_store[OBJECTS];
byte carried[OBJECTS * HISTORY * CLOCKS];
byte view[THREADS * CLOCKS];
byte fenced[THREADS * CLOCKS];   /* the view at the last release fence */
byte total_order[OBJECTS];       /* the last store that a seq_cst access made or returned */
byte accesses[CLOCKS];           /* how many of each there were: plain objects */
byte bucket[CLOCKS];             /* what the lock of the kernel's futex queue hands on */

hidden byte clock, place, before;

#define STORE_OF(object, number) ((object) * HISTORY + (number))

#define JOIN(to, to_base, from, from_base)                                                                  \
  clock = 0;                                                                                                \
  do                                                                                                        \
  :: clock < CLOCKS && from[(from_base) + clock] > to[(to_base) + clock] ->                                 \
     to[(to_base) + clock] = from[(from_base) + clock];                                                     \
     clock++                                                                                                \
  :: clock < CLOCKS && from[(from_base) + clock] <= to[(to_base) + clock] -> clock++                        \
  :: else -> break                                                                                          \
  od;                                                                                                       \
  clock = 0

/* Leaves in `place` the new store, which carries nothing yet but itself. */
inline append_store(thread, object, number) {
  assert(newest_store[object] + 1 < HISTORY);
  newest_store[object] = newest_store[object] + 1;
  place = STORE_OF(object, newest_store[object]);
  value[place] = number;
  view[(thread) * CLOCKS + (object)] = newest_store[object];
  carried[place * CLOCKS + (object)] = newest_store[object]
}

inline publish_view(thread, object, order) {
  if
  :: HAS_RELEASE(order) -> JOIN(carried, place * CLOCKS, view, (thread) * CLOCKS)
  :: else -> JOIN(carried, place * CLOCKS, fenced, (thread) * CLOCKS)
  fi;
  if
  :: HAS_TOTAL_ORDER(order) -> total_order[object] = newest_store[object]
  :: else
  fi
}

inline atomic_store(thread, object, number, order) {
  d_step {
    append_store(thread, object, number);
    publish_view(thread, object, order);
    place = 0
  }
}

/* `result` is a variable of the calling process. */
inline atomic_load(thread, object, order, result) {
  atomic {
    result = view[(thread) * CLOCKS + (object)];
    if
    :: HAS_TOTAL_ORDER(order) && total_order[object] > result -> result = total_order[object]
    :: else
    fi;
    do
    :: result < newest_store[object] -> result++
    :: break
    od;
    place = 0;
    d_step {
      view[(thread) * CLOCKS + (object)] = result;
      place = STORE_OF(object, result);
      if
      :: HAS_ACQUIRE(order) -> JOIN(view, (thread) * CLOCKS, carried, place * CLOCKS)
      :: else
      fi;
      if
      :: HAS_TOTAL_ORDER(order) -> total_order[object] = result
      :: else
      fi;
      result = value[place];
      place = 0
    }
  }
}

/* `number` may use `old`, a variable of the calling process, which is set to what was there. */
inline atomic_exchange(thread, object, number, order, old) {
  d_step {
    before = STORE_OF(object, newest_store[object]);
    old = value[before];
    if
    :: HAS_ACQUIRE(order) -> JOIN(view, (thread) * CLOCKS, carried, before * CLOCKS)
    :: else
    fi;
    append_store(thread, object, number);
    JOIN(carried, place * CLOCKS, carried, before * CLOCKS);
    carried[place * CLOCKS + (object)] = newest_store[object];
    publish_view(thread, object, order);
    place = 0; before = 0
  }
}

inline release_fence(thread) {
  d_step { JOIN(fenced, (thread) * CLOCKS, view, (thread) * CLOCKS) }
}

inline plain_write(thread, plain) {
  d_step {
    assert(view[(thread) * CLOCKS + WRITES(plain)] == accesses[WRITES(plain)]);  /* else a data race */
    assert(view[(thread) * CLOCKS + READS(plain)] == accesses[READS(plain)]);
    accesses[WRITES(plain)] = accesses[WRITES(plain)] + 1;
    view[(thread) * CLOCKS + WRITES(plain)] = accesses[WRITES(plain)]
  }
}

inline plain_read(thread, plain) {
  d_step {
    assert(view[(thread) * CLOCKS + WRITES(plain)] == accesses[WRITES(plain)]);  /* else a data race */
    accesses[READS(plain)] = accesses[READS(plain)] + 1;
    view[(thread) * CLOCKS + READS(plain)] = accesses[READS(plain)]
  }
}

/* The kernel's side of a futex. Its queue has a lock: who comes later knows what those before it knew. */
inline enter_futex_queue(thread) {
  JOIN(view, (thread) * CLOCKS, bucket, 0);
  JOIN(bucket, 0, view, (thread) * CLOCKS)
}
