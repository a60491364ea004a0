#include "live/web_server.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/test.h"

#include "tests/live/live_fixture.h"
#include "tests/tries.h"

namespace forereach::web_server_test {

using namespace std::chrono_literals;

/** A connection as a browser or an attacker makes it. */
class Connection final {
 public:
  explicit Connection(int port, const char* address = "127.0.0.1", int receive_buffer = 0)
      : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof(receive_buffer));
    timeval patience{10, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, address, &to.sin_addr);
    is_open_ = connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0;
  }
  ~Connection() { close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  [[nodiscard]] bool is_open() const { return is_open_; }
  void Send(const std::string& text) const { static_cast<void>(send(socket_, text.data(), text.size(), MSG_NOSIGNAL)); }
  /** Until the other side closes, or `end` has come. */
  [[nodiscard]] std::string Receive(const std::string& end = "") const {
    std::string all;
    char buffer[65536];
    for (ssize_t got = 0; (got = recv(socket_, buffer, sizeof(buffer), 0)) > 0;) {
      all.append(buffer, static_cast<std::size_t>(got));
      if (!end.empty() && all.find(end) != std::string::npos) break;
    }
    return all;
  }

 private:
  const int socket_;
  bool is_open_ = false;
};

struct WebServerTest : testing::Test {
  WebServerTest() : watcher_(CourseTask(), {}, CourseTask), server_(watcher_, 0) { watcher_.Tick(1); }

  [[nodiscard]] std::string Ask(const std::string& bytes) const {
    const Connection connection(server_.port());
    connection.Send(bytes);
    return connection.Receive();
  }
  [[nodiscard]] std::string Get(const std::string& target, const std::string& more = "") const {
    return Ask("GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server_.port()) + "\r\n" + more +
               "\r\n");
  }

  Watcher watcher_;
  const WebServer server_;
};

const std::string kEvents = "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n";

TEST_F(WebServerTest, ServesThePageWithItsPolicy) {
  const std::string page = Get("/");
  EXPECT_THAT(
      page, AllOf(StartsWith("HTTP/1.1 200 OK\r\n"), EndsWith("</html>\n"),
                  HasSubstr("Content-Security-Policy: default-src 'none'"), HasSubstr("connect-src 'self'"),
                  HasSubstr("frame-ancestors 'none'"), Not(HasSubstr("unsafe-inline")),
                  HasSubstr("X-Content-Type-Options: nosniff"), HasSubstr("Cross-Origin-Resource-Policy: same-origin"),
                  Not(HasSubstr("Access-Control-Allow"))));
}

TEST_F(WebServerTest, SendsWhatTheWatcherTells) {
  const Connection reader(server_.port());
  reader.Send(kEvents);
  EXPECT_THAT(reader.Receive("\n\n"), HasSubstr("\"decisions\":0"));
  Play(CourseEvents(), watcher_);
  EXPECT_THAT(reader.Receive("\"decisions\":" + std::to_string(kCourseDecisions)),
              HasSubstr("\"outcome\":\"certified\""));
}

TEST_F(WebServerTest, RefusesOtherHostsOriginsAndTargets) {
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(Get("/events", "Origin: http://evil.example\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(Get("/", "Sec-Fetch-Site: cross-site\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(Get("/?reset=1"), StartsWith("HTTP/1.1 404"));
  for (const char* target : {"/index.html", "/..", "/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/etc/passwd"}) {
    EXPECT_THAT(Get(target), Not(StartsWith("HTTP/1.1 200"))) << target;
    EXPECT_THAT(Get(target), Not(HasSubstr("root:"))) << target;
  }
  for (const char* method : {"POST", "PUT", "DELETE", "PATCH", "OPTIONS", "HEAD", "TRACE", "PROPFIND", "MKCOL"}) {
    const std::string answer = Ask(std::string(method) +
                                   " / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\n"
                                   "Access-Control-Request-Method: POST\r\nContent-Length: 0\r\n\r\n");
    EXPECT_THAT(answer, Not(StartsWith("HTTP/1.1 2"))) << method;
    EXPECT_THAT(answer, Not(HasSubstr("Access-Control-Allow"))) << method;
  }
  EXPECT_THAT(Get("/events",
                  "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                  "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"),
              StartsWith("HTTP/1.1 400"));
}

// What it says of a request that it cannot read is civetweb's; that it goes on is ours.
TEST_F(WebServerTest, KeepsServingAfterHostileBytes) {
  std::mt19937_64 random(11);
  const std::string good = "GET / HTTP/1.1\r\nHost: localhost\r\nAccept: */*\r\nOrigin: http://localhost\r\n\r\n";
  std::vector<std::string> requests{
      "GET / HTTP/9.9\r\n\r\n",
      "GET http://[::1/ HTTP/1.1\r\nHost: localhost\r\n\r\n",
      std::string(3, '\0'),
      "GET /" + std::string(20'000, 'a') + " HTTP/1.1\r\nHost: localhost\r\n\r\n",
      "GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n",
      "GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999999999999\r\n\r\n",
      "GET / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n",
      "GET /%ff%00%zz HTTP/1.1\r\nHost: localhost\r\nHost: evil\r\n\r\n",
      "\r\n\r\n\r\n"};
  std::string many = "GET / HTTP/1.1\r\nHost: localhost\r\n";
  for (int i = 0; i < 200; ++i) many += "X" + std::to_string(i) + ": y\r\n";
  requests.push_back(many + "\r\n");
  for (int i = 0; i < Tries(200); ++i) {
    std::string request = good;
    for (int k = static_cast<int>(random() % 5); k >= 0; --k)
      request[random() % request.size()] = static_cast<char>(random());
    requests.push_back(request);
  }
  for (const std::string& request : requests) {
    const Connection connection(server_.port());
    connection.Send(request);
    connection.Send("\r\n\r\n");
  }
  EXPECT_THAT(Get("/"), StartsWith("HTTP/1.1 200 OK\r\n"));
}

TEST_F(WebServerTest, ListensOnOneAddress) {
  EXPECT_TRUE(Connection(server_.port(), "127.0.0.1").is_open());
  EXPECT_FALSE(Connection(server_.port(), "127.0.0.2").is_open());
  EXPECT_THROW(WebServer(watcher_, server_.port()), ServerError);
}

TEST_F(WebServerTest, RefusesOneReaderMoreThanItsLimit) {
  {
    std::vector<std::unique_ptr<Connection>> readers;
    for (int i = 0; i < WebServer::kMostReaders; ++i) {
      readers.push_back(std::make_unique<Connection>(server_.port()));
      readers.back()->Send(kEvents);
      EXPECT_THAT(readers.back()->Receive("\n\n"), StartsWith("HTTP/1.1 200"));
    }
    EXPECT_THAT(Ask(kEvents), StartsWith("HTTP/1.1 503"));
    EXPECT_THAT(Get("/"), StartsWith("HTTP/1.1 200")) << "the page is there for all";
  }
  // They have gone: their places are free once a write has told of it.
  std::string answer;
  for (int i = 0; i < 50 && !answer.starts_with("HTTP/1.1 200"); ++i) {
    std::this_thread::sleep_for(100ms);
    watcher_.Tick(i);
    const Connection reader(server_.port());
    reader.Send(kEvents);
    answer = reader.Receive("\r\n\r\n");
  }
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
}

// A reader that does not read is behind; messages are taken meanwhile, others read, and the server ends.
TEST(SlowReaderTest, DelaysNeitherMessagesNorOtherReadersNorTheEnd) {
  Watcher watcher(CourseTask(), {}, CourseTask);
  auto server = std::make_unique<WebServer>(watcher, 0);
  const Connection slow(server->port(), "127.0.0.1", 2048);
  slow.Send(kEvents);
  const std::vector<LogEvent> events = CourseEvents();
  const auto begin = std::chrono::steady_clock::now();
  Play(events, watcher);
  const auto alone = std::chrono::steady_clock::now() - begin;
  std::this_thread::sleep_for(500ms);  // the reader's buffers are full
  const auto again = std::chrono::steady_clock::now();
  Play(events, watcher);
  EXPECT_LT(std::chrono::steady_clock::now() - again, 5 * alone + 2s);
  const Connection other(server->port());
  other.Send(kEvents);
  EXPECT_THAT(other.Receive("\n\n"), HasSubstr("\"decisions\""));
  const auto end = std::chrono::steady_clock::now();
  server.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - end, std::chrono::milliseconds(WebServer::kWriteMs + 3000));
}

}  // namespace forereach::web_server_test
