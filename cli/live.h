/** The command that `forereach` leaves to the program forereach-live, which loads a web server: the commands that stop
and start a robot do without. */
#pragma once

namespace forereach {

inline constexpr struct {
  const char* name = "live";
  const char* purpose =
      "Show the running robot on a page for this machine's browsers, until Ctrl-C: it listens to the bus and sends "
      "nothing";
} kLive;

}  // namespace forereach
