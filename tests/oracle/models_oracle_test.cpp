// Values, Jacobians and Hessians of the nominal models against closed formulas in 256 bits.
#include "tests/test.h"

#include "forereach/dynamics/equations_model.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/rounding.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::models_oracle_test {

constexpr double kDt = 0.1, kWheelbase = 2.5, kPointMassDt = 0.15;

enum Variable { kX, kY, kTheta, kV, kA, kDelta, kJerk, kSteerRate };

// What a model's equations say, worked out by hand. Entries not in the maps are zero.
struct Formulas {
  std::vector<Real> value;
  std::map<std::pair<int, int>, Real> jacobian;
  std::map<std::tuple<int, int, int>, Real> hessian;  // output, row <= column
};

Formulas Bicycle(const std::vector<Real>& z) {
  const Real dt(kDt), per_wheelbase = dt / Real(kWheelbase);
  const Real s = sin(z[kTheta]), c = cos(z[kTheta]), t = tan(z[kDelta]), secant = Real(1) + t * t, &v = z[kV];
  return {{z[kX] + dt * (v * c), z[kY] + dt * (v * s), z[kTheta] + per_wheelbase * (v * t), v + dt * z[kA],
           z[kA] + dt * z[kJerk], z[kDelta] + dt * z[kSteerRate]},
          {{{0, kX}, 1},
           {{0, kTheta}, -dt * v * s},
           {{0, kV}, dt * c},
           {{1, kY}, 1},
           {{1, kTheta}, dt * v * c},
           {{1, kV}, dt * s},
           {{2, kTheta}, 1},
           {{2, kV}, per_wheelbase * t},
           {{2, kDelta}, per_wheelbase * v * secant},
           {{3, kV}, 1},
           {{3, kA}, dt},
           {{4, kA}, 1},
           {{4, kJerk}, dt},
           {{5, kDelta}, 1},
           {{5, kSteerRate}, dt}},
          {{{0, kTheta, kTheta}, -dt * v * c},
           {{0, kTheta, kV}, -dt * s},
           {{1, kTheta, kTheta}, -dt * v * s},
           {{1, kTheta, kV}, dt * c},
           {{2, kV, kDelta}, per_wheelbase * secant},
           {{2, kDelta, kDelta}, per_wheelbase * v * Real(2) * t * secant}}};
}

Formulas PointMassFormulas(const std::vector<Real>& z) {
  const Real dt(kPointMassDt), half_square = dt * dt / Real(2);
  Formulas f{{}, {}, {}};
  for (std::size_t axis = 0; axis < 2; ++axis)
    f.value.push_back(z[axis] + dt * z[axis + 2] + half_square * z[axis + 4]);
  for (std::size_t axis = 0; axis < 2; ++axis) f.value.push_back(z[axis + 2] + dt * z[axis + 4]);
  for (int axis = 0; axis < 2; ++axis) {
    f.jacobian[{axis, axis}] = 1;
    f.jacobian[{axis, axis + 2}] = dt;
    f.jacobian[{axis, axis + 4}] = half_square;
    f.jacobian[{axis + 2, axis + 2}] = 1;
    f.jacobian[{axis + 2, axis + 4}] = dt;
  }
  return f;
}

struct ModelCase {
  const char* name;
  std::shared_ptr<const NominalModel> model;
  Formulas (*formulas)(const std::vector<Real>&);
  friend void PrintTo(const ModelCase& model, std::ostream* out) { *out << model.name; }
};

struct Model : testing::TestWithParam<ModelCase> {
  const NominalModel& model() const { return *GetParam().model; }

  // Typical, extreme and special values of every variable; angles within what can be reduced.
  Eigen::VectorXd AnyPoint(Random& random) const {
    Eigen::VectorXd z = random.Vector(model().num_variables(), std::ldexp(1, random.Integer(-30, 12)));
    for (double& entry : z)
      if (random.Coin(0.1)) entry = random.Coin() ? 0 : random.Coin() ? 1e-300 : 1.5707963267948966;
    return z;
  }
};

Formulas At(const ModelCase& model, const Eigen::VectorXd& z) { return model.formulas({z.begin(), z.end()}); }

void ExpectJacobian(const Linearization& linearization, const Formulas& f) {
  std::map<std::pair<int, int>, Interval> listed;
  for (const auto& [row, column, value] : linearization.jacobian()) {
    ASSERT_TRUE(listed.emplace(std::pair(row, column), value).second) << "an entry listed twice";
    const auto entry = f.jacobian.find({row, column});
    ASSERT_TRUE(Inside(entry == f.jacobian.end() ? Real(0) : entry->second, value)) << row << ", " << column;
  }
  for (const auto& [place, value] : f.jacobian) ASSERT_TRUE(listed.count(place)) << place.first << ", " << place.second;
}

TEST_P(Model, LinearizationContainsValueAndJacobian) {
  for (TracedRandom random(501); random.Again(4000);) {
    const Eigen::VectorXd z = AnyPoint(random);
    const Formulas f = At(GetParam(), z);
    Linearization linearization;
    model().Linearize(View(z), linearization);
    for (std::size_t k = 0; k < f.value.size(); ++k) {
      ASSERT_TRUE(Inside(f.value[k], linearization.value[k]) || linearization.value[k] == Interval::Entire())
          << "value " << k;
    }
    ExpectJacobian(linearization, f);
    if (HasFatalFailure()) return;
  }
}

TEST_P(Model, LinearizationIsTight) {
  for (TracedRandom random(502); random.Again(1000);) {
    const Eigen::VectorXd z = random.Vector(model().num_variables(), 1.2);
    Linearization linearization;
    model().Linearize(View(z), linearization);
    for (int k = 0; k < model().num_states(); ++k) {
      const Interval& value = linearization.value[static_cast<std::size_t>(k)];
      ASSERT_LE(value.upper - value.lower, 5e-15);
    }
    for (const auto& entry : linearization.jacobian()) ASSERT_LE(entry.value.upper - entry.value.lower, 1e-14);
  }
}

// Rounded once from extended precision: the nearest double except where extended precision meets a tie.
TEST_P(Model, EvaluateIsRoundedOnce) {
  int nearest = 0, total = 0;
  for (TracedRandom random(503); random.Again(3000);) {
    Eigen::VectorXd z = random.Vector(model().num_variables(), 1.2), next(model().num_states());
    z = z.cwiseAbs();  // no cancellation, so relative accuracy is due
    model().Evaluate(View(z), {next.data(), static_cast<std::size_t>(next.size())});
    const Formulas f = At(GetParam(), z);
    for (std::size_t k = 0; k < f.value.size(); ++k) {
      const double computed = next[static_cast<Eigen::Index>(k)], rounded = f.value[k].ToDouble();
      ASSERT_TRUE(computed == rounded || computed == NextUp(rounded) || computed == NextDown(rounded));
      nearest += computed == rounded;
      ++total;
    }
  }
  RecordProperty("correctly_rounded_percent", std::to_string(100.0 * nearest / total));
  EXPECT_GE(nearest, total * 99 / 100);
}

std::vector<Interval> AnyBox(Random& random, int size) {
  std::vector<Interval> box;
  for (int l = 0; l < size; ++l) {
    const double center = random.Uniform(-1.2, 1.2) * (l == kV ? 20 : 1);
    const double half = random.Coin(0.2) ? 0 : std::ldexp(random.Uniform(0, 1), -random.Integer(1, 40));
    box.emplace_back(center - half, center + half);
  }
  return box;
}

std::vector<Real> PointIn(Random& random, const std::vector<Interval>& box) {
  std::vector<Real> z;
  for (const Interval& side : box)
    z.push_back(random.Coin() ? Real(random.Coin() ? side.lower : side.upper)
                              : Real(side.lower) + Real(random.Uniform(0, 1)) * (Real(side.upper) - Real(side.lower)));
  return z;
}

TEST_P(Model, HessianContainsAllSecondDerivativesOverTheBox) {
  for (TracedRandom random(504); random.Again(2000);) {
    const std::vector<Interval> box = AnyBox(random, model().num_variables());
    HessianEnclosure hessian;
    model().EncloseHessian(box, hessian);
    std::map<std::tuple<int, int, int>, Interval> listed;
    for (int e = 0; e < hessian.count; ++e) {
      const auto& [output, row, column, value] = hessian.entries[static_cast<std::size_t>(e)];
      ASSERT_LE(row, column);
      ASSERT_TRUE(listed.emplace(std::tuple(output, row, column), value).second) << "an entry listed twice";
    }
    for (int sample = 0; sample < 6; ++sample) {
      const Formulas f = GetParam().formulas(PointIn(random, box));
      for (const auto& [place, value] : f.hessian) {
        ASSERT_TRUE(listed.count(place));
        ASSERT_TRUE(Inside(value, listed[place]))
            << std::get<0>(place) << ": " << std::get<1>(place) << ", " << std::get<2>(place);
      }
      for (const auto& [place, value] : listed) ASSERT_TRUE(f.hessian.count(place) || value.Contains(0));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Model,
                         testing::Values(ModelCase{"point_mass", MakePointMass(kPointMassDt), PointMassFormulas},
                                         ModelCase{"kinematic_bicycle", MakeKinematicBicycle(kDt, kWheelbase),
                                                   Bicycle}));

TEST(PointMassModel, HasNoSecondDerivativesAtAll) {
  TracedRandom random(505);
  HessianEnclosure hessian;
  hessian.count = 7;
  MakePointMass(kPointMassDt)->EncloseHessian(AnyBox(random, 6), hessian);
  EXPECT_EQ(hessian.count, 0);
}

// Each second derivative uses every variable once, so its enclosure is its range: dense samples reach almost all of it.
TEST(BicycleModel, HessianIsTheTrueRange) {
  const auto model = MakeKinematicBicycle(kDt, kWheelbase);
  for (TracedRandom random(506); random.Again(60);) {
    std::vector<Interval> box(8, Interval(0));
    const double theta = random.Uniform(-3, 3), v = random.Uniform(-5, 20), delta = random.Uniform(-1, 1);
    box[kTheta] = {theta - random.Uniform(0, 1), theta + random.Uniform(0, 1)};
    box[kV] = {v - random.Uniform(0, 3), v + random.Uniform(0, 3)};
    box[kDelta] = {delta - random.Uniform(0, 0.3), delta + random.Uniform(0, 0.3)};
    HessianEnclosure hessian;
    model->EncloseHessian(box, hessian);
    for (int e = 0; e < hessian.count; ++e) {
      const auto& [output, row, column, value] = hessian.entries[static_cast<std::size_t>(e)];
      double lowest = kInfinity, highest = -kInfinity;
      const int samples = 400;
      for (int i = 0; i <= samples; ++i)
        for (const double speed : {box[kV].lower, box[kV].upper}) {
          const double angle = box[kTheta].lower + (box[kTheta].upper - box[kTheta].lower) * i / samples;
          const double steer = box[kDelta].lower + (box[kDelta].upper - box[kDelta].lower) * i / samples;
          const double t = std::tan(steer), per_wheelbase = kDt / kWheelbase;
          const std::map<std::tuple<int, int, int>, double> values{
              {{0, kTheta, kTheta}, -kDt * speed * std::cos(angle)},
              {{0, kTheta, kV}, -kDt * std::sin(angle)},
              {{1, kTheta, kTheta}, -kDt * speed * std::sin(angle)},
              {{1, kTheta, kV}, kDt * std::cos(angle)},
              {{2, kV, kDelta}, per_wheelbase * (1 + t * t)},
              {{2, kDelta, kDelta}, per_wheelbase * speed * 2 * t * (1 + t * t)}};
          const double at = values.at({output, row, column});
          lowest = std::min(lowest, at);
          highest = std::max(highest, at);
        }
      EXPECT_LE(value.upper - value.lower, (highest - lowest) * 1.0001 + 1e-14)
          << output << ": " << row << ", " << column;
    }
  }
}

TEST(BicycleModel, SteeringAcrossThePoleHasNoFiniteEnclosure) {
  const auto model = MakeKinematicBicycle(kDt, kWheelbase);
  for (const Interval& steering : {Interval(1.5, 1.6), Interval(-1.6, -1.5), Interval(-2, 2), Interval(1.5, 100)}) {
    std::vector<Interval> box(8, Interval(1));
    box[kDelta] = steering;
    HessianEnclosure hessian;
    model->EncloseHessian(box, hessian);
    int infinite = 0;
    for (int e = 0; e < hessian.count; ++e) {
      const auto& entry = hessian.entries[static_cast<std::size_t>(e)];
      infinite += !entry.second_derivative.IsFinite();
      EXPECT_EQ(entry.second_derivative.IsFinite(), entry.output != 2);
    }
    EXPECT_GT(infinite, 0);
  }
}

TEST(Models, RefuseStepsThatAreNotPositive) {
  for (const double bad : {0.0, -1.0, kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW((void)MakePointMass(bad), std::invalid_argument);
    EXPECT_THROW((void)MakeKinematicBicycle(bad, 1), std::invalid_argument);
    EXPECT_THROW((void)MakeKinematicBicycle(1, bad), std::invalid_argument);
  }
  EXPECT_NE(MakePointMass(0.1)->description(), MakePointMass(NextUp(0.1))->description());
}

// Expressions with hand-made derivatives, as a model with three variables that count.
struct Expressions {
  static constexpr int kStates = 7, kInputs = 0;
  static constexpr const char* kName = "expressions";
  static constexpr std::array<const char*, kStates> kStateNames{
      "x y / w", "sin x cos y", "tan(x y)", "-x (y - w) + 3", "x x x", "1 / (x + 2)", "cos(sin(x) y)"};
  static constexpr std::array<const char*, 0> kInputNames{};
  static constexpr std::array<const char*, 0> kParameterNames{};

  template <class T>
  static constexpr void Step(std::span<const T>, std::span<const T> z, std::span<T> next) {
    const T &x = z[0], &y = z[1], &w = z[2];
    next[0] = x * y / w;
    next[1] = sin(x) * cos(y);
    next[2] = tan(x * y);
    next[3] = -x * (y - w) + T(3);
    next[4] = x * x * x;
    next[5] = T(1) / (x + T(2));
    next[6] = cos(sin(x) * y);
  }
  [[nodiscard]] std::array<double, 0> parameters() const { return {}; }
};

struct Derivatives {
  double gradient[3], hessian[3][3];
};

Derivatives ByHand(std::size_t expression, double x, double y, double w) {
  const double sx = std::sin(x), cx = std::cos(x), sy = std::sin(y), cy = std::cos(y);
  switch (expression) {
    case 0:
      return {
          {y / w, x / w, -x * y / (w * w)},
          {{0, 1 / w, -y / (w * w)}, {1 / w, 0, -x / (w * w)}, {-y / (w * w), -x / (w * w), 2 * x * y / (w * w * w)}}};
    case 1: return {{cx * cy, -sx * sy, 0}, {{-sx * cy, -cx * sy, 0}, {-cx * sy, -sx * cy, 0}, {0, 0, 0}}};
    case 2: {
      const double t = std::tan(x * y), d = 1 + t * t, dd = 2 * t * d;
      return {{d * y, d * x, 0}, {{dd * y * y, d + dd * x * y, 0}, {d + dd * x * y, dd * x * x, 0}, {0, 0, 0}}};
    }
    case 3: return {{w - y, -x, x}, {{0, -1, 1}, {-1, 0, 0}, {1, 0, 0}}};
    case 4: return {{3 * x * x, 0, 0}, {{6 * x, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
    case 5:
      return {{-1 / ((x + 2) * (x + 2)), 0, 0}, {{2 / ((x + 2) * (x + 2) * (x + 2)), 0, 0}, {0, 0, 0}, {0, 0, 0}}};
    default: {
      const double s = std::sin(sx * y), c = std::cos(sx * y);
      return {{-s * cx * y, -s * sx, 0},
              {{-c * cx * cx * y * y + s * sx * y, -c * sx * cx * y - s * cx, 0},
               {-c * sx * cx * y - s * cx, -c * sx * sx, 0},
               {0, 0, 0}}};
    }
  }
}

TEST(Program, DerivativesAgreeWithThoseMadeByHand) {
  const EquationsModel<Expressions> model{Expressions{}};
  const Program& program = model.program();
  for (TracedRandom random(507); random.Again(300);) {
    const std::array<double, 7> z{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Sign() * random.Uniform(0.5, 2)};
    std::vector<PlainInterval> ranges;
    std::vector<Interval> intervals;
    for (const double x : z) ranges.push_back({x, x}), intervals.emplace_back(x);
    Expansion plain;
    model.Expand(z, ranges, plain);
    Linearization linearization;
    model.Linearize(z, linearization);
    HessianEnclosure hessian;
    model.EncloseHessian(intervals, hessian);
    std::map<std::pair<int, int>, int> first;
    std::map<std::tuple<int, int, int>, int> second;
    for (int e = 0; e < program.num_first; ++e) first[{program.jacobian[e].row, program.jacobian[e].column}] = e;
    for (int e = 0; e < program.num_second; ++e)
      second[{program.hessian[e].output, program.hessian[e].row, program.hessian[e].column}] = e;
    for (std::size_t f = 0; f < 7; ++f) {
      SCOPED_TRACE(Expressions::kStateNames[f]);
      const int output = static_cast<int>(f);
      const Derivatives expected = ByHand(f, z[0], z[1], z[2]);
      for (int i = 0; i < 3; ++i) {
        const auto entry = first.find({output, i});
        ASSERT_NEAR(entry == first.end() ? 0 : plain.jacobian[entry->second], expected.gradient[i], 1e-13);
        if (entry != first.end())
          ASSERT_NEAR(linearization.entries[entry->second].value.Middle(), expected.gradient[i], 1e-13);
        for (int j = i; j < 3; ++j) {
          const auto place = second.find({output, i, j});
          ASSERT_NEAR(place == second.end() ? 0 : plain.hessian[place->second].lower, expected.hessian[i][j], 1e-12)
              << i << j;
          if (place == second.end()) continue;
          ASSERT_NEAR(plain.hessian[place->second].upper, expected.hessian[i][j], 1e-12);
          ASSERT_NEAR(hessian.entries[place->second].second_derivative.Middle(), expected.hessian[i][j], 1e-12);
        }
      }
    }
  }
}

// The domain of a random task, wide or narrow, and a box inside it around a center.
struct DomainCase {
  std::vector<Interval> domain, box;
  std::vector<PlainInterval> ranges;
  Eigen::VectorXd center;

  DomainCase(Random& random, int size) : center(size) {
    for (int l = 0; l < size; ++l) {
      const double reach = (l == kV ? 20 : l == kDelta ? 1.3 : 1.5) * std::ldexp(1, -random.Integer(0, 20));
      const double middle = random.Uniform(-1, 1) * (l == kDelta ? 0.1 : 1);
      domain.emplace_back(middle - reach, middle + reach);
      double a = random.Uniform(middle - reach, middle + reach), b = random.Uniform(middle - reach, middle + reach);
      if (random.Coin()) b = a + (b - a) * std::ldexp(1, -random.Integer(0, 50));
      if (random.Coin(0.1)) b = a;
      const double half = std::abs(b - a) / 2;
      center[l] = std::clamp((a + b) / 2, middle - reach, middle + reach);
      const double lower = std::max(center[l] - half, middle - reach),
                   upper = std::min(center[l] + half, middle + reach);
      box.emplace_back(lower, upper);
      ranges.push_back({lower, upper});
    }
  }
};

TEST_P(Model, ExpansionErrorBoundsThePlainEvaluation) {
  const Program& program = model().program();
  for (TracedRandom random(508); random.Again(3000);) {
    const DomainCase c(random, model().num_variables());
    const ExpansionError error = BoundExpansionError(program, model().parameters(), c.domain);
    Expansion plain;
    model().Expand(View(c.center), c.ranges, plain);
    const Formulas at_center = At(GetParam(), c.center);
    for (std::size_t k = 0; k < at_center.value.size(); ++k) {
      ASSERT_LT(error.value[k], 1e-9);
      ASSERT_TRUE(Inside(at_center.value[k], Interval(plain.value[k]) + Interval(-error.value[k], error.value[k])));
    }
    for (int e = 0; e < program.num_first; ++e) {
      const auto entry = at_center.jacobian.find({program.jacobian[e].row, program.jacobian[e].column});
      const Real exact = entry == at_center.jacobian.end() ? Real(0) : entry->second;
      ASSERT_TRUE(Inside(exact, Interval(plain.jacobian[e]) + Interval(-error.jacobian[e], error.jacobian[e])));
    }
    for (int sample = 0; sample < 4; ++sample) {
      const Formulas inside = GetParam().formulas(PointIn(random, c.box));
      for (int e = 0; e < program.num_second; ++e) {
        const auto entry =
            inside.hessian.find({program.hessian[e].output, program.hessian[e].row, program.hessian[e].column});
        const Real exact = entry == inside.hessian.end() ? Real(0) : entry->second;
        const Interval range(plain.hessian[e].lower, plain.hessian[e].upper);
        ASSERT_TRUE(Inside(exact, range + Interval(-error.hessian[e], error.hessian[e]))) << "entry " << e;
      }
    }
  }
}

// A heading known to half a turn or worse: the sine's slopes at both ends may have the same sign, and a maximum and a
// minimum lie between them.
TEST(BicycleModel, PlainRangesHoldForHeadingsWiderThanPi) {
  const auto model = MakeKinematicBicycle(kDt, kWheelbase);
  const Program& program = model->program();
  std::vector<Interval> domain(8, Interval(-1, 1));
  domain[kTheta] = Interval(-20, 20);
  domain[kV] = Interval(-20, 20);
  const ExpansionError error = BoundExpansionError(program, model->parameters(), domain);
  for (TracedRandom random(510); random.Again(3000);) {
    std::vector<PlainInterval> ranges(8, {0, 0});
    Eigen::VectorXd center = Eigen::VectorXd::Zero(8);
    const double width = random.Uniform(3, 8);
    center[kTheta] = random.Uniform(-7, 7);
    ranges[kTheta] = {center[kTheta] - width / 2, center[kTheta] + width / 2};
    center[kV] = random.Uniform(-10, 10);
    ranges[kV] = {center[kV] - 1, center[kV] + 1};
    Expansion plain;
    model->Expand(View(center), ranges, plain);
    std::vector<double> headings{ranges[kTheta].lower, ranges[kTheta].upper, center[kTheta]};
    for (int quarter = -8; quarter <= 8; ++quarter) {
      const double extremum = quarter * 1.5707963267948966;
      if (ranges[kTheta].lower <= extremum && extremum <= ranges[kTheta].upper) headings.push_back(extremum);
    }
    for (const double heading : headings)
      for (const double speed : {ranges[kV].lower, ranges[kV].upper}) {
        std::vector<Real> z(center.begin(), center.end());
        z[kTheta] = heading, z[kV] = speed;
        const Formulas f = Bicycle(z);
        for (std::size_t e = 0; e < static_cast<std::size_t>(program.num_second); ++e) {
          const Program::Second& entry = program.hessian[e];
          const Interval range(plain.hessian[e].lower, plain.hessian[e].upper);
          ASSERT_TRUE(Inside(f.hessian.at({entry.output, entry.row, entry.column}),
                             range + Interval(-error.hessian[e], error.hessian[e])))
              << "heading " << heading << " of [" << ranges[kTheta].lower << ", " << ranges[kTheta].upper << "]";
        }
      }
  }
}

// The plain ranges are no looser than interval arithmetic's, which are the true ones where each variable occurs once.
TEST_P(Model, ExpansionRangesAreTight) {
  for (TracedRandom random(509); random.Again(2000);) {
    const DomainCase c(random, model().num_variables());
    Expansion plain;
    model().Expand(View(c.center), c.ranges, plain);
    HessianEnclosure hessian;
    model().EncloseHessian(c.box, hessian);
    for (int e = 0; e < hessian.count; ++e) {
      const Interval& tight = hessian.entries[e].second_derivative;
      const double slack = 1e-10 * (1 + tight.Magnitude());
      ASSERT_GE(plain.hessian[e].lower, tight.lower - slack);
      ASSERT_LE(plain.hessian[e].upper, tight.upper + slack);
    }
  }
}

// Differences of large squares: what their rounding leaves is many times their size, and it is all the error of the
// products and quotients made of them.
struct Differences {
  static constexpr int kStates = 4, kInputs = 0;
  static constexpr const char* kName = "differences";
  static constexpr std::array<const char*, kStates> kStateNames{"(u^2 - w^2) y", "y (u^2 - w^2)", "(u^2 - w^2) / y",
                                                                "y / (u^2 - w^2 + 1e4)"};
  static constexpr std::array<const char*, 0> kInputNames{};
  static constexpr std::array<const char*, 0> kParameterNames{};

  template <class T>
  static constexpr void Step(std::span<const T>, std::span<const T> z, std::span<T> next) {
    const T &u = z[0], &w = z[1], &y = z[2];
    const T difference = u * u - w * w;
    next[0] = difference * y;
    next[1] = y * difference;
    next[2] = difference / y;
    next[3] = y / (difference + T(1e4));
  }
  [[nodiscard]] std::array<double, 0> parameters() const { return {}; }
};

TEST(ExpansionError, BoundsProductsAndQuotientsOfDifferencesThatCancel) {
  const EquationsModel<Differences> model{Differences{}};
  const std::vector<Interval> domain{{1e6, 1e6 + 1e-3}, {1e6, 1e6 + 1e-3}, {0.5, 1e3}, {0, 1}};
  const ExpansionError error = BoundExpansionError(model.program(), model.parameters(), domain);
  std::array<double, 4> worst{};
  for (TracedRandom random(511); random.Again(3000);) {
    std::vector<double> z;
    std::vector<PlainInterval> ranges;
    for (const Interval& side : domain) {
      z.push_back(random.Uniform(side.lower, side.upper));
      ranges.push_back({z.back(), z.back()});
    }
    if (random.Coin()) z[2] = random.Coin() ? 1e3 : 0.5;
    Expansion plain;
    model.Expand(z, ranges, plain);
    const Rational u(z[0]), w(z[1]), y(z[2]), difference = u * u - w * w;
    const Rational values[] = {difference * y, y * difference, difference / y, y / (difference + 10000)};
    for (std::size_t k = 0; k < 4; ++k) {
      const Rational off = abs(values[k] - Rational(plain.value[k]));
      ASSERT_LE(off, Rational(error.value[k])) << Differences::kStateNames[k];
      worst[k] = std::max(worst[k], off.get_d() / error.value[k]);
    }
  }
  for (std::size_t k = 0; k < 3; ++k) EXPECT_GT(worst[k], 0.05) << "the bound of " << Differences::kStateNames[k];
}

TEST(ExpansionError, IsInfiniteWhereADivisorMayBeZero) {
  const EquationsModel<Differences> model{Differences{}};
  const std::vector<Interval> domain{{1, 2}, {1, 2}, {-1, 2}, {0, 1}};
  EXPECT_EQ(BoundExpansionError(model.program(), model.parameters(), domain).value[2], kInfinity);
}

TEST(ExpansionError, IsInfiniteWhereTheDomainHoldsAPole) {
  const auto model = MakeKinematicBicycle(kDt, kWheelbase);
  std::vector<Interval> domain(8, Interval(-1, 1));
  EXPECT_LT(BoundExpansionError(model->program(), model->parameters(), domain).value[kTheta], 1e-12);
  domain[kDelta] = Interval(0, 2);
  EXPECT_EQ(BoundExpansionError(model->program(), model->parameters(), domain).value[kTheta], kInfinity);
}

}  // namespace forereach::models_oracle_test
