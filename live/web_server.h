/** Serves the live page on the loopback interface. The only file that uses civetweb is web_server.cpp.

It reads from a Watcher and has nothing else: no bus, no key, no file. Each reader of /events has a thread of its own,
which copies what is new and then writes it; a slow one is behind, and after kWriteMs without progress it is cut off. So
readers hold up neither the bus nor each other, and there are at most kMostReaders. */
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lcmtypes/bad_input.h"
#include "live/watcher.h"

namespace forereach {

/** The page cannot be served: the text names the port and the reason. */
class ServerError : public BadInput {
 public:
  using BadInput::BadInput;
};

class WebServer final {
 public:
  static constexpr int kMostReaders = 8;
  static constexpr int kWriteMs = 5000;  ///< Also for a request to arrive.
  static constexpr int kUpdateMs = 200;  ///< Between two events for a reader.

  /** Listens on 127.0.0.1. @param port 0: one that is free. @param watcher must outlive the server.
  @throws ServerError. */
  WebServer(const Watcher& watcher, int port);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  [[nodiscard]] int port() const;

 private:
  class Content;
  std::unique_ptr<Content> content_;
};

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
