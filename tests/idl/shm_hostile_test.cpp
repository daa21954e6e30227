// What a hostile local user can do: nothing. As root the acts are those of another user (nobody, 65534).
#include <fcntl.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <functional>
#include <iterator>
#include <thread>

#include "tests/idl/shm_bed.hpp"

namespace tubed {
namespace {

constexpr uid_t kNobody = 65534;
constexpr gid_t kReaders = 54321;  // a group that need not have a name

/// Runs `act` in a child, as nobody when this is root, in the supplementary group `group` if given; its exit
/// code.
pid_t start_as_nobody(const std::function<int()>& act, std::optional<gid_t> group = {}) {
  const pid_t child = fork();
  if (child != 0) {
    return child;
  }
  const gid_t extra = group.value_or(0);
  if (geteuid() == 0 &&
      (setgroups(group ? 1 : 0, &extra) != 0 || setgid(kNobody) != 0 || setuid(kNobody) != 0)) {
    _exit(100);
  }
  _exit(act());
}

int wait_while_beating(pid_t child, ShmWriter& writer) {
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    writer.beat(shm_test_now_ns());
    std::this_thread::yield();
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string complaint_of_fetch(const std::string& path) {
  try {
    close(fetch_descriptor(path, 5000, {}));
  } catch (const ShmError& error) {
    return error.what();
  }
  return "";
}

class ShmHostileUser : public ::testing::Test {
 protected:
  void SetUp() override {
    if (geteuid() != 0) {
      GTEST_SKIP() << "SKIPPED: acting as another user needs root";
    }
  }
  ShmFolder folder_;
};

TEST_F(ShmHostileUser, AUserOutsideTheGroupCannotEvenConnect) {
  ShmWriterSettings settings = small_writer(folder_.socket());
  settings.door.group = kReaders;
  ShmWriter writer(settings, shm_test_now_ns());
  const pid_t child = start_as_nobody([&] {
    return complaint_of_fetch(folder_.socket()).find("Permission denied") != std::string::npos ? 0 : 1;
  });
  EXPECT_EQ(wait_while_beating(child, writer), 0);
  EXPECT_EQ(writer.door_counters().admitted, 0U);
}

TEST_F(ShmHostileUser, AUserWhomTheFileModeLetsThroughIsRefusedByHisCredentials) {
  ShmWriterSettings settings = small_writer(folder_.socket());
  settings.door.group = kReaders;
  ShmWriter writer(settings, shm_test_now_ns());
  chmod(folder_.socket().c_str(), 0666);  // as an administrator's mistake would
  const pid_t child = start_as_nobody([&] {
    return complaint_of_fetch(folder_.socket()).find("refuses this user") != std::string::npos ? 0 : 1;
  });
  EXPECT_EQ(wait_while_beating(child, writer), 0);
  EXPECT_EQ(writer.door_counters().refused, 1U);
}

TEST_F(ShmHostileUser, AMemberOfTheGroupIsAdmitted) {
  ShmWriterSettings settings = small_writer(folder_.socket());
  settings.door.group = kReaders;
  ShmWriter writer(settings, shm_test_now_ns());
  const pid_t child =
      start_as_nobody([&] { return complaint_of_fetch(folder_.socket()).empty() ? 0 : 1; }, kReaders);
  EXPECT_EQ(wait_while_beating(child, writer), 0);
}

/// Every act that would change the writer's memory, with a descriptor that was handed out in order; the
/// number of the first that succeeds, 0 when all fail.
int first_act_that_succeeds(int descriptor, std::size_t bytes) {
  const std::string itself = "/proc/self/fd/" + std::to_string(descriptor);
  const std::array<char, 8> scribble{};
  void* shown = mmap(nullptr, bytes, PROT_READ, MAP_SHARED, descriptor, 0);
  if (shown == MAP_FAILED) {
    return 90;
  }
  const std::array<std::function<bool()>, 13> acts{
      [&] { return mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0) != MAP_FAILED; },
      [&] { return mprotect(shown, bytes, PROT_READ | PROT_WRITE) == 0; },
      [&] { return ftruncate(descriptor, 0) == 0; },
      [&] { return ftruncate(descriptor, static_cast<off_t>(2 * bytes)) == 0; },
      [&] { return pwrite(descriptor, scribble.data(), scribble.size(), 0) > 0; },
      [&] { return write(descriptor, scribble.data(), scribble.size()) > 0; },
      [&] { return fallocate(descriptor, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, 4096) == 0; },
      [&] { return fallocate(descriptor, FALLOC_FL_ZERO_RANGE, 0, 4096) == 0; },
      [&] { return fallocate(descriptor, 0, static_cast<off_t>(bytes), 4096) == 0; },
      [&] { return fcntl(descriptor, F_ADD_SEALS, F_SEAL_WRITE) == 0; },
      [&] { return open(itself.c_str(), O_RDWR | O_CLOEXEC) >= 0 && geteuid() != 0; },
      [&] { return fchmod(descriptor, 0777) == 0 && geteuid() == kNobody; },
      [&] { return madvise(shown, bytes, MADV_REMOVE) == 0; },
  };
  for (std::size_t i = 0; i < acts.size(); ++i) {
    if (acts[i]()) {
      return static_cast<int>(i) + 1;
    }
  }
  return 0;
}

TEST_F(ShmHostileUser, AnAdmittedReaderCanChangeNothing) {
  ShmWriterSettings settings = small_writer(folder_.socket());
  settings.door.group = kReaders;
  ShmWriter writer(settings, shm_test_now_ns());
  const pid_t child = start_as_nobody(
      [&] {
        const int descriptor = fetch_descriptor(folder_.socket(), 5000, {});
        return first_act_that_succeeds(descriptor, settings.geometry.segment_bytes());
      },
      kReaders);
  EXPECT_EQ(wait_while_beating(child, writer), 0) << "the number of the act that succeeded";
}

TEST(ShmHostileReader, EvenTheWritersOwnUserCannotWriteThroughTheDescriptor) {
  const ShmFolder folder;
  const ShmWriterSettings settings = small_writer(folder.socket());
  ShmWriter writer(settings, shm_test_now_ns());
  const pid_t child = fork();
  if (child == 0) {
    const int descriptor = fetch_descriptor(folder.socket(), 5000, {});
    // Reopening needs no permission of root's; that descriptor must be of no use either.
    const int again = open(("/proc/self/fd/" + std::to_string(descriptor)).c_str(), O_RDWR | O_CLOEXEC);
    const int act = again < 0 ? 0 : first_act_that_succeeds(again, settings.geometry.segment_bytes());
    _exit(act != 0 ? act : first_act_that_succeeds(descriptor, settings.geometry.segment_bytes()));
  }
  EXPECT_EQ(wait_while_beating(child, writer), 0) << "the number of the act that succeeded";
}

/// The slowest of `count` publications, one every 200 us.
std::int64_t slowest_publish_ns(ShmWriter& writer, int count) {
  std::array<std::byte, 256> payload{};
  std::int64_t slowest_ns = 0;
  std::vector<std::int64_t> durations_ns;
  for (int i = 0; i < count; ++i) {
    const std::int64_t from_ns = shm_test_now_ns();
    writer.publish(payload, from_ns);
    durations_ns.push_back(shm_test_now_ns() - from_ns);
    usleep(200);
  }
  std::sort(durations_ns.begin(), durations_ns.end());
  slowest_ns = durations_ns[durations_ns.size() * 99 / 100];
  std::printf("publish: p50 %.1f us, p99 %.1f us, max %.1f us\n",
              static_cast<double>(durations_ns[durations_ns.size() / 2]) / 1e3,
              static_cast<double>(slowest_ns) / 1e3, static_cast<double>(durations_ns.back()) / 1e3);
  return slowest_ns;
}

TEST_F(ShmHostileUser, AFloodOfConnectionsCostsThePublisherAFewAnswers) {
  ShmWriterSettings settings = small_writer(folder_.socket());
  settings.door.group = kReaders;
  ShmWriter writer(settings, shm_test_now_ns());
  slowest_publish_ns(writer, 2000);
  const pid_t flood = start_as_nobody(
      [&] {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        const std::string path = folder_.socket();
        std::copy(path.begin(), path.end(), address.sun_path);
        while (true) {
          const int connection = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0);
          static_cast<void>(
              connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof(address)));
          close(connection);
        }
        return 0;
      },
      kReaders);
  const std::int64_t flooded_ns = slowest_publish_ns(writer, 2000);
  kill(flood, SIGKILL);
  waitpid(flood, nullptr, 0);
  const ShmDoorCounters& counters = writer.door_counters();
  std::printf("admitted %llu, throttled %llu\n", static_cast<unsigned long long>(counters.admitted),
              static_cast<unsigned long long>(counters.throttled));
  EXPECT_GT(counters.throttled, 100U) << "there was no flood";
  // Sixteen answers; a third of a period would be felt by nobody. A busy machine may take its time, hence the
  // p99.
  EXPECT_LT(flooded_ns, 10'000'000);
}

}  // namespace
}  // namespace tubed
