#include "daemon/publishing/journal.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>

namespace tubed {
namespace {

TEST(JournalEntry, WordsAndFieldsAreLinesOfTheirOwn) {
  EXPECT_EQ(journal_entry(4, "em is lost", {{"TUBED_STAGE", "em"}, {"TUBED_WHY", ""}}),
            "PRIORITY=4\nSYSLOG_IDENTIFIER=tubed\nMESSAGE=em is lost\nTUBED_STAGE=em\nTUBED_WHY=\n");
}

TEST(JournalEntry, AValueOfSeveralLinesHasItsLengthInFrontAndForgesNoField) {
  const std::string entry = journal_entry(6, "a\nPRIORITY=0", {});
  const std::string length("\x0c\0\0\0\0\0\0\0", 8);
  EXPECT_EQ(entry, "PRIORITY=6\nSYSLOG_IDENTIFIER=tubed\nMESSAGE\n" + length + "a\nPRIORITY=0\n");
}

TEST(JournalSocket, AnEntryArrivesAsOneDatagram) {
  const TemporaryFolder folder;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = folder.path() / "socket";
  std::copy(path.begin(), path.end(), address.sun_path);
  const int journal = socket(AF_UNIX, SOCK_DGRAM, 0);
  JournalSocket socket(path);
  EXPECT_FALSE(socket.send("nobody listens"));
  ASSERT_EQ(bind(journal, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);

  EXPECT_TRUE(socket.send("MESSAGE=here\n"));

  std::array<char, 64> bytes{};
  const ssize_t received = recv(journal, bytes.data(), bytes.size(), MSG_DONTWAIT);
  EXPECT_EQ(std::string(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(received, 0))),
            "MESSAGE=here\n");
  close(journal);
}

TEST(JournalSocket, OnlyTheStreamThatSystemdNamesIsTheJournals) {
  struct stat status {};
  ASSERT_EQ(fstat(STDERR_FILENO, &status), 0);
  const std::string device = std::to_string(status.st_dev);
  const std::string inode = std::to_string(status.st_ino);
  EXPECT_TRUE(JournalSocket::of_this_service((device + ":" + inode).c_str(), STDERR_FILENO).has_value());
  EXPECT_FALSE(
      JournalSocket::of_this_service((device + ":" + inode + "1").c_str(), STDERR_FILENO).has_value());
  EXPECT_FALSE(JournalSocket::of_this_service(nullptr, STDERR_FILENO).has_value());
}

}  // namespace
}  // namespace tubed
