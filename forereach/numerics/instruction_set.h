/** Compiles a function for several instruction sets and calls one of them. No other file chooses an instruction set.

A hot function f is written once. `Dispatch<f>(instructions, arguments...)` calls it in machine code for the baseline or
for AVX2; everything that f calls is inlined into both. Both compute the same bits (lanes.h), so the choice changes the
time only. If f calls functions that are not FOREREACH_INLINE, do not mark f FOREREACH_INLINE: g++ would no longer
inline those functions. */
#pragma once

#include <utility>

#include "forereach/numerics/compilation.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

enum class InstructionSet { kBaseline, kAvx2 };

/** The fastest instruction set that this machine has. Cost: a load and a test. */
[[nodiscard]] inline InstructionSet BestInstructionSet() noexcept {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") ? InstructionSet::kAvx2 : InstructionSet::kBaseline;
#else
  return InstructionSet::kBaseline;
#endif
}

namespace internal {

#if defined(__x86_64__)
#define FOREREACH_AVX2 [[gnu::target("avx2"), gnu::flatten, gnu::noinline]]
#else
#define FOREREACH_AVX2 [[gnu::flatten, gnu::noinline]]
#endif

template <auto kFunction, class Type = decltype(kFunction)>
struct Compiled;

template <auto kFunction, class Result, class... Arguments, bool kNoexcept>
struct Compiled<kFunction, Result (*)(Arguments...) noexcept(kNoexcept)> {
  [[gnu::flatten, gnu::noinline]] static Result Baseline(Arguments... arguments) noexcept(kNoexcept) {
    return kFunction(arguments...);
  }
  FOREREACH_AVX2 static Result Avx2(Arguments... arguments) noexcept(kNoexcept) { return kFunction(arguments...); }
};

template <auto kFunction, class Class, class Result, class... Arguments, bool kNoexcept>
struct Compiled<kFunction, Result (Class::*)(Arguments...) const noexcept(kNoexcept)> {
  [[gnu::flatten, gnu::noinline]] static Result Baseline(const Class& object,
                                                         Arguments... arguments) noexcept(kNoexcept) {
    return (object.*kFunction)(arguments...);
  }
  FOREREACH_AVX2 static Result Avx2(const Class& object, Arguments... arguments) noexcept(kNoexcept) {
    return (object.*kFunction)(arguments...);
  }
};

#undef FOREREACH_AVX2

}  // namespace internal

/** Returns kFunction(arguments...). For a const member function, the object is the first argument. No argument is moved
from. @pre the machine has the instruction set. */
template <auto kFunction, class... Arguments>
[[gnu::always_inline]] inline decltype(auto) Dispatch(InstructionSet instructions, Arguments&&... arguments) {
  using Both = internal::Compiled<kFunction>;
  return instructions == InstructionSet::kAvx2 ? Both::Avx2(arguments...) : Both::Baseline(arguments...);
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
