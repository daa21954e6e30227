#include "idl/shm_ring.hpp"

#include <gtest/gtest.h>
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <deque>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/idl/shm_bed.hpp"

namespace tubed {
namespace {

constexpr std::size_t kWords = 32;
using Words = std::array<std::uint64_t, kWords>;

/// Writer and reader over the same memory of one process.
class ShmRing : public ::testing::Test {
 protected:
  static constexpr ShmGeometry kGeometry{4, kWords * 8};

  void publish(std::uint64_t number) {
    Words words{};
    fill_pattern(words, number);
    writer_.publish(std::as_bytes(std::span(words)), 1000);
  }

  static bool is_whole_pattern(const ShmSample& sample) {
    Words words{};
    return sample.copy(0, std::as_writable_bytes(std::span(words))) && sample.whole() &&
           is_pattern(words, sample.number());
  }

  struct alignas(64) Line {
    std::byte bytes[64];
  };
  std::vector<Line> memory_ = std::vector<Line>(kGeometry.segment_bytes() / 64);
  std::byte* bytes_ = memory_[0].bytes;
  ShmRingWriter writer_{bytes_, kGeometry, {TUBED_SHM_IMAGES, 1, "lateral", 77}, 5};
  ShmRingReader reader_{bytes_, kGeometry.segment_bytes()};
};

TEST_F(ShmRing, AReaderLearnsWhatTheWriterSaysOfItself) {
  EXPECT_EQ(reader_.identity().content, static_cast<std::uint32_t>(TUBED_SHM_IMAGES));
  EXPECT_EQ(reader_.identity().name, "lateral");
  EXPECT_EQ(reader_.identity().writer_start, 77U);
  EXPECT_EQ(reader_.geometry().slot_count, 4U);
  EXPECT_EQ(reader_.heartbeat_ns(), 5);
}

TEST_F(ShmRing, BeforeTheFirstSampleThereIsNone) {
  EXPECT_EQ(reader_.newest(), 0U);
  EXPECT_FALSE(reader_.look(0).whole());
  EXPECT_FALSE(reader_.look(1).whole());
}

TEST_F(ShmRing, EverySampleTheRingStillHoldsIsRead) {
  for (std::uint64_t number = 1; number <= 6; ++number) {
    publish(number);
  }
  EXPECT_EQ(reader_.newest(), 6U);
  for (std::uint64_t number = 3; number <= 6; ++number) {
    EXPECT_TRUE(is_whole_pattern(reader_.look(number))) << number;
  }
  EXPECT_FALSE(is_whole_pattern(reader_.look(2)));
}

TEST_F(ShmRing, ASampleOfAnyLengthComesAsItWasWritten) {
  for (const std::size_t length : {0U, 1U, 7U, 8U, 9U, 63U, 255U, 256U}) {
    std::vector<std::byte> sent(length, std::byte{0x5a});
    writer_.publish(sent, 1);
    const ShmSample sample = reader_.look(reader_.newest());
    std::vector<std::byte> got(sample.bytes());
    ASSERT_EQ(sample.bytes(), length);
    EXPECT_TRUE(sample.copy(0, got));
    EXPECT_TRUE(sample.whole());
    EXPECT_EQ(got, sent);
  }
}

TEST_F(ShmRing, ASampleUnderThePenIsNotWhole) {
  publish(1);
  const ShmSample first = reader_.look(1);
  for (std::uint64_t number = 2; number <= 4; ++number) {
    publish(number);
  }
  EXPECT_TRUE(first.whole());
  writer_.begin();  // sample 5, in the slot of sample 1
  EXPECT_FALSE(first.whole());
  EXPECT_FALSE(reader_.look(5).whole());
  EXPECT_EQ(reader_.newest(), 4U);
}

TEST_F(ShmRing, WhatIsFilledInPlaceIsPublishedByCommit) {
  std::byte* payload = writer_.begin();
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(payload) % 64, 0U);
  Words words{};
  fill_pattern(words, 1);
  std::memcpy(payload, words.data(), sizeof(words));
  EXPECT_EQ(reader_.newest(), 0U);
  EXPECT_EQ(writer_.commit(sizeof(words), 9), 1U);
  EXPECT_TRUE(is_whole_pattern(reader_.look(1)));
  EXPECT_EQ(reader_.look(1).published_ns(), 9);
}

TEST_F(ShmRing, MoreThanASampleHasIsNotCopied) {
  publish(1);
  std::array<std::byte, 8> to{};
  EXPECT_TRUE(reader_.look(1).copy(kWords * 8 - 8, to));
  EXPECT_FALSE(reader_.look(1).copy(kWords * 8, to));
  EXPECT_FALSE(reader_.look(1).copy(std::size_t{1} << 40U, to));
}

TEST_F(ShmRing, ALengthThatTheWriterInventsIsCutToTheSlot) {
  publish(1);
  const std::uint64_t invented = ~std::uint64_t{0};
  std::memcpy(
      bytes_ + TUBED_SHM_HEADER_BYTES + kGeometry.slot_bytes() + offsetof(tubed_shm_slot, payload_bytes),
      &invented, sizeof(invented));
  EXPECT_EQ(reader_.look(1).bytes(), kWords * 8);
}

TEST_F(ShmRing, AHeaderThatContradictsItsMemoryIsRefused) {
  EXPECT_THROW(ShmRingReader(bytes_, TUBED_SHM_HEADER_BYTES - 1), ShmError);
  EXPECT_THROW(ShmRingReader(bytes_, kGeometry.segment_bytes() - 1), ShmError);
  auto& header = *reinterpret_cast<tubed_shm_header*>(bytes_);
  const tubed_shm_header good = header;
  for (const std::uint32_t count : {0U, 1U, 1025U, 5U}) {
    header.slot_count = count;
    EXPECT_THROW(ShmRingReader(bytes_, kGeometry.segment_bytes()), ShmError) << count;
  }
  header = good;
  header.slot_bytes += 64;
  EXPECT_THROW(ShmRingReader(bytes_, kGeometry.segment_bytes()), ShmError);
  header = good;
  header.payload_bytes = ~std::uint64_t{0} - 100;
  EXPECT_THROW(ShmRingReader(bytes_, kGeometry.segment_bytes()), ShmError);
  header = good;
  header.layout_version = 2;
  EXPECT_THROW(ShmRingReader(bytes_, kGeometry.segment_bytes()), ShmError);
  header = good;
  header.magic = 0;
  EXPECT_THROW(ShmRingReader(bytes_, kGeometry.segment_bytes()), ShmError);
}

TEST_F(ShmRing, ANumberThatGoesBackwardsIsNoNewsAndEndsNoWait) {
  publish(1);
  publish(2);
  auto& header = *reinterpret_cast<tubed_shm_header*>(bytes_);
  std::atomic_ref(header.newest).store(1);
  const std::int64_t before_ns = shm_test_now_ns();
  reader_.wait(2, before_ns + 2'000'000);
  EXPECT_GE(shm_test_now_ns(), before_ns + 2'000'000);
}

/// Readers that sleep until there is a sample, each in a thread of its own.
class Sleepers {
 public:
  Sleepers(const ShmRingReader& reader, int count) {
    for (int i = 0; i < count; ++i) {
      std::atomic<pid_t>& id = ids_.emplace_back(0);
      threads_.emplace_back([&reader, &id] {
        id = static_cast<pid_t>(syscall(SYS_gettid));
        while (reader.newest() == 0) {
          reader.wait(0, shm_test_now_ns() + 60'000'000'000);
        }
      });
      while (id == 0 || !is_asleep(id)) {
        std::this_thread::yield();
      }
    }
  }
  ~Sleepers() {
    for (std::thread& thread : threads_) {
      thread.join();
    }
  }

  /// Those that still sleep: woken ones count as running at once.
  [[nodiscard]] std::ptrdiff_t asleep() const { return std::count_if(ids_.begin(), ids_.end(), is_asleep); }

 private:
  static bool is_asleep(pid_t thread) {
    std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/syscall");
    int call = -1;
    return file >> call && call == SYS_futex;
  }
  std::deque<std::atomic<pid_t>> ids_;
  std::vector<std::thread> threads_;
};

TEST(ShmWriter, WithoutAnotherThreadItWakesAllReadersItself) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket()), shm_test_now_ns());
  ShmVisit visit(folder.socket(), {});
  writer.beat(shm_test_now_ns());
  const ShmReader reader(visit.answer(0).value(), small_reader(folder.socket()));
  const Sleepers sleepers(reader.ring(), 3 * ShmRingWriter::kMaxWoken);
  EXPECT_EQ(sleepers.asleep(), 3 * ShmRingWriter::kMaxWoken);
  writer.publish(std::array<std::byte, 8>{}, shm_test_now_ns());
  EXPECT_EQ(sleepers.asleep(), 0);
}

TEST_F(ShmRing, OfManySleepersASampleWakesAFewAndAnotherThreadTheRest) {
  constexpr int kCount = 100;
  const auto& header = *reinterpret_cast<const tubed_shm_header*>(bytes_);
  const Sleepers sleepers(reader_, kCount);
  publish(1);
  EXPECT_TRUE(writer_.leaves_sleepers());
  EXPECT_EQ(syscall(SYS_futex, &header.wake, FUTEX_WAKE, 1, nullptr, nullptr, 0), 1)
      << "nobody was left asleep";
  std::thread([&] { writer_.wake_sleepers(); }).join();
  EXPECT_EQ(syscall(SYS_futex, &header.wake, FUTEX_WAKE, kCount, nullptr, nullptr, 0), 0)
      << "somebody sleeps on";
}

TEST_F(ShmRing, AFewSleepersAreAllWokenByTheSampleItself) {
  const auto& header = *reinterpret_cast<const tubed_shm_header*>(bytes_);
  const Sleepers sleepers(reader_, ShmRingWriter::kMaxWoken - 1);
  publish(1);
  EXPECT_FALSE(writer_.leaves_sleepers());
  EXPECT_EQ(syscall(SYS_futex, &header.wake, FUTEX_WAKE, 1, nullptr, nullptr, 0), 0) << "somebody sleeps on";
}

TEST_F(ShmRing, WaitingEndsAtTheDeadline) {
  publish(1);
  const std::int64_t before_ns = shm_test_now_ns();
  reader_.wait(1, before_ns + 2'000'000);
  EXPECT_GE(shm_test_now_ns(), before_ns + 2'000'000);
}

TEST_F(ShmRing, WhoIsRungUpWithoutNewsIsNotKept) {
  publish(1);
  auto& header = *reinterpret_cast<tubed_shm_header*>(bytes_);
  std::atomic<bool> done{false};
  std::thread mad([&] {
    while (!done) {
      std::atomic_ref(header.wake).fetch_add(1);
      syscall(SYS_futex, &header.wake, FUTEX_WAKE, 1, nullptr, nullptr, 0);
      std::this_thread::yield();
    }
  });
  const std::int64_t begun_ns = shm_test_now_ns();
  reader_.wait(1, begun_ns + 20'000'000'000);
  const std::int64_t kept_ns = shm_test_now_ns() - begun_ns;
  done = true;
  mad.join();
  EXPECT_LT(kept_ns, 10'000'000'000);
}

TEST_F(ShmRing, AGoodbyeEndsWaiting) {
  writer_.end();
  reader_.wait(0, shm_test_now_ns() + 60'000'000'000);
  EXPECT_TRUE(reader_.has_ended());
}

TEST_F(ShmRing, ASleeperIsWokenBySamplesOfAnotherThread) {
  constexpr std::uint64_t kSamples = 2000;
  std::atomic<std::uint64_t> reached{0};
  std::thread sleeper([&] {
    std::uint64_t seen = 0;
    while (seen < kSamples) {
      reader_.wait(seen, shm_test_now_ns() + 60'000'000'000);
      seen = reader_.newest();
      reached.store(seen);
    }
  });
  for (std::uint64_t number = 1; number <= kSamples; ++number) {
    publish(number);
    while (reached.load() < number) {
      std::this_thread::yield();
    }
  }
  sleeper.join();
  EXPECT_EQ(reached.load(), kSamples);
}

TEST_F(ShmRing, NoReaderEverTakesATornSampleForAWholeOne) {
  constexpr std::uint64_t kSamples = 100'000;
  std::atomic<std::uint64_t> torn{0};
  std::atomic<std::uint64_t> whole{0};
  const auto read = [&] {
    for (std::uint64_t newest = 0; newest < kSamples;) {
      newest = reader_.newest();
      // The oldest slot, where the writer is about to be: nearly every look meets it.
      const ShmSample sample = reader_.look(newest > 3 ? newest - 3 : newest);
      Words words{};
      if (sample.copy(0, std::as_writable_bytes(std::span(words))) && sample.whole()) {
        ++whole;
        torn += is_pattern(words, sample.number()) ? 0 : 1;
      }
    }
  };
  std::thread one(read);
  std::thread other(read);
  for (std::uint64_t number = 1; number <= kSamples; ++number) {
    publish(number);
  }
  one.join();
  other.join();
  EXPECT_GT(whole.load(), 0U);
  EXPECT_EQ(torn.load(), 0U);
}

}  // namespace
}  // namespace tubed
