/** Compiles a function for several instruction sets and calls one of them. No other file chooses an instruction set.

A hot function f is written once. `Dispatch<f>(instructions, arguments...)` calls it in machine code for the baseline,
AVX2 or AVX-512; everything that f calls is inlined into each. All compute the same bits (lanes.h), so the choice
changes the time only. `Dispatch<f, g>` calls g in place of f with AVX-512: the same of vectors of eight. If f calls
functions that are not FOREREACH_INLINE, do not mark f FOREREACH_INLINE: g++ would no longer inline those functions. */
#pragma once

#include <utility>

#include "forereach/numerics/compilation.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

/** Whether this machine has it. */
[[nodiscard]] inline bool IsSupported(InstructionSet instructions) noexcept {
#if defined(__x86_64__)
  if (instructions == InstructionSet::kAvx512)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
  if (instructions == InstructionSet::kAvx2) return __builtin_cpu_supports("avx2");
#endif
  return instructions == InstructionSet::kBaseline;
}

/** The fastest instruction set that this machine has. Cost: a few loads and tests. */
[[nodiscard]] inline InstructionSet BestInstructionSet() noexcept {
  for (const InstructionSet best : {InstructionSet::kAvx512, InstructionSet::kAvx2})
    if (IsSupported(best)) return best;
  return InstructionSet::kBaseline;
}

namespace internal {

#if defined(__x86_64__)
#define FOREREACH_AVX2 [[gnu::target("avx2"), gnu::flatten, gnu::noinline]]
#define FOREREACH_AVX512 [[gnu::target("avx512f,avx512vl,avx512dq,avx512bw"), gnu::flatten, gnu::noinline]]
#else
#define FOREREACH_AVX2 [[gnu::flatten, gnu::noinline]]
#define FOREREACH_AVX512 FOREREACH_AVX2
#endif

template <auto kFunction, class Type = decltype(kFunction)>
struct Compiled;

template <auto kFunction, class Result, class... Arguments, bool kNoexcept>
struct Compiled<kFunction, Result (*)(Arguments...) noexcept(kNoexcept)> {
  [[gnu::flatten, gnu::noinline]] static Result Baseline(Arguments... arguments) noexcept(kNoexcept) {
    return kFunction(arguments...);
  }
  FOREREACH_AVX2 static Result Avx2(Arguments... arguments) noexcept(kNoexcept) { return kFunction(arguments...); }
  FOREREACH_AVX512 static Result Avx512(Arguments... arguments) noexcept(kNoexcept) { return kFunction(arguments...); }
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
  FOREREACH_AVX512 static Result Avx512(const Class& object, Arguments... arguments) noexcept(kNoexcept) {
    return (object.*kFunction)(arguments...);
  }
};

#undef FOREREACH_AVX2
#undef FOREREACH_AVX512

}  // namespace internal

/** Returns kFunction(arguments...). For a const member function, the object is the first argument. No argument is moved
from. @pre the machine has the instruction set. */
template <auto kFunction, auto kOfEight = kFunction, class... Arguments>
[[gnu::always_inline]] inline decltype(auto) Dispatch(InstructionSet instructions, Arguments&&... arguments) {
  using Each = internal::Compiled<kFunction>;
  if (instructions == InstructionSet::kAvx512) return internal::Compiled<kOfEight>::Avx512(arguments...);
  return instructions == InstructionSet::kAvx2 ? Each::Avx2(arguments...) : Each::Baseline(arguments...);
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
