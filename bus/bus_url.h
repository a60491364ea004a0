/** Where a bus is: the text of `bus.url` and `--lcm-url`, checked. */
#pragma once

#include <cstdint>
#include <string>

#include "lcmtypes/bad_input.h"

namespace forereach {

/** The bus cannot be opened; the text says what to do about it. */
class BusError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** `udpm://239.255.76.67:7667?ttl=0`, LCM's UDP multicast. */
struct MulticastUrl {
  std::string group = "239.255.76.67";  ///< Dotted decimal, 224.0.0.0 to 239.255.255.255.
  std::uint16_t port = 7667;
  int ttl = 0;                    ///< 0 stays on this machine, 1 on this network.
  long receive_buffer_bytes = 0;  ///< recv_buf_size; 0: the URL does not say.

  /** What LCM is given: its own parser reads nothing that a person wrote. */
  [[nodiscard]] std::string ForSending() const;
};

/** `udpm://` alone stands for LCM's defaults. Options are separated by `&` or `,`, as LCM has them.
@throws BusError naming the URL, the part of it that is wrong and what it has to be. */
[[nodiscard]] MulticastUrl ParseMulticastUrl(const std::string& url);

}  // namespace forereach
