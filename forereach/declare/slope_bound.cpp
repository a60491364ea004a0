#include "forereach/declare/slope_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <stdexcept>
#include <string>

#include "forereach/declare/mean_value.h"
#include "forereach/numerics/arithmetic.h"
#include "forereach/numerics/require.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

using Arguments = std::vector<Interval>;

constexpr std::size_t kBetweenReports = 256;

// ---- Where a box lies to the domain's inequalities and balls.

double SmallestValue(const Domain::Inequality& inequality, const Arguments& box) {
  double smallest = 0;
  for (Eigen::Index l = 0; l < inequality.coefficients.size(); ++l) {
    const double c = inequality.coefficients[l];
    const Interval& z = box[ToSize(l)];
    if (c != 0) smallest = AddDown(smallest, MulDown(c, c > 0 ? z.lower : z.upper));
  }
  return smallest;
}

double SmallestSquaredDistance(const Domain::Ball& ball, const Arguments& box) {
  double smallest = 0;
  for (Eigen::Index i = 0; i < ball.center.size(); ++i) {
    const Interval& z = box[ToSize(ball.coordinates[ToSize(i)])];
    const double c = ball.center[i];
    const double away = std::max({0.0, SubDown(z.lower, c), SubDown(c, z.upper)});
    smallest = AddDown(smallest, MulDown(away, away));
  }
  return smallest;
}

bool LiesOutside(const Domain& domain, const Arguments& box) {
  return std::ranges::any_of(
             domain.inequalities,
             [&](const auto& inequality) { return SmallestValue(inequality, box) > inequality.bound; }) ||
         std::ranges::any_of(domain.balls, [&](const auto& ball) {
           return SmallestSquaredDistance(ball, box) > MulUp(ball.radius, ball.radius);
         });
}

// A point near z that is likely to be in the domain; whether it is, is for Domain::Contains to say.
void MoveInside(const Domain& domain, const Arguments& box, std::span<double> z) {
  constexpr double kInward = 1 - 0x1p-44;
  for (int round = 0; round < 8 && !domain.Contains(z); ++round) {
    for (const Domain::Ball& ball : domain.balls) {
      const auto entry = [&](Eigen::Index i) -> double& { return z[ToSize(ball.coordinates[ToSize(i)])]; };
      const Eigen::VectorXd& center = ball.center;
      double square = 0;
      for (Eigen::Index i = 0; i < center.size(); ++i) square += std::pow(entry(i) - center[i], 2);
      const double scale = std::min(1.0, kInward * ball.radius / std::sqrt(square));
      for (Eigen::Index i = 0; i < center.size(); ++i) entry(i) = center[i] + scale * (entry(i) - center[i]);
    }
    for (const auto& [coefficients, bound] : domain.inequalities) {
      const Eigen::Map<Eigen::VectorXd> point(z.data(), coefficients.size());
      const double excess = coefficients.dot(point) - bound;
      if (excess > 0)
        Eigen::Map<Eigen::VectorXd>(z.data(), coefficients.size()) -=
            excess / kInward / coefficients.squaredNorm() * coefficients;
    }
    for (std::size_t l = 0; l < z.size(); ++l) z[l] = std::clamp(z[l], box[l].lower, box[l].upper);
  }
}

// ---- The search.

// A residual that may be undefined has no slope.
Interval Slope(const Jet& residual) { return residual.value.IsFinite() ? residual.slope : Interval::Entire(); }

// The larger of a bound and 0; infinity for NaN, which bounds nothing.
double NonNegative(double bound) { return std::isnan(bound) ? kInfinity : std::max(0.0, bound); }

// Of two numbers that are not negative, for comparisons only: positive where both are, and finite.
double Product(double a, double b) {
  return a > 0 && b > 0 ? std::clamp(a * b, std::numeric_limits<double>::denorm_min(), kMaxDouble) : 0;
}

struct SlopePart {
  double bound;
  int node, cut;
  Arguments box;

  // Of infinite bounds the newest part goes first: it is cut down to a box that shows where, or to finite ones.
  bool operator<(const SlopePart& other) const {
    if (bound != other.bound) return bound < other.bound;
    return bound < kInfinity ? node > other.node : node < other.node;
  }
};

class SlopeSearch {
 public:
  SlopeSearch(const ResidualSlopes& slopes, const Domain& domain, std::span<const Interval> parameters, int row,
              int column, const SlopeBoundOptions& options)
      : slopes_(slopes), domain_(domain), options_(options), root_(domain.Ranges()) {
    result_.row = row;
    result_.column = column;
    root_.insert(root_.end(), parameters.begin(), parameters.end());
    for (int i = 0; i < slopes.num_arguments(); ++i)
      if (slopes.Occurs(row, i) && (i == column || root_[ToSize(i)].lower < root_[ToSize(i)].upper))
        active_.push_back(i);
    constrained_.resize(root_.size());
    for (const auto& ball : domain.balls)
      for (const int l : ball.coordinates) constrained_[ToSize(l)] = true;
    for (const auto& inequality : domain.inequalities)
      for (Eigen::Index l = 0; l < inequality.coefficients.size(); ++l)
        if (inequality.coefficients[l] != 0) constrained_[ToSize(l)] = true;
  }

  SlopeBound Run(const SlopeProgress& progress) {
    if (active_.size() > Jet::kMaxArguments)
      throw std::invalid_argument("slope bound: row " + std::to_string(result_.row) + " of the residual depends on " +
                                  std::to_string(active_.size()) + " arguments that vary, at most " +
                                  std::to_string(Jet::kMaxArguments) + " may");
    result_.cover.nodes.resize(1);
    Add(0, kInfinity, root_);
    while (!parts_.empty() && parts_.top().bound > Enough() && parts_.top().cut >= 0 &&
           result_.boxes < options_.max_boxes) {
      const SlopePart part = parts_.top();
      parts_.pop();
      Bisect(part);
      if (progress && result_.boxes % kBetweenReports < 2) progress(Closed(part.bound));
    }
    if (!parts_.empty()) result_.upper = std::max(result_.upper, parts_.top().bound);
    if (!parts_.empty() && result_.upper == kInfinity) result_.unbounded = parts_.top().box;
    result_.reached = result_.upper <= Enough();
    if (progress) progress(1);
    return std::move(result_);
  }

 private:
  // A box with at most this bound is good enough: it is not cut any further.
  [[nodiscard]] double Enough() const { return MulDown(AddDown(1, options_.gap), result_.lower); }

  // How far the gap is closed, by its logarithm.
  double Closed(double upper) {
    const double gap = upper / result_.lower - 1;
    if (!(gap < kInfinity)) return closed_;
    if (first_gap_ == 0) first_gap_ = std::max(gap, 2 * options_.gap);
    const double closed = std::log(first_gap_ / gap) / std::log(first_gap_ / options_.gap);
    return closed_ = closed > closed_ ? std::min(closed, 1.0) : closed_;
  }

  void Bisect(const SlopePart& part) {
    const std::size_t argument = ToSize(part.cut);
    const double at = part.box[argument].Middle();
    std::vector<Cover::Node>& nodes = result_.cover.nodes;
    const int below = static_cast<int>(nodes.size());
    nodes[ToSize(part.node)] = {part.cut, false, at, below, below + 1};
    nodes.resize(nodes.size() + 2);
    Arguments half = part.box;
    half[argument].upper = at;
    Add(below, part.bound, half);
    half[argument] = {at, part.box[argument].upper};
    Add(below + 1, part.bound, half);
  }

  // Bounds a box, which then is a leaf until it is cut. @param bound holds already.
  void Add(int node, double bound, const Arguments& box) {
    Cover::Node& leaf = result_.cover.nodes[ToSize(node)];
    if (LiesOutside(domain_, box)) {
      leaf.outside = true;
      return;
    }
    ++result_.boxes;
    const bool inside =
        FindExit(domain_, std::span(box).first(ToSize(slopes_.num_variables()))).kind == DomainExit::Kind::kNone;
    cut_ = -1;
    cut_score_ = 0;
    leaf.number = std::min(bound, std::max(SignedBound(box, inside, 1), SignedBound(box, inside, -1)));
    if (leaf.number <= Enough())
      result_.upper = std::max(result_.upper, leaf.number);
    else
      parts_.push({leaf.number, node, cut_ < 0 && !inside ? WidestCut(box, inside) : cut_, box});
  }

  // An upper bound on sign * slope over the box, at least 0. What remains of the box shrinks to the ends at which the
  // slope is largest, as far as it is monotone there; then the mean-value form takes the rest. The point looked at may
  // raise the lower bound, and cut_ becomes the argument that cost most.
  double SignedBound(const Arguments& box, bool inside, double sign) {
    Arguments rest = box;
    double bound = kInfinity;
    while (true) {
      const Jet jet = slopes_.Enclose(result_.row, result_.column, rest, active_);
      const Interval slope = Slope(jet);
      bound = std::min(bound, NonNegative(sign > 0 ? slope.upper : -slope.lower));
      if (bound <= Enough()) return bound;
      const auto rises = std::span(jet.curvature).first(active_.size());
      if (!slope.IsFinite() || !std::ranges::all_of(rises, [](const Interval& c) { return c.IsFinite(); })) {
        cut_ = WidestCut(box, inside);
        (void)At(Middle(box), inside, sign);
        return bound;
      }
      if (!ShrinkToLargest(rises, sign, box, inside, rest))
        return std::min(bound, NonNegative(MeanValueBound(rises, sign, rest, inside)));
    }
  }

  // Moves the arguments in which the slope is monotone to their better ends. Whether there were any.
  bool ShrinkToLargest(std::span<const Interval> rises, double sign, const Arguments& box, bool inside,
                       Arguments& rest) {
    bool moved = false;
    for (std::size_t i = 0; i < active_.size(); ++i) {
      const Interval rise = sign > 0 ? rises[i] : -rises[i];
      Interval& range = rest[ToSize(active_[i])];
      if (!(range.lower < range.upper) || (rise.lower < 0 && rise.upper > 0)) continue;
      range = rise.lower >= 0 ? range.upper : range.lower;
      moved = true;
      // The better end may lie outside the domain: then cutting helps all the same.
      if (!inside && constrained_[ToSize(active_[i])])
        Prefer(active_[i], Product(rise.Magnitude(), Width(box[ToSize(active_[i])])), box, cut_, cut_score_);
    }
    return moved;
  }

  double MeanValueBound(std::span<const Interval> rises, double sign, const Arguments& rest, bool inside) {
    std::vector<double> point = Middle(rest);
    double excess = 0;
    for (std::size_t i = 0; i < active_.size(); ++i) {
      const Interval& range = rest[ToSize(active_[i])];
      if (!(range.lower < range.upper)) continue;
      const Interval rise = sign > 0 ? rises[i] : -rises[i];
      const ExpansionPoint expansion = ExpandForUpperBound(range, rise);
      point[ToSize(active_[i])] = expansion.point;
      excess = AddUp(excess, expansion.excess);
      Prefer(active_[i], Product(rise.Magnitude(), Width(range)), rest, cut_, cut_score_);
    }
    return AddUp(At(point, inside, sign).upper, excess);
  }

  // sign * slope at a point, which counts if it is in the domain, or else one near it.
  Interval At(const std::vector<double>& point, bool inside, double sign) {
    const Interval there = Signed(point, sign);
    if (there.upper > result_.lower) {
      std::vector<double> counted = point;
      const auto z = std::span(counted).first(ToSize(slopes_.num_variables()));
      if (inside || domain_.Contains(z)) {
        Count(counted, there);
      } else {
        MoveInside(domain_, root_, z);
        if (domain_.Contains(z)) Count(counted, Signed(counted, sign));
      }
    }
    return there;
  }

  void Count(const std::vector<double>& point, const Interval& there) {
    if (!(there.lower > result_.lower) && !result_.point.empty()) return;
    result_.lower = std::max(result_.lower, there.lower);
    result_.point = point;
  }

  Interval Signed(const std::vector<double>& point, double sign) const {
    const Arguments w(point.begin(), point.end());
    const int column = result_.column;
    const Interval slope = Slope(slopes_.Enclose(result_.row, column, w, {&column, 1}));
    return sign > 0 ? slope : -slope;
  }

  int WidestCut(const Arguments& box, bool inside) const {
    int best = -1;
    double best_score = 0;
    for (int i = 0; i < static_cast<int>(box.size()); ++i)
      if (std::ranges::count(active_, i) > 0 || (!inside && constrained_[ToSize(i)]))
        Prefer(i, ShareOf(box[ToSize(i)], root_[ToSize(i)]), box, best, best_score);
    return best;
  }

  static void Prefer(int argument, double score, const Arguments& box, int& best, double& best_score) {
    const Interval& range = box[ToSize(argument)];
    const double middle = range.Middle();
    if (!(score > best_score && range.lower < middle && middle < range.upper)) return;
    best = argument;
    best_score = score;
  }

  static double Width(const Interval& range) { return std::min(range.upper - range.lower, kMaxDouble); }
  static double ShareOf(const Interval& part, const Interval& whole) {
    if (whole.upper - whole.lower < kInfinity) return Width(part) / Width(whole);
    return (part.upper / 2 - part.lower / 2) / (whole.upper / 2 - whole.lower / 2);
  }

  static std::vector<double> Middle(const Arguments& box) {
    std::vector<double> point(box.size());
    std::ranges::transform(box, point.begin(), [](const Interval& range) { return range.Middle(); });
    return point;
  }

  const ResidualSlopes& slopes_;
  const Domain& domain_;
  const SlopeBoundOptions options_;
  Arguments root_;
  std::vector<int> active_;
  std::vector<bool> constrained_;  // by an inequality or a ball
  std::priority_queue<SlopePart> parts_;
  SlopeBound result_;
  int cut_ = -1;  // of the box that is being bounded
  double cut_score_ = 0;
  double first_gap_ = 0, closed_ = 0;
};

}  // namespace

double SlopeBound::gap() const {
  if (upper == lower) return 0;
  return lower > 0 ? DivUp(SubUp(upper, lower), lower) : kInfinity;
}

SlopeBound BoundSlope(const ResidualSlopes& slopes, const Domain& domain, std::span<const Interval> parameters, int row,
                      int column, const SlopeBoundOptions& options, const SlopeProgress& progress) {
  RequireExactArithmetic();
  domain.Validate(slopes.num_states(), slopes.num_variables() - slopes.num_states());
  const auto count = ToSize(slopes.num_arguments() - slopes.num_variables());
  Require(parameters.size() == count, "slope bound: " + std::to_string(parameters.size()) + " parameter ranges for " +
                                          std::to_string(count) + " parameters");
  Require(0 <= row && row < slopes.num_states(), "slope bound: no row " + std::to_string(row));
  Require(0 <= column && column < slopes.num_variables(), "slope bound: no column " + std::to_string(column));
  Require(options.gap > 0 && options.gap < kInfinity,
          "slope bound: gap " + ToText(options.gap) + " is outside (0, inf)");
  Require(options.max_boxes > 0, "slope bound: max_boxes is 0");
  return SlopeSearch(slopes, domain, parameters, row, column, options).Run(progress);
}

}  // namespace forereach
