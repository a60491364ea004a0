#include "task/row_readers.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "command_line/nearest.h"
#include "forereach/numerics/text.h"
#include "task/config_error.h"
#include "task/schema.h"

namespace forereach::key_rows {

void FailAt(const std::string& file, const ExpressionError& error) {
  throw ConfigError("{}:{}:{}: {}{}", file, error.line(), error.column(), error.what(),
                    error.word().empty() ? "" : "; " + Suggestion(error.word(), error.known()));
}

std::string PathIn(const Field& at) { return (std::filesystem::path(at.file()).parent_path() / at.Text()).string(); }

int IndexOf(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<int>(std::ranges::find(names, name) - names.begin());
}

void RequireOrdered(const Field& lower, const Field& upper) {
  if (lower.Number() <= upper.Number()) return;
  upper.Fail(fmt::format("{} is outside {}, below {}", ToText(upper.Number()),
                         Range{lower.Number(), kReal.upper, false, true}.text(), lower.key()));
}

ModelText::Parameter ReadParameter(const Field& at) {
  if (at.Count() == 0) return {at.name(), at.Number(), at.Number()};
  RequireOrdered(at[0], at[1]);
  return {at.name(), at[0].Number(), at[1].Number()};
}

}  // namespace forereach::key_rows
