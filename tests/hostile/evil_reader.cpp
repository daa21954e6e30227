// A reader of shared memory that was let in, or wants to be, and means harm.
//   evil_reader SOCKET sleep COUNT     lets COUNT threads sleep on the ring's bell, again and again
//   evil_reader SOCKET knock COUNT     asks COUNT times to be let in, 50 at once
//   evil_reader SOCKET hold COUNT      opens COUNT connections, never reads what is answered, keeps them
//   evil_reader SOCKET garbage COUNT   sends 4 kB of garbage over each of COUNT connections
// Says "ready" when it is at it, "done" when it has done it COUNT times, and goes on until it is ended.
#include <linux/futex.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "idl/shm_door.hpp"
#include "idl/shm_segment.hpp"

namespace {

using tubed::ShmError;
using tubed::ShmSegment;

constexpr int kAtOnce = 50;  // of the door's queue of 64

std::uint32_t* g_bell = nullptr;  // the threads of sleep() have no other way to share it
std::atomic<int> g_asleep{0};

void say(const char* word) {
  std::puts(word);
  std::fflush(stdout);
}

void* sleep_for_ever(void* /*unused*/) {
  ++g_asleep;
  while (true) {
    const std::uint32_t rung = __atomic_load_n(g_bell, __ATOMIC_ACQUIRE);
    syscall(SYS_futex, g_bell, FUTEX_WAIT, rung, nullptr, nullptr, 0);
  }
}

void sleep(const std::string& path, int count) {
  const ShmSegment segment = ShmSegment::adopt(tubed::fetch_descriptor(path, 5000, {}));
  g_bell = &reinterpret_cast<tubed_shm_header*>(segment.memory())->wake;
  pthread_attr_t small;
  pthread_attr_init(&small);
  pthread_attr_setstacksize(&small, 65536);
  pthread_t thread{};
  for (int i = 0; i < count; ++i) {
    if (pthread_create(&thread, &small, sleep_for_ever, nullptr) != 0) {
      throw ShmError("only " + std::to_string(i) + " threads");
    }
  }
  while (g_asleep < count) usleep(1000);
  say("ready");
  pause();
}

int connection_to(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  const int connection = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0);
  while (connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    usleep(200);  // the queue at the door is full
  }
  return connection;
}

void knock(const std::string& path, int count) {
  say("ready");
  for (int asked = 0; asked < count; asked += kAtOnce) {
    std::vector<std::unique_ptr<tubed::ShmVisit>> visits;
    for (int i = 0; i < kAtOnce; ++i) {
      visits.push_back(std::make_unique<tubed::ShmVisit>(path, std::vector<uid_t>{}));
    }
    for (const auto& visit : visits) {
      try {
        close(visit->answer(5000).value_or(-1));
      } catch (const ShmError&) {  // too often, as it should say
      }
    }
  }
  say("done");
  pause();
}

void hold(const std::string& path, int count) {
  say("ready");
  for (int i = 0; i < count; ++i) connection_to(path);
  say("done");
  pause();
}

void talk_garbage(const std::string& path, int count) {
  std::array<char, 4096> garbage{};
  garbage.fill('\x5a');
  say("ready");
  for (int i = 0; i < count; ++i) {
    const int connection = connection_to(path);
    static_cast<void>(send(connection, garbage.data(), garbage.size(), MSG_NOSIGNAL));
    close(connection);
  }
  say("done");
  pause();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 64;
  const std::string path = argv[1];
  const std::string act = argv[2];
  const int count = std::atoi(argv[3]);
  const rlimit many{20000, 20000};
  setrlimit(RLIMIT_NOFILE, &many);
  try {
    if (act == "sleep") sleep(path, count);
    if (act == "knock") knock(path, count);
    if (act == "hold") hold(path, count);
    if (act == "garbage") talk_garbage(path, count);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "evil_reader: %s\n", error.what());
    return 1;
  }
  return 64;
}
