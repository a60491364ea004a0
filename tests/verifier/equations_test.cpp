// Derivatives written by hand against difference quotients of the equations themselves, in high precision.
#include <map>

#include <gtest/gtest.h>

#include "certifier/dynamics/equations_model.h"
#include "certifier/dynamics/models.h"
#include "tests/oracle/random.h"
#include "verifier/equations.h"

namespace forereach::verifier {
namespace {

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

class Derivatives : public testing::TestWithParam<std::shared_ptr<const NominalModel>> {};

TEST_P(Derivatives, AreThoseOfTheEquations) {
  const NominalModel& model = *GetParam();
  const auto equations = EquationsOf(model);
  ASSERT_TRUE(equations);
  Random random(71);
  SCOPED_TRACE(random.trace());
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Real> z;
    for (int l = 0; l < model.num_variables(); ++l) z.emplace_back(random.Uniform(-1.4, 1.4));
    std::map<std::pair<int, int>, Real> first;
    for (const auto& [output, variable, value] : equations->First(z)) first[{output, variable}] = value;
    std::map<std::array<int, 3>, Real> second;
    for (const auto& [output, row, column, value] : equations->Second(z)) {
      EXPECT_LE(row, column);
      second[{output, row, column}] = value;
    }
    for (int k = 0; k < model.num_states(); ++k)
      for (int l = 0; l < model.num_variables(); ++l) {
        const auto value = [&](const std::vector<Real>& at) {
          return equations->Value(at)[static_cast<std::size_t>(k)];
        };
        EXPECT_TRUE(Agree((first[{k, l}]), Slope(value, z, l))) << k << ", " << l;
        for (int j = l; j < model.num_variables(); ++j) {
          const auto slope = [&](const std::vector<Real>& at) {
            for (const auto& [output, variable, entry] : equations->First(at))
              if (output == k && variable == l) return entry;
            return Real();
          };
          EXPECT_TRUE(Agree((second[{k, l, j}]), Slope(slope, z, j))) << k << ", " << l << ", " << j;
        }
      }
  }
}

TEST_P(Derivatives, BoundTheirRangeOverABox) {
  const NominalModel& model = *GetParam();
  const auto equations = EquationsOf(model);
  Random random(72);
  SCOPED_TRACE(random.trace());
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<Real> box, point;
    for (int l = 0; l < model.num_variables(); ++l) {
      const double lower = random.Uniform(-1.4, 1.2), upper = lower + random.Uniform(0, 0.2);
      box.push_back(Real::FromTo(lower, upper));
      point.emplace_back(random.Uniform(lower, upper));
    }
    const auto ranges = equations->Second(box), values = equations->Second(point);
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      EXPECT_TRUE(CertainlyAtMost(ranges[i].value.lower(), values[i].value));
      EXPECT_TRUE(CertainlyAtMost(values[i].value, ranges[i].value.upper()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Models, Derivatives, testing::Values(MakePointMass(0.15), MakeKinematicBicycle(0.1, 2.5)),
                         [](const auto& test) { return test.param->name(); });

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

TEST(Equations, OfAnUnknownModelAreNone) { EXPECT_FALSE(EquationsOf(EquationsModel<Unicycle>(Unicycle{}))); }

}  // namespace
}  // namespace forereach::verifier
