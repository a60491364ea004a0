/** Checks the compiler flags of a program that includes ForeReach's headers. Every installed header includes this one.

A certificate is a theorem about rounded numbers, and the user's program compiles parts of the library, because models
are templates. So some flags would invalidate proofs, and others would change the layout of objects that cross the
library's boundary. These flags are compile errors with an explanation. All other flags give the same bits: optimisation
levels, instruction sets, sanitizers, assertions and debug symbols.

Properties that the preprocessor cannot check are tested at program start (arithmetic.h) or prevent linking
(sets/eigen.h). */
#pragma once

#if __cplusplus < 202002L
#error "ForeReach is written in C++20: compile with -std=c++20 or later"
#endif

#include <version>  // defines the macros of the standard library

#if !defined(__GNUC__) || !defined(__LP64__) || !(defined(__x86_64__) || defined(__aarch64__))
#error "ForeReach needs g++ or clang++ and a 64-bit machine, x86-64 or aarch64: compile without -m32 and -mx32"
#endif

#ifndef __cpp_exceptions
#error "ForeReach reports a caller's mistake by an exception: compile without -fno-exceptions"
#endif

// Layout.
#ifndef __GLIBCXX__
#error "ForeReach is built with libstdc++, and its containers cross the interface: compile without -stdlib=libc++"
#endif
#ifdef _GLIBCXX_DEBUG
#error \
    "_GLIBCXX_DEBUG changes the layout of containers that cross ForeReach's interface: use _GLIBCXX_ASSERTIONS instead"
#endif
#if !_GLIBCXX_USE_CXX11_ABI
#error "ForeReach is built with libstdc++'s strings of C++11: compile without _GLIBCXX_USE_CXX11_ABI=0"
#endif

// Arithmetic.
#if defined(__FAST_MATH__)
#error "ForeReach's bounds need IEEE arithmetic: compile without -ffast-math and -Ofast"
#elif __FINITE_MATH_ONLY__
#error "ForeReach's bounds use NaN and infinity: compile without -ffinite-math-only"
#elif defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || defined(__NO_SIGNED_ZEROS__)
#error "ForeReach's bounds need IEEE arithmetic: compile without -funsafe-math-optimizations and what belongs to it"
#endif
#if __FLT_EVAL_METHOD__ != 0
#error "ForeReach's bounds need arithmetic in double: compile without -mfpmath=387 and -fexcess-precision"
#endif

namespace forereach::internal {

// Flags without a macro.
static_assert(0.1 != 0.1f, "ForeReach's constants are doubles: compile without -fsingle-precision-constant");
struct CharAndDouble {
  char c;
  double d;
};
static_assert(sizeof(CharAndDouble) == 16,
              "ForeReach's classes have their natural layout: compile without -fpack-struct");

}  // namespace forereach::internal

/** Between these two, every operation is rounded by itself: a * b + c is not fused, though compilers do that by default
where the machine can. Headers whose arithmetic is compiled in the user's program stand between them. Where the build
passes -ffp-contract=off for all, as the CMake targets do, they do nothing.

clang warns of functions that pass wide vectors; here all of them are inlined. */
#if defined(__clang__)
#define FOREREACH_ARITHMETIC_BEGIN                                                                          \
  _Pragma("clang diagnostic push") _Pragma("clang diagnostic ignored \"-Wpsabi\"")                          \
      _Pragma("clang diagnostic ignored \"-Wignored-pragmas\"") _Pragma("float_control(precise, on, push)") \
          _Pragma("clang fp contract(off)")
#define FOREREACH_ARITHMETIC_END _Pragma("float_control(pop)") _Pragma("clang diagnostic pop")
#elif defined(FOREREACH_ROUNDS_EACH_OPERATION)
#define FOREREACH_ARITHMETIC_BEGIN
#define FOREREACH_ARITHMETIC_END
#else
#define FOREREACH_ARITHMETIC_BEGIN _Pragma("GCC push_options") _Pragma("GCC optimize (\"fp-contract=off\")")
#define FOREREACH_ARITHMETIC_END _Pragma("GCC pop_options")
#endif
