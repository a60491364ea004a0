/** Serves the live page on the loopback interface. The only file that uses civetweb is web_server.cpp.

It reads from a Watcher and has nothing else: no bus, no key, no file. Each reader of /events has a thread of its own,
which copies what is new and then writes it; a slow one is behind, and after kWriteMs without progress it is cut off. So
readers hold up neither the bus nor each other, and there are at most kMostReaders. */
#pragma once

#include <memory>
#include <string>

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

}  // namespace forereach
