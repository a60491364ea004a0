#include "forereach/residual/affine_set.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "forereach/numerics/size.h"

namespace forereach {
namespace {

// An observation counts as violated at a vertex from this part of its width on, or of the largest value.
constexpr double kOfWidth = 0x1p-44, kOfValue = 0x1p-50;
// Coefficients of an observation by others below this are taken for zero; rows nearer to a hyperplane, for in it.
constexpr double kNoCoefficient = 0x1p-36, kFlat = 1e-9;
// A search looks along a direction that is off by this share, so that no weight is zero: ties would let it go in
// circles.
constexpr double kPerturbed = 0x1p-40;
constexpr int kMostSteps = 400, kMostStepsOfAQuery = 24;
constexpr int kSamples = 32;  // of the domain, and of the data
// Up to this many observations a query looks at all of them.
constexpr std::size_t kFew = 128;
constexpr std::size_t kNear = 64;

}  // namespace

// L U = P Phi of a basis, by elimination with the largest pivot of each column.
class AffineSet::Factors {
 public:
  Factors(const AffineSet& set, const Basis& basis) : n_(set.size_) {
    for (std::size_t i = 0; i < n_; ++i) {
      std::ranges::copy(set.phi(basis[i]), a_[i].begin());
      order_[i] = i;
    }
    for (std::size_t c = 0; c < n_ && is_regular_; ++c) Eliminate(c);
  }

  [[nodiscard]] bool is_regular() const { return is_regular_; }

  /** x with Phi x = y. */
  [[nodiscard]] Vector Solve(const Vector& y) const {
    Vector x{};
    for (std::size_t i = 0; i < n_; ++i) {
      x[i] = y[order_[i]];
      for (std::size_t j = 0; j < i; ++j) x[i] -= a_[i][j] * x[j];
    }
    for (std::size_t i = n_; i-- > 0;) {
      for (std::size_t j = i + 1; j < n_; ++j) x[i] -= a_[i][j] * x[j];
      x[i] /= a_[i][i];
    }
    return x;
  }

  /** w with Phi^T w = d: d as a combination of the rows. */
  [[nodiscard]] Vector Combine(std::span<const double> d) const {
    Vector x{}, w{};
    for (std::size_t i = 0; i < n_; ++i) {
      x[i] = d[i];
      for (std::size_t j = 0; j < i; ++j) x[i] -= a_[j][i] * x[j];
      x[i] /= a_[i][i];
    }
    for (std::size_t i = n_; i-- > 0;) {
      for (std::size_t j = i + 1; j < n_; ++j) x[i] -= a_[j][i] * x[j];
      w[order_[i]] = x[i];
    }
    return w;
  }

 private:
  void Eliminate(std::size_t c) {
    std::size_t pivot = c;
    for (std::size_t i = c + 1; i < n_; ++i)
      if (std::abs(a_[i][c]) > std::abs(a_[pivot][c])) pivot = i;
    std::swap(a_[c], a_[pivot]);
    std::swap(order_[c], order_[pivot]);
    is_regular_ = std::abs(a_[c][c]) > 0 && std::abs(a_[c][c]) < kInfinity;
    for (std::size_t i = c + 1; i < n_ && is_regular_; ++i) {
      const double factor = a_[i][c] /= a_[c][c];
      for (std::size_t j = c + 1; j < n_; ++j) a_[i][j] -= factor * a_[c][j];
    }
  }

  std::size_t n_;
  std::array<Vector, kMostUnknowns> a_;
  std::array<std::size_t, kMostUnknowns> order_{};
  bool is_regular_ = true;
};

namespace {

double Dot(std::span<const double> a, const double* b) {
  double sum = 0;
  for (std::size_t l = 0; l < a.size(); ++l) sum += a[l] * b[l];
  return sum;
}

}  // namespace

AffineSet::AffineSet(std::vector<int> columns, std::span<const double> domain_lower,
                     std::span<const double> domain_upper, std::span<const double> rest)
    : columns_(std::move(columns)), size_(columns_.size() + 1) {
  for (const int l : columns_) {
    domain_lower_.push_back(domain_lower[ToSize(l)]);
    domain_upper_.push_back(domain_upper[ToSize(l)]);
  }
  for (std::size_t l = 0; l < rest.size(); ++l) {
    if (rest[l] == 0) continue;
    middle_[rest_.size()] = domain_lower[l] / 2 + domain_upper[l] / 2;
    rest_variables_.push_back(static_cast<int>(l));
    rest_.push_back(rest[l]);
    rest_lower_.push_back(domain_lower[l]);
    rest_upper_.push_back(domain_upper[l]);
  }
}

void AffineSet::Add(int id, std::span<const double> z, double lower, double upper) {
  // An observation that says nothing, or NaN, bounds nothing: without it A is only larger.
  if (!(-kInfinity < lower && lower <= upper && upper < kInfinity)) return;
  for (const int l : columns_) phi_.push_back(z[ToSize(l)]);
  phi_.push_back(1);
  for (const int l : rest_variables_) places_.push_back(z[ToSize(l)]);
  lower_.push_back(lower);
  upper_.push_back(upper);
  all_.push_back(static_cast<int>(ids_.size()));
  ids_.push_back(id);
  if (HasRest()) seen_lower_.resize(ids_.size()), seen_upper_.resize(ids_.size());
  size_of_values_ = std::max({size_of_values_, std::abs(lower), std::abs(upper)});
}

bool AffineSet::LatestMayNarrow() const {
  if (!is_bounded_) return true;
  const auto last = ids_.size() - 1;
  const Place place = PlaceOf(last);
  // With a rest, queries look at every observation: the hull, which is seen from the middle, is derived from it, and
  // the vertices, where queries begin, now and then.
  if (HasRest() && last > derived_ + derived_ / 4) return true;
  for (std::size_t v = 0; v < vertices_.size(); ++v) {
    if (HasRest() && aims_[v].from != middle_) continue;
    const double value = Dot(phi(static_cast<int>(last)), vertices_[v].theta.data());
    const double apart = Apart(place.data(), aims_[v].from.data());
    if (!(lower_[last] - apart <= value && value <= upper_[last] + apart)) return true;
  }
  return false;
}

// At least d(a, b).
double AffineSet::Apart(const double* a, const double* b) const noexcept {
  if (!HasRest()) return 0;
  double sum = 0;
  for (std::size_t r = 0; r < rest_.size(); ++r) sum += rest_[r] * std::abs(a[r] - b[r]);
  // Of at most kMaxVariables terms, each rounded as many times and four: below 2^-48 of them.
  return sum * (1 + 0x1p-46) + 0x1p-1000;
}

// From the place of any query or observation.
double AffineSet::FarthestFrom(const double* place) const {
  Place corner{};
  for (std::size_t r = 0; r < rest_.size(); ++r)
    corner[r] = place[r] - rest_lower_[r] > rest_upper_[r] - place[r] ? rest_lower_[r] : rest_upper_[r];
  return Apart(place, corner.data());
}

AffineSet::Place AffineSet::PlaceOf(std::size_t i) const {
  Place place{};
  for (std::size_t r = 0; r < rest_.size(); ++r) place[r] = places_[i * rest_.size() + r];
  return place;
}

// @param lower, upper an entry for each observation; without a rest not used.
AffineSet::Ends AffineSet::EndsFrom(const Place& from, double* lower, double* upper) const noexcept {
  if (!HasRest()) return {lower_.data(), upper_.data()};
  for (std::size_t i = 0; i < lower_.size(); ++i) {
    const double apart = Apart(&places_[i * rest_.size()], from.data());
    lower[i] = SubDown(lower_[i], apart);
    upper[i] = AddUp(upper_[i], apart);
  }
  return {lower, upper};
}

// The rows that are farthest from the span of those before them, in columns that are scaled to the data's spread (a
// column without any is taken for zero); how many there are.
std::size_t AffineSet::ChooseBasis(Basis& basis) {
  const std::size_t count = ids_.size(), q = size_;
  unexcited_.clear();
  std::vector<double> middle(q - 1), spread(q - 1), rows(count * q);
  for (std::size_t l = 0; l + 1 < q; ++l) {
    double least = kInfinity, most = -kInfinity;
    for (std::size_t i = 0; i < count; ++i)
      least = std::min(least, phi_[i * q + l]), most = std::max(most, phi_[i * q + l]);
    middle[l] = least / 2 + most / 2;
    spread[l] = most / 2 - least / 2;
    // Spread of rounding size would make a matrix that is regular by its rounding alone.
    if (!(spread[l] > kFlat * std::abs(middle[l]))) spread[l] = kInfinity;
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t l = 0; l + 1 < q; ++l) rows[i * q + l] = (phi_[i * q + l] - middle[l]) / spread[l];
    rows[i * q + q - 1] = 1;
  }
  std::vector<Vector> units;
  const auto remove = [&](double* row) {  // its part along the last unit vector
    const double along = Dot({row, q}, units.back().data());
    for (std::size_t l = 0; l < q; ++l) row[l] -= along * units.back()[l];
  };
  while (units.size() < q) {
    std::size_t farthest = 0;
    double most = 0;
    for (std::size_t i = 0; i < count; ++i) {
      double* const row = &rows[i * q];
      if (!units.empty()) remove(row);
      if (const double square = Dot({row, q}, row); square > most) most = square, farthest = i;
    }
    if (!(most > kFlat * kFlat)) break;
    basis[units.size()] = static_cast<int>(farthest);
    Vector unit{};
    for (std::size_t l = 0; l < q; ++l) unit[l] = rows[farthest * q + l] / std::sqrt(most);
    units.push_back(unit);
  }
  if (units.size() == q) return q;
  // What is left of the axis that is farthest from the span is orthogonal to all rows.
  Vector normal{};
  double longest = 0;
  for (std::size_t axis = 0; axis + 1 < q; ++axis) {
    Vector left{};
    left[axis] = 1;
    for (const Vector& unit : units) {
      const double along = Dot({left.data(), q}, unit.data());
      for (std::size_t l = 0; l < q; ++l) left[l] -= along * unit[l];
    }
    if (const double square = Dot({left.data(), q}, left.data()); square > longest) longest = square, normal = left;
  }
  double largest = 0;
  for (std::size_t l = 0; l + 1 < q; ++l) {
    if (spread[l] < kInfinity) normal[l] /= spread[l];
    largest = std::max(largest, std::abs(normal[l]));
  }
  for (std::size_t l = 0; l + 1 < q; ++l) unexcited_.push_back(largest > 0 ? normal[l] / largest : 0);
  return units.size();
}

bool AffineSet::BoundParameters(const Basis& basis) {
  const Factors factors(*this, basis);
  if (!factors.is_regular()) return false;
  const std::size_t q = size_;
  std::array<Vector, kMostUnknowns> inverse;  // by columns
  for (std::size_t j = 0; j < q; ++j) {
    Vector unit{};
    unit[j] = 1;
    inverse[j] = factors.Solve(unit);
  }
  // R is any matrix: what it lacks of the inverse is bounded here outward, and the proof needs no more (soundness
  // 3.19).
  std::array<Vector, kMostUnknowns> error;  // |I - R Phi|
  Vector most{};                            // |R| |y|
  for (std::size_t l = 0; l < q; ++l) {
    for (std::size_t m = 0; m < q; ++m) {
      Interval entry(l == m ? 1.0 : 0.0);
      for (std::size_t j = 0; j < q; ++j) entry = entry - Interval(inverse[j][l]) * Interval(phi(basis[j])[m]);
      error[l][m] = entry.Magnitude();
    }
    most[l] = 0x1p-1000;
    for (std::size_t j = 0; j < q; ++j) {
      const auto i = ToSize(basis[j]);
      // As seen from wherever it may be.
      const double size = AddUp(std::max(std::abs(lower_[i]), std::abs(upper_[i])), FarthestFrom(PlaceOf(i).data()));
      most[l] = AddUp(most[l], MulUp(std::abs(inverse[j][l]), size));
    }
  }
  const auto next = [&](const Vector& v, std::size_t l) {
    double sum = most[l];
    for (std::size_t m = 0; m < q; ++m) sum = AddUp(sum, MulUp(error[l][m], v[m]));
    return sum;
  };
  Vector v = most;
  for (int round = 0; round < 4; ++round) {
    Vector grown{};
    // A guess at a fixed point, with room for the rounding of the test below, which alone proves it.
    for (std::size_t l = 0; l < q; ++l) grown[l] = 1.25 * next(v, l);
    v = grown;
  }
  limit_ = v;
  for (std::size_t l = 0; l < q; ++l)
    // |R| |y| + |I - R Phi| v <= v: the spectral radius is below 1, so |theta| <= v for every theta of A.
    if (!(next(v, l) <= v[l] && v[l] < kInfinity)) return false;
  return true;
}

void AffineSet::Perturb(const Vector& weights, const Basis& basis, Vector& direction) const noexcept {
  double largest = 0;
  for (const double weight : weights) largest = std::max(largest, std::abs(weight));
  for (std::size_t j = 0; j < size_; ++j) {
    const double share = 0.5 + 0.5 * static_cast<double>(j + 1) / static_cast<double>(size_);
    const double off = std::copysign(kPerturbed * share * largest, weights[j]);
    for (std::size_t l = 0; l < size_; ++l) direction[l] += off * phi(basis[j])[l];
  }
}

AffineSet::Climb AffineSet::Search(const Vector& direction, const Ends& ends, std::span<const int> rows,
                                   const Basis& start, int most_steps) const noexcept {
  Climb found;
  found.basis = start;
  const std::size_t q = size_;
  Vector perturbed = direction;
  for (int step = 0;; ++step) {
    const Factors factors(*this, found.basis);
    if (!factors.is_regular()) break;
    // Weights of zero let the simplex walk in circles; the perturbed direction has none. Its weights only choose the
    // way.
    if (step == 0) Perturb(factors.Combine({direction.data(), q}), start, perturbed);
    found.weights = factors.Combine({direction.data(), q});
    const Vector weights = factors.Combine({perturbed.data(), q});
    Vector y{};
    for (std::size_t j = 0; j < q; ++j) {
      const auto i = ToSize(found.basis[j]);
      y[j] = weights[j] < 0 ? ends.lower[i] : ends.upper[i];
    }
    found.theta = factors.Solve(y);
    if (step == most_steps) break;
    int entering = -1;
    double worst = 0, sign = 0;
    for (const int row : rows) {
      const auto i = ToSize(row);
      const double value = Dot(phi(row), found.theta.data());
      const double above = value - ends.upper[i], below = ends.lower[i] - value;
      if (!(std::max(above, below) > worst)) continue;
      // A violation of rounding size is none: the climb would not end.
      const double allowed = kOfWidth * (ends.upper[i] - ends.lower[i]) + kOfValue * size_of_values_;
      const double violation = std::max(above, below) - allowed;
      if (!(violation > worst)) continue;
      if (std::find(found.basis.begin(), found.basis.begin() + std::ptrdiff_t(q), row) !=
          found.basis.begin() + std::ptrdiff_t(q))
        continue;
      worst = violation;
      sign = above > below ? 1 : -1;
      entering = row;
    }
    if (entering < 0) break;
    const Vector alpha = factors.Combine(phi(entering));
    std::size_t leaving = q;
    double least = kInfinity;
    for (std::size_t j = 0; j < q; ++j) {
      const double towards = weights[j] < 0 ? -sign * alpha[j] : sign * alpha[j];
      if (!(towards > kNoCoefficient)) continue;
      const double ratio = std::abs(weights[j]) / towards;
      if (ratio < least || (ratio == least && towards > std::abs(alpha[leaving]))) least = ratio, leaving = j;
    }
    if (leaving == q) {
      found.contradicted = entering;
      break;
    }
    found.basis[leaving] = entering;
  }
  return found;
}

double AffineSet::SupportUpper(const Vector& direction, const Ends& ends, const Climb& found) const noexcept {
  double sum = 0;
  std::array<Interval, kMostUnknowns> rest;
  std::ranges::copy(direction, rest.begin());
  for (std::size_t j = 0; j < size_; ++j) {
    const auto i = ToSize(found.basis[j]);
    const double weight = found.weights[j];
    // The rule that proves: true for any weights that are numbers, so nothing above has to be.
    if (!(std::abs(weight) < kInfinity)) return kInfinity;
    sum = AddUp(sum, MulUp(weight, weight < 0 ? ends.lower[i] : ends.upper[i]));
    for (std::size_t l = 0; l < size_; ++l) rest[l] = rest[l] - Interval(weight) * Interval(phi(found.basis[j])[l]);
  }
  for (std::size_t l = 0; l < size_; ++l) sum = AddUp(sum, MulUp(rest[l].Magnitude(), limit_[l]));
  return sum < kInfinity ? sum : kInfinity;
}

// Where a search along this direction begins. With a rest, a vertex that was seen from elsewhere may lie far out: there
// it is that of the direction that is most alike.
const AffineSet::Basis& AffineSet::Nearest(const Vector& direction) const noexcept {
  if (HasRest()) return vertices_[MostAlike(direction, aims_)].basis;
  const Vertex* nearest = vertices_.data();
  double most = -kInfinity;
  for (const Vertex& vertex : vertices_)
    if (const double value = Dot({vertex.theta.data(), size_}, direction.data()); value > most)
      most = value, nearest = &vertex;
  return nearest->basis;
}

std::size_t AffineSet::MostAlike(const Vector& direction, std::span<const Aim> aims) const noexcept {
  std::size_t nearest = 0;
  double least = kInfinity;
  for (std::size_t v = 0; v < aims.size(); ++v) {
    const Vector& other = aims[v].direction;
    double apart = std::abs(other[size_ - 1] - direction[size_ - 1]);
    for (std::size_t l = 0; l + 1 < size_; ++l)
      apart += std::abs(other[l] - direction[l]) / (domain_upper_[l] - domain_lower_[l]);
    if (apart < least) least = apart, nearest = v;
  }
  return nearest;
}

// Along every axis, then at points of the domain and of the data; each in both senses.
std::vector<AffineSet::Aim> AffineSet::Aims() const {
  std::vector<Aim> all;
  for (std::size_t l = 0; l < size_; ++l) all.push_back({{}, middle_}), all.back().direction[l] = 1;
  constexpr std::array kPrimes{2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37};
  for (int i = 1; i <= kSamples; ++i) {
    Aim aim{{}, middle_};
    for (std::size_t l = 0; l + 1 < size_; ++l) {
      double digit = 1, share = 0;  // the van der Corput sequence to a prime base
      for (int left = i; left > 0; left /= kPrimes[l]) share += (digit /= kPrimes[l]) * (left % kPrimes[l]);
      aim.direction[l] = domain_lower_[l] + share * (domain_upper_[l] - domain_lower_[l]);
      const auto r = std::ranges::find(rest_variables_, columns_[l]) - rest_variables_.begin();
      if (r < std::ssize(rest_variables_)) aim.from[static_cast<std::size_t>(r)] = aim.direction[l];
    }
    aim.direction[size_ - 1] = 1;
    all.push_back(aim);
  }
  const std::size_t stride = ids_.size() / ToSize(kSamples) + 1;
  for (std::size_t i = 0; i < ids_.size(); i += stride) {
    all.push_back({{}, PlaceOf(i), static_cast<int>(i)});
    std::ranges::copy(phi(static_cast<int>(i)), all.back().direction.begin());
  }
  for (std::size_t i = all.size(); i-- > 0;) {
    Aim opposite = all[i];
    for (double& entry : opposite.direction) entry = -entry;
    all.push_back(opposite);
  }
  return all;
}

bool AffineSet::Prove(const Climb& found, const Ends& ends, int seen_from) {
  const auto i = ToSize(found.contradicted);
  const Factors factors(*this, found.basis);
  Climb up = found, down = found;
  up.weights = factors.Combine(phi(found.contradicted));
  Vector along{}, against{};
  std::ranges::copy(phi(found.contradicted), along.begin());
  for (std::size_t l = 0; l < size_; ++l) down.weights[l] = -up.weights[l], against[l] = -along[l];
  const double gap = std::max(SubDown(ends.lower[i], SupportUpper(along, ends, up)),
                              SubDown(-SupportUpper(against, ends, down), ends.upper[i]));
  // Both sides outward: what the others say of phi . theta misses what this one shows, so A is empty (F).
  if (!(gap > 0)) return false;
  std::vector<std::size_t> order(size_);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, std::ranges::greater{}, [&](std::size_t j) { return std::abs(up.weights[j]); });
  contradiction_ = AffineContradiction{-1, {ids_[i]}, gap};
  for (const std::size_t j : order) contradiction_->rows.push_back(ids_[ToSize(found.basis[j])]);
  if (HasRest() && seen_from >= 0 && std::ranges::count(contradiction_->rows, ids_[ToSize(seen_from)]) == 0)
    contradiction_->rows.push_back(ids_[ToSize(seen_from)]);
  return true;
}

void AffineSet::SetHull() {
  const Ends ends = EndsFrom(middle_, seen_lower_.data(), seen_upper_.data());
  for (std::size_t l = 0; l < size_; ++l) {
    Vector axis{}, opposite{};
    axis[l] = 1;
    opposite[l] = -1;
    const Climb least = Search(opposite, ends, all_, Nearest(opposite), kMostSteps),
                most = Search(axis, ends, all_, Nearest(axis), kMostSteps);
    hull_[l] = {-SupportUpper(opposite, ends, least), SupportUpper(axis, ends, most)};
    if (l + 1 < size_) TestSlope(l, least, most);
    const double size = hull_[l].Magnitude();
    // Coarse on purpose: whoever derives the hull again, with other rounding, takes the same slope. Any slope is sound.
    const double unit = std::ldexp(1.0, std::max(std::ilogb(size), -900) - 16);
    slope_[l] = hull_[l].IsFinite() && size > 0 ? std::nearbyint(hull_[l].Middle() / unit) * unit : 0;
    reach_[l] = hull_[l].DistanceUpper(slope_[l]);
    // M is the same wherever it is seen from, b + g is not.
    limit_[l] = std::min(limit_[l], l + 1 < size_ ? size : AddUp(size, FarthestFrom(middle_.data())));
  }
}

void AffineSet::TestSlope(std::size_t l, const Climb& least, const Climb& most) {
  const double size = std::max(hull_[l].lower, -hull_[l].upper);
  // The whole hull lies beyond what is declared of the slope (soundness 3.19): data refute it.
  if (contradiction_ || most_[l] == 0 || !(size > most_[l])) return;
  contradiction_ = AffineContradiction{-1, {}, size, most_[l]};
  const Basis& basis = (hull_[l].lower > most_[l] ? least : most).basis;
  for (std::size_t j = 0; j < size_; ++j) contradiction_->rows.push_back(ids_[ToSize(basis[j])]);
}

void AffineSet::Derive() {
  if (contradiction_) return;
  is_bounded_ = false;
  if (!HasRest()) vertices_.clear(), aims_.clear();
  active_.clear();
  Basis basis{};
  const std::size_t rank = ids_.empty() ? 0 : ChooseBasis(basis);
  if (rank == size_ && BoundParameters(basis)) FindVertices(basis);
  if (!is_bounded_) {
    vertices_.clear();
    aims_.clear();
    active_.assign(basis.begin(), basis.begin() + std::ptrdiff_t(rank));
    active_.insert(active_.end(), all_.end() - std::ptrdiff_t(std::min(all_.size(), kMostKept / 2)), all_.end());
    SortActive();
  }
  Forget();
  derived_ = ids_.size();
}

void AffineSet::SortActive() {
  std::ranges::sort(active_);
  active_.erase(std::unique(active_.begin(), active_.end()), active_.end());
}

void AffineSet::FindVertices(const Basis& start) {
  // With a rest, those of the last time are where searches begin, if there are any.
  const std::vector<Vertex> last = std::exchange(vertices_, {});
  const std::vector<Aim> last_aims = std::exchange(aims_, {});
  if (last.empty()) vertices_.push_back({start, {}}), aims_.push_back({});
  for (const Aim& aim : Aims()) {
    const Ends ends = EndsFrom(aim.from, seen_lower_.data(), seen_upper_.data());
    const Basis& from = last.empty() ? Nearest(aim.direction) : last[MostAlike(aim.direction, last_aims)].basis;
    const Climb found = Search(aim.direction, ends, all_, from, kMostSteps);
    if (found.contradicted >= 0 && Prove(found, ends, aim.row)) return;
    if (active_.empty()) vertices_.clear(), aims_.clear();  // where the first search began
    std::size_t v = 0;
    while (v < vertices_.size() &&
           !(vertices_[v].basis == found.basis && vertices_[v].theta == found.theta && aims_[v].from == aim.from))
      ++v;
    if (v < vertices_.size()) continue;
    vertices_.push_back({found.basis, found.theta});
    aims_.push_back(aim);
    active_.insert(active_.end(), found.basis.begin(), found.basis.begin() + std::ptrdiff_t(size_));
  }
  SortActive();
  if (all_.size() <= kFew) active_ = all_;
  SetHull();
  is_bounded_ = std::all_of(hull_.begin(), hull_.begin() + std::ptrdiff_t(size_),
                            [](const Interval& range) { return range.IsFinite(); });
  if (is_bounded_) TestPlaces();
}

// The observations that are new, from their own places, where a rest hides least of what contradicts them.
void AffineSet::TestPlaces() {
  if (!HasRest()) return;
  const std::size_t stride = (ids_.size() - tested_) / kMostPlaces + 1;
  for (; tested_ < ids_.size() && !contradiction_; tested_ += stride) {
    Vector direction{};
    std::ranges::copy(phi(static_cast<int>(tested_)), direction.begin());
    const Ends ends = EndsFrom(PlaceOf(tested_), seen_lower_.data(), seen_upper_.data());
    const Climb found = Search(direction, ends, all_, Nearest(direction), kMostSteps);
    if (found.contradicted >= 0) static_cast<void>(Prove(found, ends, static_cast<int>(tested_)));
  }
  tested_ = ids_.size();
}

void AffineSet::Learn(int id, std::span<const double> z, double lower, double upper) {
  if (contradiction_) return;
  const std::size_t before = ids_.size();
  Add(id, z, lower, upper);
  if (ids_.size() == before) return;
  // One that agrees with every known vertex cuts none off. If it cuts elsewhere, A is only taken for larger.
  if (LatestMayNarrow()) return Derive();
  TestPlaces();
  Forget();
}

// Leaves what is not active: a query finds the same as before. With a rest each observation bounds it nearby, and the
// latest are active, too.
void AffineSet::Forget() {
  if (ids_.size() <= kMostKept) return;
  if (HasRest() && is_bounded_) {
    active_.clear();
    for (const Vertex& vertex : vertices_)
      active_.insert(active_.end(), vertex.basis.begin(), vertex.basis.begin() + std::ptrdiff_t(size_));
    SortActive();
    active_.insert(active_.end(), all_.end() - std::ptrdiff_t((kMostKept - active_.size()) / 2), all_.end());
    SortActive();
  }
  std::vector<int> place(ids_.size());
  for (std::size_t kept = 0; kept < active_.size(); ++kept) {
    const auto i = ToSize(active_[kept]);
    place[i] = static_cast<int>(kept);
    for (std::size_t l = 0; l < size_; ++l) phi_[kept * size_ + l] = phi_[i * size_ + l];
    for (std::size_t r = 0; r < rest_.size(); ++r) places_[kept * rest_.size() + r] = places_[i * rest_.size() + r];
    lower_[kept] = lower_[i];
    upper_[kept] = upper_[i];
    ids_[kept] = ids_[i];
  }
  const std::size_t kept = active_.size();
  phi_.resize(kept * size_);
  places_.resize(kept * rest_.size());
  seen_lower_.resize(HasRest() ? kept : 0);
  seen_upper_.resize(seen_lower_.size());
  lower_.resize(kept);
  upper_.resize(kept);
  ids_.resize(kept);
  all_.resize(kept);
  active_ = all_;
  tested_ = std::min(tested_, kept);
  for (Vertex& vertex : vertices_)
    for (std::size_t j = 0; j < size_; ++j) vertex.basis[j] = place[ToSize(vertex.basis[j])];
}

// About kNear observations with the narrowest ends.
std::span<const int> AffineSet::SeenBest(const Ends& ends, std::span<int> rows) const noexcept {
  if (all_.size() <= 2 * kNear) return all_;
  std::array<double, kMostKept> widths;
  for (std::size_t i = 0; i < all_.size(); ++i) widths[i] = ends.upper[i] - ends.lower[i];
  std::nth_element(widths.begin(), widths.begin() + kNear, widths.begin() + std::ssize(all_));
  std::size_t count = 0;
  for (const int row : all_)
    if (ends.upper[ToSize(row)] - ends.lower[ToSize(row)] <= widths[kNear]) rows[count++] = row;
  return rows.first(count);
}

Interval AffineSet::Enclose(std::span<const double> z) const noexcept {
  if (!is_bounded_ || ids_.size() > kMostKept) return Interval::Entire();
  Vector along{}, against{};
  for (std::size_t l = 0; l + 1 < size_; ++l) along[l] = z[ToSize(columns_[l])];
  along[size_ - 1] = 1;
  for (std::size_t l = 0; l < size_; ++l) against[l] = -along[l];
  Place from{};
  for (std::size_t r = 0; r < rest_.size(); ++r) from[r] = z[ToSize(rest_variables_[r])];
  std::array<double, kMostKept> lower, upper;
  const Ends ends = EndsFrom(from, lower.data(), upper.data());
  const auto search = [&](const Vector& direction, std::span<const int> rows, const Basis& start) {
    return Search(direction, ends, rows, start, kMostStepsOfAQuery);
  };
  if (!HasRest()) {
    const double most = SupportUpper(along, ends, search(along, active_, Nearest(along)));
    return {-SupportUpper(against, ends, search(against, active_, Nearest(against))), most};
  }
  // Most steps look at few observations, those that are seen best.
  std::array<int, kMostKept> near_rows;
  const std::span<const int> near = SeenBest(ends, near_rows);
  const Climb most = search(along, all_, search(along, near, Nearest(along)).basis),
              least = search(against, all_, search(against, near, most.basis).basis);
  return {-SupportUpper(against, ends, least), SupportUpper(along, ends, most)};
}

}  // namespace forereach
