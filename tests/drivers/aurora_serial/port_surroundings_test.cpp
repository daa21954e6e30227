// What a port says about its USB adapter: a /sys as the kernel lays it out for ftdi_sio and cdc_acm, around a
// pseudo-terminal.
#include "drivers/aurora_serial/port_surroundings.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <functional>

#include "drivers/aurora_serial/serial_port.hpp"
#include "drivers/laboratory/aurora_emulator/pseudo_terminal.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;
using aurora::emulator::PseudoTerminal;

class AdapterAtAPort : public testing::Test {
 protected:
  void SetUp() override {
    folder = fs::temp_directory_path() / ("port_surroundings_test." + std::to_string(::getpid()));
    fs::create_directories(folder / "sys/class/tty");
    fs::create_directories(folder / "sys/dev/char");
    fs::create_directories(folder / "dev/serial/by-id");
    places = {(folder / "sys").string(), "/nowhere", (folder / "dev").string()};
    struct stat port {};
    ASSERT_EQ(::stat(terminal.path().c_str(), &port), 0);
    number = std::to_string(::major(port.st_rdev)) + ":" + std::to_string(::minor(port.st_rdev));
  }
  void TearDown() override { fs::remove_all(folder); }

  static void write(const fs::path& file, const std::string& text) { std::ofstream(file) << text << '\n'; }

  /// An adapter as ftdi_sio shows it: the USB device, its interface, the port of the interface, the tty.
  void plug_in(const std::string& name, const std::string& serial_number, const std::string& latency = "16") {
    const fs::path usb = folder / "sys/devices" / ("of-" + name);
    const fs::path port = usb / "1-1:1.0" / name;
    const fs::path tty = port / "tty" / name;
    fs::create_directories(tty);
    write(usb / "idVendor", "0403");
    write(usb / "idProduct", "6001");
    write(usb / "serial", serial_number);
    write(usb / "1-1:1.0/bInterfaceNumber", "00");
    write(port / "latency_timer", latency);
    fs::create_symlink("../../../" + name, tty / "device");
    fs::create_symlink(tty, folder / "sys/class/tty" / name);
  }
  /// The pseudo-terminal is that tty.
  void becomes(const std::string& name) {
    fs::remove(folder / "sys/dev/char" / number);
    fs::create_symlink(folder / "sys/devices" / ("of-" + name) / "1-1:1.0" / name / "tty" / name,
                       folder / "sys/dev/char" / number);
  }
  void pull_out(const std::string& name) {
    fs::remove(folder / "sys/class/tty" / name);
    fs::remove_all(folder / "sys/devices" / ("of-" + name));
  }
  /// A port at ttyUSB0 that was open once and whose device node is gone.
  std::string explained_after_pulling_out() {
    const fs::path node = folder / "dev/ttyUSB0";
    fs::create_symlink(terminal.path(), node);
    SerialPort port(node.string(), places);
    EXPECT_EQ(port.open(), 0);
    port.close();
    fs::remove(node);
    pull_out("ttyUSB0");
    EXPECT_EQ(port.open(), ENOENT);
    on_explain();
    return std::string(port.explain(ENOENT).text());
  }

  PseudoTerminal terminal{""};
  fs::path folder;
  SystemPlaces places;
  std::string number;
  std::function<void()> on_explain = [] {};
};

TEST_F(AdapterAtAPort, IsIdentifiedByItsUsbDevice) {
  plug_in("ttyUSB0", "FT1234");
  becomes("ttyUSB0");
  SerialPort port(terminal.path(), places);
  ASSERT_EQ(port.open(), 0);
  ASSERT_TRUE(port.adapter());
  EXPECT_EQ(describe(*port.adapter()).text(), "0403:6001, serial number FT1234");
  EXPECT_EQ(port.device_name().text(), "ttyUSB0");
}

// cdc_acm's tty belongs to the interface itself.
TEST_F(AdapterAtAPort, IsIdentifiedWithoutAPortOfItsOwn) {
  const fs::path usb = folder / "sys/devices/acm";
  const fs::path tty = usb / "1-2:1.0/tty/ttyACM0";
  fs::create_directories(tty);
  write(usb / "idVendor", "23f2");
  write(usb / "idProduct", "0003");
  write(usb / "1-2:1.0/bInterfaceNumber", "00");
  fs::create_symlink("../../../1-2:1.0", tty / "device");
  fs::create_symlink(tty, folder / "sys/dev/char" / number);
  SerialPort port(terminal.path(), places);
  ASSERT_EQ(port.open(), 0);
  ASSERT_TRUE(port.adapter());
  EXPECT_EQ(describe(*port.adapter()).text(), "23f2:0003");
  EXPECT_FALSE(port.latency_timer_ms());
}

TEST_F(AdapterAtAPort, ThatIsNoneIsNotIdentified) {
  SerialPort port(terminal.path());
  ASSERT_EQ(port.open(), 0);
  EXPECT_FALSE(port.adapter());
  EXPECT_FALSE(port.latency_timer_ms());
}

TEST_F(AdapterAtAPort, WithALongLatencyTimerIsTold) {
  plug_in("ttyUSB0", "FT1234", "16");
  becomes("ttyUSB0");
  SerialPort port(terminal.path(), places);
  ASSERT_EQ(port.open(), 0);
  EXPECT_EQ(port.latency_timer_ms(), 16);
  EXPECT_EQ(port.note().text(),
            "the USB adapter holds replies back for 16 ms (28 instead of 40 measurements a second with 5 "
            "coils at 115200 baud): install 60-tubed.rules, or as root echo 1 > "
            "/sys/bus/usb-serial/devices/ttyUSB0/latency_timer");
  write(folder / "sys/devices/of-ttyUSB0/1-1:1.0/ttyUSB0/latency_timer", "1");
  port.look_around({});
  EXPECT_EQ(port.latency_timer_ms(), 1);
  EXPECT_EQ(port.note().text(), "");
}

TEST_F(AdapterAtAPort, ThatIsBackUnderAnotherNameIsFound) {
  plug_in("ttyUSB0", "FT1234");
  becomes("ttyUSB0");
  on_explain = [&] {
    plug_in("ttyUSB1", "FT1234");
    plug_in("ttyUSB2", "FT9999");
    fs::create_symlink("../../ttyUSB2", folder / "dev/serial/by-id/usb-FTDI_of_somebody");
    fs::create_symlink("../../ttyUSB1", folder / "dev/serial/by-id/usb-FTDI_FT1234-if00-port0");
  };
  EXPECT_EQ(explained_after_pulling_out(),
            (folder / "dev/ttyUSB0").string() +
                " is not there: its adapter is back as /dev/ttyUSB1; set em.device to "
                "/dev/serial/by-id/usb-FTDI_FT1234-if00-port0, which always leads to it");
}

TEST_F(AdapterAtAPort, IsNotTakenForOneWithAnotherSerialNumber) {
  plug_in("ttyUSB0", "FT1234");
  becomes("ttyUSB0");
  on_explain = [&] { plug_in("ttyUSB1", "FT9999"); };
  const std::string words = explained_after_pulling_out();
  EXPECT_EQ(words.find("ttyUSB1"), std::string::npos) << words;
  EXPECT_NE(words.find("plug in the cable"), std::string::npos) << words;
}

TEST_F(AdapterAtAPort, IsNotGuessedAtAmongSeveralAlike) {
  plug_in("ttyUSB0", "");
  becomes("ttyUSB0");
  on_explain = [&] {
    plug_in("ttyUSB1", "");
    plug_in("ttyUSB2", "");
  };
  EXPECT_EQ(explained_after_pulling_out().find("is back as"), std::string::npos);
}

TEST_F(AdapterAtAPort, IsNotLookedForBehindALinkThatFollowsIt) {
  plug_in("ttyUSB0", "FT1234");
  plug_in("ttyUSB1", "FT9999");
  becomes("ttyUSB0");
  const fs::path link = folder / "dev/serial/by-id/usb-FTDI_FT1234-if00-port0";
  fs::create_symlink(terminal.path(), link);
  SerialPort port(link.string(), places);
  ASSERT_EQ(port.open(), 0);
  port.close();
  fs::remove(link);
  EXPECT_EQ(port.open(), ENOENT);
  EXPECT_EQ(port.explain(ENOENT).text(), link.string() + " " + std::string(describe_open_error(ENOENT)));
}

}  // namespace
}  // namespace tubed
