// The error bounds of the plain evaluation of the elementary functions, against evaluation in 256 bits of the same
// program. Program.DerivativesAgreeWithThoseMadeByHand checks that a program has the right derivatives.
#include "forereach/dynamics/rounding.h"

#include "tests/test.h"

#include "forereach/dynamics/program_model.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/in_reals.h"
#include "tests/oracle/traced_random.h"

namespace forereach::rounding_oracle_test {

constexpr int kOutputs = 16;  // as many as a program has

// Every function, of p in [-0.4, 0.4] and q in [0.5, 3].
template <class T>
void AllFunctions(const T& p, const T& q, std::span<T> next) {
  next[0] = sqrt(p + q);
  next[1] = exp(p);
  next[2] = log(p + q);
  next[3] = asin(p);
  next[4] = acos(p);
  next[5] = atan(p * q);
  next[6] = tanh(p - q);
  next[7] = atan2(p, q);
  next[8] = atan2(q, p);
  next[9] = pow(p, 3);
  next[10] = pow(p + q, -2);
  next[11] = abs(p + q) * p;
  next[12] = max(p, q + T(2)) * p;
  next[13] = min(p, -q) * q;
  next[14] = SignedSquare(p) * log(q);
  next[15] = sqrt(T(1) - p * p);
}

struct Plainly {
  static constexpr double kLeastRounding = 1e-17;  // what the plain values are off by, at least in some trial
  static constexpr int kStates = kOutputs, kInputs = 0;
  static constexpr std::array<const char*, 0> kParameterNames{};

  template <class T>
  static void Step(std::span<const T> /*parameters*/, std::span<const T> z, std::span<T> next) {
    AllFunctions<T>(z[0] * z[1] / T(4), z[2], next);
  }
  static std::vector<Interval> Domain(Random& random) {
    std::vector<Interval> domain(kOutputs, Interval(0));
    const double size = std::ldexp(1, -random.Integer(0, 20));
    for (int l = 0; l < 2; ++l) {
      const double middle = random.Uniform(-1.2, 1.2) * (1 - size);
      domain[static_cast<std::size_t>(l)] = {middle - 1.2 * size, middle + 1.2 * size};
    }
    const double middle = 1.75 + random.Uniform(-1.25, 1.25) * (1 - size);
    domain[2] = {middle - 1.25 * size, middle + 1.25 * size};
    return domain;
  }
};

// The operand is a difference of squares, whose rounding error is many times that of the function.
struct AfterCancellation {
  static constexpr double kLeastRounding = 1e-13;
  static constexpr int kStates = kOutputs, kInputs = 0;
  static constexpr std::array<const char*, 0> kParameterNames{};

  template <class T>
  static void Step(std::span<const T> /*parameters*/, std::span<const T> z, std::span<T> next) {
    const T difference = z[0] * z[0] - z[1] * z[1];
    AllFunctions<T>(difference * T(0x1p-26) + z[2], difference * T(0x1p-22), next);
  }
  static std::vector<Interval> Domain(Random& random) {
    std::vector<Interval> domain(kOutputs, Interval(0));
    domain[0] = {1e6, 1e6 + random.Uniform(0, 0.1)};
    domain[1] = {1e6 - random.Uniform(1.5, 5), 1e6 - 1.4};
    domain[2] = {-random.Uniform(0.1, 0.3), random.Uniform(0.01, 0.1)};
    return domain;
  }
};

template <class Equations>
std::shared_ptr<const ProgramModel> Model() {
  const auto draft = std::make_shared<const ProgramDraft>(DraftOf<Equations>());
  const std::vector<std::string> names(kOutputs, "z");
  return std::make_shared<const ProgramModel>(draft, std::vector<Interval>{},
                                              ModelNames{"functions", names, {}, {}, {}});
}

double PointIn(Random& random, const Interval& x) {
  return random.Coin()   ? std::clamp(random.Uniform(x.lower, x.upper), x.lower, x.upper)
         : random.Coin() ? x.lower
                         : x.upper;
}

// A box in the domain, and its center.
struct AnyBox {
  std::vector<Interval> box;
  std::vector<PlainInterval> ranges;
  std::vector<double> center;

  AnyBox(Random& random, const std::vector<Interval>& domain) {
    for (const Interval& whole : domain) {
      center.push_back(PointIn(random, whole));
      const double reach = random.Coin(0.1) ? 0 : std::ldexp(random.Uniform(0, 1), -random.Integer(0, 50));
      box.emplace_back(std::max(whole.lower, center.back() - reach), std::min(whole.upper, center.back() + reach));
      ranges.push_back({box.back().lower, box.back().upper});
    }
  }
};

template <class Equations>
class RoundingOf : public testing::Test {};
using Both = testing::Types<Plainly, AfterCancellation>;
TYPED_TEST_SUITE(RoundingOf, Both);

TYPED_TEST(RoundingOf, ElementaryFunctionsIsBounded) {
  const auto model = Model<TypeParam>();
  const Program& program = model->program();
  double largest = 0;
  for (TracedRandom random(530); random.Again(400);) {
    const std::vector<Interval> domain = TypeParam::Domain(random);
    const ExpansionError error = BoundExpansionError(program, {}, domain);
    const AnyBox any(random, domain);
    Expansion plain;
    model->Expand(any.center, any.ranges, plain);
    const auto inside = [](const Real& exact, double lower, double upper, double bound) {
      return Real(lower) - Real(bound) <= exact && exact <= Real(upper) + Real(bound);
    };
    const std::vector<Real> at_center = InReals(program, {}, std::vector<Real>(any.center.begin(), any.center.end()));
    for (int k = 0; k < program.states; ++k) {
      const Real& exact = at_center[static_cast<std::size_t>(program.value[k])];
      ASSERT_LT(error.value[k], 1e-5) << "output " << k;
      ASSERT_TRUE(inside(exact, plain.value[k], plain.value[k], error.value[k])) << "output " << k;
      largest = std::max(largest, abs(exact - Real(plain.value[k])).ToDouble());
    }
    for (int e = 0; e < program.num_first; ++e) {
      const Real& exact = at_center[static_cast<std::size_t>(program.jacobian[e].node)];
      ASSERT_LT(error.jacobian[e], 1e3);
      ASSERT_TRUE(inside(exact, plain.jacobian[e], plain.jacobian[e], error.jacobian[e]))
          << "output " << program.jacobian[e].row << ", column " << program.jacobian[e].column;
    }
    for (int sample = 0; sample < 4; ++sample) {
      std::vector<Real> z;
      for (const Interval& side : any.box) z.emplace_back(PointIn(random, side));
      const std::vector<Real> values = InReals(program, {}, z);
      for (int e = 0; e < program.num_second; ++e) {
        ASSERT_LT(error.hessian[e], kInfinity);
        ASSERT_TRUE(inside(values[static_cast<std::size_t>(program.hessian[e].node)], plain.hessian[e].lower,
                           plain.hessian[e].upper, error.hessian[e]))
            << "output " << program.hessian[e].output << ": " << program.hessian[e].row << ", "
            << program.hessian[e].column;
      }
    }
  }
  EXPECT_GT(largest, TypeParam::kLeastRounding) << "nothing was rounded";
}

// One function of (y, x), which are the states, over a domain.
struct OneFunction {
  const char* name;
  Symbol (*function)(Symbol, Symbol);
  Interval y, x;
  bool value, slope;  // whether they have a bound

  [[nodiscard]] ExpansionError Error() const {
    ProgramDraft draft(1, 2);
    const Symbol first = Symbol::Variable(draft, 0), second = Symbol::Variable(draft, 1);
    const std::array<int, 1> values{function(first, second).node()};
    draft.SetValues(values);
    draft.Differentiate();
    return BoundExpansionError(draft.View(), {}, std::array{y, x});
  }
};

TEST(RoundingAt, KinksAndEndsOfDomainsHasNoBound) {
  const auto root = [](Symbol y, Symbol /*x*/) { return sqrt(y); };
  const auto logarithm = [](Symbol y, Symbol /*x*/) { return log(y); };
  const auto arc_sine = [](Symbol y, Symbol /*x*/) { return asin(y); };
  const auto arc_cosine = [](Symbol y, Symbol /*x*/) { return acos(y); };
  const auto size = [](Symbol y, Symbol /*x*/) { return abs(y - Symbol(1.0)); };
  const auto larger = [](Symbol y, Symbol x) { return max(y, x); };
  const auto smaller = [](Symbol y, Symbol x) { return min(y, x); };
  const auto angle = [](Symbol y, Symbol x) { return atan2(y, x); };
  const auto angle_above_1 = [](Symbol y, Symbol x) { return atan2(y - Symbol(1.0), x); };
  const auto inverse = [](Symbol y, Symbol /*x*/) { return pow(y, -1); };
  const auto gate = [](Symbol y, Symbol x) { return abs(sqrt(x) * (y - Symbol(1.0))); };
  const Interval any(1, 2);
  for (const OneFunction& f : {
           OneFunction{"sqrt", root, {0.5, 1}, any, true, true},
           OneFunction{"sqrt to 0", root, {0, 1}, any, true, false},
           OneFunction{"sqrt below 0", root, {-0x1p-1074, 1}, any, false, false},
           OneFunction{"log", logarithm, {0.5, 1}, any, true, true},
           OneFunction{"log to 0", logarithm, {0, 1}, any, false, false},
           OneFunction{"log below 0", logarithm, {-2, -1}, any, false, true},  // 1 / y has values there
           OneFunction{"asin", arc_sine, {-0.9, 0.9}, any, true, true},
           OneFunction{"asin to 1", arc_sine, {-0.9, 1}, any, true, false},
           OneFunction{"asin above 1", arc_sine, {-0.9, NextUp(1)}, any, false, false},
           OneFunction{"acos", arc_cosine, {-0.9, 0.9}, any, true, true},
           OneFunction{"acos to -1", arc_cosine, {-1, 0.9}, any, true, false},
           OneFunction{"acos below -1", arc_cosine, {NextDown(-1), 0.9}, any, false, false},
           OneFunction{"abs above", size, {1.1, 2}, any, true, true},
           OneFunction{"abs below", size, {0, 0.9}, any, true, true},
           OneFunction{"abs to its kink", size, {1, 2}, any, true, false},
           OneFunction{"abs a rounding above its kink", gate, {NextUp(1), 2}, any, true, false},
           OneFunction{"abs well above its kink", gate, {1 + 0x1p-40, 2}, any, true, true},
           OneFunction{"max beside", larger, {3, 4}, any, true, true},
           OneFunction{"max to", larger, {2, 4}, any, true, false},
           OneFunction{"min beside", smaller, {-1, 0.5}, any, true, true},
           OneFunction{"min across", smaller, {-1, 1.5}, any, true, false},
           OneFunction{"atan2", angle, {-1, 1}, {0.1, 1}, true, true},
           OneFunction{"atan2 above the cut", angle, {0.1, 1}, {-2, 1}, true, true},
           OneFunction{"atan2 just above the cut", angle, {0x1p-40, 1}, {-2, 1}, true, false},
           OneFunction{"atan2 to the cut", angle, {0, 1}, {-2, 1}, false, false},
           OneFunction{"atan2 to the origin", angle, {-1, 1}, {0, 1}, false, false},
           OneFunction{"atan2 a rounding above the cut", angle_above_1, {NextUp(1), 2}, {-2, -1}, false, false},
           OneFunction{"atan2 well above the cut", angle_above_1, {1 + 0x1p-40, 2}, {-2, -1}, true, true},
           OneFunction{"1/y", inverse, {0.1, 1}, any, true, true},
           OneFunction{"1/y to 0", inverse, {0, 1}, any, false, false},
       }) {
    const ExpansionError error = f.Error();
    EXPECT_EQ(error.value[0] < kInfinity, f.value) << f.name;
    EXPECT_EQ(error.jacobian[0] < kInfinity, f.slope) << f.name;
  }
}

}  // namespace forereach::rounding_oracle_test
