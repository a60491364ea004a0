/** What the readers of several rows share. */
#pragma once

#include <string>
#include <vector>

#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/model_text.h"
#include "task/field.h"

namespace forereach::key_rows {

/** @throws ConfigError with the place of the error in an expression of `file`, and the nearest known name. */
[[noreturn]] void FailAt(const std::string& file, const ExpressionError& error);

/** The path of a file that a task file names, relative to the task file's directory. */
[[nodiscard]] std::string PathIn(const Field& at);

/** The index of a name that is there. */
[[nodiscard]] int IndexOf(const std::vector<std::string>& names, const std::string& name);

/** @throws ConfigError unless lower <= upper, which are numbers. */
void RequireOrdered(const Field& lower, const Field& upper);

/** A parameter that is a number, or a list of its smallest and largest value. */
[[nodiscard]] ModelText::Parameter ReadParameter(const Field& at);

}  // namespace forereach::key_rows
