#include "clients/tubectl/check/doctor_network.hpp"

#include <gtest/gtest.h>
#include <net/if.h>

#include <fstream>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeading =
    "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n";

/// A machine in a folder on which tubed runs as process 4711 with the sockets that a test gives it.
class DoctorNetwork : public testing::Test {
 protected:
  DoctorNetwork() { machine_.root = folder_.path(); }

  void run(const std::string& name, const std::string& udp, const std::string& tcp = "") {
    const fs::path process = machine_.root / "proc/4711";
    fs::create_directories(process / "net");
    fs::create_directories(process / "fd");
    std::ofstream(process / "comm") << name << '\n';
    std::ofstream(process / "net/udp") << kHeading << udp;
    std::ofstream(process / "net/tcp") << kHeading << tcp;
    fs::create_symlink("socket:[100]", process / "fd/7");
    fs::create_symlink("socket:[101]", process / "fd/8");
  }

  NamedFinding only_finding(const FilterReader& filter, const std::string& network_interface = "lo") {
    const std::vector<NamedFinding> findings = examine_network(machine_, network_interface, filter);
    EXPECT_EQ(findings.size(), 1U);
    return findings.empty() ? NamedFinding{} : findings.front();
  }

  const TemporaryFolder folder_;
  Machine machine_;
  const unsigned lo_ = if_nametoindex("lo");
  const FilterReader none_ = [](int, int) { return std::nullopt; };
  const FilterReader lo_only_ = [this](int, int) { return AllowedInterfaces{lo_, lo_}; };
  // 7410 = 0x1CF2, 7411 = 0x1CF3, 9756 = 0x261C
  const std::string discovery_ = "  1: 00000000:1CF2 00000000:0000 07 0:0 00:0 0 996 0 100\n";
  const std::string data_ = "  2: 00000000:1CF3 00000000:0000 07 0:0 00:0 0 996 0 101\n";
};

TEST_F(DoctorNetwork, SocketsThatAreFilteredToLoopbackAreReachedByThisHostOnly) {
  run("tubed", discovery_ + data_);
  const Finding finding = only_finding(lo_only_).finding;
  EXPECT_EQ(finding.verdict, Verdict::kGood);
  EXPECT_EQ(finding.found, "tubed (process 4711), UDP 0.0.0.0 port 7410 7411: reached by only this host");
}

TEST_F(DoctorNetwork, ASocketWithoutAFilterIsWrongAndComesWithAdvice) {
  run("tubed", discovery_);
  const Finding finding = only_finding(none_).finding;
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_NE(finding.found.find("anybody who can route to this machine"), std::string::npos) << finding.found;
  EXPECT_FALSE(finding.advice.empty());
}

TEST_F(DoctorNetwork, AChosenInterfaceIsReachedByItsHosts) {
  run("tubed", discovery_);
  const FilterReader another = [this](int, int) { return AllowedInterfaces{lo_ + 4711, lo_}; };
  const Finding finding = only_finding(another).finding;
  EXPECT_EQ(finding.verdict, Verdict::kAdvice);
  EXPECT_NE(finding.found.find("hosts on interface " + std::to_string(lo_ + 4711)), std::string::npos)
      << finding.found;
}

TEST_F(DoctorNetwork, OneSocketWithoutAFilterIsToldApartFromTheOthers) {
  run("tubed", discovery_ + data_);
  const FilterReader first_only = [this](int, int fd) {
    return fd == 7 ? std::optional(AllowedInterfaces{lo_, lo_}) : std::nullopt;
  };
  const std::vector<NamedFinding> findings = examine_network(machine_, "lo", first_only);
  ASSERT_EQ(findings.size(), 2U);
  EXPECT_NE(findings[0].finding.found.find("port 7410: reached by only"), std::string::npos);
  EXPECT_NE(findings[1].finding.found.find("port 7411: reached by anybody"), std::string::npos);
}

TEST_F(DoctorNetwork, AFilterThatMayNotBeReadIsANoteThatSaysHow) {
  run("tubed", discovery_);
  const FilterReader refused = [](int, int) -> std::optional<AllowedInterfaces> {
    throw std::runtime_error("its filter cannot be read (Operation not permitted): sudo tubectl doctor");
  };
  const Finding finding = only_finding(refused).finding;
  EXPECT_EQ(finding.verdict, Verdict::kNote);
  EXPECT_NE(finding.found.find("sudo tubectl doctor"), std::string::npos);
}

TEST_F(DoctorNetwork, AnExporterThatListensEverywhereIsWrongAndAtLoopbackGood) {
  run("tubed-exporter", "", "  1: 00000000:261C 00000000:0000 0A 0:0 00:0 0 996 0 100\n");
  EXPECT_EQ(examine_network(machine_, "lo", none_).front().finding.verdict, Verdict::kWrong);
  std::ofstream(machine_.root / "proc/4711/net/tcp")
      << kHeading << "  1: 0100007F:261C 00000000:0000 0A 0:0 00:0 0 996 0 100\n";
  const Finding finding = examine_network(machine_, "lo", none_).front().finding;
  EXPECT_EQ(finding.verdict, Verdict::kGood);
  EXPECT_NE(finding.found.find("TCP 127.0.0.1 port 9756"), std::string::npos) << finding.found;
}

TEST_F(DoctorNetwork, WithoutADaemonTheConfigurationSaysWhoWillReachIt) {
  EXPECT_EQ(only_finding(none_).finding.verdict, Verdict::kGood);
  const Finding eth1 = only_finding(none_, "eth1").finding;
  EXPECT_EQ(eth1.verdict, Verdict::kAdvice);
  EXPECT_NE(eth1.found.find("hosts on eth1"), std::string::npos) << eth1.found;
}

TEST_F(DoctorNetwork, ADaemonThatHasEndedAndWaitsForItsParentDoesNotRun) {
  run("tubed", "");
  std::ofstream(machine_.root / "proc/4711/stat") << "4711 (tubed) Z 1 4711 4711 0 -1\n";
  const Finding finding = only_finding(none_).finding;
  EXPECT_NE(finding.found.find("tubed does not run"), std::string::npos) << finding.found;
}

}  // namespace
}  // namespace tubed
