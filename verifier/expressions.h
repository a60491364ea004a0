/** The verifier's own parser of expressions (forereach/dynamics/model_text.h; docs/expressions.md describes the
language). It shares no code with the certifier's. */
#pragma once

#include <map>
#include <stdexcept>
#include <string>
#include <string_view>

#include "forereach/dynamics/model_text.h"
#include "verifier/tape.h"

namespace forereach::verifier {

/** A text that is not in the language. The message says where: "line 3, column 7: ...". */
class ExpressionError final : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/** What names stand for: places of a tape. */
using Names = std::map<std::string, int, std::less<>>;

/** The limits of the language. */
inline constexpr std::size_t kMaxExpressionSize = 65536;  ///< Characters of one expression.
inline constexpr int kMaxNesting = 200;                   ///< Parentheses, minus signs and powers inside each other.
inline constexpr int kMaxOperations = 65536;              ///< Of all expressions on one tape.
inline constexpr int kMaxExponent = 64;                   ///< In size, for a^n with a whole number n.

/** Whether the name is taken by the language: a function or pi. */
[[nodiscard]] bool IsReserved(std::string_view name);

/** Appends an expression to the tape and returns the place of its value. The stacks are explicit: nothing recurses.
Cost O(size log(tape)).
@throws ExpressionError if the text is not an expression, has an unknown name, or exceeds a limit. */
[[nodiscard]] int Parse(const ExpressionText& expression, const Names& names, Tape& tape);

}  // namespace forereach::verifier
