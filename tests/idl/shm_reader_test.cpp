#include "idl/shm_reader.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <memory>
#include <thread>

#include "tests/idl/shm_bed.hpp"

namespace tubed {
namespace {

constexpr std::size_t kWords = 32;
constexpr std::int64_t kMillisecond = 1'000'000;

/// A writer that beats in a thread of its own while `use` runs: that lets readers in.
template <typename Function>
void while_beating(ShmWriter& writer, Function&& use) {
  std::atomic<bool> done{false};
  std::thread beater([&] {
    while (!done) {
      writer.beat(shm_test_now_ns());
      std::this_thread::yield();
    }
  });
  use();
  done = true;
  beater.join();
}

ShmReader connect(ShmWriter& writer, const ShmReaderSettings& settings) {
  std::optional<ShmReader> reader;
  std::exception_ptr error;
  while_beating(writer, [&] {
    try {
      reader.emplace(settings);
    } catch (const ShmError&) {
      error = std::current_exception();
    }
  });
  if (error) {
    std::rethrow_exception(error);
  }
  return std::move(*reader);
}

std::string complaint(ShmWriter& writer, const ShmReaderSettings& settings) {
  try {
    connect(writer, settings);
  } catch (const ShmError& error) {
    return error.what();
  }
  return "";
}

void publish(ShmWriter& writer, std::uint64_t number, std::int64_t now_ns = shm_test_now_ns()) {
  std::array<std::uint64_t, kWords> words{};
  fill_pattern(words, number);
  writer.publish(std::as_bytes(std::span(words)), now_ns);
}

TEST(ShmReader, OnlyWhatIsPublishedAfterItConnectedIsNews) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket()), shm_test_now_ns());
  publish(writer, 1);
  ShmReader reader = connect(writer, small_reader(folder.socket()));
  EXPECT_EQ(reader.news(shm_test_now_ns()), ShmNews::kNone);
  publish(writer, 2);
  EXPECT_EQ(reader.news(shm_test_now_ns()), ShmNews::kSample);
  EXPECT_EQ(reader.take_newest().number(), 2U);
  EXPECT_EQ(reader.news(shm_test_now_ns()), ShmNews::kNone);
}

TEST(ShmReader, ASlowReaderIsToldHowManyItLost) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket(), 4), shm_test_now_ns());
  ShmReader reader = connect(writer, small_reader(folder.socket()));
  for (std::uint64_t number = 1; number <= 10; ++number) {
    publish(writer, number);
  }
  // Of four slots three are safe: 8, 9, 10.
  EXPECT_EQ(reader.take_next().number(), 8U);
  EXPECT_EQ(reader.lost(), 7U);
  EXPECT_EQ(reader.take_newest().number(), 10U);
  EXPECT_EQ(reader.lost(), 8U);
}

TEST(ShmReader, AWriterWithoutHeartbeatIsSilentAfter200Ms) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket()), shm_test_now_ns());
  ShmReader reader = connect(writer, small_reader(folder.socket()));
  const std::int64_t beat_ns = shm_test_now_ns();
  writer.beat(beat_ns);
  EXPECT_EQ(reader.news(beat_ns + 200 * kMillisecond), ShmNews::kNone);
  EXPECT_EQ(reader.news(beat_ns + 200 * kMillisecond + 1), ShmNews::kSilent);
}

TEST(ShmReader, AHeartbeatOfTheFutureIsNoSignOfLife) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket()), shm_test_now_ns());
  ShmReader reader = connect(writer, small_reader(folder.socket()));
  const std::int64_t now_ns = shm_test_now_ns();
  for (const std::int64_t heartbeat_ns : {now_ns + 1000 * kMillisecond, INT64_MAX, INT64_MIN}) {
    writer.beat(heartbeat_ns);
    EXPECT_EQ(reader.news(now_ns), ShmNews::kSilent) << heartbeat_ns;
  }
}

TEST(ShmReader, SleepEndsWhenSilenceBegins) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket()), shm_test_now_ns());
  ShmReader reader = connect(writer, small_reader(folder.socket()));
  writer.beat(shm_test_now_ns() - 195 * kMillisecond);
  reader.sleep_until(shm_test_now_ns() + 60'000 * kMillisecond);
  EXPECT_EQ(reader.news(shm_test_now_ns()), ShmNews::kSilent);
}

TEST(ShmReader, AGoodbyeIsNotASilence) {
  const ShmFolder folder;
  auto writer = std::make_unique<ShmWriter>(small_writer(folder.socket()), shm_test_now_ns());
  ShmReader reader = connect(*writer, small_reader(folder.socket()));
  publish(*writer, 1);
  writer.reset();
  EXPECT_EQ(reader.news(shm_test_now_ns()), ShmNews::kSample);  // its last words first
  EXPECT_TRUE(reader.take_newest().whole());
  EXPECT_EQ(reader.news(shm_test_now_ns()), ShmNews::kEnded);
  EXPECT_FALSE(std::filesystem::exists(folder.socket()));
}

TEST(ShmReader, AnotherStartOfTheWriterIsAnotherMemory) {
  const ShmFolder folder;
  auto writer = std::make_unique<ShmWriter>(small_writer(folder.socket()), shm_test_now_ns());
  ShmReader first = connect(*writer, small_reader(folder.socket()));
  writer.reset();
  ShmWriter again(small_writer(folder.socket()), shm_test_now_ns());
  ShmReader second = connect(again, small_reader(folder.socket()));
  EXPECT_NE(first.identity().writer_start, second.identity().writer_start);
  publish(again, 1);
  EXPECT_EQ(first.news(shm_test_now_ns()), ShmNews::kEnded);
  EXPECT_EQ(second.news(shm_test_now_ns()), ShmNews::kSample);
}

TEST(ShmReader, WhatIsWrongWithAConnectionIsSaidInWords) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket()), shm_test_now_ns());
  ShmReaderSettings settings = small_reader(folder.socket());
  settings.content = TUBED_SHM_ESTIMATES;
  EXPECT_NE(complaint(writer, settings).find("publishes images of version 2, expected estimates"),
            std::string::npos);
  settings = small_reader(folder.socket());
  settings.trusted = {geteuid() + 1};
  EXPECT_NE(complaint(writer, settings).find("who is not trusted"), std::string::npos);
  EXPECT_NE(complaint(writer, small_reader(folder.path() + "/other.sock")).find("nobody writes at"),
            std::string::npos);
}

TEST(ShmReader, AWriterThatHangsIsGivenUpAfterTheTimeout) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket()), shm_test_now_ns());
  try {
    ShmReader reader(small_reader(folder.socket(), 1));
    FAIL() << "connected to a writer that serves nobody";
  } catch (const ShmError& error) {
    EXPECT_NE(std::string(error.what()).find("does not answer within 1 ms"), std::string::npos)
        << error.what();
  }
}

/// Counts this process's descriptors.
std::ptrdiff_t open_descriptors() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return std::distance(begin(all), end(all));
}

/// A door of somebody's own making, who answers the first visitor with a greeting and `descriptors`.
std::thread forged_door(const std::string& path, std::vector<int> descriptors) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  const int door = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  EXPECT_EQ(bind(door, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  EXPECT_EQ(listen(door, 1), 0);
  return std::thread([door, descriptors = std::move(descriptors)] {
    const int visitor = accept(door, nullptr, nullptr);
    tubed_shm_greeting greeting{TUBED_SHM_MAGIC, TUBED_SHM_LAYOUT_VERSION, TUBED_SHM_WELCOME};
    iovec part{&greeting, sizeof(greeting)};
    const std::size_t bytes = descriptors.size() * sizeof(int);
    std::vector<char> control(CMSG_SPACE(bytes));
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* rights = CMSG_FIRSTHDR(&message);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(bytes);
    std::memcpy(CMSG_DATA(rights), descriptors.data(), bytes);
    sendmsg(visitor, &message, MSG_NOSIGNAL);
    close(visitor);
    close(door);
  });
}

TEST(ShmVisit, DescriptorsThatAWriterAddsDoNotStayWithTheReader) {
  for (const std::size_t sent : {2U, 3U, 40U}) {
    const ShmFolder folder;
    const std::ptrdiff_t before = open_descriptors();
    std::thread door = forged_door(folder.socket(), std::vector<int>(sent, STDERR_FILENO));
    EXPECT_THROW(ShmReader(small_reader(folder.socket())), ShmError);
    door.join();
    EXPECT_EQ(open_descriptors(), before) << sent << " were sent";
  }
}

TEST(ShmVisit, WhoNeverWaitsIsLetInAtALaterCall) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket()), 0);
  ShmVisit visit(folder.socket(), {});
  EXPECT_FALSE(visit.answer(0).has_value());
  writer.beat(0);
  const std::optional<int> descriptor = visit.answer(0);
  ASSERT_TRUE(descriptor.has_value());
  EXPECT_EQ(ShmReader(*descriptor, small_reader(folder.socket())).identity().name, "A");
}

TEST(ShmVisit, AFullQueueAtTheDoorIsWaitedFor) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket()), 0);
  std::vector<std::unique_ptr<ShmVisit>> queue;
  for (int i = 0; i < 200; ++i) {  // more than the door lets queue
    queue.push_back(std::make_unique<ShmVisit>(folder.socket(), std::vector<uid_t>{}));
  }
  ShmVisit visit(folder.socket(), {});
  EXPECT_FALSE(visit.answer(5).has_value());
  queue.clear();
  std::optional<int> descriptor;
  for (std::int64_t now_s = 0; now_s < 100 && !descriptor; ++now_s) {
    writer.beat(now_s * 1000 * kMillisecond);  // the rate limit lets a second's worth through each time
    descriptor = visit.answer(0);
  }
  ASSERT_TRUE(descriptor.has_value());
  close(*descriptor);
}

TEST(ShmDoor, ASocketOfALivingWriterIsNotTaken) {
  const ShmFolder folder;
  const ShmWriter writer(small_writer(folder.socket()), shm_test_now_ns());
  EXPECT_THROW(ShmWriter(small_writer(folder.socket()), 0), ShmError);
  EXPECT_TRUE(std::filesystem::is_socket(folder.socket()));
}

TEST(ShmDoor, ASocketThatADeadWriterLeftIsReplaced) {
  const ShmFolder folder;
  const pid_t child = fork();
  if (child == 0) {
    const ShmWriter writer(small_writer(folder.socket()), 0);
    _exit(0);  // as if killed: nothing is cleaned up
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(std::filesystem::is_socket(folder.socket()));
  ShmWriter writer(small_writer(folder.socket()), shm_test_now_ns());
  EXPECT_EQ(connect(writer, small_reader(folder.socket())).identity().name, "A");
}

TEST(ShmDoor, AFileThatIsNoSocketStays) {
  const ShmFolder folder;
  close(open(folder.socket().c_str(), O_CREAT | O_WRONLY, 0600));
  EXPECT_THROW(ShmWriter(small_writer(folder.socket()), 0), ShmError);
  EXPECT_TRUE(std::filesystem::is_regular_file(folder.socket()));
}

TEST(ShmDoor, AFloodOfOneUserIsAnsweredWithARefusalAndCostsAFewAnswersAServing) {
  const ShmFolder folder;
  ShmWriter writer(small_writer(folder.socket()), 0);
  int admitted = 0;
  int refused = 0;
  for (int i = 0; i < 50; ++i) {
    // The answer comes from a beat while this thread waits; the writer's clock stands still.
    std::atomic<bool> done{false};
    std::thread server([&] {
      while (!done) {
        writer.beat(0);
      }
    });
    try {
      close(fetch_descriptor(folder.socket(), 5000, {}));
      ++admitted;
    } catch (const ShmError& error) {
      EXPECT_NE(std::string(error.what()).find("too often"), std::string::npos) << error.what();
      ++refused;
    }
    done = true;
    server.join();
  }
  EXPECT_EQ(admitted, static_cast<int>(ShmDoor::kBurst));
  EXPECT_EQ(refused, 50 - admitted);
  EXPECT_EQ(writer.door_counters().throttled, static_cast<std::uint64_t>(refused));
}

}  // namespace
}  // namespace tubed
