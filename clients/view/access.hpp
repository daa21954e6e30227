// Who may read the page. Pure: a request comes as values, a verdict goes back.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tubed {

/// What counts of a request's head. Empty: the header is not there.
struct RequestHead {
  std::string_view method{};
  std::string_view target{};  ///< path and query, as sent
  std::string_view host{};
  std::string_view origin{};
  std::string_view cookie{};
  std::string_view fetch_site{};  ///< Sec-Fetch-Site
  std::string_view fetch_mode{};  ///< Sec-Fetch-Mode
  bool is_upgrade = false;        ///< to a WebSocket
  bool has_body = false;
};

/// What is asked of a request.
struct AccessRules {
  /// What "Host" may say, lower case, with the port. A page of another name that was made to point at this
  /// address (DNS rebinding) has another one. Empty: any, for a Unix socket, whose proxy decides.
  std::vector<std::string> hosts;
  /// Empty: none is asked for. Else the cookie tubed_view has to be it, which GET /?token=TOKEN sets.
  std::string token;
};

/// 200: the request is served; 303: its token was right, and goes into a cookie; others: refused, with words
/// for a person.
struct AccessVerdict {
  unsigned status = 200;
  const char* words = "";
};

/// Every rule in one place:
/// | asked | otherwise |
/// |---|---|
/// | GET or HEAD | 405 |
/// | no body | 413 |
/// | exactly one of AccessRules::hosts | 421 |
/// | Origin, where there is one, is http or https at that host; a WebSocket has one | 403 |
/// | another site only navigates here (Sec-Fetch-*) | 403 |
/// | the token, where one is set | 401 |
AccessVerdict judge(const RequestHead& request, const AccessRules& access);

/// The path without its query.
std::string_view path_of(std::string_view target);

}  // namespace tubed
