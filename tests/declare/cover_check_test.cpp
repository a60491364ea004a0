// The verifier's check of covers: whole ones hold; with a part missing, a bound lowered or a leaf moved they do not.
#include "verifier/cover_check.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/declare/families.h"

namespace forereach::verifier {
namespace {

using testing::HasSubstr;

SlopeClaim ClaimOf(const Family& family, int row, int column, double gap = 1e-7) {
  const SlopeBound bound = family.Bound(row, column, {gap});
  return {row, column, bound.upper, bound.cover};
}

// The leaf with the largest bound, close to the largest slope.
Cover::Node& Largest(Cover& cover) {
  return *std::ranges::max_element(
      cover.nodes, {}, [](const Cover::Node& node) { return node.argument < 0 && !node.outside ? node.number : 0; });
}

class Covers : public testing::Test {
 protected:
  CoverVerdict Check() const { return CoverChecker(family_.domain, family_.residual).Check(claim_); }
  void ExpectRefuted(const char* text) const {
    const CoverVerdict verdict = Check();
    EXPECT_EQ(verdict.answer, Answer::kNo);
    EXPECT_THAT(verdict.what, HasSubstr(text));
  }

  Family family_ = Bicycle();
  SlopeClaim claim_ = ClaimOf(family_, 2, 3);
};

TEST_F(Covers, AsTheyAreHold) {
  EXPECT_EQ(Check().answer, Answer::kYes);
  claim_ = ClaimOf(family_, 2, 5);
  EXPECT_EQ(Check().answer, Answer::kYes);
}

TEST_F(Covers, OfParameterBoxesHold) {
  family_ = Bicycle(0.1);
  for (const int column : {3, 5}) {
    claim_ = ClaimOf(family_, 2, column);
    EXPECT_EQ(Check().answer, Answer::kYes) << Check().what;
  }
}

TEST_F(Covers, OfABallHold) {
  family_ = PointMassInBall();
  for (const int column : {2, 3}) {
    claim_ = ClaimOf(family_, 3, column, 1e-2);
    EXPECT_EQ(Check().answer, Answer::kYes) << Check().what;
  }
}

TEST_F(Covers, AMissingPartIsSeen) {
  for (auto part : {&Cover::Node::below, &Cover::Node::above}) {
    const Cover before = claim_.cover;
    claim_.cover.nodes[0].*part = -1;
    ExpectRefuted("a part of the domain is missing");
    claim_.cover = before;
  }
  claim_.cover.nodes.clear();
  ExpectRefuted("a part of the domain is missing");
}

TEST_F(Covers, ALoopIsNoCover) {
  claim_.cover.nodes[1] = {3, false, 5, 1, 1};
  ExpectRefuted("missing");
}

TEST_F(Covers, ALoweredBoundIsSeen) {
  Cover::Node& leaf = Largest(claim_.cover);
  leaf.number *= 1 - 1e-6;
  ExpectRefuted("but the slope is");
}

TEST_F(Covers, ALoweredDeclarationIsSeen) {
  claim_.bound *= 1 - 1e-6;
  ExpectRefuted("above the declared");
}

TEST_F(Covers, ALeafSaidToLieOutsideIsSeen) {
  Largest(claim_.cover).outside = true;
  ExpectRefuted("said to lie outside");
}

TEST_F(Covers, ACutOutsideItsBoxIsSeen) {
  for (const double at : {26.0, -1.0, std::nan("")}) {
    claim_.cover.nodes[0] = {3, false, at, 1, 2};
    ExpectRefuted("outside of its box");
  }
}

TEST_F(Covers, ForALargerDomainDoesNotHold) {
  family_ = Bicycle(0.05);
  EXPECT_NE(Check().answer, Answer::kYes);
}

TEST_F(Covers, OnlyOfWhatIsNotZero) {
  claim_.row = 0;
  ExpectRefuted("zero");
}

}  // namespace
}  // namespace forereach::verifier
