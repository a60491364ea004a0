#include "python/judgement.h"

#include <exception>
#include <iterator>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "forereach/certify/batch.h"
#include "forereach/certify/explain.h"
#include "forereach/numerics/arithmetic.h"
#include "forereach/safety/obstacle_index.h"
#include "records/decision_json.h"
#include "records/outlines.h"
#include "records/timeline.h"

namespace forereach {
namespace {

TubeNumbers NumbersOf(const Decision& decision, const Tube& tube, int num_states) {
  TubeNumbers numbers{.num_states = num_states};
  if (decision.outcome == Outcome::kFalsified && decision.step < 0) return numbers;
  numbers.length = tube.length();
  for (int t = 0; t <= tube.length(); ++t) {
    const Zonotope& slice = tube.slice(t);
    for (int k = 0; k < num_states; ++k) {
      numbers.center.push_back(slice.center(k));
      numbers.half_width.push_back(slice.HalfWidthUpper(k));
      const Interval hull = tube.hull(t, k);
      numbers.hull.insert(numbers.hull.end(), {hull.lower, hull.upper});
    }
    numbers.generators.push_back(slice.GeneratorMatrix());
  }
  return numbers;
}

Plan PlanOf(const Eigen::MatrixXd& controls, const Schedule& schedule) {
  const auto inputs = static_cast<int>(controls.rows());
  return {controls.data(), inputs, static_cast<int>(controls.cols()), inputs, schedule};
}

Case CaseOf(const Judgement& judgement) {
  return {judgement.task->ProblemWith(judgement.num_learned), judgement.controls, judgement.schedule,
          Zonotope::Enclose(judgement.initial_set), judgement.task->config().obstacles};
}

Config Certifying(Config config) {
  RequireForCertifying(config);
  return config;
}

}  // namespace

JudgingTask::JudgingTask(Config config) : config_(Certifying(std::move(config))), certifier_(config_.problem) {}

Judgements JudgingTask::Certify(std::vector<Eigen::MatrixXd> plans, std::vector<Box> initial_sets, unsigned threads,
                                bool until_certified) const {
  RequireExactArithmetic();
  if (initial_sets.empty()) initial_sets.push_back(config_.initial_set);
  std::vector<std::shared_ptr<Judgement>> all;
  std::vector<Plan> views;
  std::vector<Zonotope> sets;
  for (const Box& box : initial_sets) certifier_.Require(sets.emplace_back(Zonotope::Enclose(box)), config_.obstacles);
  for (std::size_t i = 0; i < plans.size(); ++i) {
    const auto made = std::make_shared<Judgement>(Judgement{.task = shared_from_this()});
    made->controls = std::move(plans[i]);
    made->schedule = ScheduleFromZero(config_, static_cast<int>(made->controls.cols()));
    made->initial_set = initial_sets[initial_sets.size() == 1 ? 0 : std::min(i, initial_sets.size() - 1)];
    views.push_back(PlanOf(made->controls, made->schedule));
    if (const auto misfit = certifier_.FindMisfit(views.back()))
      throw std::invalid_argument((plans.size() > 1 ? "plan " + std::to_string(i) + ": " : "") + misfit->what);
    all.push_back(made);
  }
  std::exception_ptr failure;
  std::mutex failing;
  const std::shared_lock lock(mutex_);
  const ObstacleIndex index(config_.obstacles);
  const BatchOptions options{.threads = threads, .until_certified = until_certified};
  const auto decisions = CertifyAll(certifier_, views, sets, {config_.obstacles, index}, options,
                                    [&](std::size_t i, const Decision& decision, const Tube& tube) {
                                      try {
                                        all[i]->decision = decision;
                                        all[i]->num_learned = learned_.size();
                                        all[i]->message =
                                            Explain(decision, certifier_, config_.obstacles, views[i], tube);
                                        all[i]->tube = NumbersOf(decision, tube, model().num_states());
                                      } catch (...) {
                                        const std::lock_guard guard(failing);
                                        failure = std::current_exception();
                                      }
                                    });
  if (failure) std::rethrow_exception(failure);
  all.resize(ToSize(std::ranges::find(decisions, Outcome::kNone, &Decision::outcome) - decisions.begin()));
  return {std::make_move_iterator(all.begin()), std::make_move_iterator(all.end())};
}

void JudgingTask::Require(const Eigen::MatrixXd& controls, const Zonotope& x0) const {
  certifier_.Require(PlanOf(controls, ScheduleFromZero(config_, static_cast<int>(controls.cols()))), x0,
                     config_.obstacles);
}

Learned JudgingTask::Observe(std::vector<double> z, std::vector<double> next) {
  RequireExactArithmetic();
  const auto require = [](const char* name, std::size_t size, int expected) {
    if (size != ToSize(expected))
      throw std::invalid_argument(std::string(name) + ": " + std::to_string(size) + " entries, must have " +
                                  std::to_string(expected));
  };
  require("z", z.size(), model().num_variables());
  require("x_next", next.size(), model().num_states());
  const std::unique_lock lock(mutex_);
  const Learned learned = certifier_.Learn(z, next);
  if (learned == Learned::kAdded) learned_.Add(z, next, 0);
  return learned;
}

std::size_t JudgingTask::num_observations() const {
  const std::shared_lock lock(mutex_);
  return certifier_.num_observations();
}

std::shared_ptr<const Problem> JudgingTask::ProblemWith(std::size_t num_learned) const {
  const std::shared_lock lock(mutex_);
  return WithLearned(config_.problem, learned_, num_learned);
}

std::shared_ptr<const Problem> JudgingTask::problem() const {
  const std::shared_lock lock(mutex_);
  return WithLearned(config_.problem, learned_, learned_.size());
}

std::vector<Advice> AdviseOn(const Judgement& judgement) {
  const Case judged = CaseOf(judgement);
  return Advise(judged, Certifier(judged.problem), {.tails = TailsOf(judgement.task->config())});
}

Picture PictureOf(const Judgement& judgement) {
  const Case judged = CaseOf(judgement);
  if (judged.problem->projection.rows() != 2)
    throw std::invalid_argument("plot: the task has " + std::to_string(judged.problem->projection.rows()) +
                                " safety coordinates, a picture has 2");
  Picture picture;
  picture.obstacles = judged.obstacles;
  if (judgement.tube.length < 0) return picture;
  const Certifier certifier(judged.problem);
  Tube tube;
  const Decision again = certifier.Certify(judged.plan(), judged.initial_set, judged.obstacles, tube);
  const int last = again.outcome == Outcome::kCertified ? tube.length() : again.step;
  for (std::vector<Picture::Polygon>& unit : Sweeps(certifier, tube, last))
    picture.certified.insert(picture.certified.end(), std::make_move_iterator(unit.begin()),
                             std::make_move_iterator(unit.end()));
  for (int t = 0; t <= judgement.tube.length; ++t)
    picture.path.emplace_back(
        judged.problem->projection *
        Eigen::Map<const Eigen::VectorXd>(
            judgement.tube.center.data() + static_cast<std::ptrdiff_t>(t) * judgement.tube.num_states,
            judgement.tube.num_states));
  return picture;
}

}  // namespace forereach
