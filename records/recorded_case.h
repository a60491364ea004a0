/** Recorded decisions with everything that they were judged by, and a certifier that judges them again. */
#pragma once

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "certifier/gate/candidate_message.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certify/batch.h"
#include "forereach/certify/certifier.h"
#include "records/timeline.h"

namespace forereach {

/** Why a candidate cannot be judged under this task; empty if it can, as far as Certifier::Require agrees. */
[[nodiscard]] inline std::string WhyNotJudged(const candidate_plan_t& candidate, const Config& task) {
  if (!HasSizes(candidate, *task.problem->model)) return "its candidate is not of this task's sizes";
  return WhyNoSchedule(candidate, task.gate);
}

struct RecordedCase {
  decision_t decision{};
  std::string event;                          ///< RecordedDecision::event
  std::optional<candidate_plan_t> candidate;  ///< No value if the log lacks it, or it is none.
  Basis basis;
  std::string missing;  ///< Why it cannot be judged again; empty if it can, as far as Certifier::Require agrees.
};

/** The case of a decision. It is valid as long as the decision's task. */
[[nodiscard]] inline RecordedCase CaseOf(const RecordedDecision& recorded) {
  RecordedCase made{recorded.decision, recorded.event, {}, recorded.basis, {}};
  if (recorded.candidate) made.candidate = Decoded<candidate_plan_t>(recorded.candidate->bytes);
  if (!made.candidate)
    made.missing = recorded.candidate ? "its candidate cannot be read" : "its candidate is not in the log";
  else if (!recorded.is_of_known_task)
    made.missing = "it was decided under a task that is not kept next to the log";
  else
    made.missing = WhyNotJudged(*made.candidate, *recorded.basis.task);
  return made;
}

/** A candidate, and what was decided on it. */
struct JudgedCandidate {
  candidate_plan_t candidate;
  Schedule schedule;
  int outcome, step;      ///< decision_t's.
  std::size_t place = 0;  ///< Of the judge's own record of it.

  [[nodiscard]] bool IsAnsweredBy(const Decision& decision) const {
    return static_cast<int>(decision.outcome) == outcome && decision.step == step;
  }
};

/** Certifies the candidates of cases again, each with what the certifier knew. Cases of one task in the order of the
log need one certifier, which learns from case to case; another order is as good, and slower. */
class CaseJudge {
 public:
  virtual ~CaseJudge() = default;
  CaseJudge(const CaseJudge&) = delete;
  CaseJudge& operator=(const CaseJudge&) = delete;

 protected:
  explicit CaseJudge(unsigned threads) : threads_(threads) {}

  /** Certifies a candidate again, together with others under the same obstacles and observations. @pre nothing is
  missing. */
  void Put(const RecordedCase& recorded, std::size_t place) {
    constexpr std::size_t kBatch = 256;
    if (waiting_.size() >= kBatch || !IsUnderSame(recorded.basis)) CertifyAgain();
    basis_ = recorded.basis;
    waiting_.push_back({*recorded.candidate, ScheduleOf(*recorded.candidate, basis_.task->gate),
                        recorded.decision.outcome, recorded.decision.step, place});
  }

  /** Certifies all that wait. Call it at the end, too. */
  void CertifyAgain() {
    if (waiting_.empty()) return;
    Follow(basis_);
    std::vector<Plan> plans;
    std::vector<Zonotope> initial_sets;
    std::vector<const JudgedCandidate*> asked;
    for (const JudgedCandidate& judged : waiting_) try {
        const Zonotope initial_set = InitialSetOf(judged.candidate);
        const Plan plan = PlanOf(judged.candidate, judged.schedule);
        certifier_->Require(plan, initial_set, *basis_.obstacles);
        plans.push_back(plan);
        initial_sets.push_back(initial_set);
        asked.push_back(&judged);
      } catch (const std::invalid_argument& error) {
        Refuse(judged, error.what());
      }
    static_cast<void>(CertifyAll(
        *certifier_, plans, initial_sets, *basis_.obstacles, threads_,
        [&](std::size_t i, const Decision& again, const Tube& tube) { Look(*asked[i], *certifier_, again, tube); }));
    for (const JudgedCandidate* judged : asked) Take(*judged);
    waiting_.clear();
  }

 private:
  /** The candidate cannot be certified again. */
  virtual void Refuse(const JudgedCandidate& judged, const std::string& why) = 0;
  /** It was certified again. Called by several threads, each with another candidate. */
  virtual void Look(const JudgedCandidate& judged, const Certifier& certifier, const Decision& again,
                    const Tube& tube) = 0;
  /** The same, after all calls of Look for these candidates, in their order. */
  virtual void Take(const JudgedCandidate& judged) = 0;

  [[nodiscard]] bool IsUnderSame(const Basis& basis) const {
    return basis.task == basis_.task && basis.obstacles == basis_.obstacles && basis.learned == basis_.learned &&
           basis.learned_begin == basis_.learned_begin && basis.learned_end == basis_.learned_end;
  }

  // The certifier as the one of the log was under this basis.
  void Follow(const Basis& basis) {
    if (!certifier_ || task_ != basis.task || begin_ != basis.learned_begin || known_ > basis.learned_end) {
      certifier_ = std::make_unique<Certifier>(basis.task->problem);
      task_ = basis.task;
      begin_ = known_ = basis.learned_begin;
    }
    for (; known_ < basis.learned_end; ++known_) {
      const ExecutedTransition& transition = (*basis.learned)[known_];
      static_cast<void>(certifier_->Learn(transition.z, transition.next, transition.longer));
    }
  }

  const unsigned threads_;
  std::unique_ptr<Certifier> certifier_;
  const Config* task_ = nullptr;          // of the certifier
  std::size_t begin_ = 0, known_ = 0;     // what it has learned
  std::vector<JudgedCandidate> waiting_;  // under the basis below, and not yet certified again
  Basis basis_;
};

}  // namespace forereach
