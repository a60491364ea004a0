/** A task that judges plans for Python, and its judgements. Nothing here knows Python, so all of it runs without its
lock. */
#pragma once

#include <memory>
#include <optional>
#include <shared_mutex>
#include <string>
#include <vector>

#include "advise/advice.h"
#include "forereach/certify/certifier.h"
#include "forereach/residual/learned_transitions.h"
#include "records/picture.h"
#include "task/config.h"

namespace forereach {

/** The slices X_0 .. X_length of a tube, as numbers. */
struct TubeNumbers {
  int length = -1, num_states = 0;                   ///< -1: there is none.
  std::vector<double> center = {}, half_width = {};  ///< (length + 1) * n
  std::vector<double> hull = {};                     ///< (length + 1) * n * 2, rounded outward
  std::vector<Eigen::MatrixXd> generators = {};      ///< of each slice, n-by-g
};

class JudgingTask;

/** A decision with everything that it rests on. It keeps its task alive. */
struct Judgement {
  std::shared_ptr<const JudgingTask> task;
  std::size_t num_learned = 0;    ///< Transitions that the task had observed.
  Eigen::MatrixXd controls = {};  ///< m-by-T
  Schedule schedule = {};
  Box initial_set = {};
  Decision decision = {};
  std::string message = {};
  TubeNumbers tube = {};
};
using Judgements = std::vector<std::shared_ptr<const Judgement>>;

/** Any number of threads may call any of its functions. */
class JudgingTask final : public std::enable_shared_from_this<JudgingTask> {
 public:
  /** @throws ConfigError as RequireForCertifying. @throws std::invalid_argument, std::runtime_error as Certifier. */
  explicit JudgingTask(Config config);

  [[nodiscard]] const Config& config() const { return config_; }
  [[nodiscard]] const NominalModel& model() const { return *config_.problem->model; }

  /** As `forereach certify` decides, bit for bit. Each call tests its thread's arithmetic, which other libraries of the
  process may have changed.
  @param plans m-by-T each. @param initial_sets X_0 of each plan, or one for all; none: the task's.
  @param until_certified the plans after the first certified one are not judged and left out.
  @throws std::invalid_argument as Certifier::Require and CertifyAll, std::runtime_error as RequireExactArithmetic. */
  [[nodiscard]] Judgements Certify(std::vector<Eigen::MatrixXd> plans, std::vector<Box> initial_sets, unsigned threads,
                                   bool until_certified = false) const;

  /** @throws std::invalid_argument as Certifier::Require for a plan, m-by-T, that begins in x0. */
  void Require(const Eigen::MatrixXd& controls, const Zonotope& x0) const;

  /** Certifier::Learn. It waits for the calls of Certify under way. @throws std::invalid_argument for other sizes. */
  [[nodiscard]] Learned Observe(std::vector<double> z, std::vector<double> next);
  [[nodiscard]] std::size_t num_observations() const;

  /** The task's problem with the first so many observed transitions. */
  [[nodiscard]] std::shared_ptr<const Problem> ProblemWith(std::size_t num_learned) const;
  /** All of them. */
  [[nodiscard]] std::shared_ptr<const Problem> problem() const;

 private:
  const Config config_;
  Certifier certifier_;
  LearnedTransitions learned_;
  mutable std::shared_mutex mutex_;  // the two above: Learn alone, Certify together
};

/** What would have turned it (advise/advice.h), with the braking tails of the task's planner. */
[[nodiscard]] std::vector<Advice> AdviseOn(const Judgement& judgement);

/** Its tube from above, up to the failing step, among the task's obstacles; for display, not for bounds.
@throws std::invalid_argument unless the safety coordinates are planar. */
[[nodiscard]] Picture PictureOf(const Judgement& judgement);

}  // namespace forereach
