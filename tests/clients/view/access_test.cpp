#include "clients/view/access.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

const AccessRules kOpen{.hosts = {"127.0.0.1:8080", "localhost:8080"}, .token = ""};
const AccessRules kWithToken{.hosts = {"or-3:8080"}, .token = "0123456789abcdef"};

RequestHead page() { return {.method = "GET", .target = "/", .host = "127.0.0.1:8080"}; }
RequestHead stream() {
  return {.method = "GET",
          .target = "/stream",
          .host = "127.0.0.1:8080",
          .origin = "http://127.0.0.1:8080",
          .is_upgrade = true};
}

TEST(AccessRules, ThePageAndItsStreamAreServed) {
  EXPECT_EQ(judge(page(), kOpen).status, 200U);
  EXPECT_EQ(judge(stream(), kOpen).status, 200U);
}

TEST(AccessRules, NamesOfHostsAreComparedWithoutRegardToCase) {
  RequestHead request = page();
  request.host = "LocalHost:8080";
  EXPECT_EQ(judge(request, kOpen).status, 200U);
}

TEST(AccessRules, AnotherNameThatPointsHereIsRefused) {
  for (const char* host : {"", "evil.example", "evil.example:8080", "127.0.0.1", "127.0.0.1:9999",
                           "127.0.0.1:8080.evil.example"}) {
    RequestHead request = page();
    request.host = host;
    EXPECT_EQ(judge(request, kOpen).status, 421U) << host;
  }
}

TEST(AccessRules, APageOfAnotherOriginIsRefused) {
  for (const char* origin : {"http://evil.example", "null", "http://127.0.0.1:9999",
                             "http://127.0.0.1:8080.evil.example", "ftp://127.0.0.1:8080"}) {
    RequestHead request = page();
    request.origin = origin;
    EXPECT_EQ(judge(request, kOpen).status, 403U) << origin;
    request = stream();
    request.origin = origin;
    EXPECT_EQ(judge(request, kOpen).status, 403U) << origin;
  }
}

TEST(AccessRules, AStreamSaysWhereItComesFrom) {
  RequestHead request = stream();
  request.origin = "";
  EXPECT_EQ(judge(request, kOpen).status, 403U);
  request.origin = "https://127.0.0.1:8080";  // through a proxy with TLS
  EXPECT_EQ(judge(request, kOpen).status, 200U);
}

TEST(AccessRules, AnotherSiteMayLinkHereAndNotRead) {
  RequestHead request = page();
  request.fetch_site = "cross-site";
  request.fetch_mode = "navigate";
  EXPECT_EQ(judge(request, kOpen).status, 200U);
  request.fetch_mode = "no-cors";
  EXPECT_EQ(judge(request, kOpen).status, 403U);
}

TEST(AccessRules, OnlyGetWithoutABody) {
  RequestHead request = page();
  request.method = "POST";
  EXPECT_EQ(judge(request, kOpen).status, 405U);
  request = page();
  request.has_body = true;
  EXPECT_EQ(judge(request, kOpen).status, 413U);
}

TEST(AccessRules, TheTokenIsAskedForUntilTheCookieHasIt) {
  RequestHead request = page();
  request.host = "or-3:8080";
  EXPECT_EQ(judge(request, kWithToken).status, 401U);
  request.target = "/?token=0123456789abcdef";
  EXPECT_EQ(judge(request, kWithToken).status, 303U);
  request.target = "/";
  request.cookie = "other=1; tubed_view=0123456789abcdef; more=2";
  EXPECT_EQ(judge(request, kWithToken).status, 200U);
}

TEST(AccessRules, ATokenThatIsShorterLongerOrAnotherIsRefused) {
  for (const char* token : {"", "0", "0123456789abcde", "0123456789abcdefg", "0123456789abcdee"}) {
    RequestHead request = page();
    request.host = "or-3:8080";
    const std::string target = std::string("/?token=") + token;
    const std::string cookie = std::string("tubed_view=") + token;
    request.target = target;
    EXPECT_EQ(judge(request, kWithToken).status, 401U) << token;
    request.target = "/";
    request.cookie = cookie;
    EXPECT_EQ(judge(request, kWithToken).status, 401U) << token;
  }
}

TEST(AccessRules, BehindAUnixSocketTheProxyKnowsTheName) {
  RequestHead request = stream();
  request.host = "or-3.hospital.example";
  request.origin = "https://or-3.hospital.example";
  EXPECT_EQ(judge(request, {}).status, 200U);
  request.origin = "https://evil.example";
  EXPECT_EQ(judge(request, {}).status, 403U);
}

TEST(AccessRules, ThePathEndsWhereItsQueryBegins) {
  EXPECT_EQ(path_of("/view.js?x=1"), "/view.js");
  EXPECT_EQ(path_of("/"), "/");
  EXPECT_EQ(path_of(""), "");
}

}  // namespace
}  // namespace tubed
