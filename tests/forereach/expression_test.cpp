// Texts as expressions: what each stands for, to the last bit, and what is said of those that are none.
#include "forereach/dynamics/expression.h"

#include "tests/test.h"

namespace forereach::expression_test {

const std::vector<std::string> kNames{"x", "y", "theta", "v", "dt"};
constexpr long double Wide(double x) { return x; }

// volatile: the library computes at run time, the compiler in its own way.
const volatile long double kX = 0.75L, kY = -1.25L, kTheta = 0.5L, kV = 3, kDt = 0.1;

long double ValueOf(const std::string& text) {
  const std::vector<long double> values{kX, kY, kTheta, kV, kDt};
  return Evaluate<long double>(ParseExpression({text}, kNames), values, [](double x) { return Wide(x); });
}

// "line:column: what; known: ..."
std::string ErrorOf(const ExpressionText& text) {
  try {
    static_cast<void>(ParseExpression(text, kNames));
  } catch (const ExpressionError& error) {
    std::string said = std::to_string(error.line()) + ":" + std::to_string(error.column()) + ": " + error.what();
    if (!error.word().empty()) said += " [" + error.word() + "]";
    return said;
  }
  return "";
}

std::string ErrorOf(const std::string& text) { return ErrorOf(ExpressionText{text}); }

TEST(Expression, OperatorsBindAsInMathematics) {
  const std::pair<const char*, long double> cases[] = {
      {"x", kX},
      {"1", 1},
      {"0.5", 0.5L},
      {".5", 0.5L},
      {"1e-3", Wide(1e-3)},
      {"1E+2", 100},
      {"0.1", Wide(0.1)},
      {"pi", Wide(std::numbers::pi)},
      {"x + y*v", kX + kY * kV},
      {"(x + y)*v", (kX + kY) * kV},
      {"x - y - v", (kX - kY) - kV},
      {"x - (y - v)", kX - (kY - kV)},
      {"x / v / y", kX / kV / kY},
      {"x / v * y", kX / kV * kY},
      {"-x^2", -(kX * kX)},
      {"(-x)^2", kX * kX},
      {"-x*y", -kX * kY},
      {"x*-y", kX * -kY},
      {"x - -y", kX + kY},
      {"+x", kX},
      {"x + +y", kX + kY},
      {"2^3^2", std::exp(9 * std::log(2.0L))},
      {"2^-1", 0.5L},
      {"2^-1*4", 2},
      {"2*3^2", 18},
      {"-2^-2", -0.25L},
      {"v^+2", 9},
      {"v^(2)", 9},
      {"v^2.0", 9},
      {"y^3", kY * kY * kY},
      {"(y)^2*v", kY * kY * kV},
      {"dt*v*x", (kDt * kV) * kX},
      {"dt*(v*x)", kDt * (kV * kX)},
      {" x\t+\n y ", kX + kY},
      {"sin(theta)", std::sin(kTheta)},
      {"cos ( theta )", std::cos(kTheta)},
      {"tan(theta)", std::tan(kTheta)},
      {"asin(theta)", std::asin(kTheta)},
      {"acos(theta)", std::acos(kTheta)},
      {"atan(theta)", std::atan(kTheta)},
      {"sqrt(x)", std::sqrt(kX)},
      {"exp(y)", std::exp(kY)},
      {"log(v)", std::log(kV)},
      {"tanh(y)", std::tanh(kY)},
      {"abs(y)", -kY},
      {"signed_square(y)", -kY * kY},
      {"signed_square(x)", kX * kX},
      {"atan2(y, x)", std::atan2(kY, kX)},
      {"min(x, y)", kY},
      {"max(x, y)", kX},
      {"hypot(3, 4)", 5},
      {"sin(cos(theta) + atan2(y, max(x, v))*2)", std::sin(std::cos(kTheta) + std::atan2(kY, kV) * 2)},
      {"softplus(x, 0.5)", 0.5L * (kX / 0.5L + std::log1p(std::exp(-kX / 0.5L)))},
      {"smooth_gate(v)", std::exp(-1 / kV)},
      {"smooth_gate(y)", 0},
  };
  for (const auto& [text, value] : cases) EXPECT_EQ(ValueOf(text), value) << text;
}

TEST(Expression, AnExponentThatIsNoSmallWholeNumberIsAnExponential) {
  EXPECT_EQ(ValueOf("v^0.5"), std::exp(0.5L * std::log(kV)));
  EXPECT_EQ(ValueOf("v^x"), std::exp(kX * std::log(kV)));
  EXPECT_EQ(ValueOf("v^--2"), std::exp(2 * std::log(kV)));
  const auto last = [](const char* text) { return ParseExpression({text}, kNames).nodes.back(); };
  for (const char* inside : {"v^64", "v^-64", "v^0", "v^(-64)"})
    EXPECT_EQ(last(inside).kind, Expression::Kind::kWholePower) << inside;
  for (const char* outside : {"v^65", "v^-65", "v^63.5", "v^1e300", "v^pi", "v^(1 + 1)"})
    EXPECT_EQ(last(outside).kind, Expression::Kind::kPower) << outside;
  EXPECT_EQ(last("v^-64").b, -64);
}

TEST(Expression, OperandsComeBeforeOperatorsInTheOrderOfTheText) {
  const Expression e = ParseExpression({"x + dt*(v*cos(theta))"}, kNames);
  using Kind = Expression::Kind;
  std::vector<Kind> kinds;
  for (const auto& node : e.nodes) kinds.push_back(node.kind);
  EXPECT_THAT(kinds, ElementsAre(Kind::kName, Kind::kName, Kind::kName, Kind::kName, Kind::kCall, Kind::kMultiply,
                                 Kind::kMultiply, Kind::kAdd));
  EXPECT_EQ(e.nodes[4].column, 11);                               // cos
  EXPECT_EQ(e.nodes[7].column, 3);                                // +
  EXPECT_EQ(ParseExpression({"v^-2"}, kNames).nodes.size(), 2u);  // the exponent is no operand
}

TEST(Expression, ErrorsSayWhereAndWhatWasExpected) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "1:1: expected a number, a name or (, found the end"},
      {"  ", "1:3: expected a number, a name or (, found the end"},
      {"x +", "1:4: expected a number, a name or (, found the end"},
      {"x + * y", "1:5: expected a number, a name or (, found *"},
      {"x y", "1:3: expected an operator, found y"},
      {"(x y", "1:4: expected an operator or ), found y"},
      {"(x", "1:1: ( has no )"},
      {"(", "1:2: expected a number, a name or (, found the end"},
      {"()", "1:2: expected a number, a name or (, found )"},
      {"x)", "1:2: ) has no ("},
      {"x, y", "1:2: , separates the arguments of a function, and here is none"},
      {"(x, y)", "1:3: , separates the arguments of a function, and here is none"},
      {"sin(theta", "1:1: ( has no )"},
      {"sin", "1:1: sin is a function; expected ( behind it"},
      {"sin x", "1:1: sin is a function; expected ( behind it"},
      {"sin()", "1:5: expected a number, a name or (, found )"},
      {"sin(x, y)", "1:1: sin has more arguments, has to have 1"},
      {"1 + atan2(x)", "1:5: atan2 has 1 argument, has to have 2"},
      {"max(x, y, v)", "1:1: max has more arguments, has to have 2"},
      {"2x", "1:1: 2x is not a number; write * for a product: 2*x"},
      {"2(x)", "1:2: expected an operator, found ("},
      {"x(2)", "1:1: x is not a function; write * for a product: x*("},
      {"pi(2)", "1:1: pi is not a function; write * for a product: pi*("},
      {"x**2", "1:2: ** is not an operator; write ^ for a power"},
      {"1.", "1:1: 1. is not a number; write digits behind the point"},
      {".", "1:1: . is not a number; write digits behind the point"},
      {"1..2", "1:1: 1. is not a number; write digits behind the point"},
      {"1.2.3", "1:1: 1.2. is not a number"},
      {"1e", "1:1: 1e is not a number; write * for a product: 1*e"},
      {"007", "1:1: 007 has a leading zero"},
      {"1e999", "1:1: 1e999 is too large or too small to represent"},
      {"1e-999", "1:1: 1e-999 is too large or too small to represent"},
      {"x + thetta", "1:5: thetta is not a name that is known here [thetta]"},
      {"x + sn(theta)", "1:5: sn is not a function [sn]"},
      {"x = 1", "1:3: = does not occur in expressions; expected a name, a number or one of + - * / ^ ( ) ,"},
      {"x\xc2\xb2",
       "1:2: the byte 0xc2 does not occur in expressions; expected a name, a number or one of + - * / ^ ( ) ,"},
  };
  for (const auto& [text, error] : cases) EXPECT_EQ(ErrorOf(text), error) << text;
  EXPECT_EQ(ErrorOf(std::string("x\0", 2)),
            "1:2: the byte 0x00 does not occur in expressions; expected a name, a number or one of + - * / ^ ( ) ,");
}

TEST(Expression, PlacesAreThoseOfTheFile) {
  EXPECT_EQ(ErrorOf(ExpressionText{"x + + ", 12, 7}), "12:13: expected a number, a name or (, found the end");
  EXPECT_EQ(ErrorOf(ExpressionText{"x\n  + z\n", 12, 7}), "13:5: z is not a name that is known here [z]");
}

TEST(Expression, AnUnknownNameComesWithThoseThatAreKnown) {
  try {
    static_cast<void>(ParseExpression({"thetta"}, kNames));
    FAIL();
  } catch (const ExpressionError& error) {
    EXPECT_THAT(error.known(), ElementsAre("x", "y", "theta", "v", "dt", "pi"));
  }
  try {
    static_cast<void>(ParseExpression({"cosh(x)"}, kNames));
    FAIL();
  } catch (const ExpressionError& error) {
    EXPECT_THAT(error.known(), testing::IsSupersetOf({"cos", "tanh", "hypot"}));
    EXPECT_EQ(error.known().size(), Functions().size());
  }
}

TEST(Expression, TellsNamesAndReservedNamesApart) {
  for (const char* name : {"x", "_", "x_1", "Theta2"}) EXPECT_TRUE(IsName(name)) << name;
  for (const char* name : {"", "1x", "x-y", "x y", "x.y", "\xc3\xa4"}) EXPECT_FALSE(IsName(name)) << name;
  for (const char* name : {"pi", "sin", "hypot", "smooth_gate"}) EXPECT_TRUE(IsReserved(name)) << name;
  for (const char* name : {"dt", "Pi", "e"}) EXPECT_FALSE(IsReserved(name)) << name;
}

std::string Repeated(const std::string& text, std::size_t times) {
  std::string all;
  for (; times > 0; --times) all += text;
  return all;
}

TEST(Expression, DepthIsBounded) {
  for (const auto& [open, close] : {std::pair{"(", ")"}, {"sin(", ")"}, {"-", ""}, {"2^", ""}, {"max(x, ", ")"}}) {
    const auto nested = [&, o = std::string(open), c = std::string(close)](std::size_t levels) {
      return Repeated(o, levels) + "x" + Repeated(c, levels);
    };
    EXPECT_EQ(ErrorOf(nested(200)), "") << open;
    EXPECT_THAT(ErrorOf(nested(201)), EndsWith("is nested deeper than 200 levels")) << open;
  }
  EXPECT_EQ(ErrorOf(Repeated("x + y*(", 199) + "v" + Repeated(")", 199)), "");
  EXPECT_EQ(ErrorOf(Repeated("-x*(x^y) + ", 1000) + "v"), "");  // one after the other
}

TEST(Expression, SizeIsBounded) {
  const std::string largest = Repeated("x*", kLargestExpression / 2 - 1) + "x ";
  ASSERT_EQ(largest.size(), kLargestExpression);
  EXPECT_EQ(ErrorOf(largest), "");
  EXPECT_EQ(ErrorOf(largest + " "), "1:1: has 65537 bytes, at most 65536 are allowed");
}

// A random expression with all parentheses, and its value as C++ computes it.
struct Random {
  std::mt19937_64 random;

  int Below(int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); }

  std::pair<std::string, long double> Make(int depth) {
    const int kind = depth == 0 ? Below(2) : Below(9);
    if (kind == 0) {
      const int which = Below(5);
      return {kNames[ToSize(which)], std::array{kX, kY, kTheta, kV, kDt}[ToSize(which)]};
    }
    if (kind == 1) {
      std::ostringstream text;
      const double number = Below(1000) / 64.0;
      text << number;
      return {text.str(), std::stod(text.str())};
    }
    const auto [a, a_value] = Make(depth - 1);
    if (kind == 2) return {"-(" + a + ")", -a_value};
    if (kind == 3) return {"cos(" + a + ")", std::cos(a_value)};
    const auto [b, b_value] = Make(depth - 1);
    if (kind == 4) return {"min(" + a + ", " + b + ")", std::min(a_value, b_value)};
    const char sign = "+-*/"[kind - 5];
    const long double value = kind == 5   ? a_value + b_value
                              : kind == 6 ? a_value - b_value
                              : kind == 7 ? a_value * b_value
                                          : a_value / b_value;
    return {"(" + a + ") " + sign + " (" + b + ")", value};
  }
};

TEST(Expression, RandomExpressionsHaveTheirValue) {
  const unsigned seed = std::random_device()();
  Random random{std::mt19937_64(seed)};
  for (int trial = 0; trial < 2000; ++trial) {
    const auto [text, value] = random.Make(6);
    const long double found = ValueOf(text);
    EXPECT_TRUE(found == value || (std::isnan(found) && std::isnan(value))) << "seed " << seed << ": " << text;
  }
}

TEST(Expression, AnyTextIsTakenOrRefusedInItsPlace) {
  const unsigned seed = std::random_device()();
  std::mt19937_64 random(seed);
  constexpr std::string_view kPieces[] = {"x", "theta", "sin", "atan2", "(",  ")", ",",    "+",   "-", "*",  "/",  "^",
                                          "1", "2.5",   "pi",  " ",     "\n", "q", "max(", "1e3", ".", "^2", "^-1"};
  int taken = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    std::string text;
    for (int left = static_cast<int>(random() % 12); left >= 0; --left) text += kPieces[random() % std::size(kPieces)];
    try {
      const Expression e = ParseExpression({text, 3, 5}, kNames);
      ++taken;
      for (std::size_t i = 0; i < e.nodes.size(); ++i)
        ASSERT_LT(e.nodes[i].a, static_cast<int>(std::max<std::size_t>(i, 5)));
    } catch (const ExpressionError& error) {
      const auto lines = std::count(text.begin(), text.end(), '\n');
      ASSERT_TRUE(3 <= error.line() && error.line() <= 3 + lines) << "seed " << seed << ": " << text;
      ASSERT_GE(error.column(), 1);
    }
  }
  EXPECT_GT(taken, 100) << "seed " << seed;
}

}  // namespace forereach::expression_test
