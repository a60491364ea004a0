// The adversarial family: the value of a true declaration, a kept one, and one estimated from uninformative data.
#include "tests/test.h"

#include "research/experiment.h"

namespace forereach::research::adversarial_test {

TEST(AdversarialFamily, TheTrueDeclarationIsSoundAndTheOthersAreNot) {
  const Scope scope{1, true};
  const Experiment experiment = AdversarialFamily();
  const std::vector<Cell> cells = experiment.cells(scope);
  std::vector<CellResult> results;
  for (const Cell& cell : cells) results.push_back(RunCell(cell, {30, 24}));
  const std::vector<Table> tables = experiment.tables(Results(scope, cells, results));
  const auto figure = [&](std::size_t table, const std::string& what) {
    return std::ranges::find(tables[table].rows, what, &Row::what)->ours.mean;
  };
  for (const std::string lambda : {"lambda = 1: ", "lambda = 4: ", "lambda = 32: "}) {
    for (const char* group : {"A", "C"})  // none where it abstains before the horizon
      EXPECT_EQ(figure(1, lambda + "true, " + group + " coverage").value_or(1), 1) << lambda << group;
    EXPECT_EQ(figure(1, lambda + "true, false certificates, all groups"), 0) << lambda;
    EXPECT_EQ(figure(1, lambda + "estimate, C coverage"), 0) << lambda;
    EXPECT_EQ(figure(0, lambda + "estimate"), figure(0, "lambda = 1: estimate")) << lambda;
  }
  EXPECT_GT(figure(1, "lambda = 1: true, A certified"), 0.3);
  EXPECT_EQ(figure(1, "lambda = 1: kept, C coverage"), 1);
  EXPECT_EQ(figure(1, "lambda = 32: kept, C coverage"), 0);
  EXPECT_GT(figure(1, "lambda = 32: estimate, false certificates, all groups"), 8);
}

}  // namespace forereach::research::adversarial_test
