// The verifier's parser: values of what it accepts, places and causes of what it refuses.
#include "tests/test.h"

#include "verifier/expressions.h"
#include "verifier/jet.h"

namespace forereach::verifier::expressions_test {

// With x = 3, y = -2.
Real ValueOf(const std::string& text) {
  Tape tape;
  const Names names{{"x", tape.Add({Op::kVariable, -1, -1, 0})}, {"y", tape.Add({Op::kVariable, -1, -1, 1})}};
  const int place = Parse({text, 1, 1}, names, tape);
  const std::vector<Real> variables{3.0, -2.0};
  return Evaluate(tape, std::vector{place}, RealArithmetic(variables, {}))[0];
}

std::string RefusalOf(const std::string& text, int line = 1, int column = 1) {
  Tape tape;
  const Names names{{"x", tape.Add({Op::kVariable, -1, -1, 0})}};
  return Thrown<ExpressionError>([&] { static_cast<void>(Parse({text, line, column}, names, tape)); });
}

std::string Repeated(const std::string& piece, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) text += piece;
  return text;
}

TEST(Expressions, AreReadByTheRulesOfPrecedence) {
  const std::pair<const char*, double> cases[] = {{"1 + 2*3", 7},       {"(1 + 2)*3", 9},
                                                  {"1 - 2 - 3", -4},    {"1 - (2 - 3)", 2},
                                                  {"12/3/2", 2},        {"12/3*2", 8},
                                                  {"12/(3*2)", 2},      {"-x^2", -9},
                                                  {"(-x)^2", 9},        {"2^-1", 0.5},
                                                  {"2^-x^2*4", 0x1p-7}, {"x^2^3", 6561},
                                                  {"(x^2)^3", 729},     {"-x*y", 6},
                                                  {"x*-y*x", 18},       {"x - -y", 1},
                                                  {"x--y", 1},          {"+x + +y", 1},
                                                  {"- + -x", 3},        {"\tx\r\n*\ny ", -6},
                                                  {"y^3", -8},          {"y^-3", -0.125},
                                                  {"y^(2)", 4},         {"y^(-2)", 0.25},
                                                  {"y^+2", 4},          {"y^2.0", 4},
                                                  {"y^2e0", 4},         {"y^0", 1},
                                                  {"y^1", -2},          {".5 + 1e-3 + 1E+3", 1000.501},
                                                  {"((x))", 3},         {"max(x, y) + 10*min(x, y)", -17},
                                                  {"hypot(x, 2*y)", 5}, {"abs(y) - abs(x)", -1},
                                                  {"sqrt(x^2)", 3},     {"max(min(x, 1), (y))", 1}};
  for (const auto& [text, value] : cases)
    EXPECT_NEAR(ValueOf(text).ToDouble(), value, 1e-12 * (1 + std::abs(value))) << text;
}

TEST(Expressions, ANumberIsTheNearestDouble) {
  EXPECT_TRUE((ValueOf("0.1") - Real(0.1)).IsZero());
  EXPECT_TRUE((ValueOf("pi") - Real(0x1.921fb54442d18p+1)).IsZero());
  EXPECT_TRUE((ValueOf("123456789012345678901234567890") - Real(123456789012345678901234567890.0)).IsZero());
  EXPECT_TRUE((ValueOf("4.9406564584124654e-324") - Real(0x1p-1074)).IsZero());
}

TEST(Expressions, AnExponentThatIsNoSmallWholeLiteralTakesALogarithm) {
  EXPECT_TRUE(ValueOf("y^64").IsFinite());
  EXPECT_TRUE(ValueOf("y^-64").IsFinite());
  for (const char* text : {"y^65", "y^-65", "y^0.5", "y^(1 + 1)", "y^x", "y^--2", "y^2^1", "y^pi"})
    EXPECT_FALSE(ValueOf(text).IsFinite()) << text;
  EXPECT_NEAR(ValueOf("x^65").ToDouble() / ValueOf("x^64").ToDouble(), 3, 1e-12);
}

TEST(Expressions, RefusalsNamePlaceAndCause) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "line 1, column 1: expected a number, a name or an opening parenthesis"},
      {"x +", "line 1, column 4: expected a number, a name or an opening parenthesis"},
      {"x + * x", "line 1, column 5: expected a number, a name or an opening parenthesis"},
      {"()", "line 1, column 2: expected a number, a name or an opening parenthesis"},
      {"x x", "line 1, column 3: expected an operator"},
      {"2 (x)", "line 1, column 3: expected an operator"},
      {"(x", "line 1, column 1: this parenthesis is not closed"},
      {"x)", "line 1, column 2: this parenthesis was not opened"},
      {"x + z", "line 1, column 5: unknown name z"},
      {"sin", "line 1, column 1: unknown name sin"},
      {"sinus(x)", "line 1, column 1: unknown function sinus"},
      {"x(2)", "line 1, column 1: unknown function x"},
      {"sin(x, x)", "line 1, column 9: sin takes 1 argument(s), not 2"},
      {"atan2(x)", "line 1, column 8: atan2 takes 2 argument(s), not 1"},
      {"sin()", "line 1, column 5: expected a number, a name or an opening parenthesis"},
      {"sin(x", "line 1, column 4: this parenthesis is not closed"},
      {"x, x", "line 1, column 2: a comma separates the arguments of a function"},
      {"sin((x, x))", "line 1, column 7: a comma separates the arguments of a function"},
      {"x ? 1", "line 1, column 3: this character has no meaning in an expression"},
      {"x\n + \n   $", "line 3, column 4: this character has no meaning in an expression"},
      {"2x", "line 1, column 2: a number ends before a letter or a second point"},
      {"1.2.3", "line 1, column 4: a number ends before a letter or a second point"},
      {"1.", "line 1, column 1: a number has a digit after its point"},
      {".", "line 1, column 1: a number has a digit after its point"},
      {"007", "line 1, column 1: a number has no leading zero"},
      {"1e", "line 1, column 1: an exponent has a digit"},
      {"1e+", "line 1, column 1: an exponent has a digit"},
      {"1e999", "line 1, column 1: this number exceeds the range of doubles"},
      {"x^1e-999", "line 1, column 3: this number exceeds the range of doubles"}};
  for (const auto& [text, message] : cases) EXPECT_EQ(RefusalOf(text), message) << text;
  EXPECT_EQ(RefusalOf("x + z", 7, 11), "line 7, column 15: unknown name z");
  EXPECT_EQ(RefusalOf("x +\nz", 7, 11), "line 8, column 1: unknown name z");
  EXPECT_NE(RefusalOf(std::string("x\0", 2)), "");
  EXPECT_NE(RefusalOf("x\xc3\xa4"), "");
}

TEST(Expressions, NestingIsBounded) {
  for (const auto& [open, close] : {std::pair("(", ")"), {"sin(", ")"}, {"-", ""}, {"x^", ""}}) {
    EXPECT_EQ(RefusalOf(Repeated(open, kMaxNesting) + "x" + Repeated(close, kMaxNesting)), "") << open;
    EXPECT_NE(RefusalOf(Repeated(open, kMaxNesting + 1) + "x" + Repeated(close, kMaxNesting + 1))
                  .find("nested deeper than 200 levels"),
              std::string::npos)
        << open;
  }
  EXPECT_EQ(RefusalOf(Repeated("+", 60000) + "x"), "");
  EXPECT_EQ(RefusalOf(Repeated("(x)*", 10000) + "x"), "");  // beside each other
}

TEST(Expressions, SizeIsBounded) {
  const std::string longest = Repeated("x+", static_cast<int>(kMaxExpressionSize / 2) - 1) + "xx";
  ASSERT_EQ(longest.size(), kMaxExpressionSize);
  EXPECT_EQ(RefusalOf(longest), "line 1, column 65535: unknown name xx");
  EXPECT_EQ(RefusalOf(longest + "x"),
            "line 1, column 1: the expression has 65537 characters, at most 65536 are allowed");
  Tape tape;
  for (int i = 0; i < kMaxOperations; ++i) tape.Number(i + 0.5);
  EXPECT_EQ(Parse({"0.5", 1, 1}, {}, tape), 0);
  EXPECT_THROW(static_cast<void>(Parse({"0.25", 1, 1}, {}, tape)), ExpressionError);
}

TEST(Expressions, HostileTextsEndQuickly) {
  const auto begin = std::chrono::steady_clock::now();
  const int most = static_cast<int>(kMaxExpressionSize);
  for (const char* piece :
       {"(", "-", "x^", "2^", "sin(", "x-", "x/", "max(x,", ")", ",", "1", "1e9", "._", "+", "x", "\n"})
    static_cast<void>(RefusalOf(Repeated(piece, most / static_cast<int>(std::string(piece).size()))));
  for (const char* piece : {"x*x+", "sin(x)*", "x^2/", "x-"}) {
    EXPECT_EQ(RefusalOf(Repeated(piece, most / static_cast<int>(std::string(piece).size()) - 1) + "x"), "") << piece;
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
}

TEST(Tape, EqualOperationsAreOne) {
  Tape tape;
  const Names names{{"x", tape.Add({Op::kVariable, -1, -1, 0})}};
  const int once = Parse({"sin(x + 1)", 1, 1}, names, tape), size = tape.size();
  EXPECT_EQ(Parse({"sin((x + 1))", 1, 1}, names, tape), once);
  EXPECT_EQ(tape.size(), size);
  EXPECT_NE(Parse({"sin(1 + x)", 1, 1}, names, tape), once);
  EXPECT_NE(tape.Number(0.0), tape.Number(-0.0));
}

TEST(Tape, EvaluatesOnlyWhatIsWanted) {
  Tape tape;
  const Names names{{"x", tape.Add({Op::kVariable, -1, -1, 0})}};
  const int unused = Parse({"1/x", 1, 1}, names, tape), wanted = Parse({"x + 1", 1, 1}, names, tape);
  EXPECT_EQ(tape.LastUses(std::vector{wanted})[static_cast<std::size_t>(unused)], -1);
  const std::vector<Real> zero{0.0};
  EXPECT_EQ(Evaluate(tape, std::vector{wanted, wanted}, RealArithmetic(zero, {}))[1].ToDouble(), 1);
}

}  // namespace forereach::verifier::expressions_test
