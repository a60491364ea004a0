// Key files: a key is read out of what MakeKeyFile writes, and of nothing else.
#include "fuzz/fuzz.h"
#include "lcmtypes/authentic.h"

bool forereach::Try(Bytes data) {
  static MemoryFile file;
  const std::string& path = file.Write(data);
  return IsTaken([&] {
    const std::string text = "forereach-key-1 " + ToHex(LoadKey(path)) + "\n";
    std::string given(data.begin(), data.end());
    for (char& c : given) c = static_cast<char>('A' <= c && c <= 'F' ? c - 'A' + 'a' : c);
    Require(given == text);
  });
}
