#include "forereach/declare/motion_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <queue>
#include <stdexcept>
#include <string>

#include "forereach/declare/mean_value.h"
#include "forereach/numerics/arithmetic.h"
#include "forereach/safety/clearance.h"

namespace forereach {
namespace {

using Arguments = std::vector<Interval>;  // z = (x, u)
using Quantity = std::function<RangeWithSlopes(const Flow::Derivatives&)>;

double WidthOf(const Interval& range) { return range.upper - range.lower; }

std::optional<Interval> Intersection(const Interval& a, const Interval& b) {
  const Interval both(std::max(a.lower, b.lower), std::min(a.upper, b.upper));
  return both.lower <= both.upper ? std::optional(both) : std::nullopt;
}

// ---- The largest value of a quantity over a box, by branch and bound.

class MotionSearch {
 public:
  // Values up to `least` are of no interest. It ends where `stops` says so.
  MotionSearch(const Flow& flow, Quantity quantity, const SlopeBoundOptions& options, double least,
               const std::function<bool()>& stops)
      : flow_(flow), quantity_(std::move(quantity)), options_(options), stops_(stops) {
    found_.lower = least;
  }

  MotionBound Run(const Arguments& region) {
    root_ = region;
    Push(region);
    while (true) {
      found_.upper = pieces_.top().bound;
      if (IsEnough(found_.upper) || stops_() || !Cut()) break;
    }
    found_.reached = IsEnough(found_.upper);
    return found_;
  }

 private:
  struct Piece {
    double bound;
    std::size_t number, cut;
    Arguments box;

    // Of infinite bounds the newest goes first: it is cut down to a box that has none, or to finite ones.
    bool operator<(const Piece& other) const {
      return bound != other.bound ? bound < other.bound : number < other.number;
    }
  };

  [[nodiscard]] bool IsEnough(double bound) const {
    return bound <= AddDown(found_.lower, MulDown(options_.gap, std::abs(found_.lower)));
  }

  RangeWithSlopes Evaluate(const Arguments& box) {
    ++found_.boxes;
    flow_.Enclose(box, derivatives_);
    return quantity_(derivatives_);
  }

  // Adds a box, after every argument in which the quantity is monotone is set to its better end.
  void Push(Arguments box) {
    RangeWithSlopes range = Evaluate(box);
    while (range.value.IsFinite() && MoveToBetterEnds(range, box)) range = Evaluate(box);
    std::size_t cut = 0;
    const double bound = BoundOver(range, box, cut);
    pieces_.push({bound, pieces_pushed_++, cut, std::move(box)});
  }

  // Sets each argument in which the quantity is monotone to its better end, and says whether there was one.
  static bool MoveToBetterEnds(const RangeWithSlopes& range, Arguments& box) {
    bool moved = false;
    for (std::size_t i = 0; i < box.size(); ++i) {
      const Interval& slope = range.gradient[i];
      if (!(box[i].lower < box[i].upper) || (slope.lower < 0 && slope.upper > 0)) continue;
      box[i] = slope.lower >= 0 ? box[i].upper : box[i].lower;
      moved = true;
    }
    return moved;
  }

  // The lesser of the natural enclosure and the mean-value form, which is expanded around a point that may raise the
  // lower bound. `cut` becomes the argument that costs most.
  double BoundOver(const RangeWithSlopes& range, const Arguments& box, std::size_t& cut) {
    const bool expands =
        range.value.IsFinite() && std::ranges::all_of(std::span(range.gradient).first(box.size()),
                                                      [](const Interval& slope) { return slope.IsFinite(); });
    Arguments point = box;
    double excess = 0, most = -1;
    for (std::size_t i = 0; i < box.size(); ++i) {
      double score = Share(box, i);
      point[i] = box[i].Middle();
      if (expands && box[i].lower < box[i].upper) {
        const ExpansionPoint expansion = ExpandForUpperBound(box[i], range.gradient[i]);
        point[i] = expansion.point;
        excess = AddUp(excess, expansion.excess);
        score = range.gradient[i].Magnitude() * WidthOf(box[i]);
      }
      if (score > most && CanBeCut(box[i])) {
        most = score;
        cut = i;
      }
    }
    const Interval there = Evaluate(point).value;
    if (there.IsFinite()) found_.lower = std::max(found_.lower, there.lower);
    if (!range.value.IsFinite()) {
      cut = CutOfPole(box, cut);
      return kInfinity;
    }
    return expands && there.IsFinite() ? std::min(range.value.upper, AddUp(there.upper, excess)) : range.value.upper;
  }

  // The argument that matters where there is no finite enclosure: one without whose width there is one, if there is
  // such.
  std::size_t CutOfPole(const Arguments& box, std::size_t otherwise) {
    std::size_t best = otherwise;
    double widest = 0;
    for (std::size_t i = 0; i < box.size(); ++i) {
      if (!(Share(box, i) > widest) || !CanBeCut(box[i])) continue;
      Arguments without = box;
      without[i] = box[i].Middle();
      if (!Evaluate(without).value.IsFinite()) continue;
      best = i;
      widest = Share(box, i);
    }
    return best;
  }

  static bool CanBeCut(const Interval& range) {
    const double middle = range.Middle();
    return range.lower < middle && middle < range.upper;
  }

  [[nodiscard]] double Share(const Arguments& box, std::size_t i) const {
    const double whole = WidthOf(root_[i]);
    return whole > 0 ? WidthOf(box[i]) / whole : 0;
  }

  // Halves the box of the largest bound. False if that is not possible.
  bool Cut() {
    if (found_.boxes >= options_.max_boxes) return false;
    Arguments box = pieces_.top().box;
    Interval& range = box[pieces_.top().cut];
    if (!CanBeCut(range)) return false;
    pieces_.pop();
    const Interval above(range.Middle(), range.upper);
    range.upper = above.lower;
    Push(box);
    range = above;
    Push(std::move(box));
    return true;
  }

  const Flow& flow_;
  Quantity quantity_;
  const SlopeBoundOptions options_;
  const std::function<bool()>& stops_;
  Arguments root_;
  Flow::Derivatives derivatives_;
  std::priority_queue<Piece> pieces_;
  std::size_t pieces_pushed_ = 0;
  MotionBound found_;
};

RangeWithSlopes Negated(RangeWithSlopes range) {
  range.value = -range.value;
  for (Interval& slope : range.gradient) slope = -slope;
  return range;
}

// Before the first bound is searched for.
bool IsStopped(const SampledMotion& motion) { return motion.watch && motion.watch(0, 1); }

[[noreturn]] void FailWithoutBound(const SampledMotion& motion) {
  if (IsStopped(motion))
    throw std::runtime_error(
        "stopped before there was any bound on the motion between two samples; give it more time, or narrow `domain`");
  throw std::runtime_error(
      "no finite bound on the motion between two samples: the equations have none over the states that it can reach "
      "from the domain within one step; narrow `domain`");
}

// ---- Where a motion is between two samples.

// The range of a quantity over a box. Where the equations have no finite enclosure over the whole of it, as if a
// denominator were zero, they may have one over its pieces.
Interval RangeOver(const SampledMotion& motion, const Quantity& quantity, const Arguments& box) {
  const std::function<bool()> stops = [&] { return IsStopped(motion); };
  const auto largest = [&](const Quantity& side) {
    double upper = kInfinity;
    for (const std::size_t boxes : {300, 20'000})  // it need not be tight
      if (upper == kInfinity)
        upper = MotionSearch(motion.flow, side, {.gap = 0.1, .max_boxes = boxes}, -kInfinity, stops).Run(box).upper;
    return upper;
  };
  return {-largest([&](const Flow::Derivatives& d) { return Negated(quantity(d)); }), largest(quantity)};
}

Quantity First(std::size_t k) {
  return [k](const Flow::Derivatives& d) { return d.first[k]; };
}
Quantity Second(std::size_t k) {
  return [k](const Flow::Derivatives& d) { return d.second[k]; };
}

// The range of x' or x'' of each state over a box. Nothing if one has none.
using Derivative = Quantity (*)(std::size_t);
std::optional<Arguments> RangesOver(const SampledMotion& motion, Derivative derivative, const Arguments& box) {
  Flow::Derivatives whole;
  motion.flow.Enclose(box, whole);
  Arguments ranges;
  for (std::size_t k = 0; k < ToSize(motion.domain.state.dim()); ++k) {
    const Quantity quantity = derivative(k);
    Interval range = quantity(whole).value;
    if (!range.IsFinite()) range = RangeOver(motion, quantity, box);
    if (!range.IsFinite()) return std::nullopt;
    ranges.push_back(range);
  }
  return ranges;
}

Arguments RequiredRangesOver(const SampledMotion& motion, Derivative derivative, const Arguments& box) {
  if (auto ranges = RangesOver(motion, derivative, box)) return std::move(*ranges);
  FailWithoutBound(motion);
}

// B with Z + [0, period] f(B) in B, so no motion that begins in Z leaves B within a period (Picard). `end` becomes a
// box in which it is after the period.
std::optional<Arguments> ReachableIn(const SampledMotion& motion, const Arguments& start, double period,
                                     Arguments& end) {
  constexpr int kRounds = 30;
  constexpr double kWider = 1.05, kDiverges = 30;
  Arguments box = start, moved_first;
  for (int round = 0; round < kRounds; ++round) {
    const auto rates = RangesOver(motion, First, box);
    if (!rates) return std::nullopt;
    bool is_inside = true;
    Arguments wider = box;
    for (std::size_t k = 0; k < rates->size(); ++k) {
      const Interval moved = Interval(0, period) * (*rates)[k], after = start[k] + moved;
      if (round == 0) moved_first.push_back(moved);
      const double first_way = WidthOf(moved_first[k]);  // zero where nothing moves yet
      if (first_way > 0 && WidthOf(moved) > kDiverges * first_way) return std::nullopt;
      is_inside = is_inside && box[k].lower <= after.lower && after.upper <= box[k].upper;
      wider[k] = Join(box[k], start[k] + Interval(kWider) * moved);
    }
    if (is_inside) {
      end = start;
      for (std::size_t k = 0; k < rates->size(); ++k) end[k] = start[k] + Interval(period) * (*rates)[k];
      return box;
    }
    box = wider;
  }
  return std::nullopt;
}

// The same, in halves of the period if there is no such box for the whole.
std::optional<Arguments> ReachableInParts(const SampledMotion& motion, const Arguments& start, double period,
                                          int halvings, Arguments& end) {
  if (auto box = ReachableIn(motion, start, period, end)) return box;
  if (halvings == 0) return std::nullopt;
  Arguments middle;
  const auto first = ReachableInParts(motion, start, period / 2, halvings - 1, middle);
  if (!first) return std::nullopt;
  auto second = ReachableInParts(motion, middle, period / 2, halvings - 1, end);
  if (!second) return std::nullopt;
  std::ranges::transform(*first, *second, second->begin(),
                         [](const Interval& a, const Interval& b) { return Join(a, b); });
  return second;
}

// A box that no motion from Z leaves within a period.
Arguments Reachable(const SampledMotion& motion, const Arguments& start) {
  constexpr int kHalvings = 5;
  Arguments end;
  if (auto box = ReachableInParts(motion, start, motion.period, kHalvings, end)) return std::move(*box);
  FailWithoutBound(motion);
}

// Cuts a range down to what it has in common with another one. False if that is nothing.
bool CutDown(Interval& range, const Interval& to) {
  const auto both = Intersection(range, to);
  if (both) range = *both;
  return both.has_value();
}

// Whether a box shrank by more than a hundredth in some argument.
bool IsMuchSmaller(const Arguments& box, const Arguments& before) {
  for (std::size_t k = 0; k < box.size(); ++k)
    if (WidthOf(box[k]) < 0.99 * WidthOf(before[k])) return true;
  return false;
}

// From one sample in `start` to the next in `end`, at most a period later: the motion is near the chord, a bounded way
// on from `start`, and a bounded way back from `end`. `box` holds all of it. Nothing if there is no such motion.
std::optional<Arguments> BetweenSamples(const SampledMotion& motion, const Arguments& start, const Arguments& end,
                                        Arguments box) {
  constexpr int kRounds = 12;
  const Interval period(0, motion.period);
  const Interval eighth = Interval(motion.period) * Interval(motion.period) / Interval(8);
  for (int round = 0; round < kRounds; ++round) {
    const Arguments first = RequiredRangesOver(motion, First, box), second = RequiredRangesOver(motion, Second, box);
    const Arguments before = box;
    for (std::size_t k = 0; k < first.size(); ++k) {
      const double away = (eighth * Interval(second[k].Magnitude())).upper;
      const Interval moved = period * first[k];
      if (!CutDown(box[k], Join(start[k], end[k]) + Interval(-away, away)) || !CutDown(box[k], start[k] + moved) ||
          !CutDown(box[k], end[k] - moved))
        return std::nullopt;
    }
    if (!IsMuchSmaller(box, before)) break;
  }
  return box;
}

// Where the last step of a plan ends. Nothing if none that begins in the domain ends at rest.
std::optional<Arguments> EndsOfLastStep(const SampledMotion& motion, const Arguments& reachable) {
  Arguments end = reachable;
  for (std::size_t k = 0; k < ToSize(motion.domain.state.dim()); ++k) {
    const double rest = motion.rest[static_cast<Eigen::Index>(k)];
    if (!CutDown(end[k], Interval(-rest, rest))) return std::nullopt;
  }
  return end;
}

// ---- Bounds.

// Searches that are done, and all of them.
struct Searches {
  double done = 0, all = 1;
};

// The largest magnitude of any of the quantities.
MotionBound BoundMagnitude(const SampledMotion& motion, const std::vector<Quantity>& quantities,
                           const std::vector<Arguments>& regions, const SlopeBoundOptions& options,
                           Searches& searches) {
  const std::function<bool()> stops = [&] {
    return motion.watch && motion.watch(searches.done / searches.all, (searches.done + 1) / searches.all);
  };
  MotionBound all;
  for (const Quantity& quantity : quantities) {
    for (const Arguments& region : regions) {
      for (const bool negated : {false, true}) {
        const auto side = [&](const Flow::Derivatives& d) { return negated ? Negated(quantity(d)) : quantity(d); };
        const MotionBound one = MotionSearch(motion.flow, side, options, all.lower, stops).Run(region);
        ++searches.done;
        all.upper = std::max(all.upper, one.upper);
        all.lower = std::max(all.lower, one.lower);
        all.boxes += one.boxes;
      }
    }
  }
  if (!(all.upper < kInfinity)) FailWithoutBound(motion);
  all.reached = all.upper <= (1 + options.gap) * all.lower;
  return all;
}

// The second derivative of a safety coordinate: a row of P times x''.
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

Quantity AccelerationOfPlace(std::size_t i) {
  return [i](const Flow::Derivatives& d) { return d.places[i]; };
}

// ---- Recorded motion.

constexpr double kWholeTurn = 2 * std::numbers::pi;

// From the state in which transition i begins to its successor, without the turns of an angle that a record adds.
Eigen::VectorXd StepOf(const NominalModel& model, const Transitions& transitions, Eigen::Index i) {
  const Eigen::Index n = transitions.x_next.cols();
  Eigen::VectorXd next = transitions.x_next.row(i);
  if (!model.angles().empty()) {
    const Eigen::VectorXd z = transitions.z.row(i);
    std::array<double, kMaxStates> expected;
    model.Evaluate({z.data(), ToSize(z.size())}, {expected.data(), ToSize(n)});
    for (const int k : model.angles()) next[k] += kWholeTurn * std::round((expected[ToSize(k)] - next[k]) / kWholeTurn);
  }
  return next - transitions.z.row(i).head(n).transpose();
}

// Whether transition i begins where the one before it ends; an angle, up to turns and their rounding.
bool FollowsTheOneBefore(const NominalModel& model, const Transitions& transitions, Eigen::Index i) {
  constexpr double kRounding = 0x1p-48;
  for (int k = 0; k < static_cast<int>(transitions.x_next.cols()); ++k) {
    const double ended = transitions.x_next(i - 1, k), begins = transitions.z(i, k);
    if (ended != begins && !(model.IsAngle(k) && std::abs(std::remainder(ended - begins, kWholeTurn)) <= kRounding))
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
  const Arguments start = motion.domain.Ranges(), reachable = Reachable(motion, start);
  std::vector<Arguments> regions;
  for (const auto& end : {std::optional(start), EndsOfLastStep(motion, reachable)}) {
    const auto box = end ? BetweenSamples(motion, start, *end, reachable) : std::nullopt;
    if (box) regions.push_back(*box);
  }
  MotionBounds bounds;
  const auto p = ToSize(motion.projection.rows());
  const std::size_t quantities_of_all = p + motion.flow.num_places() + (motion.heading < 0 ? 0 : 2);
  const std::size_t in_regions = quantities_of_all * std::max<std::size_t>(regions.size(), 1);
  Searches searches{0, static_cast<double>(2 * (in_regions + motion.rates_of.size()))};
  for (std::size_t k = 0; k < p; ++k) {
    std::vector<Quantity> quantities{AccelerationAlong(motion.projection.row(static_cast<Eigen::Index>(k)))};
    for (std::size_t i = k; i < motion.flow.num_places(); i += p) quantities.push_back(AccelerationOfPlace(i));
    bounds.acceleration.push_back(BoundMagnitude(motion, quantities, regions, options, searches));
  }
  if (!motion.rates_of.empty()) {
    SampledMotion longer = motion;
    longer.period = motion.rates_period;
    const Arguments within = Reachable(longer, start);
    for (const int k : motion.rates_of)
      bounds.rates.push_back(BoundMagnitude(motion, {First(ToSize(k))}, {within}, options, searches));
    Eigen::VectorXd lower(std::ssize(within)), upper(lower.size());
    for (Eigen::Index i = 0; i < lower.size(); ++i)
      lower[i] = within[ToSize(i)].lower, upper[i] = within[ToSize(i)].upper;
    bounds.reachable = Box(lower, upper);
  }
  if (motion.heading < 0) return bounds;
  const auto heading = ToSize(motion.heading);
  bounds.turn_rate = BoundMagnitude(motion, {First(heading)}, regions, options, searches);
  bounds.turn_acceleration = BoundMagnitude(motion, {Second(heading)}, regions, options, searches);
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
