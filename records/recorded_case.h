/** Recorded decisions with everything that they were judged by, and a certifier that judges them again. */
#pragma once

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "certifier/gate/candidate_message.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certify/certifier.h"
#include "forereach/numerics/parallel.h"
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

/** Certifies the candidates of cases again, each with what the certifier knew, on several threads. What is found does
not depend on their number. In the order of the log each thread's certifier learns from case to case; another order is
as good, and slower. */
class CaseJudge {
 public:
  virtual ~CaseJudge() = default;
  CaseJudge(const CaseJudge&) = delete;
  CaseJudge& operator=(const CaseJudge&) = delete;

 protected:
  explicit CaseJudge(unsigned threads) : followers_(threads) {}

  /** Certifies a candidate again, together with others. @pre nothing is missing. */
  void Put(const RecordedCase& recorded, std::size_t place) {
    constexpr std::size_t kBatch = 256;
    if (waiting_.size() == kBatch) CertifyAgain();
    waiting_.push_back({{*recorded.candidate, ScheduleOf(*recorded.candidate, recorded.basis.task->gate),
                         recorded.decision.outcome, recorded.decision.step, place},
                        recorded.basis});
  }

  /** Certifies all that wait. Call it at the end, too. */
  void CertifyAgain() {
    std::vector<std::string> refusals(waiting_.size());
    ForEachInParallel(waiting_.size(), static_cast<unsigned>(followers_.size()),
                      [&](std::size_t i, std::size_t thread) {
                        const auto& [judged, basis] = waiting_[i];
                        const Plan plan = PlanOf(judged.candidate, judged.schedule);
                        const Certifier& certifier = followers_[thread].At(basis);
                        Zonotope initial_set;
                        try {
                          initial_set = InitialSetOf(judged.candidate);
                          certifier.Require(plan, initial_set, *basis.obstacles);
                        } catch (const std::invalid_argument& error) {
                          refusals[i] = error.what();
                          return;
                        }
                        Tube& tube = followers_[thread].tube;
                        Look(judged, certifier, certifier.Certify(plan, initial_set, *basis.obstacles, tube), tube);
                      });
    for (std::size_t i = 0; i < waiting_.size(); ++i)
      refusals[i].empty() ? Take(waiting_[i].judged) : Refuse(waiting_[i].judged, refusals[i]);
    waiting_.clear();
  }

 private:
  /** The candidate cannot be certified again. */
  virtual void Refuse(const JudgedCandidate& judged, const std::string& why) = 0;
  /** It was certified again. Called by several threads, each with another candidate. */
  virtual void Look(const JudgedCandidate& judged, const Certifier& certifier, const Decision& again,
                    const Tube& tube) = 0;
  /** The same, after the calls of Look for it and others. Take and Refuse are called in the order of Put. */
  virtual void Take(const JudgedCandidate& judged) = 0;

  // A thread's certifier, as the one of the log was.
  struct Follower {
    Tube tube;
    std::unique_ptr<Certifier> certifier;
    const Config* task = nullptr;      // the certifier's
    std::size_t begin = 0, known = 0;  // what it has learned

    const Certifier& At(const Basis& basis) {
      if (!certifier || task != basis.task || begin != basis.learned_begin || known > basis.learned_end) {
        certifier = std::make_unique<Certifier>(basis.task->problem);
        task = basis.task;
        begin = known = basis.learned_begin;
      }
      for (; known < basis.learned_end; ++known) {
        const ExecutedTransition& transition = (*basis.learned)[known];
        static_cast<void>(certifier->Learn(transition.z, transition.next, transition.longer));
      }
      return *certifier;
    }
  };

  struct Waiting {
    JudgedCandidate judged;
    Basis basis;
  };

  std::vector<Follower> followers_;  // one for each thread
  std::vector<Waiting> waiting_;     // not yet certified again
};

}  // namespace forereach
