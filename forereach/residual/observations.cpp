#include "forereach/residual/observations.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "forereach/dynamics/angles.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/residual/growing_disturbance.h"
#include "forereach/residual/no_nominal_value.h"
#include "forereach/residual/recorded_successor.h"
#include "forereach/residual/region_grid.h"

namespace forereach {
namespace {

[[noreturn]] void Refuse(int row, const char* why) {
  throw std::invalid_argument("transition " + std::to_string(row) + ": " + why);
}

// x_next up to its last bit, less the nominal value.
Interval ResidualOf(double x_next, double unit, const Interval& nominal) {
  return Interval(x_next) + Interval(-unit, unit) - nominal;
}

// The residual for the number of turns that brings it next to zero. The division may be rounded: if the result is
// within a quarter of a turn, no other number of turns gives such a result (docs/soundness.md, 3.14).
Interval ResidualOfAngle(double x_next, const Interval& nominal) {
  const double turns = std::round((nominal.Middle() - x_next) / kTurn.lower);
  return ResidualOf(x_next, RecordedUnit(x_next, true), nominal) + Interval(turns) * kTurn;
}

bool IsWithinAQuarterTurn(const Interval& residual) {
  return -kQuarterTurn <= residual.lower && residual.upper <= kQuarterTurn;
}

[[noreturn]] void RefuseAngle(int row, const std::string& name, const Interval& residual, double error) {
  throw AmbiguousAngle(row, "transition " + std::to_string(row) + ": " + name + " is " + ToText(residual.Middle()) +
                                (error > 0 ? " +- " + RoundedUp(error, 3) : "") +
                                " rad away from the nominal model's next value, up to whole turns, which is more than "
                                "pi/2: how often it has turned cannot be told");
}

// The regions where the true z may be: for one transition a few cells of as many as there are. A side at an end is
// within, so that both its cells count.
RegionGrid GridAround(const Declaration& declaration, const Eigen::MatrixXd& z) {
  const Eigen::VectorXd least = z.colwise().minCoeff(), most = z.colwise().maxCoeff();
  std::vector<double> lower, upper;
  for (const Interval& range : declaration.BoxAround({least.data(), ToSize(least.size())}))
    lower.push_back(NextDown(range.lower));
  for (const Interval& range : declaration.BoxAround({most.data(), ToSize(most.size())}))
    upper.push_back(NextUp(range.upper));
  return RegionGrid(declaration, lower, upper);
}

// Makes the observations of one transition after another.
class Observer final {
 public:
  Observer(const NominalModel& model, const Declaration& declaration, const StepTiming& timing,
           const Transitions& transitions)
      : model_(model), declaration_(declaration), timing_(timing), has_errors_(declaration.HasErrorInZ()) {
    grown_.fill(0);
    if (declaration.AnyRegionHas(&Region::disturbance) || declaration.AnyRegionHas(&Region::noise_bound))
      regions_ = GridAround(declaration, transitions.z);
  }

  // An enclosure for each state, valid until the next call. The step lasted by up to `longer` longer than dt or
  // shorter.
  const std::array<Interval, kMaxStates>& At(std::span<const double> z, std::span<const double> x_next, double longer,
                                             bool is_exact, int row) {
    model_.Linearize(z, linear_);
    for (std::size_t k = 0; k < x_next.size(); ++k) {
      const Interval& nominal = linear_.value[k];
      residual_[k] = IsAngle(k) ? ResidualOfAngle(x_next[k], nominal)
                                : ResidualOf(x_next[k], RecordedUnit(x_next[k], false), nominal);
      if (!residual_[k].IsFinite()) throw NoNominalValue(row, Name(k), NoNominalValue::At::kLocation);
    }
    if (has_errors_ && is_exact) error_.fill(0);
    if (has_errors_ && !is_exact) BoundErrors(z);
    if (declaration_.growing || regions_)
      BoundDisturbance(is_exact ? std::vector<Interval>(z.begin(), z.end()) : declaration_.BoxAround(z));
    if (longer > 0) EncloseRate(z, longer);
    for (std::size_t k = 0; k < x_next.size(); ++k) {
      if (error_[k] > 0) residual_[k] += Interval(-error_[k], error_[k]);
      const Interval seen = residual_[k];
      if (const double most = grown_[k].upper; most > 0) residual_[k] += Interval(-most, most);
      if (longer > 0) residual_[k] += OfDuration(longer, k, MostResidual(longer, k));
      if (!residual_[k].IsFinite()) throw NoNominalValue(row, Name(k), NoNominalValue::At::kAround);
      if (IsAngle(k)) RequireTurns(seen, x_next[k], longer, k, row);
    }
    return residual_;
  }

 private:
  [[nodiscard]] bool IsAngle(std::size_t k) const { return model_.IsAngle(static_cast<int>(k)); }
  [[nodiscard]] const std::string& Name(std::size_t k) const { return model_.state_names()[k]; }

  // error_k = e_k + sum_l (sup |D_l f0_k| + L_kl) e_l, rounded up; infinite where f0_k or a slope has no bound.
  void BoundErrors(std::span<const double> z) {
    model_.LinearizeOver(declaration_.BoxAround(z), linear_);
    for (int k = 0; k < model_.num_states(); ++k) {
      double& error = error_[ToSize(k)] = declaration_.VariableError(k);
      for (int l = 0; l < model_.num_variables(); ++l)
        error = AddUp(error, MulUp(declaration_.lipschitz(k, l), declaration_.VariableError(l)));
      // f0 might jump within the box, and no slope bounds a jump (soundness 3.16).
      if (!linear_.value[ToSize(k)].IsFinite()) error = kInfinity;
    }
    for (const auto& [k, l, slope] : linear_.jacobian())
      if (const double e = declaration_.VariableError(l); e > 0)
        error_[ToSize(k)] = AddUp(error_[ToSize(k)], MulUp(slope.Magnitude(), e));
  }

  // What may have disturbed the step or its record beyond eps, if the true z is in the box.
  void BoundDisturbance(const std::vector<Interval>& box) {
    grown_.fill(0);
    if (declaration_.growing) declaration_.growing->Enclose(box, grown_);
    if (!regions_) return;
    RegionGrid::Box at;
    for (std::size_t l = 0; l < box.size(); ++l) at.lower[l] = box[l].lower, at.upper[l] = box[l].upper;
    for (std::size_t k = 0; k < ToSize(model_.num_states()); ++k) {
      const double error = AddUp(regions_->LargestBound(RegionBound::kDisturbance, k, at),
                                 regions_->LargestBound(RegionBound::kNoise, k, at));
      grown_[k] += Interval(0, SubUp(error, declaration_.ObservationError(static_cast<Eigen::Index>(k))));
    }
  }

  // w^_k + |d_k|, at most.
  [[nodiscard]] double DisturbanceAt(std::size_t k) const {
    return AddUp(declaration_.DisturbanceBound(static_cast<Eigen::Index>(k)), grown_[k].upper);
  }

  // What a step did more or less in state k because of its duration, delta g and growth (|r| + w), if |r| is at most
  // this.
  [[nodiscard]] Interval OfDuration(double longer, std::size_t k, double most) const {
    const auto around = [](double size) { return size < kInfinity ? Interval(-size, size) : Interval::Entire(); };
    if (std::ranges::count(timing_.set_at_steps, static_cast<int>(k)) > 0) return 0;
    if (const auto i = static_cast<Eigen::Index>(k); timing_.rate_bound.size() > 0 && timing_.rate_bound[i] < kInfinity)
      return around(MulUp(longer, timing_.rate_bound[i]));
    return around(AddUp(MulUp(longer, rate_[k].Magnitude()), MulUp(growth_, AddUp(most, DisturbanceAt(k)))));
  }

  // |r_k| is at most what is seen of it, what hides it, and its growth. Infinite where it may have doubled.
  [[nodiscard]] double MostResidual(double longer, std::size_t k) const {
    if (!(growth_ < 1)) return kInfinity;
    const auto i = static_cast<Eigen::Index>(k);
    const double moved = MulUp(longer, rate_[k].Magnitude());
    const double hidden = AddUp(AddUp(declaration_.ObservationError(i), moved), MulUp(growth_, DisturbanceAt(k)));
    return DivUp(AddUp(residual_[k].Magnitude(), hidden), SubDown(1, growth_));
  }

  // Another number of turns would leave three quarters of one or more for r + w + eta, whatever the duration added to
  // these: docs/soundness.md, 3.14.
  void RequireTurns(const Interval& seen, double x_next, double longer, std::size_t k, int row) const {
    Interval within = seen;
    if (longer > 0) {
      const double unit = RecordedUnit(x_next, true);
      const double error = AddUp(declaration_.ObservationError(static_cast<Eigen::Index>(k)), grown_[k].upper);
      const double most = AddUp(MulUp(3, kTurn.upper / 4), error);
      within += OfDuration(longer, k, AddUp(most, unit));
    }
    if (!IsWithinAQuarterTurn(within))
      RefuseAngle(row, Name(k), seen, longer > 0 ? within.HalfWidthUpper() : error_[k]);
  }

  void EncloseRate(std::span<const double> z, double longer) {
    rate_.fill(Interval::Entire());
    growth_ = kInfinity;
    const std::shared_ptr<const StepRate> rate = RateOf(model_);
    if (!rate) return;
    const double dt = StepOf(model_);
    growth_ = rate->Growth(DivUp(longer, dt));
    rate->Enclose(declaration_.BoxAround(z), {SubDown(dt, longer), AddUp(dt, longer)},
                  {rate_.data(), ToSize(model_.num_states())});
  }

  const NominalModel& model_;
  const Declaration& declaration_;
  const StepTiming& timing_;
  const bool has_errors_;
  std::array<Interval, kMaxStates> rate_;
  double growth_ = 0;
  Linearization linear_;
  std::array<Interval, kMaxStates> residual_;
  std::array<double, kMaxStates> error_{};
  std::optional<RegionGrid> regions_;       // where they say something of errors
  std::array<Interval, kMaxStates> grown_;  // |d_k| over the box of the true z, and what regions say beyond the least
};

}  // namespace

Observations Observe(const NominalModel& model, const Transitions& transitions) {
  return Observe(model, {}, transitions);
}

Observations Observe(const NominalModel& model, const Declaration& declaration, const Transitions& transitions,
                     const StepTiming& timing) {
  const int n = model.num_states(), count = transitions.size();
  if (count == 0) throw std::invalid_argument("transitions: none given, at least one is needed");
  if (transitions.z.cols() != model.num_variables() || transitions.x_next.cols() != n ||
      transitions.x_next.rows() != count)
    throw std::invalid_argument("transitions: sizes do not fit the model " + model.name());

  Observations observations{transitions.z, Eigen::MatrixXd(count, n), Eigen::MatrixXd(count, n)};
  Observer observer(model, declaration, timing, transitions);
  for (int i = 0; i < count; ++i) {
    const Eigen::VectorXd z = transitions.z.row(i), x_next = transitions.x_next.row(i);
    if (!z.allFinite() || !x_next.allFinite()) Refuse(i, "not finite");
    const auto& residual = observer.At({z.data(), ToSize(z.size())}, {x_next.data(), ToSize(n)}, transitions.Longer(i),
                                       declaration.given_are_exact && !transitions.IsLearned(i), i);
    for (int k = 0; k < n; ++k) {
      observations.lower(i, k) = residual[ToSize(k)].lower;
      observations.upper(i, k) = residual[ToSize(k)].upper;
    }
  }
  return observations;
}

}  // namespace forereach
