// Tables: the paper's digits, the words where ours differ, means and deviations.
#include "experiments/table.h"

#include <set>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/paper_values.h"

namespace forereach::experiments {
namespace {

using testing::HasSubstr;

constexpr PaperValue kRecall{"x", 0.490, 3, "Table 1"};
constexpr PaperValue kWithSeeds{"x", 0.4899, 4, "Table 1", 0.1};

TEST(Estimate, OfSeedsThatHaveAValue) {
  const Estimate some = EstimateOf({1.0, std::nullopt, 2.0, 3.0});
  EXPECT_DOUBLE_EQ(*some.mean, 2);
  EXPECT_DOUBLE_EQ(some.deviation, 1);
  EXPECT_EQ(some.seeds, 3);
  EXPECT_EQ(EstimateOf({0.5}).deviation, 0);
  EXPECT_FALSE(EstimateOf({std::nullopt}).mean);
  EXPECT_FALSE(EstimateOf({}).mean);
}

TEST(Verdict, SameIsThePapersDigits) {
  EXPECT_EQ(Verdict({"", kRecall, {0.4904, 0, 1}, 3, ""}), "same");
  EXPECT_EQ(Verdict({"", kRecall, {0.4906, 0, 1}, 3, ""}), "scenario bounds are ours");
  EXPECT_EQ(Verdict({"", kRecall, {0.4906, 0, 1}, 3, "so"}), "so");
  EXPECT_EQ(Verdict({"", kRecall, {}, 3, ""}), "no plan to measure it on");
  EXPECT_EQ(Verdict({"", {}, {0.5, 0, 1}, 3, ""}), "");
}

TEST(Verdict, SeedsExplainTwoStandardErrors) {
  // Both deviations 0.1 over ten seeds: the standard error is sqrt(0.002) = 0.0447.
  EXPECT_EQ(Verdict({"", kWithSeeds, {0.4899 + 0.089, 0.1, 10}, 4, ""}), "within the seeds' spread");
  EXPECT_EQ(Verdict({"", kWithSeeds, {0.4899 - 0.090, 0.1, 10}, 4, ""}), "scenario bounds are ours");
  EXPECT_EQ(Verdict({"", kWithSeeds, {0.52, 0, 1}, 4, ""}), "scenario bounds are ours");
}

TEST(Table, PrintsPaperOursAndTheDifference) {
  const Table table{"T", "About.", {{"recall", kRecall, {0.5061, 0.02, 10}, 3, ""}, {"none", {}, {}, 3, ""}}};
  const std::string text = ToMarkdown(table);
  EXPECT_THAT(text, HasSubstr("## T\nAbout.\n"));
  EXPECT_THAT(text, HasSubstr("| recall | 0.490 | Table 1 | 0.506 ± 0.020 | +0.016 | scenario bounds are ours |"));
  EXPECT_THAT(text, HasSubstr("| none |  |  | none |  |  |"));
  EXPECT_EQ(ToCsv({table}),
            "table,what,paper,ours,deviation,difference,word\n"
            "\"T\",\"recall\",0.490,0.506100,0.020000,+0.016,\"scenario bounds are ours\"\n"
            "\"T\",\"none\",,,,,\"\"\n");
}

TEST(PaperValues, HaveKeysOfTheirOwn) {
  std::set<std::string_view> keys;
  for (const PaperValue& value : kPaperValues) EXPECT_TRUE(keys.insert(value.key).second) << value.key;
  EXPECT_EQ(Paper("bicycle.C.recall.25").value, 0.4899);
  EXPECT_THROW((void)Paper("bicycle.D.recall"), std::invalid_argument);
}

}  // namespace
}  // namespace forereach::experiments
