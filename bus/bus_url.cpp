#include "bus/bus_url.h"

#include <charconv>
#include <set>
#include <string_view>
#include <system_error>

#include <arpa/inet.h>
#include <netinet/in.h>

namespace forereach {
namespace {

constexpr std::string_view kScheme = "udpm://";
constexpr long kMaxReceiveBufferBytes = long{1} << 30;

class Reader final {
 public:
  explicit Reader(const std::string& url) : url_(url) {}

  MulticastUrl Read() {
    if (!url_.starts_with(kScheme)) Fail("it has to begin with udpm://");
    const std::string_view rest = std::string_view(url_).substr(kScheme.size());
    const std::size_t question = rest.find('?');
    if (question != 0 && !rest.empty()) ReadPlace(rest.substr(0, question));
    if (question != std::string_view::npos) ReadOptions(rest.substr(question + 1));
    return result_;
  }

 private:
  [[noreturn]] void Fail(const std::string& why) const {
    throw BusError("bus: " + url_ + ": " + why + ", as in udpm://239.255.76.67:7667?ttl=0");
  }

  long Number(std::string_view text, const std::string& name, long lowest, long highest) const {
    long value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || value < lowest || value > highest)
      Fail("the " + name + " \"" + std::string(text) + "\" has to be a number from " + std::to_string(lowest) + " to " +
           std::to_string(highest));
    return value;
  }

  void ReadPlace(std::string_view place) {
    const std::size_t colon = place.find(':');
    if (colon == std::string_view::npos) Fail("the port is missing");
    result_.group = place.substr(0, colon);
    in_addr address{};
    if (::inet_pton(AF_INET, result_.group.c_str(), &address) != 1 || !IN_MULTICAST(ntohl(address.s_addr)))
      Fail("the address \"" + result_.group + "\" has to be one of IPv4 multicast, 224.0.0.0 to 239.255.255.255");
    result_.port = static_cast<std::uint16_t>(Number(place.substr(colon + 1), "port", 1, 65535));
  }

  void ReadOptions(std::string_view options) {
    std::set<std::string_view> seen;
    while (!options.empty()) {
      const std::size_t end = options.find_first_of(",&");
      const std::string_view option = options.substr(0, end);
      options.remove_prefix(end == std::string_view::npos ? options.size() : end + 1);
      const std::size_t equals = option.find('=');
      const std::string_view name = option.substr(0, equals);
      if (!seen.insert(name).second) Fail("the option " + std::string(name) + " is given twice");
      ReadOption(name, equals == std::string_view::npos ? "" : option.substr(equals + 1));
    }
  }

  void ReadOption(std::string_view name, std::string_view value) {
    if (name == "ttl")
      result_.ttl = static_cast<int>(Number(value, "ttl", 0, 255));
    else if (name == "recv_buf_size")
      result_.receive_buffer_bytes = Number(value, "recv_buf_size", 1, kMaxReceiveBufferBytes);
    else
      Fail("the option \"" + std::string(name) + "\" has to be ttl or recv_buf_size");
  }

  const std::string& url_;
  MulticastUrl result_;
};

}  // namespace

std::string MulticastUrl::ForSending() const {
  return std::string(kScheme) + group + ":" + std::to_string(port) + "?ttl=" + std::to_string(ttl);
}

MulticastUrl ParseMulticastUrl(const std::string& url) { return Reader(url).Read(); }

}  // namespace forereach
