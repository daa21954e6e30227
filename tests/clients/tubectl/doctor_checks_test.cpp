#include "clients/tubectl/check/doctor_checks.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <string>

#include "daemon/config/sample_configuration.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;

/// A machine in a folder of its own.
class Doctor : public testing::Test {
 protected:
  Doctor() {
    machine_.root = folder_.path();
    machine_.configuration = machine_.root / "tubed.toml";
  }
  void write(const fs::path& name, const std::string& text) {
    fs::create_directories((machine_.root / name).parent_path());
    std::ofstream(machine_.root / name) << text;
  }

  Finding look(const std::string& name) const {
    for (const DoctorCheck& check : doctor_checks()) {
      if (check.name == name) return check.look(machine_);
    }
    ADD_FAILURE() << "no check " << name;
    return {};
  }

  const TemporaryFolder folder_;
  Machine machine_;
};

TEST_F(Doctor, SurvivesAMachineThatSaysNothing) {
  for (const DoctorCheck& check : doctor_checks()) {
    EXPECT_FALSE(check.look(machine_).found.empty()) << check.name;
  }
}

TEST_F(Doctor, EverythingThatIsNotInOrderComesWithAdvice) {
  for (const DoctorCheck& check : doctor_checks()) {
    const Finding finding = check.look(machine_);
    EXPECT_EQ(finding.verdict >= Verdict::kAdvice, !finding.advice.empty()) << check.name;
  }
}

TEST_F(Doctor, KnowsARealTimeKernel) {
  write("proc/version", "Linux version 6.1.0-18-amd64 #1 SMP PREEMPT_DYNAMIC Debian\n");
  EXPECT_EQ(look("kernel").verdict, Verdict::kAdvice);
  write("sys/kernel/realtime", "1\n");
  EXPECT_EQ(look("kernel").verdict, Verdict::kGood);
}

TEST_F(Doctor, OneSlowCpuAmongFastOnesIsSeen) {
  write("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
  EXPECT_EQ(look("governor").verdict, Verdict::kGood);
  write("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave\n");
  EXPECT_EQ(look("governor").verdict, Verdict::kAdvice);
  EXPECT_NE(look("governor").found.find("1 x powersave"), std::string::npos);
}

TEST_F(Doctor, ASingleCpuIsWrong) {
  write("sys/devices/system/cpu/online", "0\n");
  EXPECT_EQ(look("processors").verdict, Verdict::kWrong);
  write("sys/devices/system/cpu/online", "0-3\n");
  EXPECT_EQ(look("processors").verdict, Verdict::kGood);
}

TEST_F(Doctor, LimitsCountUnlessCapabilitiesGoBeyondThem) {
  machine_.realtime_priority_limit = 0;
  machine_.locked_memory_limit = 8U << 20U;
  EXPECT_EQ(look("priority").verdict, Verdict::kAdvice);
  EXPECT_EQ(look("locked memory").verdict, Verdict::kAdvice);
  machine_.may_exceed_limits = true;
  EXPECT_EQ(look("priority").verdict, Verdict::kGood);
  EXPECT_EQ(look("locked memory").verdict, Verdict::kGood);
}

TEST_F(Doctor, IrqbalanceIsFoundAmongTheProcesses) {
  write("proc/4711/comm", "irqbalanced\n");
  EXPECT_EQ(look("interrupts").verdict, Verdict::kGood);
  write("proc/4712/comm", "irqbalance\n");
  EXPECT_EQ(look("interrupts").verdict, Verdict::kAdvice);
}

TEST_F(Doctor, SwapIsMoreThanTheHeadingOfItsList) {
  write("proc/swaps", "Filename Type Size Used Priority\n");
  EXPECT_EQ(look("swap").verdict, Verdict::kGood);
  write("proc/swaps", "Filename Type Size Used Priority\n/dev/sda2 partition 100 0 -2\n");
  EXPECT_EQ(look("swap").verdict, Verdict::kNote);
}

TEST_F(Doctor, AWrongConfigurationIsNamedWithItsPlace) {
  std::string wrong(sample_configuration());
  wrong.replace(wrong.find("rate_hz = 30.0"), 14, "rate_hz = true");
  write("tubed.toml", wrong);
  EXPECT_EQ(look("configuration").verdict, Verdict::kWrong);
  EXPECT_NE(look("configuration").found.find("tubed.toml:9:11: daemon.rate_hz"), std::string::npos)
      << look("configuration").found;
  write("tubed.toml", sample_configuration());
  EXPECT_EQ(look("configuration").verdict, Verdict::kGood) << look("configuration").found;
}

}  // namespace
}  // namespace tubed
