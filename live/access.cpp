#include "live/access.h"

#include <algorithm>
#include <cctype>
#include <optional>

namespace forereach {
namespace {

bool EqualNames(std::string_view a, std::string_view b) {
  const auto lower = [](unsigned char c) { return std::tolower(c); };
  return std::ranges::equal(a, b, {}, lower, lower);
}

// Nothing without the header; a text that fits nowhere where it is given twice.
std::optional<std::string_view> Find(const HttpRequest& request, std::string_view name) {
  std::optional<std::string_view> value;
  for (const auto& [key, text] : request.headers) {
    if (!EqualNames(key, name)) continue;
    if (value) return "\n";
    value = text;
  }
  return value;
}

bool IsHere(std::string_view host) {
  const std::size_t colon = host.find(':');
  const std::string_view name = host.substr(0, colon);
  if (name != "127.0.0.1" && !EqualNames(name, "localhost")) return false;
  if (colon == std::string_view::npos) return true;
  const std::string_view port = host.substr(colon + 1);
  return !port.empty() && port.size() <= 5 && std::ranges::all_of(port, [](char c) { return '0' <= c && c <= '9'; });
}

}  // namespace

Answer Judge(const HttpRequest& request) {
  const auto host = Find(request, "Host");
  if (!host) return Answer::kBadRequest;
  if (!IsHere(*host)) return Answer::kForbidden;
  if (const auto origin = Find(request, "Origin"); origin && *origin != "http://" + std::string(*host))
    return Answer::kForbidden;
  if (const auto site = Find(request, "Sec-Fetch-Site"); site && *site != "same-origin" && *site != "none")
    return Answer::kForbidden;
  if (request.method != "GET") return Answer::kNotAllowed;
  const auto length = Find(request, "Content-Length");
  if ((length && *length != "0") || Find(request, "Transfer-Encoding") || Find(request, "Upgrade"))
    return Answer::kBadRequest;
  if (!request.query.empty()) return Answer::kNotFound;
  if (request.target == "/") return Answer::kPage;
  return request.target == "/events" ? Answer::kEvents : Answer::kNotFound;
}

}  // namespace forereach
