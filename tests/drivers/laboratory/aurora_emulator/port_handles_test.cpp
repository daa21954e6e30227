// Handles, and how TX and BX list them, against recordings where there are any.
#include "drivers/laboratory/aurora_emulator/port_handles.hpp"

#include <gtest/gtest.h>

#include "drivers/aurora/port_replies.hpp"
#include "tests/drivers/laboratory/aurora_emulator/emulated_room.hpp"

namespace tubed::aurora::emulator {
namespace {

std::string raw(Host& host, const CommandLine& command) {
  host.send(command.bytes());
  return std::string(as_text(host.listen()));
}

const HandleReading* reading(const Host& host, std::uint8_t handle) {
  for (const HandleReading& one : host.tracking.readings()) {
    if (one.handle == handle) {
      return &one;
    }
  }
  return nullptr;
}

Report report(const Host& host, std::uint8_t handle) {
  const HandleReading* const one = reading(host, handle);
  EXPECT_NE(one, nullptr) << "handle " << int{handle} << " is not listed";
  return one == nullptr ? Report::kImplausible : one->report;
}

std::uint32_t serial_of(Host& host, std::uint8_t handle) {
  const auto tool = parse_tool(host.ask(phinf_command(handle, kToolField)), kToolField);
  return tool && tool->tool ? tool->tool->serial_number : 0;
}

TEST(PortHandles, AToolThatCannotBeInitialisedIsListedAsRecorded) {
  // Recorded from firmware Rev 006, replies to the same commands.
  DeviceSettings settings;
  settings.plugs = two_coils_a_port(1);
  settings.plugs[0].memory = ToolMemory::kBlank;
  settings.firmware = Firmware::kOld;
  Host host(settings, 1);
  host.listen();
  host.ask(init_command());
  EXPECT_EQ(raw(host, pinit_command(0x0A)), "ERROR133A42\r");
  EXPECT_EQ(raw(host, phsr_command(HandleQuery::kToBeEnabled)), "001414\r");
  EXPECT_EQ(raw(host, tstart_command()), "OKAYA896\r");
  EXPECT_EQ(raw(host, tx_command(kTransforms)), "010ADISABLED\n0000B1B4\r");
}

TEST(PortHandles, AHandleShowsItsSwitchesAfterPinitOnly) {
  DeviceSettings settings;
  settings.plugs = two_coils_a_port(2);
  Host host(settings, 2);
  host.listen();
  host.ask(init_command());
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeInitialised)), "010A001");
  EXPECT_EQ(host.ask(pinit_command(0x0A)), "OKAY");
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeEnabled)), "020A01F0B01F");  // recorded
  EXPECT_EQ(host.ask("PENA", "0AD"), "OKAY");
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kEnabled)), "010A03F");
}

TEST(PortHandles, EveryAllocatedHandleIsInTxAndBxEnabledOrNot) {
  Host host;
  host.prepare();
  host.ask(pdis_command(0x0B));
  host.ask(tstart_command());
  host.now += milliseconds(30);
  for (const auto& command : {tx_command(kTransforms), bx_command(kTransforms)}) {
    ASSERT_NE(host.ask(command), "");
    ASSERT_EQ(host.tracking.handle_count, 5);
    EXPECT_EQ(report(host, 0x0A), Report::kValid);
    EXPECT_EQ(report(host, 0x0B), Report::kDisabled);
  }
}

TEST(PortHandles, ADisabledHandleTakesTwoBytesOfBx) {
  DeviceSettings settings;
  settings.plugs = two_coils_a_port(1);
  Host host(settings, 1);
  host.listen();
  host.ask(init_command());
  host.ask(tstart_command());
  const std::string reply = raw(host, bx_command(kTransforms));
  constexpr std::size_t kHeader = 6;
  EXPECT_EQ(reply.substr(kHeader, 5), std::string("\x01\x0A\x04\x00\x00", 5));
  EXPECT_EQ(reply.size(), kHeader + 5 + 2);
}

TEST(PortHandles, AnUnpluggedToolIsDisabledUntilTrackingBeginsAgainThenUnoccupied) {
  Host host;
  host.start_tracking();
  ASSERT_TRUE(host.device.ports().pull_out(3));
  EXPECT_NE(host.ask(tx_command(kTransforms)).find("0CDISABLED\n"), std::string::npos);
  EXPECT_EQ(host.tracking.system_status.bits, 0x0080);  // recorded

  host.ask(tstop_command());
  host.ask(tstart_command());
  EXPECT_NE(host.ask(tx_command(kTransforms)).find("0CUNOCCUPIED\n"), std::string::npos);
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(report(host, 0x0C), Report::kDisabled);  // BX has one code for both
}

TEST(PortHandles, AReplugIsANewHandleDisabledUntilItIsEnabled) {
  Host host;
  host.start_tracking();
  ASSERT_TRUE(host.device.ports().pull_out(3));
  ASSERT_TRUE(host.device.ports().plug_in(3));
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(host.tracking.system_status.bits, 0x00C0);  // recorded
  EXPECT_EQ(host.tracking.handle_count, 6);
  EXPECT_EQ(report(host, 0x0C), Report::kDisabled);
  EXPECT_EQ(report(host, 0x0F), Report::kDisabled);

  host.ask(tstop_command());
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeInitialised)), "010F001");
  EXPECT_EQ(host.ask(phf_command(0x0C)), "OKAY");
  EXPECT_EQ(host.ask(pinit_command(0x0F)), "OKAY");
  EXPECT_EQ(host.ask("PENA", "0FD"), "OKAY");
  host.ask(tstart_command());
  host.now += milliseconds(30);
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(report(host, 0x0F), Report::kValid);
  EXPECT_EQ(reading(host, 0x0C), nullptr);
}

TEST(PortHandles, AStrangersToolAppearsInTheSameWayWithItsOwnNumbers) {
  Host host;
  host.start_tracking();
  ASSERT_TRUE(host.device.ports().pull_out(3));
  ASSERT_TRUE(host.device.ports().plug_in_stranger(3, 0x12345678, "STRANGER"));
  ASSERT_TRUE(host.device.ports().plug_in_stranger(7, 0x77, "610029"));  // a port nobody has configured
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(host.tracking.handle_count, 7);
  EXPECT_EQ(report(host, 0x0F), Report::kDisabled);
  EXPECT_EQ(report(host, 0x10), Report::kDisabled);

  host.ask(tstop_command());
  for (const char* handle : {"0F", "10"}) {
    EXPECT_EQ(host.ask("PINIT", handle), "OKAY");
    EXPECT_EQ(host.ask("PENA", std::string(handle) + "D"), "OKAY");
  }
  EXPECT_EQ(serial_of(host, 0x0F), 0x12345678U);
  EXPECT_EQ(host.ask(phinf_command(0x0F, kPartNumberField)), "STRANGER            ");
  EXPECT_EQ(serial_of(host, 0x10), 0x77U);
  host.ask(tstart_command());
  host.now += milliseconds(30);
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(report(host, 0x0F), Report::kValid);    // where the tool of port 3 was
  EXPECT_EQ(report(host, 0x10), Report::kMissing);  // nothing moves this one
}

TEST(PortHandles, ThePortsOwnToolComesBackAfterAStranger) {
  Host host;
  host.listen();
  host.ask(init_command());
  PortHandles& ports = host.device.ports();
  EXPECT_FALSE(ports.plug_in_stranger(1, 1, "X"));  // occupied
  ASSERT_TRUE(ports.pull_out(1));
  ASSERT_TRUE(ports.plug_in_stranger(1, 1, "X"));
  EXPECT_FALSE(ports.plug_in(1));
  ASSERT_TRUE(ports.pull_out(1));
  ASSERT_TRUE(ports.plug_in(1));
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeInitialised)), "030B0010C0010E001");
  EXPECT_EQ(host.ask(pinit_command(0x0E)), "OKAY");
  EXPECT_EQ(serial_of(host, 0x0E), 0x3C4B0001U);
}

TEST(PortHandles, AToolThatIsThereFromTheStartAtAPortNobodyConfiguredIsListedAsWell) {
  DeviceSettings settings;
  settings.plugs.push_back({9, {0}, 0xBAD});
  Host host(settings);
  host.start_tracking();
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(host.tracking.handle_count, 6);
  EXPECT_EQ(report(host, 0x0D), Report::kDisabled);  // allocated before any second channel
}

TEST(PortHandles, AnUnusedSecondChannelIsDisabledAndMissingOnceEnabled) {
  DeviceSettings settings;
  settings.plugs = {{1, {1, 0}, 1}};
  Host host(settings, 1);
  host.listen();
  host.ask(init_command());
  host.ask(pinit_command(0x0A));
  host.ask("PENA", "0AD");
  host.ask(tstart_command());
  host.now += milliseconds(30);
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(report(host, 0x0A), Report::kValid);
  EXPECT_EQ(report(host, 0x0B), Report::kDisabled);
  host.ask(tstop_command());
  host.ask("PENA", "0BD");
  host.ask(tstart_command());
  host.now += milliseconds(30);
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(report(host, 0x0B), Report::kMissing);
  EXPECT_EQ(reading(host, 0x0B)->frame, reading(host, 0x0A)->frame);
}

TEST(PortHandles, PhrqAllocatesAHandleForAToolThatHasNone) {
  Host host;
  host.listen();
  host.ask(init_command());
  EXPECT_EQ(host.ask("PHRQ", "**********0200"), "ERROR30");  // it has one
  EXPECT_EQ(host.ask("PHRQ", "**********0900"), "ERROR2F");  // no tool there
  EXPECT_EQ(host.ask("PHRQ", "**********02"), "ERROR07");
  EXPECT_EQ(host.ask("PHRQ", "**********0x00"), "ERROR07");
  EXPECT_EQ(host.ask(phf_command(0x0B)), "OKAY");
  EXPECT_EQ(host.ask("PHRQ", "**************"), "0B");
  EXPECT_EQ(host.ask(pinit_command(0x0B)), "OKAY");
}

std::vector<std::uint8_t> definition(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) {
    bytes[i] = static_cast<std::uint8_t>(i * 7 + 1);
  }
  return bytes;
}

/// Host at a blank tool on port 1, handle 0A, after INIT.
Host at_a_blank_tool() {
  DeviceSettings settings;
  settings.plugs = two_coils_a_port(1);
  settings.plugs[0].memory = ToolMemory::kBlank;
  return Host(settings, 1);
}

void write(Host& host, const std::vector<std::uint8_t>& bytes, std::size_t blocks) {
  for (std::size_t at = 0; at < blocks * kToolMemoryBlock; at += kToolMemoryBlock) {
    const std::size_t from = std::min(at, bytes.size());
    const Bytes block = Bytes(bytes).subspan(from, std::min(kToolMemoryBlock, bytes.size() - from));
    ASSERT_EQ(host.ask(pvwr_command(0x0A, static_cast<std::uint16_t>(at), block)), "OKAY");
  }
}

TEST(PortHandles, ADefinitionOf329BytesNeedsItsPaddingToo) {
  // Genuine files are that short; six blocks hold them, and the tool stays ERROR13 (recorded).
  Host host = at_a_blank_tool();
  host.listen();
  host.ask(init_command());
  const std::vector<std::uint8_t> file = definition(329);
  write(host, file, 6);
  EXPECT_EQ(host.ask(pinit_command(0x0A)), "ERROR13");
  write(host, file, 16);
  EXPECT_EQ(host.ask(pinit_command(0x0A)), "OKAY");
  const ToolImage* const image = host.device.ports().written(1);
  ASSERT_NE(image, nullptr);
  EXPECT_TRUE(std::equal(file.begin(), file.end(), image->bytes.begin()));
  EXPECT_TRUE(
      std::all_of(image->bytes.begin() + 329, image->bytes.end(), [](int byte) { return byte == 0; }));
}

TEST(PortHandles, ADefinitionOfZerosIsNone) {
  Host host = at_a_blank_tool();
  host.listen();
  host.ask(init_command());
  write(host, std::vector<std::uint8_t>(1024), 16);
  EXPECT_EQ(host.ask(pinit_command(0x0A)), "ERROR13");
}

TEST(PortHandles, WhatHasBeenWrittenGoesWithTheToolAndWithThePower) {
  Host host = at_a_blank_tool();
  host.listen();
  host.ask(init_command());
  write(host, definition(1024), 16);
  ASSERT_TRUE(host.device.ports().written(1)->complete());
  host.device.ports().pull_out(1);
  EXPECT_EQ(host.device.ports().written(1), nullptr);
  host.device.ports().plug_in(1);
  EXPECT_EQ(host.device.ports().written(1)->blocks, 0U);
  host.device.receive_break(host.now);
  host.listen();
  host.ask(init_command());
  write(host, definition(1024), 16);
  host.device.receive_break(host.now);
  EXPECT_EQ(host.device.ports().written(1)->blocks, 0U);
}

}  // namespace
}  // namespace tubed::aurora::emulator
