/** Tables of our figures and the paper's. */
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace forereach::experiments {

/** A figure as the paper prints it. */
struct PaperValue {
  std::string_view key;
  double value;
  int decimals;            ///< As printed
  std::string_view where;  ///< The table or section it is from
  double deviation = -1;   ///< Over the ten seeds, where printed
};

/** Those of paper_values.h. @throws std::invalid_argument for an unknown key. */
[[nodiscard]] const PaperValue& Paper(std::string_view key);
/** The same for values that the paper does not always print. */
[[nodiscard]] std::optional<PaperValue> PaperOrNone(std::string_view key);

/** Mean and sample standard deviation over seeds; no value where no seed has one. */
struct Estimate {
  std::optional<double> mean;
  double deviation = 0;  ///< 0 for a single seed
  int seeds = 0;         ///< That have a value
};

[[nodiscard]] Estimate EstimateOf(const std::vector<std::optional<double>>& of_each_seed);

struct Row {
  std::string what;
  std::optional<PaperValue> paper;
  Estimate ours;
  int decimals = 3;    ///< Where the paper has none
  std::string reason;  ///< Why it may differ; without one, that the scenario bounds are ours
};

/** "same" if ours rounds to the paper's digits; "within the seeds' spread" if both spreads are known and the difference
of means is at most twice its standard error; else the reason. Empty where there is nothing to compare. */
[[nodiscard]] std::string Verdict(const Row& row);

struct Table {
  std::string title, about;
  std::vector<Row> rows;
};

[[nodiscard]] std::string ToMarkdown(const Table& table);
/** table,what,paper,ours,deviation,difference,word: one line for each row, with a header line. */
[[nodiscard]] std::string ToCsv(const std::vector<Table>& tables);

}  // namespace forereach::experiments
