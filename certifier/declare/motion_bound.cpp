#include "certifier/declare/motion_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <queue>
#include <stdexcept>
#include <string>

#include "certifier/numerics/arithmetic.h"
#include "certifier/safety/clearance.h"

namespace forereach {
namespace {

using Arguments = std::vector<Interval>;  // z = (x, u)
using Quantity = std::function<RangeWithSlopes(const Flow::Derivatives&)>;

std::optional<Interval> Intersection(const Interval& a, const Interval& b) {
  const Interval both(std::max(a.lower, b.lower), std::min(a.upper, b.upper));
  return both.lower <= both.upper ? std::optional(both) : std::nullopt;
}

// ---- Where a motion is between two samples.

Arguments BoxOf(const Domain& domain) {
  Arguments box;
  for (const Box* part : {&domain.state, &domain.input})
    for (int k = 0; k < part->dim(); ++k) box.emplace_back(part->lower()[k], part->upper()[k]);
  return box;
}

[[noreturn]] void FailWithoutBound() {
  throw std::runtime_error(
      "no finite bound on the motion between two samples: the equations have none over the states that it can reach "
      "from the domain within one step; narrow `domain`");
}

Flow::Derivatives DerivativesOver(const SampledMotion& motion, const Arguments& box) {
  Flow::Derivatives derivatives;
  motion.flow.Enclose(box, derivatives);
  for (int k = 0; k < motion.domain.state.dim(); ++k)
    if (!derivatives.first[ToSize(k)].value.IsFinite() || !derivatives.second[ToSize(k)].value.IsFinite())
      FailWithoutBound();
  return derivatives;
}

// B with Z + [0, period] f(B) in B, so no motion that begins in Z leaves B within a period (Picard).
Arguments Reachable(const SampledMotion& motion, const Arguments& start) {
  constexpr int kRounds = 100;
  constexpr double kWider = 1.05;
  Arguments box = start;
  const Interval period(0, motion.period);
  for (int round = 0; round < kRounds; ++round) {
    const Flow::Derivatives derivatives = DerivativesOver(motion, box);
    bool is_inside = true;
    Arguments wider = box;
    for (std::size_t k = 0; k < ToSize(motion.domain.state.dim()); ++k) {
      const Interval moved = period * derivatives.first[k].value, after = start[k] + moved;
      is_inside = is_inside && box[k].lower <= after.lower && after.upper <= box[k].upper;
      wider[k] = Join(box[k], start[k] + Interval(kWider) * moved);
    }
    if (is_inside) return box;
    box = wider;
  }
  FailWithoutBound();
}

// Between two samples in the domain. `reachable` holds all of it.
Arguments BetweenSamples(const SampledMotion& motion, const Arguments& start, const Arguments& reachable) {
  constexpr int kRounds = 3;
  const Interval eighth = Interval(motion.period) * Interval(motion.period) / Interval(8);
  Arguments box = reachable;
  for (int round = 0; round < kRounds; ++round) {
    const Flow::Derivatives derivatives = DerivativesOver(motion, box);
    for (std::size_t k = 0; k < ToSize(motion.domain.state.dim()); ++k) {
      const double away = (eighth * Interval(derivatives.second[k].value.Magnitude())).upper;
      if (const auto both = Intersection(box[k], start[k] + Interval(-away, away))) box[k] = *both;
    }
  }
  return box;
}

// In a plan's last step. Nothing if no such step ends at rest.
std::optional<Arguments> LastStep(const SampledMotion& motion, const Arguments& reachable) {
  const Flow::Derivatives derivatives = DerivativesOver(motion, reachable);
  Arguments box = reachable;
  for (std::size_t k = 0; k < ToSize(motion.domain.state.dim()); ++k) {
    const double rest = motion.rest[static_cast<Eigen::Index>(k)];
    if (!(rest < kInfinity)) continue;
    const auto both =
        Intersection(box[k], Interval(-rest, rest) - Interval(0, motion.period) * derivatives.first[k].value);
    if (!both) return std::nullopt;
    box[k] = *both;
  }
  return box;
}

// ---- The largest value of a quantity over a box, by branch and bound.

class Search {
 public:
  // Values up to `least` are of no interest.
  Search(const Flow& flow, Quantity quantity, const SlopeBoundOptions& options, double least)
      : flow_(flow), quantity_(std::move(quantity)), options_(options) {
    found_.lower = least;
  }

  MotionBound Run(const Arguments& region) {
    Push(region);
    while (!pieces_.empty()) {
      found_.upper = pieces_.top().bound;
      if (found_.upper <= (1 + options_.gap) * found_.lower || !Cut()) break;
    }
    found_.upper = std::max(found_.upper, 0.0);
    found_.reached = found_.upper <= (1 + options_.gap) * found_.lower;
    return found_;
  }

 private:
  struct Piece {
    double bound;
    Arguments box;
    bool operator<(const Piece& other) const { return bound < other.bound; }
  };

  RangeWithSlopes Evaluate(const Arguments& box) {
    ++found_.boxes;
    flow_.Enclose(box, derivatives_);
    return quantity_(derivatives_);
  }

  // Adds a box, after every argument in which the quantity is monotone is set to its better end.
  void Push(Arguments box) {
    RangeWithSlopes range = Evaluate(box);
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t i = 0; i < box.size(); ++i) {
        const Interval& slope = range.gradient[i];
        if (!(box[i].lower < box[i].upper) || (slope.lower < 0 && slope.upper > 0)) continue;
        box[i] = slope.lower >= 0 ? box[i].upper : box[i].lower;
        changed = true;
      }
      if (changed) range = Evaluate(box);
    }
    if (!range.value.IsFinite()) range.value.upper = kInfinity;
    Arguments middle = box;
    for (Interval& argument : middle) argument = argument.Middle();
    found_.lower = std::max(found_.lower, Evaluate(middle).value.lower);
    pieces_.push({range.value.upper, std::move(box)});
  }

  // Halves the box of the largest bound. False if that is not possible.
  bool Cut() {
    if (found_.boxes >= options_.max_boxes) return false;
    Arguments box = pieces_.top().box;
    const auto widest = std::ranges::max_element(box, {}, [](const Interval& x) { return x.upper - x.lower; });
    const double middle = widest->Middle();
    if (!(widest->lower < middle && middle < widest->upper)) return false;
    pieces_.pop();
    const double upper = widest->upper;
    widest->upper = middle;
    Push(box);
    *widest = {middle, upper};
    Push(std::move(box));
    return true;
  }

  const Flow& flow_;
  Quantity quantity_;
  const SlopeBoundOptions options_;
  Flow::Derivatives derivatives_;
  std::priority_queue<Piece> pieces_;
  MotionBound found_;
};

RangeWithSlopes Negated(RangeWithSlopes range) {
  range.value = -range.value;
  for (Interval& slope : range.gradient) slope = -slope;
  return range;
}

// The largest magnitude of any of the quantities.
MotionBound BoundMagnitude(const Flow& flow, const std::vector<Quantity>& quantities,
                           const std::vector<Arguments>& regions, const SlopeBoundOptions& options) {
  MotionBound all;
  for (const Quantity& quantity : quantities) {
    for (const Arguments& region : regions) {
      for (const bool negated : {false, true}) {
        const auto side = [&](const Flow::Derivatives& d) { return negated ? Negated(quantity(d)) : quantity(d); };
        const MotionBound one = Search(flow, side, options, all.lower).Run(region);
        all.upper = std::max(all.upper, one.upper);
        all.lower = std::max(all.lower, one.lower);
        all.boxes += one.boxes;
      }
    }
  }
  if (!(all.upper < kInfinity)) FailWithoutBound();
  all.reached = all.upper <= (1 + options.gap) * all.lower;
  return all;
}

// A row of P times x''.
Quantity AccelerationAlong(const Eigen::VectorXd& row) {
  return [row](const Flow::Derivatives& derivatives) {
    RangeWithSlopes sum;
    for (Eigen::Index k = 0; k < row.size(); ++k) {
      if (row[k] == 0) continue;
      const RangeWithSlopes& second = derivatives.second[ToSize(k)];
      sum.value += Interval(row[k]) * second.value;
      for (std::size_t i = 0; i < sum.gradient.size(); ++i) sum.gradient[i] += Interval(row[k]) * second.gradient[i];
    }
    return sum;
  };
}

// A coordinate of a place. Nothing is known of its slopes.
Quantity AccelerationOfPlace(std::size_t i) {
  return [i](const Flow::Derivatives& derivatives) {
    RangeWithSlopes range{derivatives.places[i], {}};
    range.gradient.fill(Interval(-kInfinity, kInfinity));
    return range;
  };
}

// ---- Recorded motion.

constexpr double kTurn = 2 * std::numbers::pi;

// From the state in which transition i begins to its successor, without the turns of an angle that a record adds.
Eigen::VectorXd StepOf(const NominalModel& model, const Transitions& transitions, Eigen::Index i) {
  const Eigen::Index n = transitions.x_next.cols();
  Eigen::VectorXd next = transitions.x_next.row(i);
  if (!model.angles().empty()) {
    const Eigen::VectorXd z = transitions.z.row(i);
    std::array<double, kMaxStates> expected;
    model.Evaluate({z.data(), ToSize(z.size())}, {expected.data(), ToSize(n)});
    for (const int k : model.angles()) next[k] += kTurn * std::round((expected[ToSize(k)] - next[k]) / kTurn);
  }
  return next - transitions.z.row(i).head(n).transpose();
}

// Whether transition i begins where the one before it ends; an angle, up to turns and their rounding.
bool FollowsTheOneBefore(const NominalModel& model, const Transitions& transitions, Eigen::Index i) {
  constexpr double kRounding = 0x1p-48;
  for (int k = 0; k < static_cast<int>(transitions.x_next.cols()); ++k) {
    const double ended = transitions.x_next(i - 1, k), begins = transitions.z(i, k);
    if (ended != begins && !(model.IsAngle(k) && std::abs(std::remainder(ended - begins, kTurn)) <= kRounding))
      return false;
  }
  return true;
}

// The second differences of the places of points at expressions, by their largest in each safety coordinate.
class PlaceDifferences {
 public:
  PlaceDifferences(const NominalModel& model, const Eigen::MatrixXd& projection, const Body& body)
      : places_(model, projection, body), dim_(projection.rows()) {}

  // @param last x_{i+1}, with first and second before it.
  [[nodiscard]] Eigen::VectorXd Largest(const Eigen::VectorXd& first, const Eigen::VectorXd& second,
                                        const Eigen::VectorXd& last) const {
    const auto a = At(first), b = At(second), c = At(last);
    Eigen::VectorXd largest = Eigen::VectorXd::Zero(dim_);
    for (std::size_t part = 0; part < a.size(); ++part)
      for (std::size_t j = 0; places_.IsAtExpressions(part) && j < a[part].points.size(); ++j)
        largest =
            largest.cwiseMax((c[part].points[j] - 2 * b[part].points[j] + a[part].points[j]).head(dim_).cwiseAbs());
    return largest;
  }

 private:
  [[nodiscard]] std::vector<BodyPart> At(const Eigen::VectorXd& x) const {
    return places_.At({x.data(), ToSize(x.size())});
  }

  BodyPlaces places_;
  Eigen::Index dim_;
};

}  // namespace

MotionBounds BoundMotion(const SampledMotion& motion, const SlopeBoundOptions& options) {
  RequireExactArithmetic();
  const int n = motion.domain.state.dim();
  if (motion.projection.cols() != n || motion.rest.size() != n || motion.heading >= n)
    throw std::invalid_argument("motion: projection, rest or heading are not those of " + std::to_string(n) +
                                " states");
  const Arguments start = BoxOf(motion.domain), reachable = Reachable(motion, start);
  std::vector<Arguments> regions{BetweenSamples(motion, start, reachable)};
  if (auto last = LastStep(motion, reachable)) regions.push_back(std::move(*last));
  MotionBounds bounds;
  const auto p = ToSize(motion.projection.rows());
  for (std::size_t k = 0; k < p; ++k) {
    std::vector<Quantity> quantities{AccelerationAlong(motion.projection.row(static_cast<Eigen::Index>(k)))};
    for (std::size_t i = k; i < motion.flow.num_places(); i += p) quantities.push_back(AccelerationOfPlace(i));
    bounds.acceleration.push_back(BoundMagnitude(motion.flow, quantities, regions, options));
  }
  if (motion.heading < 0) return bounds;
  const auto heading = ToSize(motion.heading);
  bounds.turn_rate =
      BoundMagnitude(motion.flow, {[&](const Flow::Derivatives& d) { return d.first[heading]; }}, regions, options);
  bounds.turn_acceleration =
      BoundMagnitude(motion.flow, {[&](const Flow::Derivatives& d) { return d.second[heading]; }}, regions, options);
  return bounds;
}

MeasuredMotion MeasureMotion(const NominalModel& model, const Transitions& transitions,
                             const Eigen::MatrixXd& projection, const Body& body, double period) {
  const int heading = body.heading;
  std::optional<PlaceDifferences> places;
  if (body.HasPlaces()) places.emplace(model, projection, body);
  MeasuredMotion measured;
  measured.acceleration = Eigen::VectorXd::Zero(projection.rows());
  Eigen::VectorXd before;  // the step from the sample before
  for (Eigen::Index i = 0; i < transitions.x_next.rows(); ++i) {
    const Eigen::VectorXd step = StepOf(model, transitions, i);
    if (i > 0 && FollowsTheOneBefore(model, transitions, i)) {
      ++measured.triples;
      const Eigen::VectorXd difference = (step - before) / (period * period);
      measured.acceleration = measured.acceleration.cwiseMax((projection * difference).cwiseAbs());
      if (places) {
        const Eigen::VectorXd begins = transitions.z.row(i).head(step.size());
        measured.acceleration =
            measured.acceleration.cwiseMax(places->Largest(begins - before, begins, begins + step) / (period * period));
      }
      if (heading >= 0) {
        for (const double turned : {before[heading], step[heading]})
          measured.turn_rate = std::max(measured.turn_rate, std::abs(turned / period));
        measured.turn_acceleration = std::max(measured.turn_acceleration, std::abs(difference[heading]));
      }
    }
    before = step;
  }
  return measured;
}

}  // namespace forereach
