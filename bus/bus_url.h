/** The address of a bus: parses and checks `bus.url` and `--lcm-url`. */
#pragma once

#include <cstdint>
#include <string>

#include "lcmtypes/bad_input.h"

namespace forereach {

/** The bus cannot be opened. The text says what to do. */
class BusError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** `udpm://239.255.76.67:7667?ttl=0`, LCM's UDP multicast. */
struct MulticastUrl {
  std::string group = "239.255.76.67";  ///< Dotted decimal, 224.0.0.0 to 239.255.255.255.
  std::uint16_t port = 7667;
  int ttl = 0;                    ///< Time to live: 0 stays on this machine, 1 on this network.
  long receive_buffer_bytes = 0;  ///< recv_buf_size in bytes; 0 if the URL does not set it.

  /** The canonical URL for LCM. LCM's parser never reads text from a user. */
  [[nodiscard]] std::string ForSending() const;
};

/** Parses a URL. `udpm://` alone means LCM's defaults. Options are separated by `&` or `,`, as in LCM.
@throws BusError with the URL, the wrong part and the requirement. */
[[nodiscard]] MulticastUrl ParseMulticastUrl(const std::string& url);

}  // namespace forereach
