// docs/expressions.md is true: its models load, its expressions have their values, its errors are what is said.
#include <regex>

#include "command_line/nearest.h"
#include "forereach/dynamics/equations_header.h"
#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/program.h"
#include "forereach/numerics/limits.h"
#include "tests/paths.h"
#include "tests/task/task_files.h"

namespace forereach::expressions_document_test {

std::string Document() { return Read(FOREREACH_SOURCE_DIR "/docs/expressions.md"); }

// The rows of the table below the line `head`, without their bars; each has `columns` cells.
std::vector<std::vector<std::string>> Rows(const std::string& head) {
  const std::string document = Document();
  const std::size_t begin = document.find(head + "\n");
  EXPECT_NE(begin, std::string::npos) << head;
  std::istringstream lines(document.substr(begin));
  std::string line;
  std::getline(lines, line);
  std::getline(lines, line);
  std::vector<std::vector<std::string>> rows;
  while (std::getline(lines, line) && line.starts_with("| ")) {
    std::vector<std::string> cells;
    for (std::size_t at = 2, bar; (bar = line.find(" |", at)) != std::string::npos; at = bar + 3)
      cells.push_back(line.substr(at, bar - at));
    rows.push_back(cells);
  }
  return rows;
}

std::string Code(const std::string& cell) { return cell.substr(1, cell.size() - 2); }

TEST(ExpressionsDocument, ValuesAreThoseOfTheTable) {
  const auto rows = Rows("| text | stands for | value |");
  const std::vector<std::string> names{"x", "y"};
  const std::vector<long double> values{2, -0.5L};
  std::set<Function> seen;
  for (const auto& row : rows) {
    ASSERT_EQ(row.size(), 3u);
    const Expression expression = ParseExpression({Code(row[0])}, names);
    const auto value = Evaluate<long double>(expression, values, [](double x) -> long double { return x; });
    EXPECT_DOUBLE_EQ(static_cast<double>(value), std::stod(row[2])) << row[0];
    for (const auto& node : expression.nodes)
      if (node.kind == Expression::Kind::kCall) seen.insert(node.function);
  }
  EXPECT_EQ(seen.size(), Functions().size()) << "each function has a row";
}

TEST(ExpressionsDocument, ErrorsAreThoseOfTheTable) {
  const std::vector<std::string> names{"theta"};
  const auto rows = Rows("| text | error |");
  EXPECT_GE(rows.size(), 5u);
  for (const auto& row : rows) {
    ASSERT_EQ(row.size(), 2u);
    try {
      static_cast<void>(ParseExpression({Code(row[0])}, names));
      ADD_FAILURE() << row[0] << " is taken";
    } catch (const ExpressionError& error) {
      EXPECT_EQ(error.what() + (error.word().empty() ? "" : "; " + Suggestion(error.word(), error.known())), row[1]);
    }
  }
}

TEST(ExpressionsDocument, LimitsAreThoseOfTheCode) {
  const auto rows = Rows("| what | at most |");
  ASSERT_EQ(rows.size(), 9u);
  EXPECT_EQ(rows[0][1], std::to_string(kMaxStates) + ", at least 1");
  EXPECT_EQ(rows[1][1], std::to_string(kMaxInputs) + ", at least 1");
  EXPECT_EQ(rows[4][1], std::to_string(kLargestExpression));
  EXPECT_EQ(rows[5][1], std::to_string(kLargestExpressions));
  EXPECT_EQ(rows[6][1], std::to_string(kDeepestExpression));
  EXPECT_EQ(rows[8][1], std::to_string(ProgramDraft::kMaxOperations));
  EXPECT_THAT(Document(),
              HasSubstr("from -" + std::to_string(kLargestWholePower) + " to " + std::to_string(kLargestWholePower)));
}

TEST(ExpressionsDocument, ModelsLoad) {
  const std::string document = Document();
  const std::regex block("```yaml\n([^`]*)```");
  const struct {
    std::size_t states, inputs;
    const char* projection;
  } sizes[] = {{5, 2, "x, y"}, {2, 1, "angle"}, {5, 2, "x, y"}, {5, 2, "x, y"}, {4, 2, "x, y"}};
  const ScratchDirectory directory;
  std::size_t count = 0;
  std::string first;
  for (std::sregex_iterator at(document.begin(), document.end(), block), end; at != end; ++at) {
    const std::string text = (*at)[1].str(), task = "task:\n";
    if (text.starts_with(task)) {  // what a task of the first model may have
      const std::string arm =
          Replaced(TaskFor("model: {file: " FOREREACH_SOURCE_DIR "/config/models/two_link_arm.yaml}\n", 4, 2, "q1"),
                   "  projection: [q1]\n", "");
      const std::string& whole = text.find("body:") == std::string::npos ? first : arm;
      EXPECT_NO_THROW(
          (void)LoadConfig(directory.Write("task.yaml", whole + text.substr(task.size())), TransitionsFile::kIgnore))
          << text;
      continue;
    }
    ASSERT_LT(count, std::size(sizes));
    const std::string model =
        std::regex_replace((*at)[1].str(), std::regex("models/"), FOREREACH_SOURCE_DIR "/config/models/");
    const auto& [states, inputs, projection] = sizes[count++];
    if (first.empty()) first = TaskFor(model, states, inputs, projection);
    const Config config =
        LoadConfig(directory.Write("task.yaml", TaskFor(model, states, inputs, projection)), TransitionsFile::kIgnore);
    EXPECT_EQ(config.problem->model->num_states(), static_cast<int>(states));
  }
  EXPECT_EQ(count, std::size(sizes));
}

// The step that is written out is the library's, and can be exported.
TEST(ExpressionsDocument, AStepThatIsWrittenOutIsTheIntegrators) {
  const std::string document = Document(), open = "```yaml\n";
  const std::size_t begin = document.find(open, document.find("**A faster Runge-Kutta step.**"));
  ASSERT_NE(begin, std::string::npos);
  const std::size_t end = document.find("```", begin + open.size());
  const ScratchDirectory directory;
  const auto model_of = [&](const std::string& model) {
    const std::string path = directory.Write("task.yaml", TaskFor(model, 5, 2, "x, y"));
    return LoadConfig(path, TransitionsFile::kIgnore).problem->model;
  };
  const auto whole = model_of(document.substr(begin + open.size(), end - begin - open.size())),
             staged = model_of("model: {file: " FOREREACH_SOURCE_DIR "/config/models/unicycle.yaml}\n");
  EXPECT_FIELDS(*whole, (state_names(), staged->state_names()), (input_names(), staged->input_names()),
                (angles(), staged->angles()));
  EXPECT_THAT(whole->parameters(), ElementsAreArray(staged->parameters()));
  for (int i = 0; i < 50; ++i) {
    const std::vector<double> z{0.1 * i,        1 - 0.2 * i,  0.3 * i - 7, 0.5 - 0.03 * i,
                                1.5 - 0.06 * i, 1 - 0.05 * i, 0.1 * i};
    std::array<long double, 5> one, other;
    whole->EvaluateWide(z, one);
    staged->EvaluateWide(z, other);
    for (std::size_t k = 0; k < one.size(); ++k) EXPECT_NEAR(static_cast<double>(one[k] - other[k]), 0, 1e-16);
  }
  EXPECT_THAT(EquationsHeader(*whole->text(), "robot", ""), HasSubstr("struct Robot {"));
  EXPECT_THROW(static_cast<void>(EquationsHeader(*staged->text(), "robot", "")), ExportError);
}

}  // namespace forereach::expressions_document_test
