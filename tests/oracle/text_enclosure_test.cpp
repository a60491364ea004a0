// Functions from text over boxes and slices, against their values in 256 bits at points of these.
#include "forereach/dynamics/text_enclosure.h"

#include "tests/test.h"

#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/text_model.h"
#include "forereach/residual/growing_disturbance.h"
#include "tests/oracle/any_expression.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"
#include "tests/text_models.h"

namespace forereach::text_enclosure_test {

const ExpressionNames kNames{{"x", "y", "z"}, {"u"}, {{"c", 0.75, 0.75}, {"d", 0.5, 1.5}}, {{"xy", {"x*y", 1, 1}}}};

// Smooth, with kinks, and not defined everywhere.
const std::vector<std::string> kExpressions{
    "x",
    "3",
    "x - d*u",
    "xy + z^2",
    "sin(xy) + exp(-z^2)*tanh(u)",
    "atan2(y + 3, x) + sqrt(z^2 + 1)/(2 + x)",
    "log(4 + x)*acos(y/4) - asin(z/4)",
    "max(x, y)*min(z, u) + abs(x)*c",
    "abs(x + 0.3) - abs(y)",
    "atan(x*z) + tan(y/3)*(1 + tan(y/3)^2) + (x + 3)^-3 + (2 + z)^c",
    "hypot(x, y + 3) + cos(u)*z*z*z",
    "d*x*(y - d)",
    "hypot(x, y)",
    "1/(x + 0.7)",
    "sqrt(x + 0.5)",
    "atan2(y, x + 0.5)",
};

class Exact {
 public:
  Exact() {
    std::vector<std::string> names{"x", "y", "z", "u", "c", "d"};
    definition_ = ParseExpression({"x*y", 1, 1}, names);
    names.emplace_back("xy");
    for (const std::string& text : kExpressions) expressions_.push_back(ParseExpression({text, 1, 1}, names));
  }
  // Of x, y, z, u, c, d.
  [[nodiscard]] Real operator()(std::size_t k, std::vector<Real> values) const {
    const auto number = [](double x) { return Real(x); };
    values.push_back(Evaluate<Real>(definition_, values, number));
    return Evaluate<Real>(expressions_[k], values, number);
  }

 private:
  Expression definition_;
  std::vector<Expression> expressions_;
};

// A slice, and what is enclosed over it.
struct Enclosed {
  Zonotope slice;
  std::vector<double> half_width, input;
  std::vector<AffineEnclosure> values{kExpressions.size()};
};

std::vector<ExpressionText> Texts() {
  std::vector<ExpressionText> texts;
  for (const std::string& text : kExpressions) texts.push_back({text, 1, 1});
  return texts;
}

Enclosed AnyEnclosed(Random& random, const TextEnclosure& enclosure) {
  Eigen::MatrixXd generators = random.Matrix(3, random.Integer(0, 6), std::ldexp(1, -random.Integer(1, 12)));
  if (random.Coin(0.3)) generators.row(random.Below(3)).setZero();
  Enclosed enclosed{Zonotope(random.Vector(3, 0.8), generators), {}, {random.Uniform(-1, 1)}};
  if (random.Coin(0.5))
    for (int k = 0; k < 3; ++k) ArraysOf(enclosed.slice).mutable_slack(k) = random.Uniform(0, 0.01);
  enclosed.half_width = HalfWidths(enclosed.slice);
  enclosure.Enclose(enclosed.slice.center(), enclosed.half_width, enclosed.input, enclosed.values);
  return enclosed;
}

// A point of the slice, often a corner.
std::vector<Real> StateOf(Random& random, const Zonotope& slice) {
  std::vector<Real> x(slice.center().begin(), slice.center().end());
  const auto weight = [&] { return random.Coin(0.8) ? random.Sign() : random.Uniform(-1, 1); };
  for (int j = 0; j < slice.num_generators(); ++j) {
    const Real b(weight());
    for (int k = 0; k < 3; ++k) x[static_cast<std::size_t>(k)] += b * Real(slice.generator(k, j));
  }
  for (int k = 0; k < 3; ++k) x[static_cast<std::size_t>(k)] += Real(weight()) * Real(slice.slack(k));
  return x;
}

// Beyond the rounding of 256 bits.
bool IsInside(const Real& x, const Interval& range) {
  if (!(x == x)) return !range.IsFinite();
  const Real allowance = Real(0x1p-200) * (abs(x) + Real(1));
  return x >= Real(range.lower) - allowance && x <= Real(range.upper) + allowance;
}

TEST(TextEnclosure, ContainsTheValueAtEveryPoint) {
  const TextEnclosure enclosure(kNames, Texts());
  const Exact exact;
  std::size_t finite = 0, all = 0;
  for (TracedRandom random(7201); random.Again(3000);) {
    const Enclosed enclosed = AnyEnclosed(random, enclosure);
    for (int sample = 0; sample < 4; ++sample) {
      std::vector<Real> at = StateOf(random, enclosed.slice);
      const std::vector<Real> x = at;
      at.emplace_back(enclosed.input[0]);
      at.emplace_back(0.75);
      at.emplace_back(random.Coin(0.6) ? (random.Coin() ? 0.5 : 1.5) : random.Uniform(0.5, 1.5));
      for (std::size_t k = 0; k < kExpressions.size(); ++k) {
        const AffineEnclosure& value = enclosed.values[k];
        const Real exactly = exact(k, at);
        Real linear(0.0);
        for (std::size_t l = 0; l < 3; ++l)
          linear += Real(value.slope[l]) * (x[l] - Real(enclosed.slice.center(static_cast<int>(l))));
        const Interval over = RangeOver(enclosed.slice, value);
        ASSERT_TRUE(IsInside(exactly, value.range)) << kExpressions[k];
        ASSERT_TRUE(IsInside(exactly - linear, value.offset)) << kExpressions[k];
        ASSERT_TRUE(IsInside(exactly, over)) << kExpressions[k];
        ++all;
        finite += over.IsFinite();
      }
    }
  }
  EXPECT_GT(finite, all * 9 / 10);
}

// The second order: the width beyond the linear part shrinks with the square.
TEST(TextEnclosure, WidthBeyondTheLinearPartShrinksWithTheSquare) {
  const TextEnclosure enclosure(kNames, Texts());
  const std::vector<double> center{0.3, -0.4, 0.2}, input{0.5};
  std::vector<AffineEnclosure> wide(kExpressions.size()), narrow(kExpressions.size());
  enclosure.Enclose(center, std::vector(3, 1e-3), input, wide);
  enclosure.Enclose(center, std::vector(3, 1e-4), input, narrow);
  for (std::size_t k = 0; k < kExpressions.size(); ++k) {
    if (kExpressions[k].find('d') != std::string::npos) continue;  // a parameter that is a range has its own width
    const auto width = [](const AffineEnclosure& value) { return value.offset.upper - value.offset.lower; };
    EXPECT_LE(width(narrow[k]), 0.0101 * width(wide[k]) + 1e-14) << kExpressions[k];
    EXPECT_LE(width(wide[k]), 1e-4) << kExpressions[k];
  }
}

TEST(TextEnclosure, TellsWhichExpressionsUseAnInput) {
  const TextEnclosure enclosure(
      {{"x"}, {"u"}, {}, {{"twice", {"2*u", 1, 1}}}},
      std::vector<ExpressionText>{{"x", 1, 1}, {"x + twice", 1, 1}, {"u", 1, 1}, {"1", 1, 1}});
  EXPECT_FALSE(enclosure.UsesInput(0));
  EXPECT_TRUE(enclosure.UsesInput(1));
  EXPECT_TRUE(enclosure.UsesInput(2));
  EXPECT_FALSE(enclosure.UsesInput(3));
}

// Of random expressions, with kinks, poles and functions that are not defined everywhere.
TEST(GrowingDisturbance, BoundsTheSizeAtEveryPointOfTheBox) {
  const ModelText text = TextModel({{"x", "x"}, {"y", "y"}}, {"u"}, {{"dt", 1, 1}, {"d", 0.5, 1.5}});
  const auto model = MakeTextModel(text);
  const std::vector<std::string> names{"x", "y", "u", "dt", "d"}, leaves{"x", "y", "u", "d", "0.3"};
  int finite = 0, tight = 0;
  for (TracedRandom random(7241); random.Again(2000);) {
    std::vector<ExpressionText> bounds;
    for (int k = 0; k < 2; ++k) bounds.push_back({AnyExpression(random, leaves, random.Integer(1, 5), false), 1, 1});
    const GrowingDisturbance growing(*model, bounds);
    std::vector<Interval> box, sizes(2);
    const double width = random.Coin() ? 0 : std::ldexp(1, -random.Integer(0, 20));
    for (int l = 0; l < 3; ++l) {
      const double middle = random.Uniform(-2, 2);
      box.emplace_back(middle - width, middle + width);
    }
    growing.Enclose(box, sizes);
    for (int sample = 0; sample < 4; ++sample) {
      std::vector<Real> at;
      for (const Interval& range : box)
        at.emplace_back(random.Coin() ? range.lower : random.Coin() ? range.upper : range.Middle());
      at.emplace_back(1.0);
      at.emplace_back(random.Coin() ? 0.5 : 1.5);
      for (std::size_t k = 0; k < 2; ++k) {
        const Real value = abs(Evaluate<Real>(ParseExpression(bounds[k], names), at, [](double x) { return Real(x); }));
        ASSERT_TRUE(IsInside(value, sizes[k])) << bounds[k].text;
        ASSERT_GE(sizes[k].lower, 0) << bounds[k].text;
        finite += sizes[k].IsFinite();
        tight += sizes[k].IsFinite() && value >= Real(sizes[k].upper) - Real(1e-9);
      }
    }
  }
  EXPECT_GT(finite, 4000);
  EXPECT_GT(tight, 1000);
}

}  // namespace forereach::text_enclosure_test
