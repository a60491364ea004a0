/** Which requests the live page answers. A page of this machine is within reach of every web site that its browser
shows, and of every name that such a site's owner resolves to 127.0.0.1. */
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace forereach {

struct HttpRequest {
  std::string_view method;
  std::string_view target;  ///< Without a query. civetweb has decoded it, and cut it off at "%00".
  std::string_view query{};
  std::vector<std::pair<std::string_view, std::string_view>> headers{};
};

enum class Answer { kPage, kEvents, kBadRequest = 400, kForbidden = 403, kNotFound = 404, kNotAllowed = 405 };

/** Only GET of "/" and "/events", without query or body, is answered, and only
- under the names 127.0.0.1 and localhost, with any port, as of a forwarded one: a name that an attacker resolves to
  this machine is none of these;
- not for a page of another origin, as far as the browser names it (Origin, Sec-Fetch-Site). */
[[nodiscard]] Answer Judge(const HttpRequest& request);

}  // namespace forereach
