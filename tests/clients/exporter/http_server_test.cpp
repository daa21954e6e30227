#include "clients/exporter/http_server.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace tubed {
namespace {

std::string metrics() { return "tubed_up 1\n"; }

TEST(HttpServer, AnswersAScrape) {
  const HttpAnswer answer = answer_to("GET", "/metrics", metrics);
  EXPECT_EQ(answer.status, 200U);
  EXPECT_STREQ(answer.type, "text/plain; version=0.0.4; charset=utf-8");
  EXPECT_EQ(answer.body, "tubed_up 1\n");
}

TEST(HttpServer, RefusesWhatItDoesNotOffer) {
  EXPECT_EQ(answer_to("GET", "/etc/passwd", metrics).status, 404U);
  EXPECT_EQ(answer_to("GET", "", metrics).status, 404U);
  EXPECT_EQ(answer_to("POST", "/metrics", metrics).status, 405U);
  EXPECT_EQ(answer_to("", "/metrics", metrics).status, 405U);
}

TEST(HttpServer, AnAddressThatIsNoneIsRefused) {
  for (const char* const where :
       {"", "9756", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x", "here:80", "127.0.0.1:70000"}) {
    EXPECT_THROW(HttpServer(where, metrics), std::invalid_argument) << where;
  }
}

}  // namespace
}  // namespace tubed
