#include "verifier/separation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Geometry>

namespace forereach::verifier {
namespace {

using Vector = Eigen::Vector3d;  // unused coordinates are zero
using RealVector = std::vector<Real>;

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr double kClose = 1e-7;  // candidates that come so near to the best are all taken in full
constexpr std::size_t kMostCandidates = 24;

Real Dot(const RealVector& a, const RealVector& b) {
  Real sum;
  for (std::size_t k = 0; k < a.size(); ++k)
    if (!a[k].IsZero() && !b[k].IsZero()) sum += a[k] * b[k];
  return sum;
}

RealVector Minus(const RealVector& a, const RealVector& b) {
  RealVector difference;
  for (std::size_t k = 0; k < a.size(); ++k) difference.push_back(a[k] - b[k]);
  return difference;
}

RealVector Negated(const RealVector& a) { return Minus(RealVector(a.size()), a); }
RealVector Turned(const RealVector& a) { return {-a[1], a[0]}; }
RealVector Cross(const RealVector& a, const RealVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
RealVector UnitAxis(int dim, int k) {
  RealVector axis(static_cast<std::size_t>(dim));
  axis[static_cast<std::size_t>(k)] = Real(1.0);
  return axis;
}

// The points whose hull the obstacle's core is.
std::vector<RealVector> CorePoints(const Obstacle& obstacle) {
  std::vector<RealVector> points;
  const auto& given = obstacle.points();
  if (obstacle.kind() != Obstacle::Kind::kBox) {
    for (const Eigen::VectorXd& point : given) points.emplace_back(point.begin(), point.end());
    return points;
  }
  for (int corner = 0; corner < 1 << obstacle.dim(); ++corner) {
    RealVector& point = points.emplace_back();
    for (int k = 0; k < obstacle.dim(); ++k) point.emplace_back(given[corner >> k & 1 ? 1 : 0][k]);
  }
  return points;
}

// Doubles of exact vectors, all brought to a size near one so that nothing overflows.
long CommonExponent(const std::vector<RealVector>& vectors) {
  long largest = -100000;
  for (const RealVector& vector : vectors)
    for (const Real& entry : vector) largest = std::max(largest, entry.exponent());
  return largest;
}
Vector Rounded(const RealVector& vector, long exponent) {
  Vector rounded = Vector::Zero();
  for (std::size_t k = 0; k < vector.size(); ++k) rounded[static_cast<Eigen::Index>(k)] = vector[k].ToDouble(-exponent);
  return rounded;
}

// The dual bound, maximised over candidate directions.
class Search {
 public:
  Search(const ProjectedSlice& slice, const Obstacle& obstacle) : slice_(slice), obstacle_(obstacle) {
    if (obstacle.kind() == Obstacle::Kind::kHalfSpace) return;
    for (const RealVector& point : CorePoints(obstacle)) core_.push_back(Minus(point, slice.center()));
    std::vector<RealVector> all = core_;
    all.insert(all.end(), slice.generators().begin(), slice.generators().end());
    exponent_ = CommonExponent(all);
    for (const RealVector& point : core_) rough_core_.push_back(Rounded(point, exponent_));
    for (const RealVector& g : slice.generators()) rough_generators_.push_back(Rounded(g, exponent_));
  }

  /** True once a direction proves `clearance`. */
  bool Run(double clearance) {
    clearance_ = clearance;
    if (obstacle_.kind() == Obstacle::Kind::kHalfSpace) {
      const Eigen::VectorXd& normal = obstacle_.points()[0];
      return Try(RealVector(normal.begin(), normal.end()));
    }
    if (TryTowardsCore() || TryNearestPoint()) return true;
    CollectNormals();
    return TryBest();
  }

  [[nodiscard]] const std::optional<Real>& best() const { return best_; }
  [[nodiscard]] bool undecided() const { return undecided_; }

 private:
  struct Candidate {
    double value;
    RealVector direction;
    Vector rough;
  };

  // min over the core minus max over the slice, seen from the slice's center, for a unit vector.
  [[nodiscard]] double Roughly(const Vector& unit) const {
    double value = kNone;
    for (const Vector& point : rough_core_) value = std::min(value, unit.dot(point));
    for (const Vector& g : rough_generators_) value -= std::abs(unit.dot(g));
    return value;
  }

  // Whether d proves the clearance: gap >= (clearance + radius) |d|.
  bool Try(const RealVector& d) {
    const Real square = Dot(d, d);
    if (!CertainlyBelow(Real(), square)) return false;
    const Real length = sqrt(square);
    Real gap;
    if (obstacle_.kind() == Obstacle::Kind::kHalfSpace) {
      gap = Real(obstacle_.offset()) - slice_.Support(d);
    } else {
      gap = Dot(d, core_.front());
      for (const RealVector& point : core_) gap = min(gap, Dot(d, point));
      gap -= slice_.Support(d) - Dot(d, slice_.center());
    }
    const Real bound = (gap / length - Real(obstacle_.radius())).lower();
    best_ = best_ ? max(*best_, bound) : bound;
    const Real needed = (Real(clearance_) + Real(obstacle_.radius())) * length;
    const Answer answer = clearance_ > 0 ? IsAtMost(needed, gap) : IsBelow(needed, gap);
    undecided_ |= answer == Answer::kUnknown;
    return answer == Answer::kYes;
  }

  bool TryTowardsCore() {
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < core_.size(); ++i)
      if (rough_core_[i].norm() < rough_core_[nearest].norm()) nearest = i;
    return Try(core_[nearest]);
  }

  void Consider(const RealVector& direction) {
    const Vector rough = Rounded(direction, CommonExponent({direction}));
    const double length = rough.norm();
    if (!(length > 0 && length < kNone)) return;
    for (const double sign : {1.0, -1.0}) {
      const Vector unit = sign * rough / length;
      candidates_.push_back({Roughly(unit), sign > 0 ? direction : Negated(direction), unit});
    }
  }

  void CollectNormals() {
    const auto& generators = slice_.generators();
    const int dim = slice_.dim();
    for (int k = 0; k < dim; ++k) Consider(UnitAxis(dim, k));
    if (dim == 2) {
      for (const RealVector& g : generators) Consider(Turned(g));
      for (std::size_t a = 0; a < core_.size(); ++a)
        for (std::size_t b = 0; b < a; ++b) Consider(Turned(Minus(core_[a], core_[b])));
    } else if (dim == 3) {
      for (std::size_t i = 0; i < generators.size(); ++i) {
        for (int k = 0; k < 3; ++k) Consider(Cross(generators[i], UnitAxis(3, k)));
        for (std::size_t j = 0; j < i; ++j) Consider(Cross(generators[i], generators[j]));
      }
    }
  }

  // A corner of {core - slice}: which point of the core, and the sign of every generator.
  struct Choice {
    std::size_t point;
    std::vector<bool> plus;

    bool operator==(const Choice&) const = default;
  };

  [[nodiscard]] Choice LowestAlong(const Vector& d) const {
    Choice choice{0, {}};
    for (std::size_t i = 1; i < core_.size(); ++i)
      if (d.dot(rough_core_[i]) < d.dot(rough_core_[choice.point])) choice.point = i;
    for (const Vector& g : rough_generators_) choice.plus.push_back(d.dot(g) > 0);
    return choice;
  }
  [[nodiscard]] Vector Rough(const Choice& choice) const {
    Vector corner = rough_core_[choice.point];
    for (std::size_t j = 0; j < choice.plus.size(); ++j)
      corner += choice.plus[j] ? Vector(-rough_generators_[j]) : rough_generators_[j];
    return corner;
  }
  [[nodiscard]] RealVector Exact(const Choice& choice) const {
    RealVector corner = core_[choice.point];
    for (std::size_t j = 0; j < choice.plus.size(); ++j)
      for (std::size_t k = 0; k < corner.size(); ++k) {
        if (choice.plus[j])
          corner[k] -= slice_.generators()[j][k];
        else
          corner[k] += slice_.generators()[j][k];
      }
    return corner;
  }

  // The point of {core - slice} next to the origin, by Wolfe's algorithm in doubles; then the same point of the face
  // that it ended on in full, whose direction is the best there is.
  bool TryNearestPoint() {
    std::vector<Choice> corners{LowestAlong(Rough(LowestAlong(rough_core_.front())))};
    std::vector<double> weights{1};
    Vector nearest = Rough(corners.front());
    for (int round = 0; round < 200 && nearest.norm() > 0; ++round) {
      const Choice next = LowestAlong(nearest);
      const double progress = nearest.squaredNorm() - nearest.dot(Rough(next));
      if (progress <= 1e-15 * nearest.squaredNorm() || std::ranges::find(corners, next) != corners.end()) break;
      corners.push_back(next);
      weights.push_back(0);
      while (!MoveToAffineMinimum(corners, weights)) {
      }
      nearest.setZero();
      for (std::size_t i = 0; i < corners.size(); ++i) nearest += weights[i] * Rough(corners[i]);
    }
    const RealVector d = ExactAffineMinimum(corners);
    return !d.empty() && Try(d);
  }

  // Weights towards the affine minimum until one of them is zero; that corner goes. True if the minimum was reached.
  bool MoveToAffineMinimum(std::vector<Choice>& corners, std::vector<double>& weights) const {
    const auto size = static_cast<Eigen::Index>(corners.size());
    Eigen::MatrixXd system = Eigen::MatrixXd::Ones(size + 1, size + 1);
    system(size, size) = 0;
    for (Eigen::Index i = 0; i < size; ++i)
      for (Eigen::Index j = 0; j < size; ++j)
        system(i, j) = Rough(corners[static_cast<std::size_t>(i)]).dot(Rough(corners[static_cast<std::size_t>(j)]));
    const Eigen::VectorXd target = system.completeOrthogonalDecomposition().solve(Eigen::VectorXd::Unit(size + 1, size));
    double step = 1;
    std::size_t leaves = corners.size();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const double end = target[static_cast<Eigen::Index>(i)];
      if (!(end <= 0)) continue;
      const double fraction = weights[i] > end ? weights[i] / (weights[i] - end) : 0;
      if (fraction <= step) step = fraction, leaves = i;
    }
    for (std::size_t i = 0; i < corners.size(); ++i)
      weights[i] += step * (target[static_cast<Eigen::Index>(i)] - weights[i]);
    if (leaves == corners.size() || corners.size() == 1) return true;
    corners.erase(corners.begin() + static_cast<std::ptrdiff_t>(leaves));
    weights.erase(weights.begin() + static_cast<std::ptrdiff_t>(leaves));
    return corners.size() == 1;
  }

  // p_0 + sum a_i (p_i - p_0) of least length, by Gauss's elimination on middles; empty where it is singular.
  [[nodiscard]] RealVector ExactAffineMinimum(const std::vector<Choice>& corners) const {
    RealVector nearest = Exact(corners.front());
    std::vector<RealVector> edges, rows;
    for (std::size_t i = 1; i < corners.size(); ++i) edges.push_back(Minus(Exact(corners[i]), nearest));
    for (const RealVector& a : edges) {
      RealVector& row = rows.emplace_back();
      for (const RealVector& b : edges) row.push_back(Dot(a, b).middle());
      row.push_back((-Dot(a, nearest)).middle());
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (rows[i][i].IsZero()) return {};
      for (std::size_t r = 0; r < rows.size(); ++r) {
        if (r == i) continue;
        const Real factor = (rows[r][i] / rows[i][i]).middle();
        for (std::size_t c = i; c < rows[r].size(); ++c) rows[r][c] = (rows[r][c] - factor * rows[i][c]).middle();
      }
    }
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (std::size_t k = 0; k < nearest.size(); ++k)
        nearest[k] += (rows[i].back() / rows[i][i]).middle() * edges[i][k];
    for (Real& entry : nearest) entry = entry.middle();
    return nearest;
  }

  // The corner of {core - slice} that d + tilt, tilt infinitely small, supports: in full.
  [[nodiscard]] RealVector Corner(const Vector& d, const Vector& tilt) const {
    const auto side = [&](const Vector& x) {
      const double along = d.dot(x);
      return std::abs(along) > 1e-12 * x.norm() ? along : tilt.dot(x);
    };
    Choice choice{0, {}};
    for (std::size_t i = 1; i < core_.size(); ++i)
      if (side(rough_core_[i] - rough_core_[choice.point]) < 0) choice.point = i;
    for (const Vector& g : rough_generators_) choice.plus.push_back(side(g) > 0);
    return Exact(choice);
  }

  bool TryBest() {
    std::ranges::stable_sort(candidates_, [](const Candidate& a, const Candidate& b) { return a.value > b.value; });
    for (std::size_t i = 0; i < std::min(candidates_.size(), kMostCandidates); ++i) {
      const auto& [value, direction, unit] = candidates_[i];
      if (i > 2 && value < candidates_[0].value - kClose) break;
      if (Try(direction)) return true;
      for (int k = 0; k < (slice_.dim() == 3 ? 3 : slice_.dim() - 1); ++k)
        for (const double sign : {1.0, -1.0}) {
          const Vector tilt = slice_.dim() == 2 ? Vector(-unit.y(), unit.x(), 0) : unit.cross(Vector::Unit(k));
          if (Try(Corner(unit, sign * tilt))) return true;
        }
    }
    return false;
  }

  const ProjectedSlice& slice_;
  const Obstacle& obstacle_;
  std::vector<RealVector> core_;  // relative to the slice's center
  std::vector<Vector> rough_core_, rough_generators_;
  long exponent_ = 0;
  double clearance_ = 0;
  std::vector<Candidate> candidates_;
  std::optional<Real> best_;
  bool undecided_ = false;
};

}  // namespace

ProjectedSlice::ProjectedSlice(const Slice& slice, const Eigen::MatrixXd& projection) {
  const auto image = [&](const std::vector<Real>& x) {
    RealVector y(static_cast<std::size_t>(projection.rows()));
    for (Eigen::Index k = 0; k < projection.rows(); ++k)
      for (Eigen::Index l = 0; l < projection.cols(); ++l)
        if (projection(k, l) != 0) y[static_cast<std::size_t>(k)] += Real(projection(k, l)) * x[static_cast<std::size_t>(l)];
    return y;
  };
  center_ = image(slice.center);
  for (const auto& column : slice.columns) {
    RealVector g = image(column);
    if (!std::ranges::all_of(g, [](const Real& entry) { return entry.IsZero(); })) generators_.push_back(std::move(g));
  }
}

Real ProjectedSlice::Support(const std::vector<Real>& d) const {
  Real value = Dot(d, center_);
  for (const RealVector& g : generators_) value += abs(Dot(d, g));
  return value;
}

// The farthest point is a corner, and its signs are those of a direction next to some generator's normal.
Real ProjectedSlice::Radius() const {
  const long exponent = CommonExponent(generators_);
  std::vector<Vector> rough;
  for (const RealVector& g : generators_) rough.push_back(Rounded(g, exponent));
  const auto corner = [&](const Vector& d) {
    Vector sum = Vector::Zero();
    for (const Vector& g : rough) sum += d.dot(g) < 0 ? Vector(-g) : g;
    return sum;
  };
  Vector best = Vector::UnitX();
  double longest = -1;
  for (const Vector& g : rough)
    for (const Vector& d : {g, Vector(-g.y(), g.x(), g.z())})
      for (const double tilt : {0.0, 1e-9, -1e-9}) {
        const Vector towards = d + tilt * g;
        if (const double length = corner(towards).norm(); length > longest) longest = length, best = towards;
      }
  RealVector sum(center_.size());
  for (std::size_t j = 0; j < generators_.size(); ++j)
    for (std::size_t k = 0; k < sum.size(); ++k) {
      if (best.dot(rough[j]) < 0)
        sum[k] -= generators_[j][k];
      else
        sum[k] += generators_[j][k];
    }
  return sqrt(Dot(sum, sum)).lower();
}

Answer IsClear(const ProjectedSlice& slice, const Obstacle& obstacle, double clearance, Real& best) {
  Search search(slice, obstacle);
  const bool proven = search.Run(clearance);
  best = search.best() ? *search.best() : Real(-kNone);
  if (proven) return Answer::kYes;
  return search.undecided() ? Answer::kUnknown : Answer::kNo;
}

}  // namespace forereach::verifier
