#include "research/table.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "research/paper_values.h"
#include "research/statistics.h"

namespace forereach::research {
namespace {

std::string Fixed(double value, int decimals) { return fmt::format("{:.{}f}", value, decimals); }

// "+0.012", "-0.012", and "0.000" for what rounds to it.
std::string Signed(double value, int decimals) {
  const std::string size = Fixed(std::abs(value), decimals);
  if (size.find_first_not_of("0.") == std::string::npos) return size;
  return (value < 0 ? "-" : "+") + size;
}

int DecimalsOf(const Row& row) { return row.paper.value() ? row.paper.value()->decimals : row.decimals; }

std::string Ours(const Row& row) {
  if (!row.ours.mean) return "none";
  std::string text = Fixed(*row.ours.mean, DecimalsOf(row));
  return row.ours.seeds > 1 ? text + " ± " + Fixed(row.ours.deviation, DecimalsOf(row)) : text;
}

std::string Papers(const Row& row) {
  if (!row.paper.value()) return "";
  const PaperValue& paper = *row.paper.value();
  const std::string text = Fixed(paper.value, paper.decimals);
  return paper.deviation < 0 ? text : text + " ± " + Fixed(paper.deviation, paper.decimals);
}

std::string Difference(const Row& row) {
  const std::optional<PaperValue>& paper = row.paper.value();
  return paper && row.ours.mean ? Signed(*row.ours.mean - paper->value, paper->decimals) : "";
}

constexpr int kPaperSeeds = 10;

// Squared standard errors of the two means; none where a spread is not known.
struct Errors {
  double paper, ours;
};
std::optional<Errors> ErrorsOf(const Row& row) {
  const std::optional<PaperValue>& paper = row.paper.value();
  if (!paper || row.ours.seeds < 2) return std::nullopt;
  const double deviation =
      paper->deviation < 0 && !paper->same_as.empty() ? Paper(paper->same_as).deviation : paper->deviation;
  if (deviation < 0) return std::nullopt;
  return Errors{deviation * deviation / kPaperSeeds, row.ours.deviation * row.ours.deviation / row.ours.seeds};
}

// Of the difference of means.
std::optional<double> StandardError(const Row& row) {
  const std::optional<Errors> errors = ErrorsOf(row);
  return errors ? std::optional(std::sqrt(errors->paper + errors->ours)) : std::nullopt;
}

// Welch's test of one row, degrees of freedom rounded down. @pre the standard error is not zero
double WelchP(const Row& row, double difference) {
  const Errors errors = *ErrorsOf(row);
  const double sum = errors.paper + errors.ours;
  const double degrees =
      sum * sum / (errors.paper * errors.paper / (kPaperSeeds - 1) + errors.ours * errors.ours / (row.ours.seeds - 1));
  return StudentTail(std::abs(difference) / std::sqrt(sum), static_cast<int>(degrees));
}

std::string Probability(double p) {
  constexpr double kLeastShown = 1e-4;
  return p < kLeastShown ? "p < 0.0001" : "p = " + Fixed(p, 4);
}

std::string Count(int count, const char* what) { return std::to_string(count) + " " + what + (count == 1 ? "" : "s"); }

std::string InWords(const JointTest& test) {
  std::string text = "All rows together: ";
  if (test.rows + test.below + test.above == 0) return text + "nothing to test.";
  if (test.rows > 0)
    text += "chi-square " + Fixed(test.chi_square, 2) + " over the " + Count(test.rows, "row") +
            " with a standard error, " + Probability(test.p) + "; the least of one row times their number, " +
            Probability(test.p_of_least) + "; ";
  else
    text += "no row has a standard error, since the paper prints no spread or neither varies; ";
  text += Count(test.below, "row") + " below the paper, " + std::to_string(test.above) + " above, sign test " +
          Probability(test.p_of_signs);
  return test.left_out > 0 ? text + ". Left out: " + Count(test.left_out, "row") + " that others decide." : text + ".";
}

// Of a figure of the paper, over the rows that hold it: what agreement is worth is the least of their marks, and the
// word the worst.
struct FigureCount {
  Mark mark = Mark::kNotGiven;
  Word word = Word::kNone;
};

std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

std::optional<PaperValue> PaperOrNone(std::string_view key) {
  const auto found = std::ranges::find(kPaperValues, key, &PaperValue::key);
  return found == std::end(kPaperValues) ? std::nullopt : std::optional(*found);
}

const PaperValue& Paper(std::string_view key) {
  const auto found = std::ranges::find(kPaperValues, key, &PaperValue::key);
  if (found == std::end(kPaperValues)) throw std::invalid_argument("paper: no value " + std::string(key));
  return *found;
}

Estimate EstimateOf(const std::vector<std::optional<double>>& of_each_seed) {
  double sum = 0, squares = 0;
  int seeds = 0;
  for (const auto& value : of_each_seed)
    if (value) sum += *value, ++seeds;
  if (seeds == 0) return {};
  const double mean = sum / seeds;
  for (const auto& value : of_each_seed)
    if (value) squares += (*value - mean) * (*value - mean);
  return {mean, seeds > 1 ? std::sqrt(squares / (seeds - 1)) : 0, seeds};
}

const char* NameOf(Mark mark) {
  switch (mark) {
    case Mark::kExact: return "exact";
    case Mark::kTaken: return "taken";
    case Mark::kFitted: return "fitted";
    case Mark::kOurs: return "ours";
    case Mark::kNotGiven: break;
  }
  return "not given";
}

const char* NameOf(Word word) {
  switch (word) {
    case Word::kSame: return "same";
    case Word::kNear: return "near";
    case Word::kOff: return "off";
    case Word::kNone: break;
  }
  return "";
}

Reference::Reference(Mark mark, std::optional<PaperValue> value)
    : mark_(value ? mark : Mark::kNotGiven), value_(std::move(value)) {
  if (value_ && mark == Mark::kNotGiven)
    throw std::invalid_argument("paper: " + std::string(value_->key) + " is given, but marked as not given");
}

Word WordOf(const Row& row) {
  const std::optional<PaperValue>& paper = row.paper.value();
  if (!paper) return Word::kNone;
  if (!row.ours.mean) return Word::kOff;
  if (Fixed(*row.ours.mean, paper->decimals) == Fixed(paper->value, paper->decimals)) return Word::kSame;
  const std::optional<double> error = StandardError(row);
  return error && std::abs(*row.ours.mean - paper->value) <= 2 * *error ? Word::kNear : Word::kOff;
}

std::string ReasonOf(const Row& row) {
  if (WordOf(row) != Word::kOff) return "";
  if (!row.reason.empty()) return row.reason;
  if (!row.ours.mean) return "no plan to measure it on";
  return row.paper.mark() == Mark::kFitted ? "searched for, and not met" : "scenario bounds are ours";
}

JointTest TestJointly(const Table& table) {
  JointTest test;
  for (const Row& row : table.rows) {
    if (!row.paper.value() || !row.ours.mean) continue;
    if (row.follows) {
      ++test.left_out;
      continue;
    }
    const double difference = *row.ours.mean - row.paper.value()->value;
    if (WordOf(row) != Word::kSame) ++(difference < 0 ? test.below : test.above);
    const double error = StandardError(row).value_or(0);
    if (error == 0) continue;
    ++test.rows;
    test.chi_square += difference * difference / (error * error);
    test.p_of_least = std::min(test.p_of_least, WelchP(row, difference));
  }
  test.p_of_least = std::min(1.0, test.p_of_least * std::max(test.rows, 1));
  test.p = ChiSquareTail(test.chi_square, test.rows);
  test.p_of_signs = SignTest(test.below, test.above);
  return test;
}

std::string ToMarkdown(const Table& table) {
  std::string text = "## " + table.title + "\n" + table.about + "\n\n";
  text += "| | mark | paper | from | ours | difference | word | why |\n|---|---|---|---|---|---|---|---|\n";
  bool compares = false;
  for (const Row& row : table.rows) {
    const std::optional<PaperValue>& paper = row.paper.value();
    compares |= paper.has_value();
    text += "| " + row.what + " | " + NameOf(row.paper.mark()) + " | " + Papers(row) + " | " +
            std::string(paper ? paper->where : "") + " | " + Ours(row) + " | " + Difference(row) + " | " +
            NameOf(WordOf(row)) + " | " + ReasonOf(row) + " |\n";
  }
  return compares ? text + "\n" + InWords(TestJointly(table)) + "\n" : text;
}

std::string CountInMarkdown(const std::vector<Table>& tables) {
  std::map<std::pair<std::string_view, bool>, FigureCount> figures;  // by key, and whether it is easily met
  int not_given = 0;
  for (const Table& table : tables)
    for (const Row& row : table.rows) {
      const std::optional<PaperValue>& paper = row.paper.value();
      if (!paper) {
        ++not_given;
        continue;
      }
      const bool is_easy = paper->decimals == 0 || paper->value == 0 || paper->value == 1;
      FigureCount& figure = figures[{paper->same_as.empty() ? paper->key : paper->same_as, is_easy}];
      figure.word = std::max(figure.word, WordOf(row));
      if (figure.mark == Mark::kNotGiven || row.paper.mark() == Mark::kFitted) figure.mark = row.paper.mark();
    }
  std::string text = "| figures | same | near | off | all |\n|---|---|---|---|---|\n";
  for (const Mark mark : kMarks)
    for (const bool is_easy : {false, true}) {
      if (mark == Mark::kNotGiven) continue;
      std::map<Word, int> count;
      int all = 0;
      for (const auto& [key, figure] : figures)
        if (figure.mark == mark && key.second == is_easy) ++count[figure.word], ++all;
      if (all == 0) continue;
      text.append("| ").append(NameOf(mark)).append(is_easy ? ": 0, 1 or a whole number |" : " |");
      for (const Word word : {Word::kSame, Word::kNear, Word::kOff}) text += ' ' + std::to_string(count[word]) + " |";
      text += ' ' + std::to_string(all) + " |\n";
    }
  return text + "| rows without a figure of the paper | | | | " + std::to_string(not_given) + " |\n";
}

std::string ToCsv(const std::vector<Table>& tables) {
  std::string text = "table,what,mark,paper,ours,deviation,low,high,difference,word,why\n";
  for (const Table& table : tables)
    for (const Row& row : table.rows) {
      const std::optional<PaperValue>& paper = row.paper.value();
      const int decimals = std::max(DecimalsOf(row), 6);
      const std::optional<Range> range = StudentRange(row.ours.mean.value_or(0), row.ours.deviation, row.ours.seeds);
      text += Quoted(table.title) + "," + Quoted(row.what) + "," + NameOf(row.paper.mark()) + "," +
              (paper ? Fixed(paper->value, paper->decimals) : "") + "," +
              (row.ours.mean ? Fixed(*row.ours.mean, decimals) : "") + "," +
              (row.ours.seeds > 1 ? Fixed(row.ours.deviation, decimals) : "") + "," +
              (range ? Fixed(range->low, decimals) : "") + "," + (range ? Fixed(range->high, decimals) : "") + "," +
              Difference(row) + "," + NameOf(WordOf(row)) + "," + Quoted(ReasonOf(row)) + "\n";
    }
  return text;
}

}  // namespace forereach::research
