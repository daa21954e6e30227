#include "clients/exporter/http_server.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace tubed {
namespace {

std::string metrics() { return "tubed_up 1\n"; }

std::string first_line(const std::string& answer) { return answer.substr(0, answer.find("\r\n")); }

TEST(HttpServer, AnswersAScrape) {
  const std::string answer = answer_to("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n", metrics);
  EXPECT_EQ(first_line(answer), "HTTP/1.1 200 OK");
  EXPECT_NE(answer.find("Content-Type: text/plain; version=0.0.4"), std::string::npos);
  EXPECT_NE(answer.find("Content-Length: 11\r\n"), std::string::npos);
  EXPECT_TRUE(answer.ends_with("\r\n\r\ntubed_up 1\n"));
}

TEST(HttpServer, RefusesWhatItDoesNotOffer) {
  EXPECT_EQ(first_line(answer_to("GET /etc/passwd HTTP/1.1\r\n\r\n", metrics)), "HTTP/1.1 404 Not Found");
  EXPECT_EQ(first_line(answer_to("POST /metrics HTTP/1.1\r\n\r\n", metrics)),
            "HTTP/1.1 405 Method Not Allowed");
  for (const char* const noise : {"", "GET", "GET /metrics", "\r\n\r\n", "GET  x", "\x16\x03\x01"}) {
    EXPECT_EQ(first_line(answer_to(noise, metrics)), "HTTP/1.1 400 Bad Request") << noise;
  }
}

TEST(HttpServer, AnAddressThatIsNoneIsRefused) {
  for (const char* const where :
       {"", "9756", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x", "here:80", "127.0.0.1:70000"}) {
    EXPECT_THROW(HttpServer{where}, std::invalid_argument) << where;
  }
}

}  // namespace
}  // namespace tubed
