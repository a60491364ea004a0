/** Tables of our figures and the paper's: what each row's agreement is worth, a word on it, and a test of all together.
 */
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace forereach::research {

/** A figure as the paper prints it. */
struct PaperValue {
  std::string_view key;
  double value;
  int decimals;                   ///< As printed
  std::string_view where;         ///< The table or section it is from
  double deviation = -1;          ///< Over the ten seeds, where printed
  std::string_view same_as = {};  ///< The key under which the paper prints the same figure with more digits
};

/** Those of paper_values.h. @throws std::invalid_argument for an unknown key. */
[[nodiscard]] const PaperValue& Paper(std::string_view key);
/** The same for values that the paper does not always print. */
[[nodiscard]] std::optional<PaperValue> PaperOrNone(std::string_view key);

/** What a row that agrees with the paper says. */
enum class Mark {
  kNotGiven,  ///< The paper prints no value
  kExact,     ///< The paper's text fixes every input, so the figure has to come out to the last digit
  kTaken,     ///< An input of ours, which we took from the paper: agreement says that it was copied rightly
  kFitted,    ///< A definition was searched for under which this figure comes out: agreement confirms nothing
  kOurs       ///< Depends on definitions that the paper does not give and that were not fitted to this figure
};
inline constexpr Mark kMarks[] = {Mark::kExact, Mark::kTaken, Mark::kFitted, Mark::kOurs, Mark::kNotGiven};
/** "exact", "taken", "fitted", "ours" or "not given". */
[[nodiscard]] const char* NameOf(Mark mark);

/** The paper's figure for a row. There is none without a mark. */
class Reference final {
 public:
  Reference() = default;  ///< Not given
  /** Not given where `value` is none. @throws std::invalid_argument if a value is marked as not given. */
  Reference(Mark mark, std::optional<PaperValue> value);

  [[nodiscard]] Mark mark() const { return mark_; }
  [[nodiscard]] const std::optional<PaperValue>& value() const { return value_; }

 private:
  Mark mark_ = Mark::kNotGiven;
  std::optional<PaperValue> value_;
};

/** Mean and sample standard deviation over seeds; no value where no seed has one. */
struct Estimate {
  Estimate() = default;
  Estimate(double value) : mean(value), seeds(1) {}                        // NOLINT: a count is a figure,
  Estimate(std::optional<double> of) : mean(of), seeds(of.has_value()) {}  // NOLINT: and so is one that may lack
  Estimate(std::optional<double> of, double spread, int of_seeds) : mean(of), deviation(spread), seeds(of_seeds) {}

  std::optional<double> mean;
  double deviation = 0;  ///< 0 for a single seed
  int seeds = 0;         ///< That have a value
};

[[nodiscard]] Estimate EstimateOf(const std::vector<std::optional<double>>& of_each_seed);

struct Row {
  std::string what;
  Reference paper;
  Estimate ours;
  int decimals = 3;      ///< Where the paper has none
  std::string reason;    ///< Why it may differ; without one, what its mark says
  bool follows = false;  ///< From other rows of its table, ours and the paper's both: joint tests leave it out
};

/** How near ours is to the paper's. */
enum class Word {
  kNone,  ///< Nothing to compare with
  kSame,  ///< Ours rounds to the paper's digits
  kNear,  ///< Both spreads over seeds are known, and the means differ by at most twice the error of their difference
  kOff    ///< Neither, or ours has no value
};
/** "", "same", "near" or "off". */
[[nodiscard]] const char* NameOf(Word word);
[[nodiscard]] Word WordOf(const Row& row);
/** Of a row that is off; else empty. */
[[nodiscard]] std::string ReasonOf(const Row& row);

struct Table {
  std::string title, about;
  std::vector<Row> rows{};

  void Add(std::string what, Reference paper, const Estimate& ours, int decimals, std::string reason = "",
           bool follows = false) {
    rows.push_back({std::move(what), std::move(paper), ours, decimals, std::move(reason), follows});
  }
  void Add(std::string what, const Estimate& ours, int decimals) { Add(std::move(what), {}, ours, decimals); }
};

/** All rows of a table against the paper at once, but those that follow from others. The chi-square and the sign test
are as though rows were independent, which rows that share seeds and observations are not; p_of_least holds however they
depend on each other. */
struct JointTest {
  int rows = 0;              ///< With a standard error: both spreads known, and not both zero
  double chi_square = 0;     ///< Of their differences, in standard errors
  double p = 1;              ///< Of one as large, with `rows` degrees of freedom
  double p_of_least = 1;     ///< The least p of a row by Welch's test, times the number of rows (Bonferroni)
  int below = 0, above = 0;  ///< Rows that lie below the paper's digits, and above, whether they have an error or not
  double p_of_signs = 1;     ///< Of a split as uneven, either way, were both equally likely
  int left_out = 0;          ///< Rows with a figure of the paper that follow from others
};
[[nodiscard]] JointTest TestJointly(const Table& table);

/** The rows, then the joint test in words where the table has rows to compare. */
[[nodiscard]] std::string ToMarkdown(const Table& table);
/** The number of the paper's figures by mark and word, as a table: each figure once, however many rows hold it, with
the worst of their words. Those that are 0, 1 or a whole number have lines of their own: they are easily met. */
[[nodiscard]] std::string CountInMarkdown(const std::vector<Table>& tables);
/** table,what,mark,paper,ours,deviation,low,high,difference,word,why: one line for each row, with a header line. Low
and high are Student's interval over the seeds (statistics.h). */
[[nodiscard]] std::string ToCsv(const std::vector<Table>& tables);

}  // namespace forereach::research
