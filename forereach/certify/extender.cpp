#include "forereach/certify/extender.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "forereach/certify/tube.h"

namespace forereach {

// Makes the node the end of the tube, with what the next step needs of the one before.
void Extender::Load(const TubeNode& node) {
  const std::size_t t = ToSize(node.depth_), n = ToSize(node.dim_), columns = node.numbers_.size() / n - 3;
  Zonotope& slice = tube_.slices_[t];
  ArraysOf(slice).Reset(node.dim_, static_cast<int>(columns));
  ArraysOf(slice).mutable_axes_in_slack() = node.axes_;
  const double* from = node.numbers_.data();
  const auto take = [&](double* to, std::size_t count) { std::copy_n(std::exchange(from, from + count), count, to); };
  take(ArraysOf(slice).mutable_centers(), n);
  take(tube_.steps_[t].half_width.data(), n);
  take(ArraysOf(slice).mutable_slacks(), n);
  for (int k = 0; k < node.dim_; ++k) {
    take(ArraysOf(slice).mutable_row(k), columns);
    // Sums over a row read its padding.
    std::fill(ArraysOf(slice).mutable_row(k) + columns, ArraysOf(slice).mutable_row(k) + slice.padded_size(), 0.0);
  }
  if (t > 0) tube_.steps_[t - 1].envelope.found = node.found_;
  tube_.length_ = node.depth_;
}

void Extender::Save(TubeNode& node) const {
  const int t = tube_.length();
  const Zonotope& slice = tube_.slice(t);
  const auto n = ToSize(slice.dim());
  node.depth_ = t;
  node.dim_ = slice.dim();
  node.axes_ = slice.axes_in_slack();
  if (t > 0) node.found_ = tube_.step(t - 1).envelope.found;
  node.numbers_.resize((3 + ToSize(slice.num_generators())) * n);
  double* to = node.numbers_.data();
  const auto put = [&](const double* from, std::size_t count) { to = std::copy_n(from, count, to); };
  put(slice.centers(), n);
  put(tube_.half_width(t).data(), n);
  put(slice.slacks(), n);
  for (int k = 0; k < slice.dim(); ++k) put(slice.row(k).data(), slice.row(k).size());
}

Decision Extender::Begin(const Zonotope& initial_set, TubeNode& root) {
  tube_.length_ = 0;
  return Judge({nullptr, 0, 0, 0, schedule_}, certifier_.Begin(initial_set, tube_), {}, root);
}

Decision Extender::Extend(const TubeNode& node, std::span<const double> input, TubeNode& next) {
  const int m = certifier_.problem().model->num_inputs(), t = node.depth_;
  if (std::ssize(input) != m || !std::ranges::all_of(input, [](double u) { return std::isfinite(u); }))
    throw std::invalid_argument("extend: not " + std::to_string(m) + " finite inputs");
  if (node.dim_ == 0 || t >= kMaxSteps)
    throw std::invalid_argument("extend: a node after " + std::to_string(t) +
                                " steps, must have begun, and be before " + std::to_string(kMaxSteps));
  Load(node);
  // Each of its steps has this control; only the last one is looked at.
  const Plan plan{input.data(), m, t + 1, 0, schedule_};
  return Judge(plan, certifier_.Propagate(plan, tube_), node.closest_, next);
}

// What is new at the end of the tube, if the step has succeeded: so does a whole plan, in the same order.
Decision Extender::Judge(const Plan& plan, Decision decision, const Decision& before, TubeNode& next) {
  // As if something touched before: nothing is closer, so nothing is searched.
  static constexpr Decision kTouched{.obstacle = 0, .margin = -kInfinity};
  // A limit at the sample before may be of the input that is applied there.
  const int last = tube_.length(), previous = std::max(plan.num_steps - 1, 0);
  if (decision.outcome == Outcome::kNone) decision = certifier_.JudgeBetween(tube_, previous);
  if (decision.outcome == Outcome::kNone)
    decision =
        certifier_.JudgeSafety(plan, obstacles_, tube_, previous, std::max(certifier_.safety().NumUnits(tube_) - 1, 0),
                               finds_closest_ ? before : kTouched);
  decision.capped = before.capped || (last > previous && tube_.step(previous).envelope.capped);
  if (decision.outcome != Outcome::kCertified) return decision;
  Save(next);
  next.closest_ = finds_closest_ ? decision : Decision{.capped = decision.capped};
  next.closest_.outcome = Outcome::kNone;
  return {};
}

}  // namespace forereach
