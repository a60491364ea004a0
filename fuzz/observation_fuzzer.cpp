// Observations of few values, so that rows repeat and tie: the search for a contradiction, the choice of those to keep,
// the store and the envelope say what looking at all pairs says, and twice the same.
#include <algorithm>
#include <bit>
#include <optional>

#include "forereach/residual/consistency.h"
#include "forereach/residual/lipschitz_envelope.h"
#include "forereach/residual/observation_store.h"
#include "forereach/residual/retention.h"
#include "forereach/sets/zonotope.h"
#include "fuzz/fuzz.h"

namespace forereach {
namespace {

constexpr int kStates = 2, kVariables = 3;
constexpr double kFar = 4, kRounding = 1e-12;

// Where `exact`, no sum or product of these rounds.
struct Scene {
  Declaration declaration{Eigen::MatrixXd(kStates, kVariables), Eigen::VectorXd(kStates)};
  Observations all;
  bool exact = false, repeats = false;
  int known = 1;  // with which the store begins
  std::size_t most = 1;
  int tail = 1, flat_blocks = 0;
};

Scene Read(FuzzedDataProvider& input) {
  Scene scene;
  scene.exact = !input.ConsumeBool();
  const double unit = scene.exact ? 0.25 : 0.1;
  const auto any = [&](int least, int most) { return unit * input.ConsumeIntegralInRange(least, most); };
  for (int k = 0; k < kStates; ++k) {
    for (int l = 0; l < kVariables; ++l) scene.declaration.lipschitz(k, l) = any(0, 3);
    scene.declaration.noise_bound[k] = any(0, 2);
  }
  const int rows = 1 + input.ConsumeIntegralInRange(0, 47);
  Observations& o = scene.all;
  o = {Eigen::MatrixXd(rows, kVariables), Eigen::MatrixXd(rows, kStates), Eigen::MatrixXd(rows, kStates)};
  for (int i = 0; i < rows; ++i) {
    const int earlier = i - input.ConsumeIntegralInRange(0, 8);  // itself: a row of its own
    for (int l = 0; l < kVariables; ++l) o.z(i, l) = earlier < i && earlier >= 0 ? o.z(earlier, l) : any(-2, 2);
    const bool again = earlier < i && earlier >= 0 && !input.ConsumeBool();
    for (int k = 0; k < kStates; ++k) {
      o.lower(i, k) = again ? o.lower(earlier, k) : any(-2, 2);
      o.upper(i, k) = again ? o.upper(earlier, k) : o.lower(i, k) + any(0, 1);
    }
    scene.repeats |= again;
  }
  scene.known = input.ConsumeIntegralInRange(1, rows);
  scene.most = input.ConsumeIntegralInRange<std::size_t>(1, static_cast<std::size_t>(rows) + 1);
  scene.tail = input.ConsumeIntegralInRange(1, 5);
  scene.flat_blocks = input.ConsumeBool() ? 32 : 0;
  return scene;
}

double Distance(const Scene& scene, int k, int i, int j) {
  return scene.declaration.lipschitz.row(k).dot((scene.all.z.row(i) - scene.all.z.row(j)).cwiseAbs());
}

// v_i of side 0 or 1.
double Value(const Scene& scene, int k, int side, int i) {
  const Observations& o = scene.all;
  return (side == 0 ? o.lower(i, k) : -o.upper(i, k)) - scene.declaration.noise_bound[k];
}

std::optional<Violation> FirstOfAllPairs(const Scene& scene, int k) {
  for (int i = 0; i < scene.all.size(); ++i)
    for (int j = i + 1; j < scene.all.size(); ++j)
      if (const auto violation = TestPair(scene.declaration, scene.all, i, j, k)) return violation;
  return std::nullopt;
}

std::optional<Violation> CheckedViolation(const Scene& scene) {
  const auto found = FindViolation(scene.declaration, scene.all);
  for (int k = 0; k < (found ? found->coordinate : kStates); ++k) Require(!FirstOfAllPairs(scene, k));
  if (!found) return found;
  const auto expected = FirstOfAllPairs(scene, found->coordinate);
  Require(expected.has_value() && found->difference > found->bound);
  const bool is_constant = (scene.declaration.lipschitz.row(found->coordinate).array() == 0).all();
  Require(is_constant ? found->difference >= expected->difference
                      : found->first == expected->first && found->second == expected->second);
  return found;
}

// Whether it gives a bound at its own place that no other gives; of equal ones the first.
bool Attains(const Scene& scene, int j) {
  for (int k = 0; k < kStates; ++k)
    for (int side = 0; side < 2; ++side) {
      bool tightest = true;
      for (int i = 0; i < scene.all.size(); ++i) {
        const double own = Value(scene, k, side, j), there = Value(scene, k, side, i);
        const bool later_equal = i > j && there == own && Distance(scene, k, i, j) == 0;
        tightest &= i == j || later_equal || there - Distance(scene, k, i, j) < own;
      }
      if (tightest) return true;
    }
  return false;
}

std::vector<int> CheckedChoice(const Scene& scene) {
  std::vector<int> kept = MostUseful(scene.declaration, scene.all, scene.most), attaining;
  Require(!kept.empty() && kept.size() <= scene.most && std::ranges::is_sorted(kept, std::ranges::less_equal()));
  for (int i = 0; i < scene.all.size(); ++i)
    if (Attains(scene, i)) attaining.push_back(i);
  if (scene.exact && attaining.size() <= scene.most && static_cast<int>(scene.most) < scene.all.size())
    Require(kept == attaining);
  return kept;
}

// At the place of each observation, what these rows give.
void CheckBounds(const Scene& scene, const ResidualEnclosure& enclosure, const std::vector<int>& rows,
                 std::vector<double>& said) {
  for (int j = 0; j < scene.all.size(); ++j) {
    const Eigen::VectorXd z = scene.all.z.row(j);
    const Zonotope place(z.head(kStates), Eigen::MatrixXd(kStates, 0));
    const std::vector<double> point(kStates, 0);
    ResidualBounds bounds;
    enclosure.Enclose({place, std::span<const double>(z.data() + kStates, kVariables - kStates), point}, bounds);
    for (int k = 0; k < kStates; ++k) {
      double lower = -kInfinity, upper = kInfinity;
      for (const int i : rows) {
        lower = std::max(lower, Value(scene, k, 0, i) - Distance(scene, k, i, j));
        upper = std::min(upper, Distance(scene, k, i, j) - Value(scene, k, 1, i));
      }
      const double is_lower = bounds.lower[static_cast<std::size_t>(k)],
                   is_upper = bounds.upper[static_cast<std::size_t>(k)];
      Require(is_lower <= lower + (scene.exact ? 0 : kRounding) && is_lower >= lower - kRounding);
      Require(is_upper >= upper - (scene.exact ? 0 : kRounding) && is_upper <= upper + kRounding);
      said.insert(said.end(), {is_lower, is_upper});
    }
  }
}

void CheckStore(const Scene& scene, std::vector<double>& said) {
  const std::vector<double> lower(kVariables, -kFar), upper(kVariables, kFar);
  std::vector<int> rows;
  for (int i = 0; i < scene.known; ++i) rows.push_back(i);
  ObservationStore store(scene.declaration, Select(scene.all, rows), lower, upper,
                         {.tail_capacity = scene.tail,
                          .max_observations = scene.most,
                          .envelope = {.max_flat_blocks = scene.flat_blocks}});
  const bool keeps_all = scene.most >= static_cast<std::size_t>(scene.all.size());
  for (int i = scene.known; i < scene.all.size(); ++i) {
    const Eigen::VectorXd z = scene.all.z.row(i), low = scene.all.lower.row(i), high = scene.all.upper.row(i);
    const auto view = [](const Eigen::VectorXd& x) { return std::span(x.data(), static_cast<std::size_t>(x.size())); };
    const auto [id, violation] = store.Insert(view(z), view(low), view(high));
    Require(id == i);
    bool contradicts = false;
    for (int j = 0; j < i; ++j)
      for (int k = 0; k < kStates; ++k) contradicts |= TestPair(scene.declaration, scene.all, j, i, k).has_value();
    Require(violation ? TestPair(scene.declaration, scene.all, violation->first, i, violation->coordinate).has_value()
                      : !contradicts || !keeps_all);
    rows.push_back(i);
  }
  store.Compact();
  const auto snapshot = store.snapshot();
  if (const auto& violation = snapshot.violation())
    for (const int id : {violation->first, violation->second}) Require(std::ranges::count(snapshot.ids(), id) == 1);
  else
    Require(!keeps_all || !FindViolation(scene.declaration, scene.all));
  said.push_back(static_cast<double>(snapshot.size()));
  if (keeps_all) CheckBounds(scene, snapshot, rows, said);
}

std::vector<double> Check(const Scene& scene) {
  std::vector<double> said;
  if (const auto violation = CheckedViolation(scene))
    said = {violation->difference, violation->bound, double(violation->first), double(violation->second)};
  const std::vector<int> kept = CheckedChoice(scene);
  said.insert(said.end(), kept.begin(), kept.end());
  const std::vector<double> lower(kVariables, -kFar), upper(kVariables, kFar);
  const LipschitzEnvelope envelope(scene.declaration, Select(scene.all, kept), lower, upper,
                                   {.max_flat_blocks = scene.flat_blocks});
  CheckBounds(scene, envelope, kept, said);
  CheckStore(scene, said);
  return said;
}

}  // namespace

bool Try(Bytes data) {
  FuzzedDataProvider input(data.data(), data.size());
  const Scene scene = Read(input);
  const std::vector<double> said = Check(scene), again = Check(scene);
  Require(
      std::ranges::equal(said, again, {}, std::bit_cast<std::uint64_t, double>, std::bit_cast<std::uint64_t, double>));
  return scene.repeats;
}

}  // namespace forereach
