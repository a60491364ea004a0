// Message types of others: first a byte with the length of a message, then the message, then the text of an .lcm file.
// Whatever the two are, a number is read, or a reason is given.
#include "identify/lcm_types.h"

#include "fuzz/fuzz.h"

namespace forereach {

bool Try(Bytes input) {
  if (input.empty()) return false;
  const std::size_t length = std::min<std::size_t>(input[0], input.size() - 1);
  const Bytes message = input.subspan(1, length), text = input.subspan(1 + length);
  bool was_read = false;
  static_cast<void>(IsTaken([&] {
    LcmTypes types;
    types.AddText("fuzzed.lcm", std::string(text.begin(), text.end()));
    const auto type = types.TypeOf(message);
    for (const char* name : {"p.a", "p.b", "a"})
      for (const char* place : {"x", "x[0]", "x[1][2]", "b.x", "b[1].x", "n"})
        static_cast<void>(IsTaken([&] {
          const auto numbers = types.Read(type.value_or(name), {place}, message);
          Require(!numbers || numbers->size() == 1);
          was_read |= numbers.has_value();
        }));
  }));
  return was_read;
}

}  // namespace forereach
