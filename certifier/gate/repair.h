/** The nearest plan to a refused one that can be certified.

Plans are made from the refused one in plain arithmetic and tried in this order:
- kSlower: the nominal path of the progress part at a pace that falls evenly from its own to a share of it. The controls
are the least squares of the distances to this path (Gauss-Newton over all steps). A braking tail follows.
- kTail: the first controls of the plan, fewer and fewer, and then a braking tail, by each way of planner.stop.
- kPushed: the controls of the progress part move by the least, in parts of their ranges, that gives enough of what
refused the plan: clearance from that obstacle, room of that limit, bound or rest. That goes by the numerical gradient
over the nominal rollout, again by what refuses the result, and then part of the way back.
- Combinations: slower, and then pushed or with an earlier tail; an earlier tail, and then pushed.

Certifier::Certify alone decides which of them is certified: a search that goes wrong costs time and proves nothing.

Nearness is the largest distance between the nominal positions P x of two plans, metres, over the samples of the refused
plan's progress part; of equals, the largest over all samples. A plan that has ended stays where it ends. */
#pragma once

#include <array>
#include <functional>
#include <optional>

#include <Eigen/Core>

#include "certifier/gate/advice_message.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "task/motion.h"

namespace forereach {

/** What was changed: a sum of these, as advice_t has it. */
enum RepairChange : int { kSlower = 1, kTail = 2, kPushed = 4 };

struct Repair {
  Eigen::MatrixXd controls;          ///< m-by-T', 1 to kMaxSteps columns, in the box of inputs
  int progress_steps = 0;            ///< of these, before the braking tail
  int changes = 0;                   ///< a sum of RepairChange
  std::array<double, 2> nearness{};  ///< m: over the progress part, over all samples
};

/** How a robot brakes, for its tails. */
struct Tails {
  const RobotMotion* motion = nullptr;  ///< Null: nobody knows. Plans keep their own, and are only pushed.
  int max_steps = 0;                    ///< of one tail
};

/** The most plans that one search certifies. */
inline constexpr int kMostRepairTrials = 64;

/** The nearest that was found: certified by `abstained.certifier` from the same X_0, at the same times and among the
same obstacles.
@param progress_steps of the refused plan, 0..T. @param tube is overwritten.
@param goes_on asked before each plan that is made. When it says false, what was found so far is the result.
@return nothing if no plan was certified. The same for the same arguments. Cost: kMostRepairTrials certify calls, and
some rollouts for each. */
[[nodiscard]] std::optional<Repair> FindRepair(const Abstained& abstained, int progress_steps, const Tails& tails,
                                               Tube& tube, const std::function<bool()>& goes_on);

/** Whether there is a repair of a candidate with this answer: it asks for one, and the answer is an abstention D or S.
 */
[[nodiscard]] bool AsksForRepair(const candidate_plan_t& candidate, const decision_t& decision);

/** Sets what an advice_t says of a repair of this candidate. */
void SetProposal(const Repair& repair, const candidate_plan_t& candidate, advice_t& advice);

}  // namespace forereach
