#include "verifier/tape.h"

#include <bit>
#include <cstdint>
#include <tuple>

#include "forereach/numerics/size.h"

namespace forereach::verifier {

bool Tape::Order::operator()(const Operation& a, const Operation& b) const {
  const auto key = [](const Operation& x) {
    return std::tuple(x.op, x.a, x.b, x.index, std::bit_cast<std::uint64_t>(x.number));
  };
  return key(a) < key(b);
}

int Tape::Add(const Operation& operation) {
  const auto [found, is_new] = places_.try_emplace(operation, size());
  if (is_new) operations_.push_back(operation);
  return found->second;
}

std::vector<int> Tape::LastUses(std::span<const int> results) const {
  std::vector<int> last(operations_.size(), -1);
  for (const int place : results) last[ToSize(place)] = size();
  for (int i = size() - 1; i >= 0; --i) {
    if (last[ToSize(i)] < 0) continue;
    for (const int operand : {at(i).a, at(i).b})
      if (operand >= 0 && last[ToSize(operand)] < 0) last[ToSize(operand)] = i;
  }
  return last;
}

}  // namespace forereach::verifier
