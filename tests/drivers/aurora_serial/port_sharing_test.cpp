// A port that others want as well, and a line that takes nothing.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cerrno>
#include <filesystem>

#include "drivers/aurora_serial/serial_port.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/laboratory/aurora_emulator/pseudo_terminal.hpp"
#include "tests/drivers/aurora_serial/other_program.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;
using aurora::as_bytes;
using aurora::emulator::PseudoTerminal;
using std::chrono::milliseconds;
using std::chrono::seconds;

bool says(const aurora::Problem& words, const std::string& part) {
  return words.text().find(part) != std::string_view::npos;
}

std::string program_text(const OtherProgram& program, const char* name) {
  return std::string(name) + " (process " + std::to_string(program.process()) + ")";
}

TEST(PortSharing, APortThatIsLockedAsNdisLibrariesDoIsInUseAndItsHolderIsNamed) {
  PseudoTerminal terminal("");
  const OtherProgram other("PlusServer", terminal.path(), OtherProgram::Lock::kRecords);
  ASSERT_TRUE(other.has_port());
  // Nothing can be found in an empty /proc but the lock's owner.
  SerialPort port(terminal.path(), {.sys = "/sys", .proc = "/nowhere", .dev = "/dev"});
  EXPECT_EQ(port.open(), EBUSY);
  EXPECT_TRUE(says(port.explain(EBUSY), "is used by process " + std::to_string(other.process())));
  SerialPort seeing(terminal.path());
  EXPECT_EQ(seeing.open(), EBUSY);
  EXPECT_TRUE(says(seeing.explain(EBUSY), program_text(other, "PlusServer"))) << seeing.explain(EBUSY).text();
}

TEST(PortSharing, TheHolderOfALockThatDoesNotNameItIsFoundByItsOpenFiles) {
  PseudoTerminal terminal("");
  const OtherProgram other("minicom", terminal.path(), OtherProgram::Lock::kWholeFile);
  ASSERT_TRUE(other.has_port());
  SerialPort port(terminal.path());
  EXPECT_EQ(port.open(), EBUSY);
  EXPECT_EQ(port.explain(EBUSY, seconds(5)).text(),
            terminal.path() + " is used by " + program_text(other, "minicom") + ": close that program");
}

TEST(PortSharing, AHolderThatMayNotBeSeenIsAnotherProgram) {
  PseudoTerminal terminal("");
  const OtherProgram other("minicom", terminal.path(), OtherProgram::Lock::kWholeFile);
  SerialPort port(terminal.path(), {.sys = "/sys", .proc = "/nowhere", .dev = "/dev"});
  EXPECT_EQ(port.open(), EBUSY);
  const aurora::Problem words = port.explain(EBUSY);
  EXPECT_TRUE(says(words, "is used by another program")) << words.text();
  EXPECT_TRUE(says(words, "fuser -v")) << words.text();
}

TEST(PortSharing, NdisLibrariesCannotTakeAPortThatIsOurs) {
  PseudoTerminal terminal("");
  SerialPort port(terminal.path());
  ASSERT_EQ(port.open(), 0);
  EXPECT_FALSE(OtherProgram("ndicapi", terminal.path(), OtherProgram::Lock::kRecords).has_port());
  EXPECT_FALSE(OtherProgram("pyserial", terminal.path(), OtherProgram::Lock::kWholeFile).has_port());
  port.close();
  EXPECT_TRUE(OtherProgram("ndicapi", terminal.path(), OtherProgram::Lock::kRecords).has_port());
}

TEST(PortSharing, AProgramThatReadsThePortAsWellIsNamedUntilItEnds) {
  PseudoTerminal terminal("");
  OtherProgram other("screen", terminal.path(), OtherProgram::Lock::kNone);
  ASSERT_TRUE(other.has_port());
  SerialPort port(terminal.path());
  ASSERT_EQ(port.open(), 0);
  port.look_around(seconds(5));
  EXPECT_TRUE(says(port.note(), program_text(other, "screen"))) << port.note().text();
  other.end();
  port.look_around(seconds(5));
  port.look_around(seconds(5));
  EXPECT_EQ(port.note().text(), "");
}

// A search that stops at its deadline goes on from there: each call gets as far as one entry at least.
TEST(PortSharing, ASearchInPiecesFindsWhatASearchAtOnceFinds) {
  PseudoTerminal terminal("");
  OtherProgram other("screen", terminal.path(), OtherProgram::Lock::kNone);
  struct stat device {};
  ASSERT_EQ(::stat(terminal.path().c_str(), &device), 0);
  const SystemPlaces places;
  PortHolderSearch search(places);
  int pieces = 0;
  while (search.found().process == 0 && pieces < 1'000'000) {
    search.look(device.st_rdev, MonotonicTime{});
    ++pieces;
  }
  EXPECT_EQ(search.found().process, other.process());
  EXPECT_GT(pieces, 3);
}

TEST(PortSharing, AnOpenThatFailsDisturbsNobody) {
  PseudoTerminal terminal("");
  const int theirs = ::open(terminal.path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
  ASSERT_EQ(::flock(theirs, LOCK_EX | LOCK_NB), 0);
  ASSERT_EQ(::ioctl(theirs, TIOCEXCL), 0);
  terminal.write(as_bytes("reply"));
  SerialPort port(terminal.path());
  EXPECT_EQ(port.open(), EBUSY);
  int exclusive = 0;
  ASSERT_EQ(::ioctl(theirs, TIOCGEXCL, &exclusive), 0);
  EXPECT_EQ(exclusive, 1);
  char room[16];
  EXPECT_EQ(::read(theirs, room, sizeof room), 5);
  ::close(theirs);
}

TEST(PortSharing, ALinkIsFollowedAnewEachTime) {
  PseudoTerminal first("");
  PseudoTerminal second("");
  const fs::path link = fs::temp_directory_path() / ("port_sharing_test." + std::to_string(::getpid()));
  fs::create_symlink(first.path(), link);
  SerialPort port(link.string());
  ASSERT_EQ(port.open(), 0);
  port.close();
  fs::remove(link);
  fs::create_symlink(second.path(), link);
  ASSERT_EQ(port.open(), 0);
  EXPECT_TRUE(second.in_use());
  EXPECT_FALSE(first.in_use());
  fs::remove(link);
}

/// Bytes written until the line takes no more.
std::size_t fill(SerialPort& port, PseudoTerminal& terminal) {
  const int descriptor = ::open(terminal.path().c_str(), O_WRONLY | O_NOCTTY | O_NONBLOCK);
  EXPECT_TRUE(port.is_open());
  const std::string block(1024, 'x');
  std::size_t filled = 0;
  for (ssize_t size = 0; (size = ::write(descriptor, block.data(), block.size())) > 0;) {
    filled += static_cast<std::size_t>(size);
  }
  ::close(descriptor);
  return filled;
}

std::size_t left_at(PseudoTerminal& terminal) {
  std::vector<std::uint8_t> bytes;
  terminal.read(bytes);
  return bytes.size();
}

TEST(PortSharing, ABreakIsABreakAndDoesNotWaitForALineThatTakesNothing) {
  PseudoTerminal terminal("");
  SerialPort port(terminal.path());
  ASSERT_EQ(port.open(), 0);
  const std::size_t filled = fill(port, terminal);
  const MonotonicTime before = monotonic_now();
  EXPECT_TRUE(port.send_break());
  const auto took = monotonic_now() - before;
  EXPECT_GE(took, milliseconds(250));
  EXPECT_LT(took, seconds(2));
  EXPECT_LT(left_at(terminal), filled / 2);
}

TEST(PortSharing, ClosingThrowsAwayWhatTheLineDoesNotTake) {
  PseudoTerminal terminal("");
  SerialPort port(terminal.path());
  ASSERT_EQ(port.open(), 0);
  const std::size_t filled = fill(port, terminal);
  const MonotonicTime before = monotonic_now();
  port.close();
  EXPECT_LT(monotonic_now() - before, seconds(1));
  EXPECT_LT(left_at(terminal), filled / 2);
}

}  // namespace
}  // namespace tubed
