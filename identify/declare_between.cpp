#include "identify/declare_between.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <iostream>
#include <span>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "command_line/progress.h"
#include "forereach/certify/learned.h"
#include "forereach/declare/motion_bound.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/safety/clearance.h"
#include "task/config.h"
#include "task/json_text.h"
#include "task/number.h"
#include "task/step_time.h"
#include "verifier/rate_check.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

constexpr int kMotionDigits = 6;

// Neither the equations nor a second difference say how a disturbance acts between two samples.
constexpr const char* kDisturbed =
    "\ndeclaration.disturbance is a bound at the samples. What disturbs the robot accelerates it, too:\n"
    "add the largest acceleration that the disturbance causes between two samples.";

// One number of task.between.
struct MotionRow {
  std::string key, name, unit;
  MotionBound bound;
};

struct MotionProposal {
  std::vector<MotionRow> rows;
  std::string source, remark;
  double seconds = 0;
  std::string rates, unconfirmed;  // for the key model.rate_bound, if asked for; the state that is not confirmed
};

// The map to the robot's frame; zero if no part of the body stands there, so that nothing has to be said of it.
Eigen::MatrixXd FrameOf(const Problem& problem) {
  return HasFrame(problem.body) ? problem.projection
                                : Eigen::MatrixXd::Zero(problem.projection.rows(), problem.projection.cols());
}

std::vector<MotionRow> RowsOf(const Config& config, const std::vector<MotionBound>& acceleration,
                              const MotionBound& turn_rate, const MotionBound& turn_acceleration) {
  const Problem& problem = *config.problem;
  const std::vector<std::string>& states = problem.model->state_names();
  const Eigen::MatrixXd frame = FrameOf(problem);
  std::vector<MotionRow> rows;
  for (std::size_t i = 0; i < acceleration.size(); ++i) {
    std::string name;
    for (std::size_t k = 0; k < states.size(); ++k) {
      const double weight = frame(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      if (weight != 0)
        name += fmt::format("{}{}{}", name.empty() ? "" : " + ", weight == 1 ? "" : ToText(weight) + " ", states[k]);
    }
    if (!name.empty()) name += "''";
    if (problem.body.HasPlaces()) name += fmt::format("{}places''[{}]", name.empty() ? "" : ", ", i);
    rows.push_back({"acceleration", name, "m/s^2", acceleration[i]});
  }
  if (problem.body.heading < 0) return rows;
  const std::string& heading = states[ToSize(problem.body.heading)];
  rows.push_back({"turn_rate", heading + "'", "rad/s", turn_rate});
  rows.push_back({"turn_acceleration", heading + "''", "rad/s^2", turn_acceleration});
  return rows;
}

// Ends the search after its time, which the bounds share, or at Ctrl-C. A second Ctrl-C ends the program.
class SearchTime final {
 public:
  explicit SearchTime(double seconds) : seconds_(seconds) {
    is_interrupted = 0;
    std::signal(SIGINT, [](int) {
      is_interrupted = 1;
      std::signal(SIGINT, SIG_DFL);
    });
  }
  ~SearchTime() { std::signal(SIGINT, SIG_DFL); }
  SearchTime(const SearchTime&) = delete;
  SearchTime& operator=(const SearchTime&) = delete;

  bool IsOver(double done, double next) {
    for (; told_ < static_cast<int>(kParts * done); ++told_) progress_.Advance();
    return is_interrupted != 0 || passed() > seconds_ * next;
  }
  [[nodiscard]] double passed() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  static constexpr int kParts = 100;
  static inline volatile std::sig_atomic_t is_interrupted = 0;

  const double seconds_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  Progress progress_{"hundredths of the search", kParts};
  int told_ = 0;
};

// The longest step of which a rate has to say how far a state moves: of a plan, or one that is recorded.
double LongestStep(const Problem& problem) {
  return AddUp(StepOf(*problem.model), std::max(MulUp(2, problem.timing.error), TooFarOff(*problem.model)));
}

// Adds a row for each state, and what the verifier says of them.
void AddRates(const Config& config, std::span<const int> states, const MotionBounds& bounds, MotionProposal& proposal) {
  const NominalModel& model = *config.problem->model;
  std::vector<verifier::RateClaim> claims;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::string& name = model.state_names()[ToSize(states[i])];
    // The verifier is asked about the number that is printed, since that is what a person copies.
    const std::string most = RoundedUp(bounds.rates[i].upper, kMotionDigits);
    proposal.rows.push_back({"rate_bound", name + "'", "unit/s", bounds.rates[i]});
    proposal.rates += fmt::format("{}{}: {}", proposal.rates.empty() ? "" : ", ", name, most);
    claims.push_back({states[i], ParseNumber(most).value});
  }
  const verifier::RateVerdict verdict =
      verifier::CheckRates(model, config.problem->domain, LongestStep(*config.problem), bounds.reachable, claims);
  proposal.rates = fmt::format("rate_bound: {{{}}}", proposal.rates);
  if (verdict.answer != verifier::Answer::kYes) proposal.unconfirmed = model.state_names()[ToSize(verdict.state)];
}

MotionProposal FromEquations(const Config& config, const BetweenCommand& command) {
  const Problem& problem = *config.problem;
  const std::vector<ExpressionText> places = problem.body.Coordinates();
  const auto flow = MakeFlow(*problem.model, places);
  if (!flow)
    throw ConfigError("{}: model: the equations of {} in continuous time are not known{}", config.path,
                      problem.model->name(),
                      command.rates ? ", so none of its rates is proven: `rate` says them, `next` does not"
                                    : "; use --from positions");
  // The last slice is not tested against the domain; where it has to be at rest, that bounds it instead.
  Eigen::VectorXd rest = Eigen::VectorXd::Constant(problem.model->num_states(), kInfinity);
  for (const RestBound& bound : problem.rest) rest[bound.coordinate] = bound.tolerance;
  const Eigen::MatrixXd frame = FrameOf(problem);
  std::vector<int> moving;  // the states whose rates are asked for
  for (int k = 0; command.rates && k < problem.model->num_states(); ++k)
    if (std::ranges::count(problem.timing.set_at_steps, k) == 0) moving.push_back(k);
  SearchTime time(command.seconds);
  const MotionBounds bounds =
      BoundMotion({*flow, problem.domain, LongestPeriod(config), frame, problem.body.heading, rest,
                   [&](double done, double next) { return time.IsOver(done, next); }, moving, LongestStep(problem)},
                  command.search);
  MotionProposal proposal;
  proposal.seconds = time.passed();
  proposal.rows = RowsOf(config, bounds.acceleration, bounds.turn_rate, bounds.turn_acceleration);
  if (command.rates) AddRates(config, moving, bounds, proposal);
  proposal.source = "equations";
  proposal.remark = fmt::format(
      "Proven for the equations of {}, for each motion with constant controls between two\n"
      "samples that are in the domain{}The residual is not included: it is a difference at the samples, and bounds no "
      "curvature between them. Add what\n"
      "the true robot does beyond the equations{}",
      problem.model->name(),
      problem.rest.empty() ? ", and for the last step of a plan, which may leave the domain.\n"
                           : ", and for the last step of a plan, which ends at rest.\n",
      command.rates ? ", and to a rate what residual and disturbance add in a second." : ".");
  return proposal;
}

MotionProposal FromPositions(const Config& config) {
  const Problem& problem = *config.problem;
  const MeasuredMotion measured =
      MeasureMotion(*problem.model, problem.transitions, FrameOf(problem), problem.body, config.period);
  if (measured.triples == 0)
    throw ConfigError(
        "{}: transitions: none begins with the state in which the one before it ends, so there is no "
        "second difference; use transitions that were recorded one after another",
        config.path);
  const auto found = [](double value) { return MotionBound{value, value, 0, true}; };
  std::vector<MotionBound> acceleration;
  for (const double value : measured.acceleration) acceleration.push_back(found(value));
  MotionProposal proposal;
  proposal.rows = RowsOf(config, acceleration, found(measured.turn_rate), found(measured.turn_acceleration));
  proposal.source = "positions";
  proposal.remark = fmt::format(
      "Largest second differences in {} triples of logged samples. This proves nothing: the true motion curves "
      "at\nleast as much. Errors of the measurement are included. Add a margin, and what was not driven.",
      measured.triples);
  if (const Eigen::VectorXd& longer = problem.transitions.longer; !longer.isZero(0))
    proposal.remark += fmt::format(
        "\nSteps that lasted up to {:g} s longer or shorter count as if they had lasted model.dt.", longer.maxCoeff());
  return proposal;
}

std::string Yaml(const std::vector<MotionRow>& rows) {
  std::string acceleration, others;
  for (const MotionRow& row : rows) {
    const std::string value = RoundedUp(row.bound.upper, kMotionDigits);
    if (row.key == "acceleration")
      acceleration += (acceleration.empty() ? "" : ", ") + value;
    else if (row.key != "rate_bound")
      others += fmt::format(", {}: {}", row.key, value);
  }
  return fmt::format("between: {{acceleration: [{}]{}}}", acceleration, others);
}

bool AllReached(const std::vector<MotionRow>& rows) {
  return std::ranges::all_of(rows, [](const MotionRow& row) { return row.bound.reached; });
}

Json ToJson(const MotionProposal& proposal, const Config& config) {
  Json document{{"source", proposal.source},
                {"proven", proposal.source == "equations"},
                {"reached", AllReached(proposal.rows)},
                {"yaml", Yaml(proposal.rows)},
                {"seconds", proposal.seconds},
                {"entries", Json::array()},
                {"digests", {{"config", ToHex(config.grounds.config)}, {"model", ToHex(config.grounds.model)}}}};
  if (!proposal.rates.empty()) document["rates"] = {{"yaml", proposal.rates}, {"unconfirmed", proposal.unconfirmed}};
  for (const MotionRow& row : proposal.rows)
    document["entries"].push_back({{"key", row.key},
                                   {"name", row.name},
                                   {"unit", row.unit},
                                   {"upper", row.bound.upper},
                                   {"lower", row.bound.lower},
                                   {"boxes", row.bound.boxes},
                                   {"reached", row.bound.reached}});
  return document;
}

void PrintForPeople(const MotionProposal& proposal, const Config& config) {
  const bool proven = proposal.source == "equations";
  const double longest = LongestPeriod(config);
  std::string text =
      fmt::format("declare: motion between two samples, at most {} s apart, from the {}{}\n",
                  longest == config.period ? ToText(longest) : RoundedUp(longest, kMotionDigits),
                  proven ? fmt::format("equations of {}", config.problem->model->name()) : "logged positions",
                  AllReached(proposal.rows) ? "" : "; stopped before --gap, at --seconds, --max-boxes or Ctrl-C");
  for (const MotionRow& row : proposal.rows) {
    text += fmt::format(
        "  {:<10} at {} {:<9}{:<8}", row.name, proven ? "most" : "least",
        proven ? RoundedUp(row.bound.upper, kMotionDigits) : RoundedDown(row.bound.lower, kMotionDigits), row.unit);
    if (proven)
      text += fmt::format("  largest found {}, {} boxes", RoundedDown(row.bound.lower, kMotionDigits), row.bound.boxes);
    text += "\n";
  }
  std::cout << text << proposal.remark << (config.problem->declaration.IsDisturbed() ? kDisturbed : "")
            << "\n\ntask:\n  " << Yaml(proposal.rows);
  if (!proposal.rates.empty())
    std::cout << "\nmodel:\n  " << proposal.rates
              << (proposal.unconfirmed.empty()
                      ? "\nThe verifier confirms these rates, for steps of up to "
                      : fmt::format("\nThe verifier does not confirm that of {}, for steps of up to ",
                                    proposal.unconfirmed))
              << RoundedUp(LongestStep(*config.problem), kMotionDigits) << " s.";
  std::cout << std::endl;
}

}  // namespace

int DeclareBetween(const BetweenCommand& command) try {
  if (command.rates && command.from_positions)
    throw ConfigError("--rates: positions show no bound on a rate; --from equations proves it");
  const Config config =
      LoadConfig(command.config, command.from_positions ? TransitionsFile::kRead : TransitionsFile::kIgnore);
  const MotionProposal proposal = command.from_positions ? FromPositions(config) : FromEquations(config, command);
  if (command.json)
    std::cout << JsonText(ToJson(proposal, config)) << std::endl;
  else
    PrintForPeople(proposal, config);
  return AllReached(proposal.rows) && proposal.unconfirmed.empty() ? 0 : 1;
} catch (const std::runtime_error& error) {
  if (dynamic_cast<const BadInput*>(&error)) throw;
  throw std::runtime_error(fmt::format("{}: model: {}", command.config, error.what()));
}

}  // namespace forereach
