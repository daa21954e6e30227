// Kills writers and readers of a ring at random instants while it is read without pause, and counts what a
// reader took for whole and was not. usage: shm_stress KILLS READS [SEED]
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "tests/idl/shm_bed.hpp"

namespace tubed {
namespace {

constexpr std::size_t kWords = 16;
constexpr std::uint32_t kSlots = 4;
constexpr std::int64_t kMicrosecond = 1000;
constexpr std::int64_t kMillisecond = 1'000'000;
using Words = std::array<std::uint64_t, kWords>;

struct Tally {
  std::uint64_t whole = 0;
  std::uint64_t overtaken = 0;
  std::uint64_t torn = 0;
};

pid_t start(const std::function<void()>& act) {
  const pid_t child = fork();
  if (child == 0) {
    act();
    _exit(0);
  }
  return child;
}

void kill_now(pid_t child) {
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
}

/// Publishes without pause until it is killed.
void write_for_ever(const std::string& path) {
  ShmWriter writer(small_writer(path, kSlots, kWords * 8), shm_test_now_ns());
  Words words{};
  for (std::uint64_t number = 1;; ++number) {
    fill_pattern(words, number);
    writer.publish(std::as_bytes(std::span(words)), shm_test_now_ns());
  }
}

std::optional<ShmReader> try_connect(const std::string& path) {
  try {
    return ShmReader(small_reader(path, 1000));
  } catch (const ShmError&) {
    return {};
  }
}

ShmReader connect(const std::string& path) {
  for (int i = 0; i < 20000; ++i) {
    if (std::optional<ShmReader> reader = try_connect(path)) {
      return std::move(*reader);
    }
    usleep(200);
  }
  std::fprintf(stderr, "no writer let this reader in within some seconds\n");
  std::exit(1);
}

void read_one(ShmSample sample, Tally& tally) {
  Words words{};
  if (!sample.copy(0, std::as_writable_bytes(std::span(words))) || !sample.whole()) {
    ++tally.overtaken;
  } else {
    ++tally.whole;
    tally.torn += is_pattern(words, sample.number()) ? 0 : 1;
  }
}

/// Reads what lies next to the writer's pen, again and again, until `until_ns`.
void read_until(ShmReader& reader, std::int64_t until_ns, Tally& tally) {
  while (shm_test_now_ns() < until_ns) {
    for (int i = 0; i < 256; ++i) {
      const std::uint64_t newest = reader.ring().newest();
      const std::uint64_t under_the_pen = newest >= kSlots ? newest - kSlots + 1 : newest;
      read_one(reader.ring().look(i % 2 == 0 ? newest : under_the_pen), tally);
    }
  }
}

/// The time from the death of the writer to the news of it.
std::int64_t wait_for_silence(ShmReader& reader, std::int64_t killed_ns) {
  while (true) {
    switch (reader.news(shm_test_now_ns())) {
      case ShmNews::kSample:
        static_cast<void>(reader.take_newest());
        break;
      case ShmNews::kSilent:
        return shm_test_now_ns() - killed_ns;
      default:
        reader.sleep_until(shm_test_now_ns() + 1000 * kMillisecond);
    }
  }
}

struct WriterKills {
  int kills = 0;
  int last_sample_lost = 0;  ///< the newest sample of a dead writer could not be read
  std::vector<std::int64_t> silence_ns;
};

WriterKills kill_writers(const std::string& path, int kills, std::mt19937_64& random, Tally& tally) {
  WriterKills result;
  std::uniform_int_distribution<std::int64_t> life_ns(0, 4 * kMillisecond);
  for (; result.kills < kills; ++result.kills) {
    const pid_t writer = start([&] { write_for_ever(path); });
    ShmReader reader = connect(path);
    read_until(reader, shm_test_now_ns() + life_ns(random), tally);
    kill_now(writer);
    const std::int64_t killed_ns = shm_test_now_ns();
    Tally last;
    const std::uint64_t newest = reader.ring().newest();
    read_one(reader.ring().look(newest), last);
    result.last_sample_lost += newest != 0 && last.whole != 1 ? 1 : 0;
    tally.torn += last.torn;
    if (result.kills % 20 == 0) {
      result.silence_ns.push_back(wait_for_silence(reader, killed_ns));
    }
  }
  return result;
}

struct ReaderKills {
  int kills = 0;
  std::vector<std::int64_t> publish_ns;
  Tally bystander;
};

/// The writer is this process; its readers are killed, one other reads on.
ReaderKills kill_readers(const std::string& path, int kills, std::mt19937_64& random) {
  ReaderKills result;
  ShmWriter writer(small_writer(path, kSlots, kWords * 8), shm_test_now_ns());
  auto* shared = static_cast<Tally*>(
      mmap(nullptr, sizeof(Tally), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  const pid_t bystander = start([&] {
    ShmReader reader = connect(path);
    while (true) {
      read_until(reader, shm_test_now_ns() + kMillisecond, *shared);
    }
  });
  std::uniform_int_distribution<std::int64_t> life_ns(0, 3 * kMillisecond);
  Words words{};
  std::uint64_t number = 0;
  for (; result.kills < kills; ++result.kills) {
    const pid_t victim = start([&] {
      ShmReader reader = connect(path);
      Tally ignored;
      read_until(reader, INT64_MAX, ignored);
    });
    const std::int64_t until_ns = shm_test_now_ns() + life_ns(random);
    do {
      fill_pattern(words, ++number);
      const std::int64_t from_ns = shm_test_now_ns();
      writer.publish(std::as_bytes(std::span(words)), from_ns);
      result.publish_ns.push_back(shm_test_now_ns() - from_ns);
    } while (shm_test_now_ns() < until_ns);
    kill_now(victim);
  }
  kill_now(bystander);
  result.bystander = *shared;
  return result;
}

/// Reads another process until so many whole samples were had.
void read_many(const std::string& path, std::uint64_t reads, Tally& tally) {
  const pid_t writer = start([&] { write_for_ever(path); });
  ShmReader reader = connect(path);
  while (tally.whole < reads) {
    read_until(reader, shm_test_now_ns() + 20 * kMillisecond, tally);
  }
  kill_now(writer);
}

double microseconds(std::int64_t ns) { return static_cast<double>(ns) / static_cast<double>(kMicrosecond); }

int run(int kills, std::uint64_t reads, std::uint64_t seed) {
  const ShmFolder folder;
  std::mt19937_64 random(seed);
  Tally tally;
  const WriterKills writers = kill_writers(folder.socket(), kills, random, tally);
  const std::int64_t slowest_ns = *std::max_element(writers.silence_ns.begin(), writers.silence_ns.end());
  std::printf(
      "writer killed %d times: %d last samples lost; dead writer flagged %zu times, at the latest %.1f ms "
      "after\n",
      writers.kills, writers.last_sample_lost, writers.silence_ns.size(), microseconds(slowest_ns) / 1000);
  ReaderKills readers = kill_readers(folder.socket(), kills, random);
  std::sort(readers.publish_ns.begin(), readers.publish_ns.end());
  const std::size_t count = readers.publish_ns.size();
  std::printf(
      "reader killed %d times: %zu publications, p50 %.1f us, p99 %.1f us, max %.1f us; bystander %llu "
      "whole, %llu torn\n",
      readers.kills, count, microseconds(readers.publish_ns[count / 2]),
      microseconds(readers.publish_ns[count * 99 / 100]), microseconds(readers.publish_ns.back()),
      static_cast<unsigned long long>(readers.bystander.whole),
      static_cast<unsigned long long>(readers.bystander.torn));
  read_many(folder.socket(), reads, tally);
  std::printf("%llu torn in %llu reads (%llu more were overtaken, seen and thrown away), seed %llu\n",
              static_cast<unsigned long long>(tally.torn), static_cast<unsigned long long>(tally.whole),
              static_cast<unsigned long long>(tally.overtaken), static_cast<unsigned long long>(seed));
  const bool is_good = tally.torn == 0 && readers.bystander.torn == 0 && readers.bystander.whole > 0 &&
                       tally.overtaken > 0 && writers.last_sample_lost == 0 &&
                       slowest_ns <= 250 * kMillisecond;
  std::puts(is_good ? "passed" : "FAILED");
  return is_good ? 0 : 1;
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: shm_stress KILLS READS [SEED]\n");
    return 64;
  }
  return tubed::run(std::max(std::atoi(argv[1]), 1), std::strtoull(argv[2], nullptr, 10),
                    argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1);
}
