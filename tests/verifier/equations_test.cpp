// Derivatives, by hand or by rule, against difference quotients of the equations themselves, in high precision.
#include "tests/test.h"

#include "forereach/dynamics/equations_model.h"
#include "forereach/dynamics/models/named_models.h"
#include "tests/oracle/traced_random.h"
#include "tests/text_models.h"
#include "verifier/equations.h"

namespace forereach::verifier::equations_test {

const Real kStep(0x1p-60), kTolerance(0x1p-90);

std::vector<Real> Moved(std::vector<Real> z, int variable, const Real& step) {
  z[static_cast<std::size_t>(variable)] += step;
  return z;
}

// (f(z + h e) - f(z - h e)) / 2h, off by O(h^2).
template <class Function>
Real Slope(Function f, const std::vector<Real>& z, int variable) {
  return (f(Moved(z, variable, kStep)) - f(Moved(z, variable, -kStep))) / (Real(2.0) * kStep);
}

bool Agree(const Real& a, const Real& b) { return CertainlyBelow(abs(a - b), kTolerance); }

struct Case {
  const char* name;
  std::shared_ptr<const Equations> equations;
  int states, variables;

  friend std::ostream& operator<<(std::ostream& out, const Case& test) { return out << test.name; }
};

Case Text(const char* name, const ModelText& model) {
  const auto states = static_cast<int>(model.states.size());
  return {name, EquationsOf(model), states, states + static_cast<int>(model.inputs.size())};
}

class Derivatives : public testing::TestWithParam<Case> {};

using FirstEntries = std::map<std::pair<int, int>, Real>;
using SecondEntries = std::map<std::array<int, 3>, Real>;

FirstEntries FirstOf(const Equations& equations, const std::vector<Real>& z) {
  FirstEntries entries;
  for (const auto& [output, variable, value] : equations.First(z)) entries[{output, variable}] = value;
  return entries;
}
SecondEntries SecondOf(const Equations& equations, const std::vector<Real>& z) {
  SecondEntries entries;
  for (const auto& [output, row, column, value] : equations.Second(z)) {
    EXPECT_LE(row, column);
    EXPECT_TRUE((entries.emplace(std::array{output, row, column}, value).second));
  }
  return entries;
}

TEST_P(Derivatives, AreThoseOfTheEquations) {
  const auto& [name, equations, states, variables] = GetParam();
  const Equations& of = *equations;
  for (TracedRandom random(71); random.Again(4);) {
    std::vector<Real> z;
    for (int l = 0; l < variables; ++l) z.emplace_back(random.Uniform(-1.4, 1.4));
    FirstEntries first = FirstOf(*equations, z);
    SecondEntries second = SecondOf(*equations, z);
    for (int l = 0; l < variables; ++l) {
      const auto value = [&](int k) {
        return [k, &of](const std::vector<Real>& at) { return of.Value(at)[static_cast<std::size_t>(k)]; };
      };
      for (int k = 0; k < states; ++k) EXPECT_TRUE(Agree((first[{k, l}]), Slope(value(k), z, l))) << k << ", " << l;
    }
    for (int j = 0; j < states; ++j) {
      FirstEntries above = FirstOf(*equations, Moved(z, j, kStep)), below = FirstOf(*equations, Moved(z, j, -kStep));
      for (int k = 0; k < states; ++k)
        for (int l = 0; l <= j; ++l) {
          const Real slope = (above[{k, l}] - below[{k, l}]) / (Real(2.0) * kStep);
          EXPECT_TRUE(Agree((second[{k, l, j}]), slope)) << k << ", " << l << ", " << j;
        }
    }
  }
}

TEST_P(Derivatives, BoundTheirRangeOverABox) {
  const auto& [name, equations, states, variables] = GetParam();
  for (TracedRandom random(72); random.Again(20);) {
    std::vector<Real> box, point;
    for (int l = 0; l < variables; ++l) {
      const double lower = random.Uniform(-1.4, 1.2), upper = lower + random.Uniform(0, 0.2);
      box.push_back(Real::FromTo(lower, upper));
      point.emplace_back(random.Uniform(lower, upper));
    }
    SecondEntries ranges = SecondOf(*equations, box);
    for (const auto& [place, value] : SecondOf(*equations, point)) {
      EXPECT_TRUE(CertainlyAtMost(ranges[place].lower(), value));
      EXPECT_TRUE(CertainlyAtMost(value, ranges[place].upper()));
    }
  }
}

using Integrator = ModelText::Integrator;

INSTANTIATE_TEST_SUITE_P(Models, Derivatives,
                         testing::Values(Case{"point_mass", EquationsOf(*MakePointMass(0.15)), 4, 6},
                                         Case{"kinematic_bicycle", EquationsOf(*MakeKinematicBicycle(0.1, 2.5)), 6, 8},
                                         Text("point_mass_text", PointMassText(0.15)),
                                         Text("bicycle_text", BicycleText(0.1, 2.5)),
                                         Text("quadrotor_euler", QuadrotorText(Integrator::kEuler)),
                                         Text("quadrotor_midpoint", QuadrotorText(Integrator::kMidpoint)),
                                         Text("quadrotor_rk4", QuadrotorText(Integrator::kRk4))),
                         [](const auto& test) { return test.param.name; });

struct Unicycle {
  static constexpr int kStates = 1, kInputs = 1;
  static constexpr const char* kName = "unicycle";
  static constexpr std::array<const char*, 1> kStateNames{"x"}, kInputNames{"v"};
  static constexpr std::array<const char*, 0> kParameterNames{};
  template <class T>
  static constexpr void Step(std::span<const T>, std::span<const T> z, std::span<T> next) {
    next[0] = z[0] + z[1];
  }
  [[nodiscard]] std::array<double, 0> parameters() const { return {}; }
};

TEST(Equations, AnUnknownModelHasNoEquations) { EXPECT_FALSE(EquationsOf(EquationsModel<Unicycle>(Unicycle{}))); }

}  // namespace forereach::verifier::equations_test
