// Models from text: the bits of the compiled models, and enclosures of values and derivatives, with and without stages.
#include "forereach/dynamics/text_model.h"

#include "tests/test.h"

#include "forereach/declare/flow.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/step_rate.h"
#include "tests/oracle/any_text.h"
#include "tests/oracle/text_in_high_precision.h"
#include "tests/oracle/traced_random.h"
#include "verifier/equations.h"

namespace forereach::text_model_test {

using Integrator = ModelText::Integrator;

// In the order of operations of kinematic_bicycle.h and point_mass.h.
ModelText Bicycle() {
  return TextModel({{"x", "x + dt * (v * cos(theta))"},
                    {"y", "y + dt * (v * sin(theta))"},
                    {"theta", "theta + dt / wheelbase * (v * tan(delta))"},
                    {"v", "v + dt * a"},
                    {"a", "a + dt * jerk"},
                    {"delta", "delta + dt * steer_rate"}},
                   {"jerk", "steer_rate"}, {{"dt", 0.1, 0.1}, {"wheelbase", 2.7, 2.7}});
}

ModelText PointMass() {
  return TextModel({{"px", "px + dt * vx + dt * dt / 2 * ax"},
                    {"py", "py + dt * vy + dt * dt / 2 * ay"},
                    {"vx", "vx + dt * ax"},
                    {"vy", "vy + dt * ay"}},
                   {"ax", "ay"}, {{"dt", 0.1, 0.1}});
}

bool SameBits(const double* a, const double* b, std::size_t count) {
  return std::memcmp(a, b, count * sizeof(double)) == 0;
}

struct Pair {
  std::shared_ptr<const NominalModel> text, compiled;
  double largest_state;
};

struct SameBitsTest : testing::TestWithParam<int> {
  [[nodiscard]] static Pair Models() {
    if (GetParam() == 0) return {MakeTextModel(Bicycle()), MakeKinematicBicycle(0.1, 2.7), 1.2};
    return {MakeTextModel(PointMass()), MakePointMass(0.1), 20};
  }
};

TEST_P(SameBitsTest, TextAndCompiledModelAgreeInExpansionRemainderAndImage) {
  const auto [text, compiled, largest] = Models();
  const auto n = static_cast<std::size_t>(text->num_states()), d = static_cast<std::size_t>(text->num_variables());
  ASSERT_EQ(text->program().num_first, compiled->program().num_first);
  ASSERT_EQ(text->program().num_second, compiled->program().num_second);
  const auto first = static_cast<std::size_t>(text->program().num_first),
             second = static_cast<std::size_t>(text->program().num_second);
  const std::vector<Interval> domain(d, Interval(-largest, largest));
  const ExpansionError error = text->BoundError(domain), same = compiled->BoundError(domain);
  EXPECT_TRUE(SameBits(error.value.data(), same.value.data(), n));
  EXPECT_TRUE(SameBits(error.jacobian.data(), same.jacobian.data(), first));
  EXPECT_TRUE(SameBits(error.hessian.data(), same.hessian.data(), second));
  for (TracedRandom random(7102); random.Again(2000);) {
    const Zonotope slice(random.Vector(static_cast<int>(n)),
                         random.Matrix(static_cast<int>(n), random.Integer(0, 40), 0.05));
    std::vector<double> half_width = HalfWidths(slice), z(d);
    half_width.resize(kMaxVariables);
    std::vector<PlainInterval> box(d);
    for (std::size_t l = 0; l < d; ++l) {
      z[l] = l < n ? slice.center(static_cast<int>(l)) : random.Uniform(-1, 1);
      box[l] = {z[l] - half_width[l], z[l] + half_width[l]};
    }
    const StepError step = BoundStepError(text->program(), error, half_width);
    struct Results {
      Expansion expansion;
      Remainder remainder;
      Zonotope next;
      ImageSums sums;
    };
    std::array<Results, 2> results;
    for (const InstructionSet instructions : {InstructionSet::kBaseline, BestInstructionSet()})
      for (const Method method : {Method::kPaper, Method::kCentred}) {
        for (const auto& [model, r] : {std::pair{text, &results[0]}, {compiled, &results[1]}}) {
          model->Expand(z, box, r->expansion, instructions);
          model->EncloseRemainder(method, slice, half_width.data(), r->expansion.hessian.data(), step.remainder.data(),
                                  r->remainder, instructions);
          model->Map(r->expansion, step, slice, r->next, r->sums, instructions);
        }
        const auto& [a, b] = results;
        ASSERT_TRUE(SameBits(a.expansion.value.data(), b.expansion.value.data(), n));
        ASSERT_TRUE(SameBits(a.expansion.jacobian.data(), b.expansion.jacobian.data(), first));
        ASSERT_TRUE(SameBits(&a.expansion.hessian[0].lower, &b.expansion.hessian[0].lower, 2 * second));
        ASSERT_TRUE(SameBits(a.remainder.center.data(), b.remainder.center.data(), n));
        ASSERT_TRUE(SameBits(a.remainder.half_width.data(), b.remainder.half_width.data(), n));
        ASSERT_TRUE(SameBits(a.sums.row.data(), b.sums.row.data(), n));
        for (int k = 0; k < static_cast<int>(n); ++k) {
          ASSERT_TRUE(SameBits(a.next.padded_row(k).data(), b.next.padded_row(k).data(), a.next.padded_size()));
          ASSERT_EQ(a.next.slack(k), b.next.slack(k));
        }
      }
  }
}

// Random equations: what the step computes in plain arithmetic differs from enclosures by no more than its error
// bounds.
TEST(TextModel, ExpansionsAreWithinTheirErrors) {
  TracedRandom random(7104);
  int bounded = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    ModelText text = AnyText(random);
    text.integrator = random.Coin() ? Integrator::kNone : Integrator::kEuler;
    for (ModelText::Parameter& parameter : text.parameters) parameter.upper = parameter.lower;
    const auto model = MakeTextModel(text);
    const auto d = static_cast<std::size_t>(model->num_variables());
    const ExpansionError error = model->BoundError(std::vector<Interval>(d, Interval(-2, 2)));
    std::vector<double> z(d);
    std::vector<PlainInterval> box;
    std::vector<Interval> point;
    for (double& coordinate : z) {
      coordinate = random.Uniform(-1.9, 1.9);
      box.push_back({coordinate, coordinate});
      point.emplace_back(coordinate);
    }
    Expansion expansion;
    Linearization exact;
    HessianEnclosure hessian;
    model->Expand(z, box, expansion);
    model->Linearize(z, exact);
    model->EncloseHessian(point, hessian);
    const auto expect_near = [&](const Interval& enclosure, double lower, double upper, double most, const char* what) {
      if (!std::isfinite(most)) return;
      ++bounded;
      ASSERT_LE(lower - most, enclosure.upper) << what << " of trial " << trial;
      ASSERT_GE(upper + most, enclosure.lower) << what << " of trial " << trial;
    };
    for (std::size_t k = 0; k < static_cast<std::size_t>(model->num_states()); ++k)
      expect_near(exact.value[k], expansion.value[k], expansion.value[k], error.value[k], "a value");
    for (std::size_t e = 0; e < static_cast<std::size_t>(exact.count); ++e)
      expect_near(exact.entries[e].value, expansion.jacobian[e], expansion.jacobian[e], error.jacobian[e], "a slope");
    for (std::size_t e = 0; e < static_cast<std::size_t>(hessian.count); ++e)
      expect_near(hessian.entries[e].second_derivative, expansion.hessian[e].lower, expansion.hessian[e].upper,
                  error.hessian[e], "a second derivative");
  }
  EXPECT_GT(bounded, 30000);
}

TEST_P(SameBitsTest, TextAndCompiledModelAgreeInValuesAndIntervals) {
  const auto [text, compiled, largest] = Models();
  for (TracedRandom random(7103); random.Again(1000);) {
    std::vector<double> z(static_cast<std::size_t>(text->num_variables())),
        next(static_cast<std::size_t>(text->num_states())), same = next;
    for (double& x : z) x = random.Uniform(-largest, largest);
    text->Evaluate(z, next);
    compiled->Evaluate(z, same);
    ASSERT_TRUE(SameBits(next.data(), same.data(), next.size()));
    Linearization a, b;
    text->Linearize(z, a);
    compiled->Linearize(z, b);
    ASSERT_EQ(a.count, b.count);
    for (std::size_t e = 0; e < static_cast<std::size_t>(a.count); ++e)
      ASSERT_EQ(a.entries[e].value, b.entries[e].value);
  }
}

INSTANTIATE_TEST_SUITE_P(BicycleAndPointMass, SameBitsTest, testing::Values(0, 1));

// Whether x lies in the range, with an allowance for what differences of 256-bit numbers leave of a derivative.
bool IsInside(const Real& x, const Interval& range) {
  const Real allowance = Real(0x1p-60) * (abs(x) + Real(1));
  return x >= Real(range.lower) - allowance && x <= Real(range.upper) + allowance;
}

ModelText Everything(Integrator integrator) {
  return TextModel({{"x", "sin(x*y) + exp(-z^2)*tanh(u) + atan2(y + 3, x) + sqrt(z^2 + 1)/(2 + x)"},
                    {"y", "log(4 + x)*acos(y/4) - asin(z/4) + max(x + 3, y)*min(z - 3, u) + abs(x + 2)*c"},
                    {"z",
                     "atan(x*z) + tan(y/3)*(1 + tan(y/3)^2) + (x + 3)^-3 + (2 + z)^c + hypot(x, y + 3) + "
                     "signed_square(x - 2) + cos(u)*z*z*z"}},
                   {"u"}, {{"dt", 0.1, 0.1}, {"c", 0.75, 0.75}}, {}, integrator);
}

class StagesTest : public testing::TestWithParam<std::tuple<int, Integrator>> {};

TEST_P(StagesTest, EncloseValuesAndDerivatives) {
  const auto [which, integrator] = GetParam();
  const ModelText text = which == 0 ? Everything(integrator) : QuadrotorText(integrator);
  const auto model = MakeTextModel(text);
  std::vector<double> parameters;
  for (const ModelText::Parameter& parameter : text.parameters) parameters.push_back(parameter.lower);
  const TextInHighPrecision exact(text, parameters);
  const int n = model->num_states(), d = model->num_variables();
  const Real h(0x1p-50);
  for (TracedRandom random(7104); random.Again((which == 0 ? 60 : 4));) {
    std::vector<double> z(static_cast<std::size_t>(d));
    std::vector<Interval> box;
    std::vector<Real> point;
    const double width = random.Coin(0.2) ? 0 : random.Uniform(0, 0.1);
    for (double& coordinate : z) {
      coordinate = random.Uniform(-0.8, 0.8);
      const bool is_input = box.size() >= static_cast<std::size_t>(n);
      box.emplace_back(coordinate - (is_input ? 0 : width), coordinate + (is_input ? 0 : width));
      point.emplace_back(random.Uniform(box.back().lower, box.back().upper));
    }
    std::vector<double> next(static_cast<std::size_t>(n));
    model->Evaluate(z, next);
    Linearization linear;
    model->Linearize(z, linear);
    const std::vector<Real> center(z.begin(), z.end()), value = exact(center);
    for (std::size_t k = 0; k < next.size(); ++k) {
      ASSERT_TRUE(value[k] >= Real(linear.value[k].lower) && value[k] <= Real(linear.value[k].upper)) << k;
      ASSERT_LE(linear.value[k].upper - linear.value[k].lower, 1e-11);
      ASSERT_NEAR(next[k], linear.value[k].Middle(), 1e-11);
    }
    const auto moved = [&](std::vector<Real> from, int l, const Real& by) {
      from[static_cast<std::size_t>(l)] = from[static_cast<std::size_t>(l)] + by;
      return from;
    };
    for (int l = 0; l < d; ++l) {
      const std::vector<Real> above = exact(moved(center, l, h)), below = exact(moved(center, l, -h));
      for (int k = 0; k < n; ++k) {
        const Real slope = (above[static_cast<std::size_t>(k)] - below[static_cast<std::size_t>(k)]) / (h + h);
        const auto* entry = std::find_if(linear.entries.begin(), linear.entries.begin() + linear.count,
                                         [&](const MatrixEntry& e) { return e.row == k && e.column == l; });
        const bool is_listed = entry != linear.entries.begin() + linear.count;
        ASSERT_TRUE(IsInside(slope, is_listed ? entry->value : Interval(0))) << k << " by " << l;
        if (is_listed) ASSERT_LE(entry->value.upper - entry->value.lower, 1e-10);
      }
    }
    HessianEnclosure hessian;
    model->EncloseHessian(box, hessian);
    for (int i = 0; i < n; ++i)
      for (int l = i; l < n; ++l) {
        const std::vector<Real> a = exact(moved(moved(point, i, h), l, h)), b = exact(moved(moved(point, i, h), l, -h)),
                                c = exact(moved(moved(point, i, -h), l, h)),
                                e = exact(moved(moved(point, i, -h), l, -h));
        for (int k = 0; k < n; ++k) {
          const auto at = static_cast<std::size_t>(k);
          const Real curvature = (a[at] - b[at] - c[at] + e[at]) / (Real(4) * h * h);
          const auto* entry = std::find_if(
              hessian.entries.begin(), hessian.entries.begin() + hessian.count,
              [&](const HessianEnclosure::Entry& x) { return x.output == k && x.row == i && x.column == l; });
          const bool is_listed = entry != hessian.entries.begin() + hessian.count;
          const Interval range = is_listed ? entry->second_derivative : Interval(0);
          ASSERT_TRUE(range.IsFinite());
          ASSERT_TRUE(IsInside(curvature, range)) << k << " by " << i << ", " << l << ": " << curvature;
          if (width == 0) ASSERT_LE(range.upper - range.lower, 1e-8);
        }
      }
  }
}

INSTANTIATE_TEST_SUITE_P(All, StagesTest,
                         testing::Combine(testing::Values(0, 1),
                                          testing::Values(Integrator::kNone, Integrator::kEuler, Integrator::kMidpoint,
                                                          Integrator::kRk4)));

// By the mean value theorem, a difference quotient in the duration is a derivative somewhere between.
TEST_P(StagesTest, TheirRateContainsTheSlopeByTheDuration) {
  const auto [which, integrator] = GetParam();
  ModelText text = which == 0 ? Everything(integrator) : QuadrotorText(integrator);
  if (integrator == Integrator::kNone)  // a step that says what its duration does
    for (std::size_t k = 0; k < text.equations.size(); ++k)
      text.equations[k].text =
          text.states[k].name + " + dt*(" + text.equations[k].text + ") + dt^2/3*" + text.states[0].name;
  const StepRate rate(text);
  const auto equations = verifier::EquationsOf(text);
  const auto at = [&](double dt) {
    std::vector<double> parameters;
    for (const ModelText::Parameter& parameter : text.parameters)
      parameters.push_back(parameter.name == "dt" ? dt : parameter.lower);
    return TextInHighPrecision(text, parameters);
  };
  const std::size_t n = text.states.size(), d = n + text.inputs.size();
  for (TracedRandom random(7105); random.Again(30);) {
    std::vector<Interval> box;
    std::vector<Real> point;
    std::vector<verifier::Real> precise_box;
    const double width = random.Coin(0.2) ? 0 : random.Uniform(0, 0.1);
    for (std::size_t l = 0; l < d; ++l) {
      const double c = random.Uniform(-0.8, 0.8), r = l < n ? width : 0;
      box.emplace_back(c - r, c + r);
      precise_box.push_back(verifier::Real::FromTo(c - r, c + r));
      point.emplace_back(random.Coin() ? box[l].lower : box[l].upper);
    }
    const double shortest = random.Uniform(0.05, 0.1), longest = shortest + random.Uniform(1e-3, 0.02);
    std::vector<Interval> all(n);
    rate.Enclose(box, {shortest, longest}, all);
    const auto precise = equations->Rate(precise_box, verifier::Real::FromTo(shortest, longest));
    const std::vector<Real> early = at(shortest)(point), late = at(longest)(point);
    for (std::size_t k = 0; k < n; ++k) {
      ASSERT_TRUE(rate.UsesDuration(static_cast<int>(k)));
      const Real slope = (late[k] - early[k]) / (Real(longest) - Real(shortest));
      ASSERT_TRUE(slope >= Real(all[k].lower) && slope <= Real(all[k].upper)) << k;
      ASSERT_TRUE(CertainlyAtMost(precise[k].lower(), slope.ToDouble()) ||
                  precise[k].lower().ToDouble() - slope.ToDouble() < 1e-12)
          << k;
      ASSERT_GT(precise[k].upper().ToDouble() + 1e-12, slope.ToDouble()) << k;
    }
  }
}

TEST(StepRate, SaysWhatDoesNotDependOnTheDuration) {
  const StepRate rate(TextModel({{"x", "x + dt*y"}, {"y", "y + u"}}, {"u"}, {{"dt", 0.1, 0.1}}, {}, Integrator::kNone));
  EXPECT_TRUE(rate.UsesDuration(0));
  EXPECT_FALSE(rate.UsesDuration(1));
}

// By the form of each equation: x plus terms that are h times what does not depend on h.
TEST(StepRate, SaysWhatIsInProportionToTheDuration) {
  const auto is_proportional = [](const std::string& equation, Integrator integrator) {
    const ModelText text = TextModel({{"x", equation}, {"y", "y + dt*u"}}, {"u"}, {{"dt", 0.1, 0.1}, {"k", 1, 2}},
                                     {{"half", "dt/2"}}, integrator);
    const bool is = StepRate(text).IsProportional(0);
    EXPECT_EQ(verifier::EquationsOf(text)->IsProportional(0), is) << equation;
    return is;
  };
  for (const char* yes : {"x + dt*y", "dt*sin(x) + x", "x - dt/k*tan(y)", "x + dt*y + half*u - 3*half*x^2", "x",
                          "x + (dt*y - dt*(u - x))", "x + dt*dt*y/half", "x - -dt*exp(y)", "x + dt"})
    EXPECT_TRUE(is_proportional(yes, Integrator::kNone)) << yes;
  for (const char* no : {"x + dt*y + dt*half*u", "y + dt*x", "x + dt*sin(dt*y)", "x + dt*abs(dt*y)", "x + max(dt*y, u)",
                         "2*x + dt*y", "x*exp(-dt)", "x + y", "dt*y", "x + dt^2*y/half", "x + y*dt/(dt + 1)"})
    EXPECT_FALSE(is_proportional(no, Integrator::kNone)) << no;
  EXPECT_TRUE(is_proportional("x*y - u", Integrator::kEuler));
  EXPECT_FALSE(is_proportional("x*y - u*dt", Integrator::kEuler));
  EXPECT_FALSE(is_proportional("x*y - u", Integrator::kMidpoint));
  EXPECT_FALSE(is_proportional("x*y - u", Integrator::kRk4));
}

// Every second derivative by the variables of a kink or a jump has no bound, even if each side of it is affine.
TEST(TextModel, AKinkInsideTheBoxHasNoFiniteHessian) {
  for (const char* equation : {"abs(x)", "max(x, y)", "min(x, 2*y)", "atan2(x, y - 3)", "sqrt(x^2)", "log(x)", "1/x",
                               "asin(x + 0.9995)", "sqrt(x)", "x^0.5", "hypot(x, y)", "tan(x + pi/2)"}) {
    for (const Integrator integrator : {Integrator::kNone, Integrator::kRk4}) {
      const auto model =
          MakeTextModel(TextModel({{"x", equation}, {"y", "u"}}, {"u"}, {{"dt", 0.1, 0.1}}, {}, integrator));
      const std::vector<Interval> at{{-0.001, 0.001}, {-0.001, 0.001}, 0.0}, beside{{0.01, 0.012}, {3.5, 3.6}, 0.0};
      HessianEnclosure hessian;
      model->EncloseHessian(at, hessian);
      const auto* entry = std::find_if(hessian.entries.begin(), hessian.entries.begin() + hessian.count,
                                       [](const auto& e) { return e.output == 0 && e.row == 0 && e.column == 0; });
      ASSERT_NE(entry, hessian.entries.begin() + hessian.count) << equation;
      EXPECT_FALSE(entry->second_derivative.IsFinite()) << equation;
      // Beside, the argument of asin is above 1, and some later stage meets the pole.
      if (integrator != Integrator::kNone || std::string(equation).starts_with("asin")) continue;
      model->EncloseHessian(beside, hessian);
      EXPECT_TRUE(entry->second_derivative.IsFinite()) << equation;
    }
  }
}

// An interval of a parameter: the enclosures contain those of each of its values.
TEST(TextModel, AParameterMayBeARange) {
  ModelText text = Bicycle();
  std::ranges::find(text.parameters, "wheelbase", &ModelText::Parameter::name)->upper = 2.9;
  const auto model = MakeTextModel(text);
  const std::vector<double> z{1, 2, 0.5, 3, 0.1, 0.2, 0.3, 0.4};
  const std::vector<Interval> domain(8, Interval(-1.2, 1.2));
  EXPECT_EQ(model->BoundError(domain).value[2], kInfinity);
  Linearization all, one;
  model->Linearize(z, all);
  for (const double wheelbase : {2.7, 2.8, 2.9}) {
    MakeKinematicBicycle(0.1, wheelbase)->Linearize(z, one);
    EXPECT_LE(all.value[2].lower, one.value[2].lower);
    EXPECT_GE(all.value[2].upper, one.value[2].upper);
  }
  EXPECT_THAT(model->description(), HasSubstr("wheelbase=[2.7,2.9]"));
}

TEST(TextModel, RefusesAWrongTextAndSaysWhy) {
  const auto make = [](const ModelText& text) { return [text] { static_cast<void>(MakeTextModel(text)); }; };
  const auto with = [](auto change) {
    ModelText text = PointMass();
    change(text);
    return text;
  };
  const auto says = [](const char* what) { return ThrowsMessage<std::invalid_argument>(HasSubstr(what)); };
  EXPECT_THAT(make(with([](ModelText& t) { t.states.resize(0); })), says("0 states are outside [1, 16]"));
  EXPECT_THAT(make(with([](ModelText& t) { t.states.resize(17, {"s", ""}); })), says("17 states are outside [1, 16]"));
  EXPECT_THAT(make(with([](ModelText& t) { t.inputs.resize(9, {"s", ""}); })), says("9 inputs are outside [0, 8]"));
  EXPECT_THAT(make(with([](ModelText& t) { t.equations.pop_back(); })), says("3 equations for 4 states"));
  EXPECT_THAT(make(with([](ModelText& t) { t.parameters.clear(); })), says("no parameter dt"));
  EXPECT_THAT(make(with([](ModelText& t) { t.parameters[0].lower = 0; })), says("dt is not one positive number"));
  EXPECT_THAT(make(with([](ModelText& t) { t.parameters[0].upper = 1; })), says("dt is not one positive number"));
  EXPECT_THAT(make(with([](ModelText& t) { t.states[1].name = "px"; })), says("the name px is used twice"));
  EXPECT_THAT(make(with([](ModelText& t) { t.states[1].name = "sin"; })), says("the name sin belongs to the language"));
  EXPECT_THAT(make(with([](ModelText& t) { t.states[1].name = "1a"; })), says("\"1a\" is no name"));
  EXPECT_THAT(make(with([](ModelText& t) {
                t.parameters.push_back({"c", 1, kInfinity});
              })),
              says("is no finite range"));
  EXPECT_THAT(make(with([](ModelText& t) { t.parameters.push_back({"c", 2, 1}); })), says("is no finite range"));
  EXPECT_THAT(make(with([](ModelText& t) { t.equations[0].text = "smooth_gate(px)"; })), says("are for residuals"));
}

// What is known of a compiled model, its equations in continuous time for example, is not known of a text of that name.
TEST(TextModel, IsNotTakenForTheCompiledModelOfTheSameName) {
  ModelText text = PointMass();
  for (const std::string name : {"point_mass", "kinematic_bicycle"}) {
    text.name = name;
    const auto model = MakeTextModel(text);
    EXPECT_EQ(model->name(), name + " (text)");
    EXPECT_EQ(MakeFlow(*model), nullptr);
  }
  EXPECT_NE(MakeFlow(*MakePointMass(0.1)), nullptr);
}

TEST(TextModel, OfTooManyOperationsIsRefused) {
  ModelText text = PointMass();
  for (int i = 0; i < 100; ++i) {
    std::string sum = "0";
    for (int j = 0; j < 1000; ++j) sum += " + px*" + std::to_string(1000 * i + j + 1);
    text.definitions.push_back({"d" + std::to_string(i), {sum}});
  }
  EXPECT_THAT([&] { static_cast<void>(MakeTextModel(text)); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("more than 65536 operations")));
}

// Definitions that each use the one before twice: the derivatives are shared like the values.
TEST(TextModel, ComputesSharedDerivativesOnce) {
  ModelText text = TextModel({{"x", "d60"}}, {"u"}, {{"dt", 0.1, 0.1}}, {{"d0", "sin(x)"}});
  for (int i = 1; i <= 60; ++i) {
    const std::string before = "d" + std::to_string(i - 1);
    text.definitions.push_back({"d" + std::to_string(i), {before + "*" + before + " + u"}});
  }
  EXPECT_LT(MakeTextModel(text)->program().size, 2000);
}

}  // namespace forereach::text_model_test
