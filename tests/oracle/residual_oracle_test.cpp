// Observations, the pairwise test and the envelope against exact rationals.
#include "tests/test.h"

#include "forereach/residual/consistency.h"
#include "forereach/residual/lipschitz_envelope.h"
#include "forereach/residual/no_nominal_value.h"
#include "forereach/residual/observations.h"
#include "tests/oracle/text_problems.h"
#include "tests/oracle/traced_random.h"

namespace forereach::residual_oracle_test {

void Enclose(const ResidualEnclosure& envelope, const Zonotope& slice, std::span<const double> input,
             ResidualBounds& bounds) {
  envelope.Enclose({slice, input, HalfWidths(slice)}, bounds);
}

// The smallest box that the envelope may be told of for one query: its hull.
LipschitzEnvelope EnvelopeFor(const Declaration& declaration, const Observations& observations, const Zonotope& slice,
                              std::span<const double> input, const EnvelopeOptions& options = {}) {
  std::vector<double> lower, upper;
  for (int k = 0; k < slice.dim(); ++k) {
    lower.push_back(SubDown(slice.center(k), slice.HalfWidthUpper(k)));
    upper.push_back(AddUp(slice.center(k), slice.HalfWidthUpper(k)));
  }
  lower.insert(lower.end(), input.begin(), input.end());
  upper.insert(upper.end(), input.begin(), input.end());
  return LipschitzEnvelope(declaration, observations, lower, upper, options);
}

constexpr double kDt = 0.15;

Rational Ulp(double x) { return Rational(NextUp(std::abs(x))) - abs(Rational(x)); }

// f0_k of the point mass, exactly.
Rational PointMassNominal(const Eigen::VectorXd& z, int k) {
  const Rational dt(kDt);
  if (k >= 2) return Rational(z[k]) + dt * Rational(z[k + 2]);
  return Rational(z[k]) + dt * Rational(z[k + 2]) + dt * dt / 2 * Rational(z[k + 4]);
}

TEST(Observe, EnclosesTheExactResidualAndOneUnitOfTheSuccessor) {
  const auto model = MakePointMass(kDt);
  for (TracedRandom random(601); random.Again(300);) {
    const double scale = std::ldexp(1, random.Integer(-1000, 900));
    Transitions data{random.Matrix(10, 6, scale), random.Matrix(10, 4, scale)};
    data.x_next(0, 0) = 0;
    data.x_next(1, 0) = scale;  // a power of two
    data.x_next(2, 0) = -0x1p-1074;
    const Observations observations = Observe(*model, data);
    for (int i = 0; i < 10; ++i)
      for (int k = 0; k < 4; ++k) {
        const double x_next = data.x_next(i, k);
        const Rational residual = Rational(x_next) - PointMassNominal(data.z.row(i), k);
        ASSERT_LE(Rational(observations.lower(i, k)), residual - Ulp(x_next));
        ASSERT_GE(Rational(observations.upper(i, k)), residual + Ulp(x_next));
        ASSERT_LE(Rational(observations.upper(i, k)) - Rational(observations.lower(i, k)),
                  2 * Ulp(x_next) + Rational(scale) * Rational(1e-14) + Rational(0x1p-1060));
      }
  }
}

TEST(Observe, OfTheBicycleEnclosesTheResidual) {
  TracedRandom random(602);
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  const Transitions data{random.Matrix(300, 8, 1.2), random.Matrix(300, 6, 2)};
  const Observations observations = Observe(*model, data);
  for (int i = 0; i < data.size(); ++i) {
    const Real theta = Real(data.z(i, 2)) + Real(0.1) / Real(2.5) * (Real(data.z(i, 3)) * tan(Real(data.z(i, 5))));
    const Real residual = Real(data.x_next(i, 2)) - theta, ulp(Ulp(data.x_next(i, 2)));
    ASSERT_LE(Real(observations.lower(i, 2)), residual - ulp);
    ASSERT_GE(Real(observations.upper(i, 2)), residual + ulp);
    ASSERT_LE(observations.upper(i, 2) - observations.lower(i, 2), 1e-14);
  }
}

// Transitions of a bicycle whose heading is recorded with any turns: x+ = wrapped f0 + r, computed in doubles.
struct Turned {
  Transitions data;
  std::vector<double> turns;  // that were taken off theta
};

Turned TurnedTransitions(Random& random, int count) {
  Turned made{{random.Matrix(count, 8, 1.2), random.Matrix(count, 6, 2)}, {}};
  for (int i = 0; i < count; ++i) {
    const Eigen::VectorXd z = made.data.z.row(i);
    const double next = z[2] + 0.1 / 2.5 * (z[3] * std::tan(z[5])) + random.Uniform(-1.5, 1.5);
    made.turns.push_back(random.Integer(-2, 2));
    made.data.x_next(i, 2) = next - made.turns.back() * (2 * std::numbers::pi);
  }
  return made;
}

// theta+ of the bicycle.
Real NextHeading(const Transitions& data, int i) {
  return Real(data.z(i, 2)) + Real(0.1) / Real(2.5) * (Real(data.z(i, 3)) * tan(Real(data.z(i, 5))));
}

TEST(Observe, TakesTheTurnsOffAnAngleAndEnclosesItsResidual) {
  TracedRandom random(631);
  const auto model = MakeKinematicBicycle(0.1, 2.5, {2}), plain = MakeKinematicBicycle(0.1, 2.5);
  const auto [data, turns] = TurnedTransitions(random, 1000);
  const Observations observations = Observe(*model, data), unturned = Observe(*plain, data);
  for (int i = 0; i < data.size(); ++i) {
    const Real turned = Real(data.x_next(i, 2)) + Real(turns[static_cast<std::size_t>(i)]) * Real(2.0) * Real::Pi();
    const Real residual = turned - NextHeading(data, i);
    const Real unit(std::max(Ulp(data.x_next(i, 2)), Rational(0x1p-49)));
    ASSERT_LE(Real(observations.lower(i, 2)), residual - unit);
    ASSERT_GE(Real(observations.upper(i, 2)), residual + unit);
    ASSERT_LE(observations.upper(i, 2) - observations.lower(i, 2), 1e-14);
    for (const int k : {0, 1, 3, 4, 5}) {
      ASSERT_EQ(observations.lower(i, k), unturned.lower(i, k));
      ASSERT_EQ(observations.upper(i, k), unturned.upper(i, k));
    }
  }
}

// Where nothing else rounds, 2 pi does: it lies between two doubles.
TEST(Observe, EnclosesTheRoundingOfATurn) {
  const auto model = MakeKinematicBicycle(0.5, 2, {2});
  for (const double next : {6.2, -6.2, 6.3, -12.5, 12.6, 25.1}) {
    Transitions data{Eigen::MatrixXd::Zero(1, 8), Eigen::MatrixXd::Zero(1, 6)};
    data.x_next(0, 2) = next;
    const Observations observations = Observe(*model, data);
    const Real turns(std::round(-next / 6.28)), residual = Real(next) + turns * Real(2.0) * Real::Pi();
    const Real unit(std::max(Ulp(next), Rational(0x1p-49)));
    EXPECT_LE(Real(observations.lower(0, 2)), residual - unit) << next;
    EXPECT_GE(Real(observations.upper(0, 2)), residual + unit) << next;
  }
}

// The nominal successor of theta is zero, exactly, and its record is known to 2^-49.
TEST(Observe, RefusesAnAngleThatIsAQuarterOfATurnOrMoreFromItsSuccessor) {
  const auto model = MakeKinematicBicycle(0.5, 2, {2});
  const auto observe = [&](double next) {
    Transitions data{Eigen::MatrixXd::Zero(3, 8), Eigen::MatrixXd::Zero(3, 6)};
    data.x_next(1, 2) = next;
    return Observe(*model, data);
  };
  const double quarter = std::numbers::pi / 2, inside = quarter - 0x1p-48;
  ASSERT_LT(Real(quarter), Real::Pi() / Real(2.0));
  for (const double sign : {1.0, -1.0}) {
    EXPECT_NO_THROW(observe(sign * inside));
    EXPECT_THROW(observe(sign * quarter), AmbiguousAngle) << "the record may be off by 2^-49";
    EXPECT_THROW(observe(sign * 2), AmbiguousAngle);
    EXPECT_THROW(observe(sign * std::numbers::pi), AmbiguousAngle);
    EXPECT_THROW(observe(sign * 4.7), AmbiguousAngle);
    EXPECT_NO_THROW(observe(sign * 4.72));  // 3/2 pi is 4.712
    EXPECT_THROW(observe(sign * (20 * std::numbers::pi + 1.6)), AmbiguousAngle);
    EXPECT_NO_THROW(observe(sign * (20 * std::numbers::pi + 1.5)));
    EXPECT_THROW(observe(sign * 1e300), AmbiguousAngle) << "where doubles are farther apart than turns";
  }
  try {
    observe(2);
    FAIL();
  } catch (const AmbiguousAngle& error) {
    EXPECT_EQ(error.row(), 1);
    EXPECT_STREQ(error.what(),
                 "transition 1: theta is 2 rad away from the nominal model's next value, up to whole turns, which is "
                 "more than pi/2: how often it has turned cannot be told");
  }
}

// e_k + sum_l (sup |D_l f0_k| + L_kl) e_l of the point mass, exactly: its derivatives are 1, dt and dt^2 / 2.
Rational RecordError(const Declaration& declaration, int k) {
  const auto e = [&](int l) { return Rational(declaration.VariableError(l)); };
  const Rational dt(kDt);
  Rational sum = 2 * e(k) + dt * e(k + 2);
  if (k < 2) sum += dt * dt / 2 * e(k + 4);
  for (int l = 0; l < 6; ++l) sum += Rational(declaration.lipschitz(k, l)) * e(l);
  return sum;
}

TEST(Observe, WidensByTheErrorsOfTheRecordAndByNoMore) {
  const auto model = MakePointMass(kDt);
  for (TracedRandom random(640); random.Again(300);) {
    const double scale = std::ldexp(1, random.Integer(-400, 400));
    const Transitions data{random.Matrix(5, 6, scale), random.Matrix(5, 4, scale)};
    Declaration declaration{random.Matrix(4, 6).cwiseAbs(), Eigen::VectorXd::Zero(4)};
    if (random.trial() % 3 != 0) declaration.state_error = random.Vector(4, scale).cwiseAbs();
    if (random.trial() % 3 != 1) declaration.input_error = random.Vector(2, scale).cwiseAbs();
    const Observations exact = Observe(*model, data), observations = Observe(*model, declaration, data);
    for (int i = 0; i < 5; ++i)
      for (int k = 0; k < 4; ++k) {
        const Rational error = RecordError(declaration, k), rounding = Rational(scale) * Rational(1e-13);
        const Rational below = Rational(exact.lower(i, k)) - Rational(observations.lower(i, k)),
                       above = Rational(observations.upper(i, k)) - Rational(exact.upper(i, k));
        ASSERT_LE(error, below);
        ASSERT_LE(error, above);
        ASSERT_LE(below, error + rounding);
        ASSERT_LE(above, error + rounding);
      }
  }
}

TEST(Observe, AnErrorOfZeroChangesNoBit) {
  TracedRandom random(643);
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  const Transitions data{random.Matrix(50, 8, 1.2), random.Matrix(50, 6, 2)};
  Declaration declaration{random.Matrix(6, 8).cwiseAbs(), Eigen::VectorXd::Zero(6)};
  declaration.state_error = Eigen::VectorXd::Zero(6);
  declaration.input_error = Eigen::VectorXd::Zero(2);
  const Observations undeclared = Observe(*model, data), zeros = Observe(*model, declaration, data);
  EXPECT_FIELDS(undeclared, (lower, zeros.lower), (upper, zeros.upper));
  declaration.input_error[0] = 0x1p-1074;
  EXPECT_NE(Observe(*model, declaration, data).lower, zeros.lower);
}

// A model, its values in high precision, and a residual within a declaration whose sigma and w^ are zero in half of the
// coordinates.
struct Robot {
  std::shared_ptr<const NominalModel> model;
  TextInHighPrecision nominal;
  Declaration declaration;
  Ramps residual;

  Robot(Random& random, const ModelText& text, const std::vector<double>& parameters)
      : model(MakeTextModel(text)),
        nominal(text, parameters),
        declaration(Declared(random, model->num_states(), model->num_variables())),
        residual(random, declaration.lipschitz) {}

  static Declaration Declared(Random& random, int states, int variables) {
    const auto some = [&](double largest) { return random.Coin() ? random.Uniform(0, largest) : 0.0; };
    const auto vector = [&](int size, double largest) {
      return Eigen::VectorXd(Eigen::VectorXd::NullaryExpr(size, [&] { return some(largest); }));
    };
    return {Eigen::MatrixXd::NullaryExpr(states, variables, [&] { return some(1); }), vector(states, 1e-3),
            vector(states, 1e-3), vector(states, 0.1), vector(variables - states, 0.1)};
  }
};

// A transition as it is recorded, and the coordinate whose errors all have one sign, if there is one.
struct Record {
  Transitions data;
  int aligned = -1;
};

// All numbers are off by less than the errors, by 1e-6 of them for rounding.
Record AnyRecord(Random& random, const Robot& robot) {
  const int n = robot.model->num_states(), variables = robot.model->num_variables();
  Record record{{Eigen::MatrixXd(1, variables), Eigen::MatrixXd(1, n)}};
  record.aligned = random.Coin(0.8) ? random.Below(n) : -1;
  const double side = random.Sign();
  Eigen::VectorXd slopes = Eigen::VectorXd::Zero(variables), z = random.Vector(variables, 2);
  Linearization there;
  robot.model->Linearize(View(z), there);
  for (const auto& [k, l, slope] : there.jacobian())
    if (k == record.aligned) slopes[l] = slope.Middle();
  const auto share = [&] { return (1 - 1e-6) * (random.Coin(0.3) ? random.Uniform(-1, 1) : random.Sign()); };
  std::vector<Real> truth;
  for (int l = 0; l < variables; ++l) {
    const double off = record.aligned >= 0 && slopes[l] != 0 ? (1 - 1e-6) * (slopes[l] > 0 ? side : -side) : share();
    truth.emplace_back(z[l] + off * robot.declaration.VariableError(l));
  }
  const std::vector<Real> nominal = robot.nominal(truth);
  for (int k = 0; k < n; ++k) {
    const auto off = [&] { return k == record.aligned ? (1 - 1e-6) * side : share(); };
    record.data.x_next(0, k) =
        (nominal[static_cast<std::size_t>(k)] + robot.residual(truth, k) +
         Real(off() * robot.declaration.noise_bound[k]) + Real(off() * robot.declaration.disturbance[k]) +
         Real(off() * robot.declaration.state_error[k]))
            .ToDouble();
  }
  record.data.z.row(0) = z;
  return record;
}

// What is observed at a place that is not the true one bounds the residual at that place. Without what e adds to the
// successor, to f0 or to the residual it does not.
TEST(Observe, OfAnInexactRecordBoundsTheResidualWhereItWasRecorded) {
  std::array<int, 3> noticed{};
  int judged = 0, refused = 0;
  for (TracedRandom random(641); random.Again(400);) {
    const ModelText text = random.Coin(0.3) ? KinkedText(random) : AnyText(random);
    std::vector<double> parameters;
    for (const auto& [name, lower, upper] : text.parameters) parameters.push_back(random.Coin() ? lower : upper);
    const Robot robot(random, text, parameters);
    const Declaration& declaration = robot.declaration;
    for (int i = 0; i < 10; ++i) {
      const auto [data, aligned] = AnyRecord(random, robot);
      if (!data.x_next.allFinite()) continue;
      Observations seen, exact;
      try {
        exact = Observe(*robot.model, data);
        seen = Observe(*robot.model, declaration, data);
      } catch (const NoNominalValue&) {
        ++refused;
        continue;
      }
      const std::vector<Real> z(data.z.row(0).begin(), data.z.row(0).end());
      for (int k = 0; k < robot.model->num_states(); ++k) {
        const Real residual = robot.residual(z, k),
                   eps = Real(declaration.noise_bound[k]) + Real(declaration.disturbance[k]);
        const auto holds = [&](double less) {
          return Real(seen.lower(0, k)) + Real(less) - eps <= residual &&
                 residual <= Real(seen.upper(0, k)) - Real(less) + eps;
        };
        ASSERT_TRUE(holds(0)) << "trial " << random.trial() << ", record " << i << ", coordinate " << k;
        ++judged;
        double of_residual = 0;
        for (int l = 0; l < robot.model->num_variables(); ++l)
          of_residual += declaration.lipschitz(k, l) * declaration.VariableError(l);
        const double of_successor = declaration.state_error[k],
                     of_model = exact.lower(0, k) - seen.lower(0, k) - of_successor - of_residual;
        noticed[0] += !holds(of_successor);
        noticed[1] += !holds(of_model);
        noticed[2] += !holds(of_residual);
      }
    }
  }
  std::cout << judged << " bounds, " << refused << " records without one; too weak without the error of the successor "
            << noticed[0] << ", of f0 " << noticed[1] << ", of the residual " << noticed[2] << "\n";
  EXPECT_GT(judged, 4000);
  EXPECT_LT(refused, judged / 10);
  EXPECT_THAT(noticed, Each(Gt(20)));
}

// The slope counts at its largest within the errors: at the recorded place that of z^2 is zero.
TEST(Observe, TheSlopeOfTheModelIsTheLargestWithinTheErrors) {
  const auto model = MakeTextModel(TextModel({{"x", "x^2"}}, {"u"}, {{"dt", 1, 1}}));
  Declaration declaration{Eigen::MatrixXd::Zero(1, 2), Eigen::VectorXd::Zero(1)};
  declaration.state_error = Eigen::VectorXd::Constant(1, 0.5);
  const Transitions data{Eigen::MatrixXd::Zero(1, 2), Eigen::MatrixXd::Ones(1, 1)};
  EXPECT_LE(Observe(*model, declaration, data).lower(0, 0), 1 - 0.5 - 2 * 0.5 * 0.5);
  EXPECT_GE(Observe(*model, declaration, data).lower(0, 0), 1 - 0.5 - 2 * 0.5 * 0.5 - 1e-15);
}

// Where the value of the model is known and its slope is not, as of the root at zero, the record is refused with the
// state's name.
TEST(Observe, RefusesARecordWhoseErrorsReachAnUnboundedSlope) {
  const auto model = MakeTextModel(TextModel({{"y", "y"}, {"x", "sqrt(x) + y"}}, {"u"}, {{"dt", 1, 1}}));
  const auto observe = [&](double x, double e_x, double e_y) {
    Declaration declaration{Eigen::MatrixXd::Zero(2, 3), Eigen::VectorXd::Zero(2)};
    declaration.state_error = Eigen::Vector2d(e_y, e_x);
    Transitions data{Eigen::MatrixXd::Zero(1, 3), Eigen::MatrixXd::Zero(1, 2)};
    data.z(0, 1) = x;
    return Observe(*model, declaration, data);
  };
  EXPECT_NO_THROW(observe(0.25, 0.125, 0));
  EXPECT_NO_THROW(observe(0, 0, 0.125)) << "x is exact";
  for (const double error : {0.25, 0.5}) {  // to the end of the root's domain, and beyond it
    try {
      observe(0.25, error, 0);
      FAIL() << error;
    } catch (const NoNominalValue& refused) {
      EXPECT_EQ(refused.at(), NoNominalValue::At::kAround);
      EXPECT_STREQ(refused.what(),
                   "transition 0: x: the nominal model has no finite derivative within the declared errors of states, "
                   "inputs and durations there");
    }
  }
  try {
    observe(-1, 0.5, 0);
    FAIL();
  } catch (const NoNominalValue& refused) {
    EXPECT_EQ(refused.at(), NoNominalValue::At::kLocation);
  }
}

// theta+ = theta at a standstill: an error of 1/4 counts before and after the step, and the turns are told as long as
// all of it is within a quarter of a turn.
TEST(Observe, RefusesAnAngleIfItsErrorsReachAQuarterOfATurn) {
  const auto model = MakeKinematicBicycle(0.5, 2, {2});
  Declaration declaration{Eigen::MatrixXd::Zero(6, 8), Eigen::VectorXd::Zero(6)};
  declaration.state_error = Eigen::VectorXd::Unit(6, 2) * 0.25;
  const auto observe = [&](double next) {
    Transitions data{Eigen::MatrixXd::Zero(1, 8), Eigen::MatrixXd::Zero(1, 6)};
    data.x_next(0, 2) = next;
    return Observe(*model, declaration, data);
  };
  const double quarter = std::numbers::pi / 2, inside = quarter - 0.5 - 0x1p-48;
  for (const double sign : {1.0, -1.0}) {
    EXPECT_NO_THROW(observe(sign * inside));
    EXPECT_THROW(observe(sign * (quarter - 0.5)), AmbiguousAngle);
    EXPECT_THROW(observe(sign * 1.5), AmbiguousAngle);
    EXPECT_NO_THROW(observe(sign * 5.3)) << "a turn less: 0.983";
    EXPECT_THROW(observe(sign * 5.2), AmbiguousAngle) << "a turn less: 1.083";
  }
  EXPECT_THAT(Thrown<AmbiguousAngle>([&] { observe(1.25); }), HasSubstr("theta is 1.25 +- 0.5 rad away"));
}

// theta+ = theta at a standstill, in a step of 1/2 s that may have been 10 % longer: 0.21 of three quarters of a turn
// may have been added, which leaves 0.581 to be seen. Where a third may have been added, nothing is left.
TEST(Observe, RefusesAnAngleIfTheDurationMayHideItsTurns) {
  const auto model = MakeKinematicBicycle(0.5, 2, {2});
  const Declaration declaration{Eigen::MatrixXd::Zero(6, 8), Eigen::VectorXd::Zero(6)};
  const StepTiming timing{.error = 0.1};
  const auto observe = [&](double next, double longer) {
    Transitions data{Eigen::MatrixXd::Zero(1, 8), Eigen::MatrixXd::Zero(1, 6), Eigen::VectorXd::Constant(1, longer)};
    data.x_next(0, 2) = next;
    return Observe(*model, declaration, data, timing);
  };
  constexpr double kPi = std::numbers::pi, kHair = 1e-12;
  const double left = kPi / 2 - 0.21 * 1.5 * kPi, third = 0.5 * (std::sqrt(4 / 3.) - 1);
  for (const double sign : {1.0, -1.0}) {
    EXPECT_NO_THROW(observe(sign * (left - kHair), 0.05));
    EXPECT_THROW(observe(sign * (left + kHair), 0.05), AmbiguousAngle);
  }
  EXPECT_NO_THROW(observe(0, third - kHair));
  EXPECT_THROW(observe(0, third + kHair), AmbiguousAngle);
  EXPECT_THROW(observe(0, 0.1), AmbiguousAngle);
  // A residual of 3.31 in a step that lasted 1.9 times as long ends where one of 0.0057 would.
  EXPECT_THROW(observe(1.9 * 3.31, 0.45), NoNominalValue);
}

// Nothing bounds a residual that may have doubled.
TEST(Observe, SaysNothingIfTheDurationMayHaveDoubledTheResidual) {
  const auto model = MakePointMass(0.5);
  const Declaration declaration{Eigen::MatrixXd::Zero(4, 6), Eigen::VectorXd::Zero(4)};
  const double twice = 0.5 * (std::sqrt(2.0) - 1);
  const auto observe = [&](double longer) {
    return Observe(*model, declaration,
                   {Eigen::MatrixXd::Zero(1, 6), Eigen::MatrixXd::Ones(1, 4), Eigen::VectorXd::Constant(1, longer)},
                   {.error = 0.2});
  };
  EXPECT_NO_THROW(observe(twice - 1e-12));
  EXPECT_THROW(observe(twice + 1e-12), NoNominalValue);
}

// One coordinate, columns of L as given, exactly known residuals.
struct Sample {
  Declaration declaration;
  Observations observations;
};

Sample Exactly(const Eigen::MatrixXd& lipschitz, const Eigen::MatrixXd& z, const Eigen::MatrixXd& residual,
               double noise = 0) {
  return {{lipschitz, Eigen::VectorXd::Constant(lipschitz.rows(), noise)}, {z, residual, residual}};
}

Sample TwoPoints(double slope, double distance, double difference, double noise) {
  return Exactly(Eigen::MatrixXd::Constant(1, 1, slope), Eigen::Vector2d(1, 1 + distance),
                 Eigen::Vector2d(3, 3 + difference), noise);
}

TEST(FindViolation, DecidesAtTheLastBit) {
  for (const double sign : {1.0, -1.0}) {
    const double bound = 0.5 * 4 + 2 * 0.25;
    const auto at = [&](double difference) {
      const Sample s = TwoPoints(0.5, sign * 4, difference, 0.25);
      return FindViolation(s.declaration, s.observations);
    };
    EXPECT_FALSE(at(sign * bound)) << "the bound itself is allowed";
    EXPECT_FALSE(at(sign * (bound - 0x1p-50)));
    const auto violation = at(sign * (bound + 0x1p-50)).value();
    EXPECT_FIELDS(violation, (first, 0), (second, 1), (coordinate, 0), (difference, bound + 0x1p-50), (bound, bound));
  }
}

// Each of the two observations has its own error and its own disturbance.
TEST(FindViolation, AllowsTheDisturbanceOfBothToTheLastBit) {
  for (const double slope : {0.5, 0.0}) {
    const double bound = slope * 4 + 2 * (0.25 + 0.125);
    const auto at = [&](double difference) {
      Sample s = TwoPoints(slope, 4, difference, 0.25);
      s.declaration.disturbance = Eigen::VectorXd::Constant(1, 0.125);
      return FindViolation(s.declaration, s.observations);
    };
    EXPECT_FALSE(at(bound));
    ASSERT_TRUE(at(bound + 0x1p-50));
    EXPECT_EQ(at(bound + 0x1p-50)->bound, bound);
  }
}

// The difference is as large as it may be: however the bound of many terms is rounded, it is no contradiction.
TEST(TestPair, NoRoundingOfTheBoundMakesAContradiction) {
  TracedRandom random(617);
  for (int trial = 0; trial < 5000; ++trial) {
    const int variables = random.Integer(1, 8);
    Declaration declaration{random.Matrix(1, variables).cwiseAbs(), random.Vector(1, 1e-3).cwiseAbs(), {}};
    if (trial % 2 == 1) declaration.disturbance = random.Vector(1, 1e-2).cwiseAbs();
    Observations two{random.Matrix(2, variables), Eigen::MatrixXd::Zero(2, 1), Eigen::MatrixXd::Zero(2, 1)};
    Rational bound = 2 * (Rational(declaration.noise_bound[0]) + Rational(declaration.DisturbanceBound(0)));
    for (int l = 0; l < variables; ++l)
      bound += Rational(declaration.lipschitz(0, l)) * abs(Rational(two.z(0, l)) - Rational(two.z(1, l)));
    two.lower(0, 0) = two.upper(0, 0) = Floor(bound);
    ASSERT_FALSE(TestPair(declaration, two, 0, 1, 0)) << "trial " << trial;
    two.lower(0, 0) = two.upper(0, 0) = Ceiling(bound) * (1 + 0x1p-47);
    ASSERT_TRUE(TestPair(declaration, two, 0, 1, 0)) << "trial " << trial;
  }
}

TEST(FindViolation, ConstantCoordinatesDecideAtTheLastBit) {
  EXPECT_FALSE([] {
    const Sample s = TwoPoints(0, 5, 0.5, 0.25);
    return FindViolation(s.declaration, s.observations);
  }());
  const Sample s = TwoPoints(0, 5, 0.5 + 0x1p-50, 0.25);
  EXPECT_FIELDS(FindViolation(s.declaration, s.observations).value(), (bound, 0.5), (difference, 0.5 + 0x1p-50));
}

// The first pair in the order of k, then i < j, that violates by exact arithmetic.
std::optional<Violation> BruteForce(const Sample& s) {
  const Observations& o = s.observations;
  for (int k = 0; k < o.num_states(); ++k)
    for (int i = 0; i < o.size(); ++i)
      for (int j = i + 1; j < o.size(); ++j) {
        Rational bound = 2 * (Rational(s.declaration.noise_bound[k]) + Rational(s.declaration.DisturbanceBound(k)));
        for (Eigen::Index l = 0; l < o.z.cols(); ++l)
          bound += Rational(s.declaration.lipschitz(k, l)) * abs(Rational(o.z(i, l)) - Rational(o.z(j, l)));
        const Rational up = Rational(o.lower(i, k)) - Rational(o.upper(j, k)),
                       down = Rational(o.lower(j, k)) - Rational(o.upper(i, k));
        if (std::max(up, down) > bound) return Violation{i, j, k, 0, 0};
      }
  return std::nullopt;
}

// Small binary fractions: nothing rounds, so the test has to agree with exact arithmetic, ties and all.
TEST(FindViolation, FindsTheFirstPairOfRowsWithColumns) {
  int found = 0;
  for (TracedRandom random(603); random.Again(2000);) {
    const int count = random.Integer(1, 12), columns = random.Integer(1, 3);
    const auto fraction = [&] { return random.Integer(-16, 16) / 4.0; };
    Sample s = Exactly(Eigen::MatrixXd::NullaryExpr(2, columns, [&] { return random.Integer(1, 8) / 4.0; }),
                       Eigen::MatrixXd::NullaryExpr(count, columns, fraction),
                       Eigen::MatrixXd::NullaryExpr(count, 2, fraction) / 4, random.Integer(0, 2) / 4.0);
    if (random.trial() % 3 == 1) s.declaration.disturbance = Eigen::Vector2d(random.trial() % 2 / 8.0, 0.25);
    s.observations.upper.array() += random.Integer(0, 1) / 8.0;
    const auto expected = BruteForce(s), violation = FindViolation(s.declaration, s.observations);
    ASSERT_EQ(violation.has_value(), expected.has_value());
    if (!expected) continue;
    ++found;
    ASSERT_EQ(violation->coordinate, expected->coordinate);
    ASSERT_EQ(violation->first, expected->first);
    ASSERT_EQ(violation->second, expected->second);
    ASSERT_GT(violation->difference, violation->bound);
  }
  EXPECT_GT(found, 200);
  EXPECT_LT(found, 1800);
}

TEST(FindViolation, OfConstantRowsAgreesWithExactArithmetic) {
  for (TracedRandom random(604); random.Again(2000);) {
    const int count = random.Integer(1, 12);
    const Sample s = Exactly(Eigen::MatrixXd::Zero(1, 2), random.Matrix(count, 2),
                             Eigen::MatrixXd::NullaryExpr(count, 1, [&] { return random.Integer(-3, 3) / 8.0; }), 0.25);
    const auto violation = FindViolation(s.declaration, s.observations);
    ASSERT_EQ(violation.has_value(), BruteForce(s).has_value());
    if (!violation) continue;
    ASSERT_LT(violation->first, violation->second);
    ASSERT_GT(violation->difference, violation->bound);
    ASSERT_EQ(std::abs(s.observations.lower(violation->first, 0) - s.observations.lower(violation->second, 0)),
              violation->difference);
  }
}

TEST(FindViolation, NeverFalsifiesWhatRationalsDoNotProve) {
  for (TracedRandom random(605); random.Again(1500);) {
    const int count = random.Integer(2, 6), columns = random.Integer(1, 3);
    // Residuals on the edge of what L allows, each off by the last bits.
    const Eigen::MatrixXd slopes = random.Matrix(1, columns).cwiseAbs();
    const Eigen::MatrixXd z = random.Matrix(count, columns, std::ldexp(1, random.Integer(-20, 20)));
    Eigen::MatrixXd residual(count, 1);
    for (int i = 0; i < count; ++i) {
      residual(i, 0) = slopes.row(0).dot(z.row(i));
      if (random.Coin()) residual(i, 0) = std::nextafter(residual(i, 0), random.Sign() * kMaxDouble);
    }
    const Sample s = Exactly(slopes, z, residual);
    if (FindViolation(s.declaration, s.observations)) ASSERT_TRUE(BruteForce(s));
  }
}

// A residual that uses up its whole declaration, observed through rounded successors, with sigma = 0.
TEST(FindViolation, NeverFalsifiesTheTruthThroughRounding) {
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  for (TracedRandom random(606); random.Again(60);) {
    const double slope_v = random.Uniform(0, 0.1), slope_delta = random.Uniform(0, 1);
    Transitions data{random.Matrix(60, 8), Eigen::MatrixXd(60, 6)};
    if (random.Coin()) data.z.col(5).setConstant(0.25);
    for (int i = 0; i < data.size(); ++i) {
      std::array<long double, 6> next;
      const Eigen::VectorXd z = data.z.row(i);
      const long double dt = 0.1, per_wheelbase = dt / 2.5L, v = z[3], delta = z[5];
      next = {z[0] + dt * (v * std::cos(static_cast<long double>(z[2]))),
              z[1] + dt * (v * std::sin(static_cast<long double>(z[2]))),
              z[2] + per_wheelbase * (v * std::tan(delta)) - slope_v * std::abs(v - 0.25L) + slope_delta * delta,
              v + dt * z[4],
              z[4] + dt * z[6],
              delta + dt * z[7]};
      for (int k = 0; k < 6; ++k) data.x_next(i, k) = static_cast<double>(next[static_cast<std::size_t>(k)]);
    }
    Declaration declaration{Eigen::MatrixXd::Zero(6, 8), Eigen::VectorXd::Zero(6)};
    declaration.lipschitz(2, 3) = slope_v;
    declaration.lipschitz(2, 5) = slope_delta;
    const Observations observations = Observe(*model, data);
    ASSERT_FALSE(FindViolation(declaration, observations));
    // Nor does it invert an envelope.
    ResidualBounds bounds;
    for (int query = 0; query < 5; ++query) {
      const Eigen::VectorXd z = data.z.row(random.Below(60));
      const Zonotope point(z.head(6), Eigen::MatrixXd(6, 0));
      Enclose(EnvelopeFor(declaration, observations, point, {z.data() + 6, 2}), point, {z.data() + 6, 2}, bounds);
      for (std::size_t k = 0; k < 6; ++k) ASSERT_LE(bounds.lower[k], bounds.upper[k]);
    }
  }
}

// Wrapped and unwrapped, the same drives give the same envelope, up to the units and the width of 2 pi.
TEST(Envelope, OfWrappedDataIsThatOfUnwrappedData) {
  const auto model = MakeKinematicBicycle(0.1, 2.5, {2});
  for (TracedRandom random(632); random.Again(100);) {
    auto [wrapped, turns] = TurnedTransitions(random, 40);
    Transitions unwrapped = wrapped;
    for (int i = 0; i < 40; ++i) {
      const Real turned = Real(wrapped.x_next(i, 2)) + Real(turns[static_cast<std::size_t>(i)] * 2) * Real::Pi();
      unwrapped.x_next(i, 2) = turned.ToDouble();
    }
    Declaration declaration{random.Matrix(6, 8).cwiseAbs(), Eigen::VectorXd::Constant(6, 10)};
    const Zonotope slice = Zonotope::FromBox(random.Vector(6), random.Vector(6, 0.1).cwiseAbs());
    const Eigen::VectorXd input = random.Vector(2);
    ResidualBounds bounds, as_driven;
    const Observations of_wrapped = Observe(*model, wrapped), of_unwrapped = Observe(*model, unwrapped);
    Enclose(EnvelopeFor(declaration, of_wrapped, slice, View(input)), slice, View(input), bounds);
    Enclose(EnvelopeFor(declaration, of_unwrapped, slice, View(input)), slice, View(input), as_driven);
    for (std::size_t k = 0; k < 6; ++k) {
      ASSERT_NEAR(bounds.lower[k], as_driven.lower[k], 1e-13);
      ASSERT_NEAR(bounds.upper[k], as_driven.upper[k], 1e-13);
    }
    EXPECT_FALSE(FindViolation(declaration, of_wrapped));
  }
}

// D_i = max over signs s of |sum_l s_l L_l (c_l - z_il)| + |G^T W s|_1, or the bound over the interval hull.
Rational Distance(const Sample& s, int k, int i, const Zonotope& slice, const Eigen::VectorXd& input) {
  std::vector<int> active;
  for (Eigen::Index l = 0; l < s.observations.z.cols(); ++l)
    if (s.declaration.lipschitz(k, l) != 0) active.push_back(static_cast<int>(l));
  const auto center = [&](int l) { return Rational(l < slice.dim() ? slice.center(l) : input[l - slice.dim()]); };
  const auto slope = [&](int l) { return Rational(s.declaration.lipschitz(k, l)); };
  if (active.size() > static_cast<std::size_t>(LipschitzEnvelope::kMaxExactColumns)) {
    Rational distance = 0;
    for (const int l : active) {
      distance += slope(l) * abs(center(l) - Rational(s.observations.z(i, l)));
      if (l < slice.dim()) distance += slope(l) * exact::HalfWidth(slice, l);
    }
    return distance;
  }
  Rational farthest = 0;
  for (std::uint32_t signs = 0; signs < 1u << active.size(); ++signs) {
    const auto weight = [&](std::size_t a) -> Rational { return (signs >> a & 1u ? -1 : 1) * slope(active[a]); };
    Rational offset = 0;
    for (std::size_t a = 0; a < active.size(); ++a)
      offset += weight(a) * (center(active[a]) - Rational(s.observations.z(i, active[a])));
    Rational distance = abs(offset);
    for (std::size_t a = 0; a < active.size(); ++a)
      if (active[a] < slice.dim()) distance += slope(active[a]) * Rational(slice.slack(active[a]));
    for (int j = 0; j < slice.num_generators(); ++j) {
      Rational along = 0;
      for (std::size_t a = 0; a < active.size(); ++a)
        if (active[a] < slice.dim()) along += weight(a) * Rational(slice.generator(active[a], j));
      distance += abs(along);
    }
    farthest = std::max(farthest, distance);
  }
  return farthest;
}

void ExpectEnvelope(const Sample& s, const Zonotope& slice, const Eigen::VectorXd& input, double tolerance) {
  std::vector<ResidualBounds> all(3);
  Enclose(EnvelopeFor(s.declaration, s.observations, slice, View(input)), slice, View(input), all[0]);
  Enclose(EnvelopeFor(s.declaration, s.observations, slice, View(input), {.max_flat_blocks = 0}), slice, View(input),
          all[1]);
  const EnvelopeOptions one_leaf{.max_leaf_visits = 1, .max_flat_blocks = 0};
  Enclose(EnvelopeFor(s.declaration, s.observations, slice, View(input), one_leaf), slice, View(input), all[2]);
  ASSERT_FALSE(all[0].capped || all[1].capped);
  for (int k = 0; k < s.observations.num_states(); ++k) {
    const Rational error = Rational(s.declaration.noise_bound[k]) + Rational(s.declaration.DisturbanceBound(k));
    std::vector<Rational> lower, upper;
    for (int i = 0; i < s.observations.size(); ++i) {
      const Rational distance = Distance(s, k, i, slice, input);
      lower.push_back(Rational(s.observations.lower(i, k)) - error - distance);
      upper.push_back(Rational(s.observations.upper(i, k)) + error + distance);
    }
    const Rational highest = *std::max_element(lower.begin(), lower.end()),
                   lowest = *std::min_element(upper.begin(), upper.end());
    const auto row = static_cast<std::size_t>(k);
    for (const ResidualBounds& bounds : all) {
      ASSERT_TRUE(AtLeast(highest, bounds.lower[row])) << "coordinate " << k;
      ASSERT_TRUE(AtMost(lowest, bounds.upper[row])) << "coordinate " << k;
      if (bounds.capped) continue;
      ASSERT_NEAR(bounds.lower[row], highest.get_d(), tolerance);
      ASSERT_NEAR(bounds.upper[row], lowest.get_d(), tolerance);
    }
  }
}

class Envelope : public testing::TestWithParam<int> {};

TEST_P(Envelope, IsTheExactEnvelopeRoundedOutward) {
  const int active = GetParam(), states = std::max(2, std::min(active, 9)), inputs = std::max(1, active - states + 1);
  const int trials = active <= 3 ? 200 : active <= 8 ? 15 : active <= 12 ? 1 : 30;
  for (TracedRandom random(607 + static_cast<std::uint64_t>(active)); random.Again(trials);) {
    const int count = active <= 3 ? random.Integer(1, 140) : 4, variables = states + inputs;
    Sample s = Exactly(Eigen::MatrixXd::Zero(1, variables), random.Matrix(count, variables),
                       random.Matrix(count, 1, 0.1), random.Coin() ? 0 : 0.01);
    s.observations.upper.array() += 1e-6;
    if (random.trial() % 2 == 1) s.declaration.disturbance = Eigen::VectorXd::Constant(1, 0.003 * random.trial());
    std::vector<int> columns(static_cast<std::size_t>(variables));
    for (int l = 0; l < variables; ++l) columns[static_cast<std::size_t>(l)] = l;
    for (int a = 0; a < active; ++a) {
      std::swap(columns[static_cast<std::size_t>(a)],
                columns[static_cast<std::size_t>(random.Integer(a, variables - 1))]);
      s.declaration.lipschitz(0, columns[static_cast<std::size_t>(a)]) = random.Uniform(0, 1);
    }
    Zonotope slice = random.AnyZonotope(states, random.Integer(0, active <= 8 ? 20 : 5), random.Coin() ? 0.3 : 0.02);
    if (random.Coin())
      for (int k = 0; k < states; ++k) ArraysOf(slice).mutable_slack(k) = random.Uniform(0, 0.1);
    const Eigen::VectorXd input = random.Vector(inputs);
    ExpectEnvelope(s, slice, input, 1e-12);
    EXPECT_EQ(EnvelopeFor(s.declaration, s.observations, slice, View(input)).uses_hull_distance(), active > 12);
    if (HasFatalFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(ActiveColumns, Envelope, testing::Values(0, 1, 2, 3, 4, 8, 12, 13));

TEST(EnvelopeOracle, HoldsForWildScales) {
  for (TracedRandom random(630); random.Again(500);) {
    const double scale = std::ldexp(1, random.Integer(-500, 480));
    Sample s = Exactly(random.Matrix(2, 4).cwiseAbs() * std::ldexp(1, random.Integer(-500, 480)),
                       random.Matrix(9, 4, scale), random.Matrix(9, 2, scale));
    s.declaration.lipschitz.col(random.Below(4)).setZero();
    const Zonotope slice = random.AnyZonotope(3, random.Integer(0, 9), scale);
    ExpectEnvelope(s, slice, random.Vector(1, scale), kInfinity);
    if (HasFatalFailure()) return;
  }
}

// Sums that overflow make infinities of both signs, and their NaN must not be mistaken for a small distance.
TEST(EnvelopeOracle, OverflowNeverNarrows) {
  const double huge = 1e300;
  const Sample s =
      Exactly(Eigen::MatrixXd::Constant(1, 3, huge), Eigen::MatrixXd::Zero(1, 3), Eigen::MatrixXd::Zero(1, 1));
  Eigen::MatrixXd generators(2, 2);
  generators << 1e10, 1e10, 1e10, -1e10;
  const Zonotope slice(Eigen::Vector2d::Zero(), generators);
  const double input = 0;
  ResidualBounds bounds;
  Enclose(EnvelopeFor(s.declaration, s.observations, slice, {&input, 1}), slice, {&input, 1}, bounds);
  EXPECT_FALSE(bounds.lower[0] > -1e310L && bounds.lower[0] > -kMaxDouble) << bounds.lower[0];
  EXPECT_FALSE(bounds.upper[0] < kMaxDouble) << bounds.upper[0];
}

TEST(EnvelopeOracle, WildDoublesNeverNarrow) {
  for (TracedRandom random(631); random.Again(3000);) {
    const auto any = [&] { return random.Double(); };
    const Sample s = Exactly(Eigen::MatrixXd::NullaryExpr(1, 3, any).cwiseAbs(),
                             Eigen::MatrixXd::NullaryExpr(3, 3, any), Eigen::MatrixXd::NullaryExpr(3, 1, any));
    const Zonotope slice(Eigen::VectorXd::NullaryExpr(2, any), Eigen::MatrixXd::NullaryExpr(2, 4, any));
    const Eigen::VectorXd input = Eigen::VectorXd::NullaryExpr(1, any);
    ResidualBounds bounds;
    Enclose(EnvelopeFor(s.declaration, s.observations, slice, View(input)), slice, View(input), bounds);
    Rational highest, lowest;
    for (int i = 0; i < 3; ++i) {
      const Rational distance = Distance(s, 0, i, slice, input), value(s.observations.lower(i, 0));
      if (i == 0 || value - distance > highest) highest = value - distance;
      if (i == 0 || value + distance < lowest) lowest = value + distance;
    }
    ASSERT_TRUE(std::isnan(bounds.lower[0]) || AtLeast(highest, bounds.lower[0]));
    ASSERT_TRUE(std::isnan(bounds.upper[0]) || AtMost(lowest, bounds.upper[0]));
  }
}

// A step that lasts longer or shorter than dt, by no more than is told: what it says of the residual of dt contains it.
// With less told it does not always.
TEST(Observe, OfAStepOffItsTimeContainsTheResidual) {
  int missed = 0;
  for (TracedRandom random(3151); random.Again(600);) {
    const bool bicycle = random.Coin();
    const auto problem = AnyProblem(random, bicycle, 1);
    if (random.Coin()) Disturb(random, *problem);
    Shift(random, *problem);
    const Declaration& declaration = problem->declaration;
    const Ramps residual(random, declaration.lipschitz);
    const int n = problem->model->num_states(), d = problem->model->num_variables();
    Eigen::VectorXd z(d);
    for (int l = 0; l < d; ++l) z[l] = random.Uniform(-0.3, 0.3) * (l < n ? StateReach(bicycle)[l] : 1);
    const std::vector<Real> exact_z(z.begin(), z.end());
    std::vector<Real> r;
    for (int k = 0; k < n; ++k) r.push_back(residual(exact_z, k));
    const double longer = 2 * AnyOffset(random, *problem).ToDouble();
    // What may have doubled says nothing: SaysNothingIfTheDurationMayHaveDoubledTheResidual.
    if (!(RateOf(*problem->model)->Growth(std::abs(longer) / StepOf(*problem->model)) < 1)) continue;
    Eigen::VectorXd next(n);
    const std::vector<Real> reached = Rolled(random, *problem, residual, exact_z, Real(longer));
    for (int k = 0; k < n; ++k) next[k] = reached[ToSize(k)].ToDouble();
    const auto contains = [&](double told) {
      const Observations seen =
          forereach::Observe(*problem->model, declaration,
                             {z.transpose(), next.transpose(), Eigen::VectorXd::Constant(1, told)}, problem->timing);
      bool all = true;
      for (int k = 0; k < n; ++k) {
        const Real hidden(declaration.ObservationError(k));
        all = all && Real(seen.lower(0, k)) - hidden <= r[ToSize(k)] && r[ToSize(k)] <= Real(seen.upper(0, k)) + hidden;
      }
      return all;
    };
    ASSERT_TRUE(contains(std::abs(longer))) << random.trial();
    missed += !contains(std::abs(longer) / 2);
  }
  EXPECT_GT(missed, 50);
}

}  // namespace forereach::residual_oracle_test
