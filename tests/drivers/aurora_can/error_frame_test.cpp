#include "drivers/aurora_can/error_frame.hpp"

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>

#include <array>
#include <string>

namespace tubed {
namespace {

CanTrouble trouble_of(std::uint32_t classes, std::uint8_t controller = 0) {
  const std::array<std::uint8_t, 8> bytes{0, controller};
  return read_error_frame(CAN_ERR_FLAG | classes, bytes);
}

TEST(ErrorFrame, BusOffAndRestartAreToldApart) {
  EXPECT_TRUE(trouble_of(CAN_ERR_BUSOFF).bus_off);
  EXPECT_FALSE(trouble_of(CAN_ERR_BUSOFF).restarted);
  EXPECT_TRUE(trouble_of(CAN_ERR_RESTARTED).restarted);
  EXPECT_FALSE(trouble_of(CAN_ERR_RESTARTED).bus_off);
}

TEST(ErrorFrame, TheStateOfTheControllerCountsOnlyInFramesAboutIt) {
  EXPECT_TRUE(trouble_of(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW).receive_overflow);
  EXPECT_TRUE(trouble_of(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE).passive);
  EXPECT_TRUE(trouble_of(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_WARNING).warning);
  EXPECT_FALSE(trouble_of(CAN_ERR_PROT, CAN_ERR_CRTL_RX_OVERFLOW).receive_overflow);
}

TEST(ErrorFrame, AShortOneIsReadAsZeros) {
  const std::array<std::uint8_t, 1> bytes{};
  EXPECT_FALSE(read_error_frame(CAN_ERR_FLAG | CAN_ERR_CRTL, bytes).passive);
}

TEST(ErrorFrame, TheGravestTroubleIsDescribed) {
  const auto words = [](const CanTrouble& trouble) { return std::string(describe(trouble)); };
  EXPECT_NE(words(trouble_of(CAN_ERR_BUSOFF | CAN_ERR_ACK)).find("bus-off"), std::string::npos);
  EXPECT_NE(words(trouble_of(CAN_ERR_ACK)).find("acknowledgement"), std::string::npos);
  EXPECT_NE(words(trouble_of(CAN_ERR_PROT)).find("bit rates"), std::string::npos);
}

}  // namespace
}  // namespace tubed
