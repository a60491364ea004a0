/** What the mutators of texts share: json_mutator.h, text_mutator.h. */
#pragma once

#include <cstring>
#include <random>
#include <string>
#include <string_view>

#include "fuzz/fuzz.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace forereach {

/** One of the last inputs that went deep; nothing if there is none. */
Bytes DeepInput(std::size_t which);

/** For LLVMFuzzerCustomMutator. Half of the time an input that went deep is what is changed, for what is refused is
refused again however it is changed; and a quarter of the changes is of bytes.
@param change makes another text of one, with a source of random numbers; empty if it cannot. */
template <class Change>
std::size_t MutateText(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed, Change change) {
  std::minstd_rand random(seed);
  random.discard(1);
  if (const Bytes deep = DeepInput(random()); random() % 2 == 0 && !deep.empty() && deep.size() <= max_size) {
    std::memcpy(data, deep.data(), deep.size());
    size = deep.size();
  }
  if (size == 0 || random() % 4 == 0) return LLVMFuzzerMutate(data, size, max_size);
  const std::string text = change(std::string_view(reinterpret_cast<const char*>(data), size), random);
  if (text.empty() || text.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::memcpy(data, text.data(), text.size());
  return text.size();
}

}  // namespace forereach
