// Places at expressions, computed in plain arithmetic, against their values in 256 bits at points of slices.
#include "tests/test.h"

#include "forereach/dynamics/expression.h"
#include "forereach/safety/placement.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::places_oracle_test {

const ExpressionNames kNames{{"q", "r", "s"}, {"u"}, {{"l", 1.5, 1.5}}, {}};
const std::vector<std::vector<std::string>> kPlaces{
    {"l*cos(q)", "l*sin(q)", "s"},
    {"l*cos(q) + cos(q + r)", "l*sin(q) + sin(q + r)", "s*q"},
    {"1e6 + q", "r^2*s", "exp(r)"},
    {"abs(q)", "hypot(r, s)", "max(q, r)"},
};

TEST(PlacesOracle, ContainTheExactPlacesOfEveryState) {
  Body body{-1, {}};
  for (const auto& place : kPlaces) {
    BodyPart& part = body.parts.emplace_back();
    part.points.clear();
    part.places.emplace_back();
    for (const std::string& coordinate : place) part.places[0].push_back({coordinate, 1, 1});
  }
  const Placement placement(Eigen::MatrixXd::Zero(3, 3), body, std::nullopt, 3, kNames);
  const std::vector<std::string> names{"q", "r", "s", "u", "l"};
  std::vector<Expression> expressions;
  for (const auto& place : kPlaces)
    for (const std::string& coordinate : place) expressions.push_back(ParseExpression({coordinate, 1, 1}, names));
  Placement::Sample sample;
  std::vector<Zonotope> places(kPlaces.size());
  for (TracedRandom random(7301); random.Again(1500);) {
    Zonotope slice(random.Vector(3, random.Coin(0.1) ? 100 : 2),
                   random.Matrix(3, random.Integer(0, 12), std::ldexp(1, -random.Integer(1, 40))));
    if (random.Coin())
      for (int k = 0; k < 3; ++k)
        ArraysOf(slice).mutable_slack(k) = std::ldexp(random.Uniform(0, 1), -random.Integer(5, 50));
    const std::vector<double> half_width = HalfWidths(slice);
    placement.Observe(slice, half_width, sample);
    placement.Enclose(sample, places.data());
    Hull hull;
    placement.EncloseHull(sample, hull);
    Placement::Pose pose;
    placement.PoseOver(sample, pose);
    const Hull body = placement.EncloseBody(pose);
    for (int point = 0; point < 6; ++point) {
      const auto weight = [&] { return random.Coin(0.8) ? random.Sign() : random.Uniform(-1, 1); };
      std::vector<Real> values(slice.center().begin(), slice.center().end());
      for (int j = 0; j < slice.num_generators(); ++j) {
        const Real b(weight());
        for (int k = 0; k < 3; ++k) values[static_cast<std::size_t>(k)] += b * Real(slice.generator(k, j));
      }
      for (int k = 0; k < 3; ++k) values[static_cast<std::size_t>(k)] += Real(weight()) * Real(slice.slack(k));
      values.emplace_back(0.0);
      values.emplace_back(1.5);
      const Eigen::Vector3d d = random.Vector(3);
      for (std::size_t i = 0; i < kPlaces.size(); ++i) {
        Real along(0.0), square(0.0);
        for (std::size_t k = 0; k < 3; ++k) {
          const Real at = Evaluate<Real>(expressions[3 * i + k], values, [](double x) { return Real(x); });
          along += Real(d[static_cast<Eigen::Index>(k)]) * at;
          ASSERT_TRUE(abs(at - Real(hull.center[k])) <= Real(hull.half_width[k])) << kPlaces[i][k];
          ASSERT_TRUE(abs(at - Real(body.center[k])) <= Real(body.half_width[k])) << kPlaces[i][k];
          const Real apart = at - Real(pose.middle[k][i]), hair = Real(0x1p-45) * (abs(at) + Real(1.0));
          square += apart * apart;
          ASSERT_TRUE(!pose.is_known || sqrt(square) <= Real(pose.around[i]) + hair) << kPlaces[i][k];
        }
        ASSERT_TRUE(along <= Real(placement.SupportUpper(sample, placement.parts()[i], d))) << i;
        ASSERT_TRUE(along <= Real(places[i].SupportUpper({d.data(), 3}))) << i;
      }
    }
  }
}

}  // namespace forereach::places_oracle_test
