// MCAP files of others: any bytes are a table of the messages of a channel, or refused with a ConfigError. The first
// byte chooses whether they are a whole file, or what is in its only chunk.
#include "identify/mcap_table.h"

#include "fuzz/fuzz.h"

namespace forereach {

bool Try(Bytes input) {
  static MemoryFile file;
  if (input.empty()) return false;
  static constexpr std::string_view kHead("\x89MCAP0\r\n\6", 9);
  std::vector<std::uint8_t> bytes(kHead.begin(), kHead.end() - (input[0] % 2 == 0 ? 1 : 0));
  if (input[0] % 2 == 1) {
    constexpr std::size_t kFront = 16 + 8 + 4 + 4 + 8;  // of a chunk without compression
    const auto put = [&](std::uint64_t value) {
      for (int shift = 0; shift < 64; shift += 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
    };
    put(kFront + input.size() - 1);
    bytes.resize(bytes.size() + kFront - 8);
    put(input.size() - 1);
  }
  bytes.insert(bytes.end(), input.begin() + 1, input.end());
  const std::string& path = file.Write(bytes);
  return IsTaken([&] {
    const LogTable table = ReadMcapLog(path, {"recorded", "t.x", "t.a.b[1]"});
    Require(table.values.rows() == std::ssize(table.lines) && table.after_loss.size() == table.lines.size());
    Require(table.values.cols() == 3);
  });
}

}  // namespace forereach
