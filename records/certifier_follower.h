/** A certifier that knows what the recorded one knew, for recorded candidates that are certified again. */
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "certifier/gate/candidate_message.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certify/batch.h"
#include "forereach/certify/certifier.h"
#include "records/timeline.h"

namespace forereach {

/** A candidate, and what was decided on it. */
struct JudgedCandidate {
  candidate_plan_t candidate;
  Schedule schedule;
  int outcome, step;      ///< decision_t's.
  std::size_t place = 0;  ///< Of the follower's own record of it.

  [[nodiscard]] bool IsAnsweredBy(const Decision& decision) const {
    return static_cast<int>(decision.outcome) == outcome && decision.step == step;
  }
};

class CertifierFollower : public TimelineUser {
 public:
  void OnStart(const Config& task) override {
    CertifyAgain();
    certifier_ = std::make_unique<Certifier>(task.problem);
  }
  void OnReload(const Config& task) override { OnStart(task); }
  void OnObstacles(Bytes, std::int64_t, SenderId) override { CertifyAgain(); }
  void OnTransition(const ExecutedTransition& transition, Bytes) override {
    CertifyAgain();
    static_cast<void>(certifier_->Learn(transition.z, transition.next, transition.longer));
  }

 protected:
  explicit CertifierFollower(unsigned threads) : threads_(threads) {}

  /** Certifies a candidate again, together with others under the same obstacles and observations. */
  void Put(const candidate_plan_t& candidate, const RecordedDecision& recorded, std::size_t place) {
    constexpr std::size_t kBatch = 256;
    obstacles_ = recorded.basis.obstacles;
    waiting_.push_back({candidate, ScheduleOf(candidate, recorded.basis.task->gate), recorded.decision.outcome,
                        recorded.decision.step, place});
    if (waiting_.size() >= kBatch) CertifyAgain();
  }

  /** Certifies all that wait. Call it at the end, too. */
  void CertifyAgain() {
    if (waiting_.empty()) return;
    std::vector<Plan> plans;
    std::vector<Zonotope> initial_sets;
    std::vector<const JudgedCandidate*> asked;
    for (const JudgedCandidate& judged : waiting_) try {
        const Zonotope initial_set = InitialSetOf(judged.candidate);
        const Plan plan = PlanOf(judged.candidate, judged.schedule);
        certifier_->Require(plan, initial_set, *obstacles_);
        plans.push_back(plan);
        initial_sets.push_back(initial_set);
        asked.push_back(&judged);
      } catch (const std::invalid_argument& error) {
        Refuse(judged, error.what());
      }
    static_cast<void>(CertifyAll(
        *certifier_, plans, initial_sets, *obstacles_, threads_,
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

  const unsigned threads_;
  std::unique_ptr<Certifier> certifier_;  // as the one of the log was when it decided on those below
  std::vector<JudgedCandidate> waiting_;  // under the obstacles below, and not yet certified again
  std::shared_ptr<const std::vector<Obstacle>> obstacles_;
};

}  // namespace forereach
