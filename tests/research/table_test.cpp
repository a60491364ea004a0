// Tables: the paper's digits, the words where ours differ, means and deviations.
#include "research/table.h"

#include "tests/test.h"

#include "research/paper_values.h"
#include "research/statistics.h"

namespace forereach::research::table_test {

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

Row RowOf(const PaperValue& paper, const Estimate& ours, std::string reason = "") {
  return {"", {Mark::kOurs, paper}, ours, 3, std::move(reason)};
}

TEST(Reference, HasAMarkWhereThePaperHasAValue) {
  EXPECT_EQ(Reference().mark(), Mark::kNotGiven);
  EXPECT_EQ(Reference(Mark::kFitted, std::nullopt).mark(), Mark::kNotGiven);
  EXPECT_EQ(Reference(Mark::kFitted, kRecall).mark(), Mark::kFitted);
  EXPECT_THROW(Reference(Mark::kNotGiven, kRecall), std::invalid_argument);
}

TEST(Word, SameIsThePapersDigits) {
  EXPECT_EQ(WordOf(RowOf(kRecall, {0.4904, 0, 1})), Word::kSame);
  EXPECT_EQ(WordOf(RowOf(kRecall, {0.4906, 0, 1})), Word::kOff);
  EXPECT_EQ(WordOf(RowOf(kRecall, {0.4906, 0.1, 10})), Word::kOff) << "the paper's spread is not known";
  EXPECT_EQ(WordOf(RowOf(kRecall, {})), Word::kOff);
  EXPECT_EQ(WordOf({"", {}, {0.5, 0, 1}, 3, ""}), Word::kNone);
}

TEST(Word, OffHasAReason) {
  EXPECT_EQ(ReasonOf(RowOf(kRecall, {0.4904, 0, 1}, "so")), "");
  EXPECT_EQ(ReasonOf(RowOf(kRecall, {0.4906, 0, 1})), "scenario bounds are ours");
  EXPECT_EQ(ReasonOf(RowOf(kRecall, {0.4906, 0, 1}, "so")), "so");
  EXPECT_EQ(ReasonOf(RowOf(kRecall, {})), "no plan to measure it on");
  EXPECT_EQ(ReasonOf({"", {Mark::kFitted, kRecall}, {0.4906, 0, 1}, 3, ""}), "searched for, and not met");
}

TEST(Word, NearIsTwoStandardErrors) {
  // Both deviations 0.1 over ten seeds: the standard error is sqrt(0.002) = 0.0447.
  EXPECT_EQ(WordOf(RowOf(kWithSeeds, {0.4899 + 0.089, 0.1, 10})), Word::kNear);
  EXPECT_EQ(WordOf(RowOf(kWithSeeds, {0.4899 - 0.090, 0.1, 10})), Word::kOff);
  EXPECT_EQ(WordOf(RowOf(kWithSeeds, {0.52, 0, 1})), Word::kOff);
}

TEST(JointTest, TakesRowsThatAreNearOneByOneAsFarTogether) {
  // Each row is 1.8 standard errors below, so near; nine of them together are not.
  Table table{"T", "About.", {}};
  for (int i = 0; i < 9; ++i) table.rows.push_back(RowOf(kWithSeeds, {0.4899 - 1.8 * std::sqrt(0.002), 0.1, 10}));
  for (const Row& row : table.rows) EXPECT_EQ(WordOf(row), Word::kNear);
  table.rows.push_back(RowOf(kWithSeeds, {0.4899, 0.1, 10}));
  table.rows.push_back(RowOf(kRecall, {0.6, 0.1, 10}));  // no spread in the paper: a sign only
  const JointTest test = TestJointly(table);
  EXPECT_EQ(test.rows, 10);
  EXPECT_NEAR(test.chi_square, 9 * 1.8 * 1.8, 1e-9);
  EXPECT_NEAR(test.p, 0.0011738, 1e-7);
  EXPECT_NEAR(test.p_of_least, 10 * 0.0886443, 1e-5);  // t = 1.8 with 18 degrees of freedom
  EXPECT_FIELDS(test, (below, 9), (above, 1));
  EXPECT_NEAR(test.p_of_signs, 22.0 / 1024, 1e-12);
  EXPECT_THAT(ToMarkdown(table),
              HasSubstr("All rows together: chi-square 29.16 over the 10 rows with a standard error, "
                        "p = 0.0012; the least of one row times their number, p = 0.8864; 9 rows below the paper, 1 "
                        "above, sign test p = 0.0215."));
}

TEST(JointTest, LeavesOutWhatOtherRowsDecide) {
  Table table{"T", "About.", {}};
  for (int i = 0; i < 9; ++i) table.rows.push_back(RowOf(kWithSeeds, {0.4, 0.1, 10}));
  const JointTest all = TestJointly(table);
  for (std::size_t i = 1; i < table.rows.size(); ++i) table.rows[i].follows = true;
  const JointTest one = TestJointly(table);
  EXPECT_FIELDS(all, (rows, 9), (left_out, 0));
  EXPECT_FIELDS(one, (rows, 1), (left_out, 8), (below, 1));
  EXPECT_NEAR(one.chi_square, all.chi_square / 9, 1e-12);
  EXPECT_NEAR(one.p_of_least, all.p_of_least / 9, 1e-12);
  EXPECT_EQ(one.p_of_signs, 1);
  EXPECT_THAT(ToMarkdown(table), HasSubstr(". Left out: 8 rows that others decide.\n"));
}

TEST(JointTest, NoProbabilityIsPrintedAsZero) {
  Table table{"T", "About.", {}};
  for (int i = 0; i < 20; ++i) table.rows.push_back(RowOf(kWithSeeds, {0.9, 0.001, 10}));
  EXPECT_THAT(ToMarkdown(table),
              AllOf(HasSubstr("with a standard error, p < 0.0001; the least of one row times their number, p < 0.0001"),
                    HasSubstr("sign test p < 0.0001.")));
}

TEST(Statistics, AreThoseOfTheTables) {
  EXPECT_NEAR(ChiSquareTail(3.841459, 1), 0.05, 1e-7);
  EXPECT_NEAR(ChiSquareTail(5.991465, 2), 0.05, 1e-7);
  EXPECT_NEAR(ChiSquareTail(18.307038, 10), 0.05, 1e-7);
  EXPECT_NEAR(ChiSquareTail(24.995790, 15), 0.05, 1e-7);
  EXPECT_EQ(ChiSquareTail(0, 4), 1);
  EXPECT_EQ(StudentTail(0, 3), 1);
  EXPECT_NEAR(StudentTail(2.262157, 9), 0.05, 1e-7);
  EXPECT_NEAR(StudentTail(3, 5), 0.0300992, 1e-7);
  EXPECT_EQ(SignTest(0, 0), 1);
  EXPECT_EQ(SignTest(3, 3), 1);
  EXPECT_NEAR(SignTest(0, 6), 2.0 / 64, 1e-12);
  // Student's t: 12.7062, 4.3027, 2.2622 for one, two and nine degrees of freedom.
  EXPECT_FALSE(StudentRange(0, 1, 1));
  EXPECT_NEAR(StudentRange(0, std::sqrt(2), 2)->high, 12.7062, 1e-4);
  EXPECT_NEAR(StudentRange(0, std::sqrt(3), 3)->low, -4.3027, 1e-4);
  EXPECT_NEAR(StudentRange(1, std::sqrt(10), 10)->high, 3.2622, 1e-4);
  // Wilson 1927 of 8 in 10, and of none and all, which have an interval too.
  EXPECT_FALSE(WilsonRange(0, 0));
  EXPECT_NEAR(WilsonRange(8, 10)->low, 0.4902, 1e-4);
  EXPECT_NEAR(WilsonRange(8, 10)->high, 0.9433, 1e-4);
  EXPECT_EQ(WilsonRange(0, 10)->low, 0);
  EXPECT_NEAR(WilsonRange(0, 10)->high, 0.2775, 1e-4);
  EXPECT_NEAR(WilsonRange(10, 10)->low, 0.7225, 1e-4);
}

TEST(Table, PrintsPaperOursAndTheDifference) {
  const Table table{
      "T", "About.", {{"recall", {Mark::kFitted, kRecall}, {0.5061, 0.02, 10}, 3, ""}, {"none", {}, {}, 3, ""}}};
  EXPECT_THAT(ToMarkdown(table), AllOf(HasSubstr("## T\nAbout.\n"),
                                       HasSubstr("| recall | fitted | 0.490 | Table 1 | 0.506 ± 0.020 | +0.016 | off | "
                                                 "searched for, and not met |"),
                                       HasSubstr("| none | not given |  |  | none |  |  |  |")));
  EXPECT_EQ(
      ToCsv({table}),
      "table,what,mark,paper,ours,deviation,low,high,difference,word,why\n"
      "\"T\",\"recall\",fitted,0.490,0.506100,0.020000,0.491793,0.520407,+0.016,off,\"searched for, and not met\"\n"
      "\"T\",\"none\",not given,,,,,,,,\"\"\n");
  EXPECT_EQ(CountInMarkdown({table}),
            "| figures | same | near | off | all |\n|---|---|---|---|---|\n| fitted | 0 | 0 | 1 | 1 |\n"
            "| rows without a figure of the paper | | | | 1 |\n");
}

TEST(Table, CountsEachFigureOnceByItsWorstWordAndThoseThatAreEasilyMetApart) {
  const PaperValue one{"one", 1.000, 3, "Table 1"}, count{"count", 9, 0, "Table 1"};
  const Table first{"T", "", {RowOf(kRecall, {0.4904, 0, 1}), RowOf(one, {1.0, 0, 1}), RowOf(one, {1.0, 0, 1})}};
  const Table second{"U", "", {RowOf(kRecall, {0.6, 0, 1}), RowOf(count, {9, 0, 1}), {"", {}, {0.5, 0, 1}, 3, ""}}};
  EXPECT_EQ(CountInMarkdown({first, second}),
            "| figures | same | near | off | all |\n|---|---|---|---|---|\n| ours | 0 | 0 | 1 | 1 |\n"
            "| ours: 0, 1 or a whole number | 2 | 0 | 0 | 2 |\n| rows without a figure of the paper | | | | 1 |\n");
}

TEST(Table, AFigureThatIsPrintedTwiceHasOneSpreadAndCountsOnce) {
  const Row rounded = RowOf(Paper("bicycle.C.recall"), {0.9720, 0.0132, 10}),
            with_spread = RowOf(Paper("bicycle.C.recall.400"), {0.9720, 0.0132, 10});
  EXPECT_EQ(WordOf(rounded), Word::kNear);
  EXPECT_EQ(WordOf(with_spread), Word::kNear);
  EXPECT_THAT(CountInMarkdown({{"T", "", {rounded, with_spread}}}), HasSubstr("| ours | 0 | 1 | 0 | 1 |"));
}

TEST(PaperValues, HaveKeysOfTheirOwn) {
  std::set<std::string_view> keys;
  for (const PaperValue& value : kPaperValues) EXPECT_TRUE(keys.insert(value.key).second) << value.key;
  for (const PaperValue& value : kPaperValues)
    EXPECT_TRUE(value.same_as.empty() || std::abs(Paper(value.same_as).value - value.value) < 5e-4) << value.key;
  EXPECT_EQ(Paper("bicycle.C.recall.25").value, 0.4899);
  EXPECT_THROW((void)Paper("bicycle.D.recall"), std::invalid_argument);
}

}  // namespace forereach::research::table_test
