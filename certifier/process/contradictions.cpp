#include "certifier/process/contradictions.h"

#include <algorithm>
#include <span>
#include <stdexcept>

#include "forereach/certify/learned.h"
#include "forereach/certify/rates.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/affine_rows_enclosure.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/regional_enclosure.h"
#include "task/step_time.h"

namespace forereach {
namespace {

bool IsSame(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && a == b;
}

bool IsSame(const Contradictions::Evidence& a, const Contradictions::Evidence& b) {
  return a.model == b.model && IsSame(a.rows.z, b.rows.z) && IsSame(a.rows.x_next, b.rows.x_next) &&
         IsSame(a.rows.longer, b.rows.longer) && a.rows.num_learned == b.rows.num_learned;
}

std::span<const double> Values(const Eigen::VectorXd& row) { return {row.data(), ToSize(row.size())}; }

// Whether every row is an observation under this task, with what then counts of its duration. One that is not says
// nothing. What a file says of a duration counts under any task.
bool AllCount(Transitions& rows, const Problem& problem, bool is_any) {
  for (int i = 0; i < rows.size(); ++i) {
    const auto longer = rows.IsLearned(i) ? CountedDuration(problem, rows.longer[i], is_any) : rows.longer[i];
    if (!longer || !IsWithin(problem, Values(rows.z.row(i)), rows.IsLearned(i))) return false;
    rows.longer[i] = *longer;
  }
  return true;
}

bool ExceedsARate(const Transitions& rows, const Problem& problem) {
  const RateBounds rates(problem);
  for (int i = 0; i < rows.size(); ++i) {
    const Eigen::VectorXd shown =
        rates.Shown(Values(rows.z.row(i)), Values(rows.x_next.row(i)), rows.longer[i], rows.IsLearned(i));
    if (rates.FindExceeded(shown) != nullptr) return true;
  }
  return false;
}

bool Contradicts(const Contradictions::Evidence& one, const Digest& model, const Problem& problem, bool is_any) try {
  const Declaration& declaration = problem.declaration;
  Transitions rows = one.rows;
  if (one.model != model || rows.x_next.cols() != declaration.lipschitz.rows() ||
      rows.z.cols() != declaration.lipschitz.cols() || !AllCount(rows, problem, is_any))
    return false;
  const Observations observed = Observe(*problem.model, declaration, rows, problem.timing);
  const auto [lower, upper] = problem.domain.Corners();
  return FindViolation(declaration, observed) || FindRegionalViolation(declaration, observed, lower, upper) ||
         FindAffineContradiction(declaration, observed, lower, upper) || ExceedsARate(rows, problem);
} catch (const std::invalid_argument&) {  // of Observe: they say nothing under this task
  return false;
}

}  // namespace

void Contradictions::Follow(const Config& config) {
  model_ = config.grounds.model;
  declaration_digest_ = config.grounds.declaration;
  problem_ = config.problem;
  is_any_ = !StepErrorUs(config.gate);
  // Another declaration may allow what contradicted the one before, and other errors explain it.
  contradict_in_force_ = Contradict(config);
}

void Contradictions::Add(Evidence one) {
  if (std::ranges::any_of(evidence_, [&](const Evidence& known) { return IsSame(known, one); })) return;
  contradict_in_force_ = contradict_in_force_ || Contradicts(one, model_, *problem_, is_any_);
  evidence_.push_back(std::move(one));
}

void Contradictions::AddReported(const Digest& model, const Digest& declaration) {
  const std::pair reported{model, declaration};
  if (std::ranges::find(reported_, reported) != reported_.end()) return;
  // Anybody who may send heartbeats may report, so their number is bounded.
  if (reported_.size() >= kMostReported) reported_.erase(reported_.begin());
  reported_.push_back(reported);
  contradict_in_force_ = contradict_in_force_ || reported == std::pair(model_, declaration_digest_);
}

bool Contradictions::Contradict(const Config& config) const {
  return WasReported(config) || std::ranges::any_of(evidence_, [&](const Evidence& one) {
           return Contradicts(one, config.grounds.model, *config.problem, !StepErrorUs(config.gate));
         });
}

bool Contradictions::WasReported(const Config& config) const {
  return std::ranges::find(reported_, std::pair(config.grounds.model, config.grounds.declaration)) != reported_.end();
}

}  // namespace forereach
