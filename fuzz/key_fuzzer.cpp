// Key files: a key is read out of what MakeKeyFile writes, and of nothing else.
#include "fuzz/fuzz.h"
#include "lcmtypes/authentic.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forereach;
  static MemoryFile file;
  const std::string& path = file.Write(Bytes(data, size));
  IsTaken([&] {
    std::string text = "forereach-key-1 " + ToHex(LoadKey(path)) + "\n", given(data, data + size);
    for (char& c : given) c = static_cast<char>('A' <= c && c <= 'F' ? c - 'A' + 'a' : c);
    Require(given == text);
  });
  return 0;
}
