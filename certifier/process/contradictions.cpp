#include "certifier/process/contradictions.h"

#include <algorithm>

#include "forereach/certify/rates.h"
#include "forereach/residual/consistency.h"

namespace forereach {
namespace {

bool IsSame(const Contradictions::Pair& a, const Contradictions::Pair& b) {
  return a.model == b.model && a.pair.z == b.pair.z && a.pair.lower == b.pair.lower && a.pair.upper == b.pair.upper;
}

bool Contradicts(const Contradictions::Pair& one, const Digest& model, const Problem& problem) {
  const Declaration& declaration = problem.declaration;
  if (one.model != model || one.pair.num_states() != declaration.lipschitz.rows() ||
      one.pair.z.cols() != declaration.lipschitz.cols())
    return false;
  return one.pair.size() == 1 ? RateBounds(problem).FindExceeded(one.pair.lower.row(0)) != nullptr
                              : FindViolation(declaration, one.pair).has_value();
}

}  // namespace

void Contradictions::Follow(const Config& config) {
  model_ = config.grounds.model;
  declaration_digest_ = config.grounds.declaration;
  problem_ = config.problem;
  contradict_in_force_ = Contradict(config);
}

void Contradictions::Add(Pair pair) {
  if (std::ranges::any_of(pairs_, [&](const Pair& known) { return IsSame(known, pair); })) return;
  contradict_in_force_ = contradict_in_force_ || Contradicts(pair, model_, *problem_);
  pairs_.push_back(std::move(pair));
}

void Contradictions::AddReported(const Digest& model, const Digest& declaration) {
  const std::pair reported{model, declaration};
  if (std::ranges::find(reported_, reported) != reported_.end()) return;
  if (reported_.size() >= kMostReported) reported_.erase(reported_.begin());
  reported_.push_back(reported);
  contradict_in_force_ = contradict_in_force_ || reported == std::pair(model_, declaration_digest_);
}

bool Contradictions::Contradict(const Config& config) const {
  return WasReported(config) || std::ranges::any_of(pairs_, [&](const Pair& one) {
           return Contradicts(one, config.grounds.model, *config.problem);
         });
}

bool Contradictions::WasReported(const Config& config) const {
  return std::ranges::find(reported_, std::pair(config.grounds.model, config.grounds.declaration)) != reported_.end();
}

}  // namespace forereach
