#include "forereach/dynamics/staged_model.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "forereach/dynamics/chain_rule.h"
#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/nested_program.h"
#include "forereach/dynamics/stages.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/interval_pair.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {
namespace {

using Columns = std::uint32_t;  // a set of them, by bits

// Which derivatives of the successor may be different from zero.
struct Pattern {
  std::array<Columns, kMaxStates> first{};
  std::array<std::array<Columns, kMaxStates>, kMaxStates> second{};  // of output k by state i: the other states
};

// By propagation of what depends on what.
Pattern PatternOf(const Program& rates, std::size_t stages) {
  const auto n = ToSize(rates.states);
  Pattern argument, sum;
  for (std::size_t j = 0; j < n; ++j) argument.first[j] = sum.first[j] = 1u << j;
  for (std::size_t s = 0; s < stages; ++s) {
    Pattern rate;
    for (const Program::First& entry : rates.jacobian) {
      const auto j = ToSize(entry.row), l = ToSize(entry.column);
      rate.first[j] |= l < n ? argument.first[l] : 1u << l;
      for (std::size_t i = 0; i < n && l < n; ++i) rate.second[j][i] |= argument.second[l][i];
    }
    for (const Program::Second& entry : rates.hessian) {
      const Columns a = argument.first[ToSize(entry.row)], b = argument.first[ToSize(entry.column)];
      for (std::size_t i = 0; i < n; ++i)
        rate.second[ToSize(entry.output)][i] |= (a >> i & 1 ? b : 0) | (b >> i & 1 ? a : 0);
    }
    for (std::size_t j = 0; j < n; ++j) {
      argument.first[j] = 1u << j | rate.first[j];
      argument.second[j] = rate.second[j];
      sum.first[j] |= rate.first[j];
      for (std::size_t i = 0; i < n; ++i) sum.second[j][i] |= rate.second[j][i];
    }
  }
  return sum;
}

// In the order of the sets of outputs that have them: a cell of the chain rule then is zero in most outputs, or in
// none.
template <class Key>
std::vector<Key> Ordered(const std::map<Key, std::uint32_t>& outputs) {
  std::vector<Key> keys;
  for (const auto& [key, set] : outputs) keys.push_back(key);
  std::ranges::stable_sort(keys, {},
                           [&](const Key& key) { return std::pair(std::popcount(outputs.at(key)), outputs.at(key)); });
  return keys;
}

}  // namespace

// The integrator's evaluations, the rates over boxes, and the chain rule for Jacobian and Hessians.
class StagedModel::Stages final {
 public:
  Stages(std::shared_ptr<const ProgramDraft> rates, ModelText::Integrator integrator, double dt,
         std::span<const Interval> parameters)
      : draft_(std::move(rates)),
        rates_(draft_->View()),
        evaluations_(EvaluationsOf(integrator)),
        dt_(dt),
        nested_(rates_, parameters) {
    if (!HasStages(integrator)) throw std::invalid_argument("a model with stages needs the integrator midpoint or rk4");
    values_needed_.assign(ToSize(rates_.size), 0);
    for (const int node : rates_.value) values_needed_[ToSize(node)] = 1;
    MarkOperands(rates_.nodes, values_needed_);
    MakeRules();
    for (const StageEvaluation& evaluation : evaluations_)
      for (const StepPart* part : {&evaluation.before, &evaluation.weight})
        parts_.push_back(PairOf(part->Of<Interval>(dt), part->Of<Interval>(dt)));
  }

  [[nodiscard]] Program Lists() const {
    Program lists;
    lists.states = rates_.states;
    lists.variables = rates_.variables;
    lists.jacobian = jacobian_;
    lists.num_first = static_cast<int>(jacobian_.size());
    lists.hessian = hessian_;
    lists.num_second = static_cast<int>(hessian_.size());
    return lists;
  }

  void Evaluate(std::span<const double> z, std::span<const double> parameters,
                std::span<long double> next) const noexcept {
    const auto n = ToSize(rates_.states);
    std::array<long double, kMaxVariables> at{};
    std::array<long double, kMaxStates> k{}, sum{};
    std::ranges::copy(z, at.begin());
    const std::span values(FOREREACH_ON_STACK(long double, rates_.size), ToSize(rates_.size));
    for (const StageEvaluation& evaluation : evaluations_) {
      const auto before = evaluation.before.Of<long double>(dt_), weight = evaluation.weight.Of<long double>(dt_);
      for (std::size_t j = 0; j < n; ++j) at[j] = z[j] + before * k[j];
      forereach::Evaluate<long double>(rates_, values_needed_, parameters, {at.data(), z.size()}, values);
      for (std::size_t j = 0; j < n; ++j) sum[j] += weight * (k[j] = values[ToSize(rates_.value[j])]);
    }
    for (std::size_t j = 0; j < n; ++j) next[j] = z[j] + sum[j];
  }

  void LinearizeOver(std::span<const Interval> box, Linearization& out) const noexcept {
    const auto finish = [&](const Result& result) {
      for (std::size_t k = 0; k < ToSize(rates_.states); ++k)
        out.value[k] = result.first != nullptr ? LoadInterval(result.next + k * kLaneCount + 2) : Interval::Entire();
      out.count = static_cast<int>(jacobian_.size());
      for (std::size_t e = 0; e < jacobian_.size(); ++e)
        out.entries[e] = {jacobian_[e].row, jacobian_[e].column, RangeAt(result.first, first_places_[e])};
    };
    Run({box, box, kFirst | kFirstIsOuter}, finish);
  }

  void EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept {
    const auto finish = [&](const Result& result) {
      out.count = static_cast<int>(hessian_.size());
      for (std::size_t e = 0; e < hessian_.size(); ++e)
        out.entries[e] = {hessian_[e].output, hessian_[e].row, hessian_[e].column,
                          RangeAt(result.second, second_places_[e])};
    };
    Run({box, box, kSecond}, finish);
  }

  void EncloseExpansion(std::span<const Interval> point, std::span<const Interval> box, Expansion& out,
                        ExpansionError& error) const noexcept {
    const auto finish = [&](const Result& result) {
      for (std::size_t k = 0; k < ToSize(rates_.states); ++k) {
        const Interval value =
            result.first != nullptr ? LoadInterval(result.next + k * kLaneCount) : Interval::Entire();
        out.value[k] = value.Middle();
        error.value[k] = value.DistanceUpper(out.value[k]);
      }
      for (std::size_t e = 0; e < jacobian_.size(); ++e) {
        const double* const entry = result.first + first_places_[e];
        out.jacobian[e] = result.first != nullptr ? entry[0] : 0;
        error.jacobian[e] = result.first != nullptr ? entry[kLaneCount] : kInfinity;
        error.jacobian_size[e] = std::abs(out.jacobian[e]);
      }
      for (std::size_t e = 0; e < hessian_.size(); ++e) {
        const Interval range = RangeAt(result.second, second_places_[e]);
        out.hessian[e] = {range.lower, range.upper};
        error.hessian[e] = 0;
      }
    };
    Run({point, box, kFirst | kSecond}, finish);
  }

 private:
  // What is wanted: first derivatives over the inner box or the outer one, second derivatives over the outer one.
  static constexpr unsigned kFirst = 1, kFirstIsOuter = 2, kSecond = 4;
  struct Request {
    std::span<const Interval> inner, outer;
    unsigned wanted;
  };
  // The cells of both rules, null where a number was not moderate; and the pairs of the next state.
  struct Result {
    const double *first, *second, *next;
  };
  // The pairs of variables and of the next state, and what is computed on the way.
  struct Work {
    alignas(32) std::array<double, kLaneCount * ToSize(kMaxVariables)> z;
    alignas(32) std::array<double, kLaneCount * ToSize(kMaxStates)> next;
    double *values, *factors;
  };

  // Columns are the variables, and those states by which the successor has second derivatives.
  void MakeRules() {
    const auto n = ToSize(rates_.states);
    const Pattern pattern = PatternOf(rates_, evaluations_.size());
    std::map<int, Columns> columns, bent;
    std::map<std::pair<int, int>, Columns> pairs;
    for (std::size_t k = 0; k < n; ++k)
      for (short l = 0; l < rates_.variables; ++l) {
        if ((pattern.first[k] >> l & 1) == 0) continue;
        jacobian_.push_back({static_cast<short>(k), l, -1, false});
        columns[l] |= 1u << k;
        for (short i = 0; i <= l && l < rates_.states; ++i) {
          if ((pattern.second[k][ToSize(i)] >> l & 1) == 0) continue;
          hessian_.push_back({static_cast<short>(k), i, l, -1});
          pairs[{i, l}] |= 1u << k;
          bent[i] |= 1u << k;
          bent[l] |= 1u << k;
        }
      }
    std::vector<ChainRule::Pair> ordered;
    for (const auto& [i, l] : Ordered(pairs)) ordered.push_back({i, l});
    rules_.emplace_back(rates_, evaluations_, dt_, Ordered(columns), std::vector<ChainRule::Pair>());
    rules_.emplace_back(rates_, evaluations_, dt_, Ordered(bent), std::move(ordered));
    for (const Program::First& entry : jacobian_) first_places_.push_back(rules_[0].Place(entry.row, entry.column));
    for (const Program::Second& entry : hessian_)
      second_places_.push_back(rules_[1].Place(entry.output, {entry.row, entry.column}));
    for (const int node : rates_.value) value_places_.push_back(nested_.PairPlace(node));
    for (const Program::First& entry : rates_.jacobian) slope_places_.push_back(nested_.PairPlace(entry.node));
    for (const Program::Second& entry : rates_.hessian) bend_places_.push_back(nested_.OuterPlace(entry.node));
    if (bend_places_.size() % 2 != 0) bend_places_.push_back(bend_places_.back());
  }

  // A number of a rule, rounded outward; unbounded without one.
  static Interval RangeAt(const double* cells, std::size_t place) {
    if (cells == nullptr) return Interval::Entire();
    const double center = cells[place], radius = cells[place + kLaneCount],
                 distance = radius + (std::abs(center) + radius) * 0x1p-51;
    return {center - distance, center + distance};
  }

  template <class Finish>
  void Run(const Request& request, const Finish& finish) const noexcept {
    const InstructionSet instructions = BestInstructionSet();
    Work work;
    work.values = FOREREACH_ON_STACK(double, nested_.size());
    work.factors = FOREREACH_ON_STACK(double, ToSize(kFactorBlock) * (slope_places_.size() + bend_places_.size() / 2));
    bool first = (request.wanted & kFirst) != 0, second = (request.wanted & kSecond) != 0;
    double* const first_cells = FOREREACH_ON_STACK(double, first ? rules_[0].size() : 0);
    double* const second_cells = FOREREACH_ON_STACK(double, second ? rules_[1].size() : 0);
    if (first) rules_[0].Begin(first_cells);
    if (second) rules_[1].Begin(second_cells);
    nested_.Begin(work.values);
    const bool is_moderate = Begin(request, work);
    first = first && is_moderate;
    second = second && is_moderate;
    for (std::size_t s = 0; s < evaluations_.size() && (first || second); ++s) {
      const NestedProgram::Moderate is = nested_.Evaluate(second, work.values, instructions);
      const bool first_is_outer = (request.wanted & kFirstIsOuter) != 0;
      first = first && (first_is_outer ? is.outer : is.inner);
      second = second && is.outer;
      Dispatch<&Stages::UseRates>(instructions, *this, s, second, work);
      first = first && rules_[0].Advance(s, work.factors - (first_is_outer ? 0 : 2), first_cells, instructions);
      second = second && rules_[1].Advance(s, work.factors, second_cells, instructions);
    }
    finish({first ? first_cells : nullptr, second ? second_cells : nullptr, work.next.data()});
  }

  // False unless all variables are moderate, hence all arguments nearly so: those of a stage are at most dt <= 60 times
  // a moderate number away.
  [[nodiscard]] bool Begin(const Request& request, Work& work) const noexcept {
    LaneMask is_moderate = AllLanes(0) == AllLanes(0);
    for (std::size_t l = 0; l < request.inner.size(); ++l) {
      const Lanes z = PairOf(request.inner[l], request.outer[l]);
      is_moderate &= IsModerate(z);
      StoreLanes(z, work.values + l * kLaneCount);
      StoreLanes(z, &work.z[l * kLaneCount]);
      if (l < ToSize(rates_.states)) StoreLanes(z, &work.next[l * kLaneCount]);
    }
    return BitsOf(is_moderate) == 15;
  }

  // Makes factors of the rates' derivatives, and adds the rates to the next state and to the argument of the next
  // stage.
  void UseRates(std::size_t s, bool second, Work& work) const noexcept {
    double* to = work.factors;
    for (const int place : slope_places_) {
      StoreFactors(LoadLanes(work.values + place), to);
      to += kFactorBlock;
    }
    for (std::size_t e = 0; second && e < bend_places_.size(); e += 2, to += kFactorBlock) {
      const double *one = work.values + bend_places_[e], *other = work.values + bend_places_[e + 1];
      StoreFactors(Lanes{one[0], one[1], other[0], other[1]}, to);
    }
    std::array<Lanes, ToSize(kMaxStates)> rate;  // which may be variables
    const std::size_t n = value_places_.size();
    for (std::size_t j = 0; j < n; ++j) rate[j] = LoadLanes(work.values + value_places_[j]);
    const auto add = [&](const double* from, const Lanes& part, double* to_state) __attribute__((always_inline)) {
      for (std::size_t j = 0; j < n; ++j)
        StoreLanes(Plus(LoadLanes(from + j * kLaneCount), Times(rate[j], part)), to_state + j * kLaneCount);
    };
    if (!evaluations_[s].weight.is_nothing()) add(work.next.data(), parts_[2 * s + 1], work.next.data());
    if (s + 1 < evaluations_.size()) add(work.z.data(), parts_[2 * s + 2], work.values);
  }

  std::shared_ptr<const ProgramDraft> draft_;
  Program rates_;
  std::vector<StageEvaluation> evaluations_;
  double dt_;
  std::vector<unsigned char> values_needed_;
  NestedProgram nested_;
  std::vector<ChainRule> rules_;  // of first and of second derivatives
  std::vector<Lanes> parts_;      // of the step, before and weight of each stage
  std::vector<int> value_places_, slope_places_, bend_places_;
  std::vector<Program::First> jacobian_;  // of the successor
  std::vector<Program::Second> hessian_;
  std::vector<std::size_t> first_places_, second_places_;  // of their entries in the cells of the rules
};

StagedModel::StagedModel(std::shared_ptr<const ProgramDraft> rates, double dt, std::vector<Interval> parameters,
                         ModelNames names)
    : StagedModel(std::make_shared<const Stages>(
                      std::move(rates), names.text == nullptr ? ModelText::Integrator::kNone : names.text->integrator,
                      dt, parameters),
                  parameters, names) {}

StagedModel::StagedModel(std::shared_ptr<const Stages> stages, std::vector<Interval> parameters, ModelNames names)
    : InterpretedModel(stages->Lists(), std::move(parameters), std::move(names)), stages_(std::move(stages)) {}

void StagedModel::EvaluateWide(std::span<const double> z, std::span<long double> next) const noexcept {
  stages_->Evaluate(z, parameters(), next);
}

void StagedModel::LinearizeOver(std::span<const Interval> box, Linearization& out) const noexcept {
  stages_->LinearizeOver(box, out);
}

void StagedModel::EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept {
  stages_->EncloseHessian(box, out);
}

void StagedModel::EncloseExpansion(std::span<const Interval> point, std::span<const Interval> box, Expansion& out,
                                   ExpansionError& error) const noexcept {
  stages_->EncloseExpansion(point, box, out, error);
}

ExpansionError StagedModel::BoundError(std::span<const Interval> /*domain*/) const {
  return ExpansionError::None(program());
}

void StagedModel::Expand(std::span<const double> /*z*/, std::span<const PlainInterval> /*box*/, Expansion& out,
                         InstructionSet /*instructions*/) const noexcept {
  out.value.fill(std::numeric_limits<double>::quiet_NaN());
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
