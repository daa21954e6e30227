#include "clients/tubectl/watch/silence.hpp"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

RunningDaemon a_daemon() {
  RunningDaemon daemon;
  daemon.pid = 4711;
  daemon.config = "/etc/tubed/tubed.toml";
  daemon.instruments = {"cath-1", "cath-2"};
  return daemon;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

constexpr const char* kHere = "a tubed runs here (process 4711, /etc/tubed/tubed.toml)";

TEST(Silence, ADaemonInAnotherDomainAndRoomIsNamedWithWhatToType) {
  RunningDaemon daemon = a_daemon();
  daemon.place.domain = 3;
  daemon.place.partition = "OR-3";

  EXPECT_EQ(
      joined(words_of_silence({}, "echo", {{daemon}, {}})),
      std::string(kHere) + " and publishes elsewhere; try: tubectl echo --domain 3 --partition 'OR-3'\n");
}

TEST(Silence, ADaemonWithKeysOrOnAnotherInterfaceIsNotHeardWithout) {
  RunningDaemon keys = a_daemon();
  keys.has_keys = true;
  RunningDaemon elsewhere = a_daemon();
  elsewhere.place.network_interface = "eth1";

  EXPECT_EQ(joined(words_of_silence({}, "top", {{keys}, {}})),
            std::string(kHere) + " and publishes elsewhere; try: tubectl top --security KEYS\n");
  EXPECT_EQ(joined(words_of_silence({}, "top", {{elsewhere}, {}})),
            std::string(kHere) + " on interface eth1; try: tubectl top --interface eth1\n");
}

TEST(Silence, AnInstrumentThatTheDaemonDoesNotHaveIsNamedWithThoseThatItHas) {
  Subscription wanted;
  wanted.instrument_id = "cath-7";

  EXPECT_EQ(joined(words_of_silence(wanted, "stat", {{a_daemon()}, {}})),
            std::string(kHere) + "; its instruments are cath-1 or cath-2, not cath-7\n");
}

TEST(Silence, ADaemonThatShouldBeHeardMayHang) {
  EXPECT_NE(joined(words_of_silence({}, "echo", {{a_daemon()}, {}})).find("starting, stopped or hung"),
            std::string::npos);
}

TEST(Silence, AConfigurationThatCannotBeReadIsSaid) {
  RunningDaemon daemon = a_daemon();
  daemon.why = "cannot be read by you: sudo may";

  EXPECT_EQ(joined(words_of_silence({}, "echo", {{daemon}, {}})),
            std::string(kHere) + "; its configuration cannot be read by you: sudo may\n");
}

TEST(Silence, ShapesInAnotherPartitionAreFoundWithoutAProcess) {
  Subscription wanted;
  wanted.network_interface = "eth1";

  const std::string words = joined(words_of_silence(wanted, "echo", {{}, {"OR-3"}}));
  EXPECT_NE(words.find("in partition 'OR-3'; try: tubectl echo --partition 'OR-3' --interface eth1\n"),
            std::string::npos)
      << words;
}

TEST(Silence, WhatTheProcessSaidIsNotSaidAgainOfItsPartition) {
  RunningDaemon daemon = a_daemon();
  daemon.place.partition = "OR-3";

  EXPECT_EQ(words_of_silence({}, "echo", {{daemon}, {"OR-3"}}).size(), 1U);
}

TEST(Silence, NoDaemonAtAllIsSaidWithWhatStartsOne) {
  const std::string words = joined(words_of_silence({}, "echo", {}));

  EXPECT_NE(words.find("no tubed runs on this machine"), std::string::npos);
  EXPECT_NE(words.find("tubectl demo"), std::string::npos);
}

TEST(Silence, AWrongSocketIsAnsweredWithTheRightOne) {
  RunningDaemon with = a_daemon();
  with.estimates_socket = "/run/tubed/estimates.sock";

  EXPECT_EQ(joined(words_of_silent_socket("/run/tubed/wrong.sock", "echo", {with})),
            std::string(kHere) + "; try: tubectl echo --shm /run/tubed/estimates.sock\n");
  EXPECT_NE(joined(words_of_silent_socket("/run/tubed/wrong.sock", "echo", {a_daemon()}))
                .find("offers no shared memory"),
            std::string::npos);
}

void pretend_process(const TemporaryFolder& proc, const std::string& pid, const std::string& comm,
                     const std::string& command) {
  std::filesystem::create_directory(proc.path() / pid);
  proc.write(pid + "/comm", comm + "\n");
  proc.write(pid + "/cmdline", command);
}

TEST(RunningDaemons, AreFoundByNameWithTheConfigurationOfTheirCommandLine) {
  const TemporaryFolder proc;
  using std::string_literals::operator""s;
  pretend_process(proc, "12", "tubed-exporter", "tubed-exporter\0"s);
  pretend_process(proc, "20", "tubed", ""s);  // has ended
  pretend_process(proc, "30", "tubed", "tubed\0--config\0/none/a.toml\0"s);
  proc.write("bad.toml", "no = configuration\n");
  pretend_process(proc, "31", "tubed", "tubed\0--config="s + (proc.path() / "bad.toml").string() + "\0"s);

  const auto found = running_daemons(proc.path());

  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].pid, 30);
  EXPECT_EQ(found[0].config + " " + found[0].why, "/none/a.toml cannot be read by you: sudo may");
  EXPECT_EQ(found[1].why, "is no configuration any more: tubed --check says why");
}

}  // namespace
}  // namespace tubed
