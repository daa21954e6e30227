#include "clients/tubectl/check/tracker_report.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

Configuration aurora_at(const std::string& device) {
  Configuration configuration;
  configuration.em_source.driver = "aurora-serial";
  configuration.em_source.device = device;
  configuration.em_source.settings = DriverSettings({{"baud", std::string("115200")}});
  return configuration;
}

AdapterFacts slow_adapter() {
  UsbIdentity identity{0x0403, 0x6001, 0, BoundedText<64>("FT1234")};
  return {true, "ttyUSB0", identity, 16};
}

TEST(TrackerReport, NamesVersionAdapterAndLatencyTimer) {
  const std::string text = report_for_help(aurora_at("/dev/ttyUSB0"), slow_adapter(), nullptr, {});
  EXPECT_NE(text.find("tubed " TUBED_VERSION ", Linux "), std::string::npos) << text;
  EXPECT_NE(text.find("port ttyUSB0: 0403:6001, serial number FT1234, latency timer 16 ms, baud 115200"),
            std::string::npos)
      << text;
}

TEST(TrackerReport, HasWhatIsNotGoodAndNoNameOfAFolder) {
  const std::vector<NamedFinding> findings{
      {"tracker port", {Verdict::kWrong, "/home/surgeon/aurora is used by screen (process 7)", ""}},
      {"coils", {Verdict::kGood, "port 1 channel 0: sensor 1", ""}}};
  const std::string text = report_for_help(aurora_at("/home/surgeon/aurora"), {}, nullptr, findings);
  EXPECT_NE(text.find("WRONG: tracker port: aurora is used by screen (process 7)"), std::string::npos)
      << text;
  EXPECT_EQ(text.find("sensor 1"), std::string::npos) << text;
  EXPECT_EQ(text.find("surgeon"), std::string::npos) << text;
  EXPECT_NE(text.find("port aurora: not there"), std::string::npos) << text;
}

TEST(TrackerReport, SaysOfEachHandleWhereItIsAndWhyItIsNotUsable) {
  aurora::CoilMap map;
  map.place(3, {2, 0});
  aurora::FoundCoil coil;
  coil.handle = 0x0B;
  coil.plug = {2, 0};
  coil.serial_number = 0x3C4B0002;
  coil.usable = true;
  EXPECT_EQ(handle_text(coil, map), "handle 0B port 2 channel 0 serial number 3C4B0002 sensor 3");
  coil.usable = false;
  coil.serial_number = 0;
  coil.error_code = 0x13;
  EXPECT_EQ(handle_text(coil, map), "handle 0B port 2 channel 0 sensor 3, not usable: ERROR13");
  EXPECT_NE(handle_text(coil, {}).find("not in the configuration"), std::string::npos);
}

}  // namespace
}  // namespace tubed
