/** The equations of a text as C++, for compilers. */
#pragma once

#include <stdexcept>
#include <string>

#include "forereach/dynamics/model_text.h"

namespace forereach {

/** A text cannot be compiled with any gain. The message says what in it, and what to write. */
class ExportError final : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/** Operations of the value and its derivatives above which compilers take too long for straight-line code. */
inline constexpr int kMostCompiled = 2048;

/** A header with one struct, as EquationsModel (equations_model.h) and UseCompiled (compiled_models.h) take it. Its
program is that of MakeTextModel(text), operation by operation.
@param text next states, or rates with the Euler step. @param name of the struct, as a word of letters, digits and
underscores: differential_drive gives the struct DifferentialDrive. @param origin a line for its comment.
@throws ExportError for midpoint and rk4, and for a parameter that is a range, because machine code gains little there
(docs/decisions.md); for an operation on numbers alone; for a program above kMostCompiled.
@throws ExpressionError, std::invalid_argument as MakeTextModel does. */
[[nodiscard]] std::string EquationsHeader(const ModelText& text, const std::string& name, const std::string& origin);

/** The struct's name: the words of `name`, each with a capital. "Model" stands before one that would not do: it begins
with a digit, or is in capitals, as macros are (EOF, NAN), or is Eigen. */
[[nodiscard]] std::string StructName(const std::string& name);

}  // namespace forereach
