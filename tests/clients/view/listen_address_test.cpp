#include "clients/view/listen_address.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace tubed {
namespace {

using Names = std::vector<std::string>;

TEST(ListenAddress, ALoopbackAddressIsCalledLocalhostToo) {
  const ListenAddress where = parse_listen_address("127.0.0.1:8080");
  EXPECT_TRUE(where.is_loopback());
  EXPECT_EQ(where.port, 8080);
  EXPECT_EQ(where.host_names(), (Names{"127.0.0.1:8080", "localhost:8080"}));
}

TEST(ListenAddress, AnIpv6AddressStandsInBrackets) {
  const ListenAddress where = parse_listen_address("[::1]:81");
  EXPECT_TRUE(where.is_loopback());
  EXPECT_EQ(where.address, "::1");
  EXPECT_EQ(where.host_names(), (Names{"[::1]:81", "localhost:81"}));
}

TEST(ListenAddress, OthersCanReachEveryOtherAddress) {
  EXPECT_FALSE(parse_listen_address("0.0.0.0:8080").is_loopback());
  EXPECT_FALSE(parse_listen_address("192.168.3.4:8080").is_loopback());
  EXPECT_FALSE(parse_listen_address("[::]:8080").is_loopback());
}

TEST(ListenAddress, AUnixSocketHasNoNameOfItsOwn) {
  const ListenAddress where = parse_listen_address("unix:/run/tubed-view/page.sock");
  EXPECT_EQ(where.unix_path, "/run/tubed-view/page.sock");
  EXPECT_TRUE(where.is_loopback());
  EXPECT_TRUE(where.host_names().empty());
}

TEST(ListenAddress, WhatIsNoneIsRefusedWithAnExample) {
  for (const std::string& words :
       {std::string(), std::string("8080"), std::string("localhost:8080"), std::string("127.0.0.1"),
        std::string("127.0.0.1:"), std::string("127.0.0.1:0"), std::string("127.0.0.1:65536"),
        std::string("127.0.0.1:80x"), std::string("::1:80"), std::string("[127.0.0.1]:80"),
        std::string("unix:page.sock"), "unix:/" + std::string(200, 'x')}) {
    try {
      parse_listen_address(words);
      FAIL() << words;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("127.0.0.1:8080"), std::string::npos) << words;
    }
  }
}

}  // namespace
}  // namespace tubed
