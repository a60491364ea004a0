#include "live/web_server.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <chrono>
#include <cstring>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include <civetweb.h>
#include <nlohmann/json.hpp>

#include "page/document.h"

namespace forereach {
namespace {

// Of every answer: no other page may show it, read it, or learn its type by guessing.
constexpr const char* kHeaders =
    "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n"
    "Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\nConnection: close\r\n";

PageDocument LivePage() {
  return {.title = "ForeReach live",
          .body = kLiveBody,
          .styles = {&kPageStyle, &kLiveStyle},
          .scripts = {&kChartScript, &kSharedScript, &kLiveScript},
          .connect = "'self'"};
}

HttpRequest RequestOf(const mg_request_info& info) {
  const auto text = [](const char* bytes) { return bytes ? std::string_view(bytes) : std::string_view(); };
  HttpRequest request{
      .method = text(info.request_method), .target = text(info.request_uri), .query = text(info.query_string)};
  for (int i = 0; i < info.num_headers; ++i)
    request.headers.emplace_back(text(info.http_headers[i].name), text(info.http_headers[i].value));
  return request;
}

int Refuse(mg_connection* connection, int status) {
  const char* const reason = mg_get_response_code_text(connection, status);
  mg_printf(connection, "HTTP/1.1 %d %s\r\n%sContent-Type: text/plain\r\nContent-Length: %zu\r\n%s\r\n%s", status,
            reason, kHeaders, std::strlen(reason), status == 405 ? "Allow: GET\r\n" : "", reason);
  return status;
}

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

class WebServer::Content {
 public:
  Content(const Watcher& watcher, int port) : watcher_(watcher), page_(LivePage().Html(watcher.Beginning())) {
    page_head_ = fmt::format(
        "HTTP/1.1 200 OK\r\n{}Content-Security-Policy: {}; frame-ancestors 'none'\r\nContent-Type: text/html; "
        "charset=utf-8\r\nContent-Length: {}\r\n\r\n",
        kHeaders, LivePage().Policy(), page_.size());
    mg_callbacks callbacks{};
    callbacks.begin_request = [](mg_connection* connection) {
      return static_cast<Content*>(mg_get_user_data(mg_get_context(connection)))->Serve(connection);
    };
    callbacks.log_message = [](const mg_connection* connection, const char* message) {
      return static_cast<Content*>(mg_get_user_data(mg_get_context(connection)))->Note(message);
    };
    const std::string address = fmt::format("127.0.0.1:{}", port), threads = std::to_string(kMostReaders + 4),
                      patience = std::to_string(kWriteMs);
    const std::array<const char*, 17> options{"listening_ports",
                                              address.c_str(),
                                              "num_threads",
                                              threads.c_str(),
                                              "request_timeout_ms",
                                              patience.c_str(),
                                              "enable_keep_alive",
                                              "no",
                                              "max_request_size",
                                              "8192",
                                              "access_control_allow_origin",
                                              "",
                                              "access_control_allow_methods",
                                              "",
                                              "enable_directory_listing",
                                              "no",
                                              nullptr};
    context_ = mg_start(&callbacks, this, const_cast<const char**>(options.data()));
    if (!context_) throw ServerError(fmt::format("{}: the page cannot be served there: {}", address, problem_));
    mg_server_port used{};
    if (mg_get_server_ports(context_, 1, &used) == 1) port_ = used.port;
  }

  ~Content() {
    is_over_ = true;
    mg_stop(context_);
  }
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;

  [[nodiscard]] int port() const { return port_; }

 private:
  // @return not zero: the request has been answered.
  int Serve(mg_connection* connection) {
    try {
      const Answer answer = Judge(RequestOf(*mg_get_request_info(connection)));
      if (answer == Answer::kPage) return SendPage(connection);
      if (answer == Answer::kEvents) return SendEvents(connection);
      return Refuse(connection, static_cast<int>(answer));
    } catch (const std::exception&) {  // no memory
      return Refuse(connection, 503);
    }
  }

  int SendPage(mg_connection* connection) {
    mg_write(connection, page_head_.data(), page_head_.size());
    mg_write(connection, page_.data(), page_.size());
    return 200;
  }

  int SendEvents(mg_connection* connection) {
    if (readers_.fetch_add(1) >= kMostReaders) {
      readers_.fetch_sub(1);
      return Refuse(connection, 503);
    }
    mg_printf(connection, "HTTP/1.1 200 OK\r\n%sContent-Type: text/event-stream\r\n\r\n", kHeaders);
    try {
      Watcher::Cursor cursor;
      while (!is_over_) {
        const std::string news = watcher_.Since(cursor);
        const std::string event = news.empty() ? ":\n\n" : fmt::format("data: {}\n\n", news);
        if (mg_write(connection, event.data(), event.size()) <= 0) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(kUpdateMs));
      }
    } catch (const std::exception&) {  // no memory
    }
    readers_.fetch_sub(1);
    return 200;
  }

  int Note(const char* message) {
    if (std::this_thread::get_id() == maker_ && !context_) problem_ = message;
    return 1;
  }

  const Watcher& watcher_;
  const std::string page_;
  std::string page_head_, problem_ = "it did not start";
  std::atomic<int> readers_ = 0;
  std::atomic<bool> is_over_ = false;
  const std::thread::id maker_ = std::this_thread::get_id();
  mg_context* context_ = nullptr;
  int port_ = 0;
};

WebServer::WebServer(const Watcher& watcher, int port) : content_(std::make_unique<Content>(watcher, port)) {}
WebServer::~WebServer() = default;
int WebServer::port() const { return content_->port(); }

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
