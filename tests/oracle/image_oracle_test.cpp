// The image of a slice's generators against exact rationals: for no matrix within the Jacobian's error does what the
// plain image leaves out exceed the slack.
#include "tests/test.h"

#include "forereach/dynamics/equations_model.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/reach/propagator.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::image_oracle_test {

// Rows of the Jacobian that no shipped model has: the last entry of a sum is one. Row 1 copies a coordinate.
struct LastIsOne {
  static constexpr int kStates = 3, kInputs = 1;
  static constexpr const char* kName = "last_is_one";
  static constexpr std::array<const char*, kStates> kStateNames{"a", "b", "c"};
  static constexpr std::array<const char*, kInputs> kInputNames{"u"};
  static constexpr std::array<const char*, 1> kParameterNames{"factor"};

  template <class T>
  static constexpr void Step(std::span<const T> parameters, std::span<const T> z, std::span<T> next) {
    next[0] = parameters[0] * z[0] + z[1];
    next[1] = z[1] + parameters[0] * z[3];
    next[2] = z[0] + z[1] + z[2];
  }
  [[nodiscard]] std::array<double, 1> parameters() const { return {0.7}; }
};

// A slice of any scale, a Jacobian that is anything, and the largest half-widths that the error is made for.
struct Case {
  Zonotope slice;
  Expansion expansion;
  ExpansionError off;
  StepError error;

  Case(Random& random, const Program& program) {
    const double scale = std::ldexp(1, random.Coin(0.2) ? random.Integer(-1060, -900) : random.Integer(-30, 30));
    slice = Zonotope(random.Vector(program.states), random.Matrix(program.states, random.Integer(0, 30), scale));
    for (int k = 0; k < program.states; ++k)
      if (random.Coin(0.3)) ArraysOf(slice).mutable_slack(k) = random.Uniform(0, scale);
    for (std::size_t e = 0; e < static_cast<std::size_t>(program.num_first); ++e) {
      const bool is_one = program.jacobian[e].is_one;
      expansion.jacobian[e] = is_one ? 1 : random.Coin(0.1) ? 0 : random.Uniform(-3, 3);
      off.jacobian[e] = is_one || random.Coin() ? 0 : random.Uniform(0, 1e-15);
      off.jacobian_size[e] = std::abs(expansion.jacobian[e]) * (random.Coin() ? 1 : 1.5);
    }
    std::array<double, kMaxVariables> half_width{};
    Propagator::HalfWidths(slice, half_width.data());
    if (random.Coin())
      for (double& r : half_width) r *= random.Uniform(1, 1000);
    error = BoundStepError(program, off, half_width);
  }
};

// max |(J' (G b + diag(s) b') - fl(J G) b)_k| for one J' within the error of J.
Rational LeftOut(Random& random, const Program& program, const Case& c, const Zonotope& image, int k) {
  std::vector<Rational> row(static_cast<std::size_t>(program.states), Rational(0));
  for (std::size_t e = 0; e < static_cast<std::size_t>(program.num_first); ++e) {
    const Program::First& entry = program.jacobian[e];
    if (entry.row != k || entry.column >= program.states) continue;
    const double part = random.Coin(0.7) ? random.Sign() : random.Uniform(-1, 1);
    row[static_cast<std::size_t>(entry.column)] =
        Rational(c.expansion.jacobian[e]) + Rational(part) * Rational(c.off.jacobian[e]);
  }
  Rational sum = 0;
  for (int l = 0; l < program.states; ++l) sum += abs(row[static_cast<std::size_t>(l)]) * Rational(c.slice.slack(l));
  for (int j = 0; j < c.slice.num_generators(); ++j) {
    Rational difference = -Rational(image.generator(k, j));
    for (int l = 0; l < program.states; ++l)
      difference += row[static_cast<std::size_t>(l)] * Rational(c.slice.generator(l, j));
    sum += abs(difference);
  }
  return sum;
}

TEST(ImageOracle, SlackBoundsTheRoundingErrorOfTheImage) {
  TracedRandom random(614);
  const std::shared_ptr<const NominalModel> last_is_one = std::make_shared<EquationsModel<LastIsOne>>(LastIsOne());
  for (const auto& model : {MakeKinematicBicycle(0.1, 2.5), MakePointMass(0.15), last_is_one})
    for (int trial = 0; trial < 2000; ++trial) {
      const Program& program = model->program();
      const Case c(random, program);
      Zonotope image;
      ImageSums sums;
      model->Map(c.expansion, c.error, c.slice, image, sums);
      for (int k = 0; k < program.states; ++k)
        ASSERT_LE(LeftOut(random, program, c, image, k), Rational(image.slack(k)) * Rational(1 + 0x1p-44))
            << model->name() << " trial " << trial << " row " << k;
    }
}

// With the error forgotten, the test above would notice.
TEST(ImageOracle, WithoutItsRoundingErrorTheImageWouldBeTooSmall) {
  Random random(615);
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  int beyond = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Case c(random, model->program());
    c.error = {};
    Zonotope image;
    ImageSums sums;
    model->Map(c.expansion, c.error, c.slice, image, sums);
    beyond += LeftOut(random, model->program(), c, image, 0) > Rational(image.slack(0)) * Rational(1 + 0x1p-44);
  }
  EXPECT_GT(beyond, 50);
}

TEST(ImageOracle, RowsThatCopyACoordinateAddNothing) {
  Random random(616);
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  const Case c(random, model->program());
  int copies = 0;
  for (int k = 0; k < model->num_states(); ++k) copies += c.error.image[static_cast<std::size_t>(k)] == 0;
  EXPECT_EQ(copies, 2);  // acceleration and steering, whose inputs are points
}

}  // namespace forereach::image_oracle_test
