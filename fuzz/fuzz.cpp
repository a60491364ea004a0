#include "fuzz/fuzz.h"

#include <array>
#include <cstdio>

#include "fuzz/mutator.h"

namespace {

std::size_t deep = 0;
std::array<std::vector<std::uint8_t>, 64> deep_inputs;  // the last

void PrintDeep() { std::fprintf(stderr, "stat::deep_executions: %zu\n", deep); }

}  // namespace

forereach::Bytes forereach::DeepInput(std::size_t which) {
  const std::size_t known = std::min(deep, deep_inputs.size());
  return known == 0 ? Bytes() : Bytes(deep_inputs[which % known]);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (forereach::Try({data, size})) deep_inputs[deep++ % deep_inputs.size()].assign(data, data + size);
  return 0;
}

// Each target's options are in CMakeLists.txt. Those of the command line come behind, and win.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  static std::vector<std::string> options{FOREREACH_FUZZ_OPTIONS};
  static std::vector<char*> all{(*argv)[0]};
  for (std::string& option : options) all.push_back(option.data());
  all.insert(all.end(), *argv + 1, *argv + *argc);
  *argc = static_cast<int>(all.size());
  all.push_back(nullptr);
  *argv = all.data();
  std::atexit(PrintDeep);
  return 0;
}

// Freed memory is touched, if it is, within the same execution.
extern "C" const char* __asan_default_options() { return "malloc_context_size=2:quarantine_size_mb=16"; }

// libFuzzer's thread that watches the memory may still be starting when leaks are looked for. What the C library holds
// then, the attributes of this thread, is freed a moment later.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:__pthread_attr_extension\nleak:pthread_attr_setaffinity_np";
}
