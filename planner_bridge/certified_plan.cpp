#include "planner_bridge/certified_plan.h"

#include <iterator>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "forereach/certify/tube.h"
#include "planner_bridge/lessons.h"

namespace forereach {
namespace {

class PlanSearch final {
 public:
  PlanSearch(Proposer& proposer, const Certifier& certifier, const Config& config, std::uint32_t seed,
             const Schedule& schedule)
      : proposer_(proposer),
        certifier_(certifier),
        config_(config),
        initial_set_(std::make_shared<const Zonotope>(Zonotope::Enclose(config.initial_set))),
        half_width_((config.initial_set.upper() - config.initial_set.lower()) / 2),
        schedule_(schedule),
        seed_(seed * kSeedSpread),
        lessons_(config.planner, config.problem->limits.size()) {}

  CertifiedPlan Run() {
    Eigen::VectorXd start = (config_.initial_set.lower() + config_.initial_set.upper()) / 2;
    while (!found_.reaches_goal && Extend(start)) start = Center(found_.progress_steps);
    return std::move(found_);
  }

 private:
  // Adds one progress part from `start`, with a braking tail in place of the old one. False if no such plan is
  // certified; then found_ does not change. The tube only widens along the plan, so the lessons of one part hold for
  // the next.
  bool Extend(const Eigen::VectorXd& start) {
    for (int attempt = 0; attempt < config_.planner.candidates; ++attempt) {
      PlanRequest request{start, lessons_.clearance(), lessons_.DomainMargin(half_width_, config_.problem->projection),
                          seed_++, attempt};
      request.limit_margin = lessons_.limit_margin();
      // The hints give the same plan each time.
      request.may_follow_hints = attempt == 0;
      request.schedule = schedule_;
      request.initial_set = initial_set_;
      request.before = found_.controls.leftCols(found_.progress_steps);
      request.schedule.start_us += found_.progress_steps * schedule_.step_us;
      const std::optional<Proposal> part = proposer_.Propose(request);
      if (!part) continue;
      const int before = found_.progress_steps, after = before + static_cast<int>(part->controls.cols());
      if (after > kMaxSteps) return false;
      Eigen::MatrixXd controls(part->controls.rows(), after);
      if (before > 0) controls.leftCols(before) = found_.controls.leftCols(before);
      controls.rightCols(part->controls.cols()) = part->controls;
      const Decision decision = Certify(controls);
      ++found_.candidates;
      if (decision.outcome == Outcome::kCertified) {
        Keep(std::move(controls), before + part->progress_steps, decision);
        return true;
      }
      if (before == 0) found_.decision = decision;
      // No other plan is certified either.
      if (decision.outcome == Outcome::kFalsified) return false;
      lessons_.Learn(decision);
    }
    return false;
  }

  Decision Certify(const Eigen::MatrixXd& controls) {
    const Plan plan{controls.data(), static_cast<int>(controls.rows()), static_cast<int>(controls.cols()),
                    static_cast<int>(controls.rows()), schedule_};
    certifier_.Require(plan, *initial_set_, config_.obstacles);
    return certifier_.Certify(plan, *initial_set_, config_.obstacles, candidate_tube_);
  }

  void Keep(Eigen::MatrixXd controls, int progress_steps, const Decision& decision) {
    std::swap(tube_, candidate_tube_);
    found_.controls = std::move(controls);
    found_.progress_steps = progress_steps;
    found_.decision = decision;
    found_.end = Position(tube_.length());
    const std::vector<double>& goal = config_.planner.goal;
    const Eigen::Map<const Eigen::VectorXd> target(goal.data(), std::ssize(goal));
    for (int t = 0; t <= tube_.length() && !found_.reaches_goal; ++t)
      found_.reaches_goal = (Position(t) - target).norm() <= config_.planner.goal_radius;
  }

  [[nodiscard]] Eigen::VectorXd Center(int t) const {
    const std::span<const double> center = tube_.slice(t).center();
    return Eigen::Map<const Eigen::VectorXd>(center.data(), std::ssize(center));
  }
  [[nodiscard]] Eigen::VectorXd Position(int t) const { return config_.problem->projection * Center(t); }

  Proposer& proposer_;
  const Certifier& certifier_;
  const Config& config_;
  const std::shared_ptr<const Zonotope> initial_set_;
  const Eigen::VectorXd half_width_;
  const Schedule schedule_;
  std::uint32_t seed_;
  Lessons lessons_;
  Tube tube_, candidate_tube_;  // of found_; of the candidate at hand
  CertifiedPlan found_;
};

}  // namespace

CertifiedPlan FindCertifiedPlan(Proposer& proposer, const Certifier& certifier, const Config& config,
                                std::uint32_t seed, const Schedule& schedule) {
  return PlanSearch(proposer, certifier, config, seed, schedule).Run();
}

}  // namespace forereach
