#include "live/web_server.h"

#include "tests/test.h"

namespace forereach::access_test {

using Headers = std::vector<std::pair<std::string_view, std::string_view>>;

Answer Get(std::string_view target, Headers headers = {{"Host", "127.0.0.1:8080"}}) {
  return Judge({.method = "GET", .target = target, .headers = std::move(headers)});
}

TEST(AccessTest, AnswersThePageAndItsEventsAndNothingElse) {
  EXPECT_EQ(Get("/"), Answer::kPage);
  EXPECT_EQ(Get("/events"), Answer::kEvents);
  for (const char* other : {"", "/x", "//", "/events/", "/EVENTS", "/../etc/passwd", "/.", "http://127.0.0.1:8080/",
                            "*", "/%2e%2e/", "/events\n"})
    EXPECT_EQ(Get(other), Answer::kNotFound) << other;
  EXPECT_EQ(Judge({.method = "GET", .target = "/", .query = "reset=1", .headers = {{"Host", "localhost"}}}),
            Answer::kNotFound);
}

TEST(AccessTest, AnswersUnderTheNamesOfThisMachineAlone) {
  for (const char* host : {"127.0.0.1", "127.0.0.1:8080", "localhost", "LocalHost:1", "localhost:65535"})
    EXPECT_EQ(Get("/", {{"hOST", host}}), Answer::kPage) << host;
  for (const char* host :
       {"", "evil.example", "evil.example:8080", "127.0.0.1.evil.example", "localhost.evil.example",
        "127.0.0.1:", "127.0.0.1:8080:1", "127.0.0.1:123456", "127.0.0.1:8x", "127.0.0.1@evil.example", "[::1]:8080",
        "127.0.0.2", "0.0.0.0:8080", " 127.0.0.1", "127.0.0.1 "})
    EXPECT_EQ(Get("/", {{"Host", host}}), Answer::kForbidden) << host;
  EXPECT_EQ(Get("/", {}), Answer::kBadRequest);
  EXPECT_EQ(Get("/", {{"Host", "127.0.0.1"}, {"host", "127.0.0.1"}}), Answer::kForbidden) << "two are none";
}

TEST(AccessTest, AnswersNoPageOfAnotherOrigin) {
  const auto from = [](const char* name, const char* value) {
    return Get("/events", {{"Host", "localhost:8080"}, {name, value}});
  };
  EXPECT_EQ(from("Origin", "http://localhost:8080"), Answer::kEvents);
  for (const char* origin : {"http://evil.example", "null", "", "http://localhost:8081", "https://localhost:8080",
                             "http://localhost:8080.evil.example"})
    EXPECT_EQ(from("Origin", origin), Answer::kForbidden) << origin;
  EXPECT_EQ(from("Sec-Fetch-Site", "same-origin"), Answer::kEvents);
  EXPECT_EQ(from("Sec-Fetch-Site", "none"), Answer::kEvents);
  for (const char* site : {"cross-site", "same-site", "", "SAME-ORIGIN"})
    EXPECT_EQ(from("Sec-Fetch-Site", site), Answer::kForbidden) << site;
}

TEST(AccessTest, AnswersGetWithoutABodyAlone) {
  for (const char* method : {"POST", "PUT", "DELETE", "HEAD", "OPTIONS", "PATCH", "TRACE", "CONNECT", "get", ""})
    EXPECT_EQ(Judge({.method = method, .target = "/", .headers = {{"Host", "localhost"}}}), Answer::kNotAllowed)
        << method;
  const auto with = [](const char* name, const char* value) {
    return Get("/", {{"Host", "localhost"}, {name, value}});
  };
  EXPECT_EQ(with("Content-Length", "0"), Answer::kPage);
  EXPECT_EQ(with("Content-Length", "1"), Answer::kBadRequest);
  EXPECT_EQ(with("Transfer-Encoding", "chunked"), Answer::kBadRequest);
  EXPECT_EQ(with("Upgrade", "websocket"), Answer::kBadRequest);
}

}  // namespace forereach::access_test
