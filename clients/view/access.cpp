#include "clients/view/access.hpp"

#include <algorithm>
#include <cctype>

namespace tubed {

namespace {

constexpr std::string_view kCookie = "tubed_view=";
constexpr std::string_view kTokenQuery = "?token=";

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return result;
}

bool is_known_host(std::string_view host, const AccessRules& access) {
  return access.hosts.empty() ||
         std::find(access.hosts.begin(), access.hosts.end(), lower(host)) != access.hosts.end();
}

/// The origin is the host that the request itself names: a page that came from here.
bool is_own_origin(std::string_view origin, std::string_view host) {
  const std::string own = lower(host);
  const std::string asked = lower(origin);
  return !own.empty() && (asked == "http://" + own || asked == "https://" + own);
}

/// Takes as long wherever they differ: the time of an answer tells nothing of the token.
bool is_equal(std::string_view given, std::string_view token) {
  unsigned char difference = given.size() == token.size() ? 0 : 1;
  for (std::size_t i = 0; i < token.size(); ++i) {
    const char letter = i < given.size() ? given[i] : '\0';
    difference = static_cast<unsigned char>(difference | (letter ^ token[i]));
  }
  return difference == 0;
}

std::string_view token_of_cookie(std::string_view cookie) {
  while (!cookie.empty()) {
    const std::size_t end = std::min(cookie.find(';'), cookie.size());
    std::string_view part = cookie.substr(0, end);
    part.remove_prefix(std::min(part.find_first_not_of(' '), part.size()));
    if (part.starts_with(kCookie)) return part.substr(kCookie.size());
    cookie.remove_prefix(std::min(end + 1, cookie.size()));
  }
  return {};
}

std::string_view token_of_target(std::string_view target) {
  const std::size_t at = target.find(kTokenQuery);
  return at == std::string_view::npos ? std::string_view() : target.substr(at + kTokenQuery.size());
}

bool is_cross_site_read(const RequestHead& request) {
  const bool from_elsewhere =
      !request.fetch_site.empty() && request.fetch_site != "same-origin" && request.fetch_site != "none";
  return from_elsewhere && request.fetch_mode != "navigate";
}

}  // namespace

std::string_view path_of(std::string_view target) {
  return target.substr(0, std::min(target.find('?'), target.size()));
}

AccessVerdict judge(const RequestHead& request, const AccessRules& access) {
  if (request.method != "GET" && request.method != "HEAD") return {405, "GET only\n"};
  if (request.has_body) return {413, "a request has no body here\n"};
  if (!is_known_host(request.host, access)) {
    return {421, "not served under this name: see --listen and --host of tubed-view\n"};
  }
  const bool needs_origin = request.is_upgrade || !request.origin.empty();
  if ((needs_origin && !is_own_origin(request.origin, request.host)) || is_cross_site_read(request)) {
    return {403, "not for pages of another origin\n"};
  }
  if (access.token.empty() || is_equal(token_of_cookie(request.cookie), access.token)) return {200, ""};
  const std::string_view token = token_of_target(request.target);
  if (!request.is_upgrade && !token.empty() && is_equal(token, access.token)) return {303, "welcome\n"};
  return {
      401,
      "open the page with /?token=TOKEN; the token is in the file that --token-file of tubed-view names\n"};
}

}  // namespace tubed
