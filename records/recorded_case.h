/** Recorded decisions with everything that they were judged by, and a certifier that judges them again. */
#pragma once

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "certifier/gate/candidate_message.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certify/pieces.h"
#include "forereach/numerics/parallel.h"
#include "records/kept_obstacles.h"
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

/** A certifier that knows what the one of a case knew. It learns from case to case, so give it them in order. */
class CaseCertifier final {
 public:
  const Certifier& At(const Basis& basis) {
    if (!certifier_ || task_ != basis.task || (learned_ != basis.learned && known_ > 0) || known_ > basis.num_learned) {
      certifier_ = std::make_unique<Certifier>(basis.task->problem);
      task_ = basis.task;
      known_ = 0;
    }
    learned_ = basis.learned;
    for (; known_ < basis.num_learned; ++known_) {
      const LearnedTransitions::Each transition = (*learned_)[known_];
      static_cast<void>(certifier_->Learn(transition.z, transition.next, transition.longer));
    }
    return *certifier_;
  }

 private:
  std::unique_ptr<Certifier> certifier_;
  const Config* task_ = nullptr;      // the certifier's
  decltype(Basis::learned) learned_;  // of these it knows the first ones
  std::size_t known_ = 0;
};

/** How many pieces of X_0 (forereach/certify/pieces.h) a decision may have taken: an abstention S is of the whole. */
[[nodiscard]] inline int MostPieces(int outcome, const GateOptions& gate) {
  return outcome == decision_t::ABSTAIN_SAFETY ? 1 : gate.max_pieces;
}

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
    if (waiting_.size() == kBatch || obstacles_.AreTooMany()) CertifyAgain();
    obstacles_.Add(*recorded.basis.obstacles);
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
                        const Certifier& certifier = followers_[thread].certifier.At(basis);
                        Zonotope initial_set;
                        try {
                          initial_set = InitialSetOf(judged.candidate);
                          certifier.Require(plan, initial_set, *basis.obstacles);
                        } catch (const std::invalid_argument& error) {
                          refusals[i] = error.what();
                          return;
                        }
                        Tube& tube = followers_[thread].tube;
                        Look(judged, certifier,
                             CertifyInPieces(certifier, plan, initial_set, *basis.obstacles,
                                             MostPieces(judged.outcome, basis.task->gate), tube),
                             tube);
                      });
    for (std::size_t i = 0; i < waiting_.size(); ++i)
      refusals[i].empty() ? Take(waiting_[i].judged) : Refuse(waiting_[i].judged, refusals[i]);
    waiting_.clear();
    obstacles_ = {};
  }

 private:
  /** The candidate cannot be certified again. */
  virtual void Refuse(const JudgedCandidate& judged, const std::string& why) = 0;
  /** It was certified again. Called by several threads, each with another candidate. */
  virtual void Look(const JudgedCandidate& judged, const Certifier& certifier, const Decision& again,
                    const Tube& tube) = 0;
  /** The same, after the calls of Look for it and others. Take and Refuse are called in the order of Put. */
  virtual void Take(const JudgedCandidate& judged) = 0;

  struct Follower {
    Tube tube;
    CaseCertifier certifier;
  };

  struct Waiting {
    JudgedCandidate judged;
    Basis basis;
  };

  std::vector<Follower> followers_;  // one for each thread
  std::vector<Waiting> waiting_;     // not yet certified again
  KeptObstacles obstacles_;          // of these
};

}  // namespace forereach
