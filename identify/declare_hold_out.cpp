#include <algorithm>
#include <array>
#include <iostream>
#include <numeric>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "command_line/progress.h"
#include "forereach/certify/batch.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "identify/declare_by.h"
#include "identify/declare_data.h"
#include "identify/hold_out.h"
#include "lcmtypes/angle.h"
#include "records/chart.h"
#include "records/decision_json.h"
#include "task/config.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

constexpr double kFactors[] = {1, 1.1, 1.25, 1.5, 2, 3, 5};

// What one factor on the learned slopes gives on the held-out blocks.
struct Trial {
  double factor = 1;
  ContradictionCounts found;
  double block_upper = 1;  // of the probability that the next block has a contradiction
  int windows = 0, certified = 0;
  int states = 0;                 // recorded ones of all windows
  std::array<int, 3> found_in{};  // of those that have a slice, by Conformance
  // Of a position in the last slice, the median over the windows; infinite if half of the tubes or more are incomplete.
  double half_width = 0;

  // A tube may end before its window.
  [[nodiscard]] int slices() const { return std::reduce(found_in.begin(), found_in.end()); }
  [[nodiscard]] int left() const { return found_in[ToSize(static_cast<int>(Conformance::kLeft))]; }
};

// The recorded commands of a stretch of held-out transitions, from the state that was recorded there.
struct Commands {
  Eigen::MatrixXd controls;  // a column a step
  Eigen::MatrixXd states;    // a column a sample, one more than steps
  Eigen::MatrixXd moved;     // how far each may be off since the steps before it were longer or shorter than dt
};

std::vector<Commands> CommandsOf(const Transitions& transitions, double dt, const Split& split, int steps) {
  const Eigen::Index n = transitions.x_next.cols(), m = transitions.z.cols() - n;
  std::vector<Commands> all;
  for (const HoldOutWindow& window : WindowsOf(transitions, split, steps)) {
    Commands& commands = all.emplace_back();
    commands.controls = transitions.z.block(window.begin, n, steps, m).transpose();
    commands.states.resize(n, steps + 1);
    commands.states.leftCols(steps) = transitions.z.block(window.begin, 0, steps, n).transpose();
    commands.states.col(steps) = transitions.x_next.row(window.begin + steps - 1);
    commands.moved.setZero(n, steps + 1);
    for (int t = 0; t < steps; ++t) {
      const double longer = transitions.Longer(window.begin + t);  // below dt / 2
      commands.moved.col(t + 1) =
          commands.moved.col(t) +
          longer / (dt - longer) * (commands.states.col(t + 1) - commands.states.col(t)).cwiseAbs();
    }
  }
  return all;
}

// The largest half-width of a safety coordinate in slice t.
double PositionHalfWidth(const Tube& tube, int t, const Eigen::MatrixXd& projection) {
  const std::span<const double> half_width = tube.half_width(t);
  const Eigen::Map<const Eigen::VectorXd> widths(half_width.data(), std::ssize(half_width));
  return (projection.cwiseAbs() * widths).maxCoeff();
}

void CertifyWindows(const Config& config, const Declaration& declaration, const Split& split,
                    const std::vector<Commands>& commands, unsigned jobs, Trial& trial) {
  if (commands.empty()) return;
  auto problem = std::make_shared<Problem>(*config.problem);
  problem->declaration = declaration;
  problem->transitions = RowsOf(config.problem->transitions, split.learn);
  problem->rest.clear();  // recorded commands need not end at rest
  const Certifier certifier(problem);
  const int steps = static_cast<int>(commands.front().controls.cols()), inputs = problem->model->num_inputs();
  const Schedule schedule = ScheduleFromZero(config, steps);
  Eigen::VectorXd half_width = (config.initial_set.upper() - config.initial_set.lower()) / 2;
  if (!declaration.given_are_exact)  // the true state of a recorded one
    for (int k = 0; k < problem->model->num_states(); ++k)
      half_width[k] = std::max(half_width[k], declaration.VariableError(k));
  std::vector<Plan> plans;
  std::vector<Zonotope> initial_sets;
  for (const Commands& each : commands) {
    plans.push_back({each.controls.data(), inputs, steps, inputs, schedule});
    initial_sets.push_back(Zonotope::FromBox(each.states.col(0), half_width));
    certifier.Require(plans.back(), initial_sets.back(), config.obstacles);
  }
  std::vector<std::array<int, 3>> found_in(plans.size());
  std::vector<double> widths(plans.size(), kInfinity);
  const auto decisions = CertifyAll(
      certifier, plans, initial_sets, config.obstacles, {.threads = jobs},
      [&](std::size_t i, const Decision&, const Tube& tube) {
        for (int t = 1; t <= tube.length(); ++t) {
          Conformance worst = Conformance::kInside;
          for (int k = 0; k < problem->model->num_states(); ++k) {
            const Interval hull = tube.hull(t, k);
            // How far what is recorded may be from the true state.
            const double error =
                AddUp(AddUp(declaration.noise_bound[k], declaration.VariableError(k)), commands[i].moved(k, t));
            worst = std::max(
                worst, Conform(commands[i].states(k, t), error, hull.lower, hull.upper, problem->model->IsAngle(k)));
          }
          ++found_in[i][ToSize(static_cast<int>(worst))];
        }
        if (tube.length() == steps) widths[i] = PositionHalfWidth(tube, steps, problem->projection);
      });
  trial.windows = static_cast<int>(plans.size());
  trial.certified = static_cast<int>(std::ranges::count(decisions, Outcome::kCertified, &Decision::outcome));
  trial.states = trial.windows * steps;
  for (const auto& counts : found_in)
    for (std::size_t kind = 0; kind < counts.size(); ++kind) trial.found_in[kind] += counts[kind];
  const auto middle = widths.begin() + std::ssize(widths) / 2;
  std::ranges::nth_element(widths, middle);
  trial.half_width = *middle;
}

// "83 of 200 recorded steps"
std::string LeftText(int left, int slices) { return fmt::format("{} of {} recorded steps", left, slices); }

// Of the factors at which recorded states have left their slices.
void WarnOfLeft(const std::vector<Trial>& trials) {
  std::string text;
  for (const Trial& trial : trials)
    if (trial.left() > 0)
      text += fmt::format("{}{} at factor {}", text.empty() ? "" : ", ", LeftText(trial.left(), trial.slices()),
                          ToText(trial.factor));
  if (!text.empty())
    std::cerr << "forereach: warning: the slices of their certificates were left by " << text
              << ". A declaration whose slices lose the robot is false, whatever it certifies" << std::endl;
}

// ---- the outcome

constexpr const char* kConformances[] = {"inside", "consistent", "left"};

double Share(int part, int whole) { return whole > 0 ? 100.0 * part / whole : 0; }

std::string Percent(double value) { return fmt::format("{:.1f} %", value); }

void PrintForPeople(const std::vector<Trial>& trials, const DataCommand& command, const Split& split) {
  const Trial& first = trials.front();
  std::string table = fmt::format(
      "hold-out: {} blocks of time, learned from {}, judged by {} with {} transitions and {} stretches of {} "
      "commands\n",
      command.blocks, split.learn.size(), split.judge.size(), first.found.transitions, first.windows, command.steps);
  const auto contradictions = [](const auto&... cells) {
    return fmt::format("  {:<8}{:<17}{:<14}{:<10}{:<12}", cells...);
  };
  const auto plans = [](const auto&... cells) { return fmt::format("{:<11}{:<9}{:<12}{:<8}{}", cells...); };
  table += contradictions("factor", "contradicting", "per thousand", "blocks", "next block") +
           plans("certified", "inside", "consistent", "left", "half-width") + "\n";
  for (const Trial& trial : trials) {
    const ContradictionCounts& found = trial.found;
    table += contradictions(ToText(trial.factor), fmt::format("{} of {}", found.contradicting, found.transitions),
                            RoundedUp(1000.0 * found.contradicting / found.transitions, 3),
                            fmt::format("{} of {}", found.blocks_contradicting, found.blocks),
                            "<= " + Percent(100 * trial.block_upper));
    if (trial.windows > 0)
      table += plans(Percent(Share(trial.certified, trial.windows)), Percent(Share(trial.found_in[0], trial.states)),
                     Percent(Share(trial.found_in[1], trial.states)), Percent(Share(trial.found_in[2], trial.states)),
                     RoundedUp(trial.half_width, 3));
    table += "\n";
  }
  std::cout << table
            << "\nfactor: on the smallest slopes that the learning blocks do not contradict, and on the scatter found "
               "there.\n"
               "contradicting: held-out transitions that provably contradict one of the learning blocks.\n"
               "next block: with "
            << ToText(100 * command.confidence)
            << " % confidence, at most so many of all further blocks contain a contradiction (Clopper & Pearson), if\n"
               "  blocks are independent and alike: the same robot, driven alike, in the same places. Within a block "
               "they need not be.\n"
               "  It is no bound for other roads, other days, or a plan that goes where nobody has driven. It is of "
               "one row, for\n  the slopes that half of the data gave: not of the row that looks best afterwards, nor "
               "of slopes learned from all data.\n"
               "certified, half-width: if the declaration with this factor is true, the recorded commands of held-out "
               "stretches\n  as plans, from task.initial_set's half-widths, or the state error where that is larger, "
               "about the recorded state,\n  among the task's obstacles; the median over the stretches of a position's "
               "half-width after "
            << command.steps
            << " steps (inf: the tube leaves the domain before).\n"
               "inside, consistent, left: recorded states whose slice contains all, a part or nothing of state +- "
               "declaration.state_error\n  (not declared: exact), and of what dt_error may have moved it. One that has "
               "left its slice halts a robot.\n"
            << (first.windows == 0 ? "There is no stretch of so many transitions that follow one another: use fewer "
                                     "--steps or fewer --blocks.\n"
                                   : "")
            << std::flush;
}

Json ToJson(const std::vector<Trial>& trials, const DataCommand& command) {
  Json document{{"blocks", command.blocks},
                {"steps", command.steps},
                {"confidence", command.confidence},
                {"factors", Json::array()}};
  for (const Trial& trial : trials) {
    document["factors"].push_back({{"factor", trial.factor},
                                   {"transitions", trial.found.transitions},
                                   {"contradicting", trial.found.contradicting},
                                   {"blocks", trial.found.blocks},
                                   {"blocks_contradicting", trial.found.blocks_contradicting},
                                   {"block_rate_at_most", trial.block_upper},
                                   {"stretches", trial.windows},
                                   {"certified", trial.certified},
                                   {"states", trial.states},
                                   {"half_width", trial.half_width}});
    for (std::size_t kind = 0; kind < trial.found_in.size(); ++kind)
      document["factors"].back()[fmt::format("states_{}", kConformances[kind])] = trial.found_in[kind];
  }
  return document;
}

Chart ChartOf(const std::vector<Trial>& trials, const DataCommand& command) {
  Chart chart{.title = "What a factor on the slopes buys, and what it costs",
              .x_name = "factor on the smallest slopes",
              .y_name = "% of held-out data",
              .x = {},
              .series = {{"blocks with a contradiction", {}},
                         {fmt::format("their bound, {} %", ToText(100 * command.confidence)), {}},
                         {"stretches certified, if the declaration is true", {}},
                         {"states inside or consistent with their slice", {}}}};
  for (const Trial& trial : trials) {
    chart.x.push_back(trial.factor);
    const double values[] = {Share(trial.found.blocks_contradicting, trial.found.blocks), 100 * trial.block_upper,
                             Share(trial.certified, trial.windows),
                             Share(trial.found_in[0] + trial.found_in[1], trial.states)};
    for (std::size_t s = 0; s < 4; ++s) chart.series[s].y.push_back(values[s]);
  }
  return chart;
}

}  // namespace

int DeclareHoldOut(const DataCommand& command) {
  const auto pictures = command.picture.empty() ? std::vector<std::string>() : PictureFiles(command.picture);
  const Config config = LoadForSlopes(command.config);
  const Problem& problem = *config.problem;
  if (command.blocks > problem.transitions.size())
    throw ConfigError("--blocks: {} is more than the task's {} transitions", command.blocks,
                      problem.transitions.size());
  const Split split = SplitByTime(problem.transitions.size(), command.blocks);
  std::optional<Progress> progress(std::in_place, "parts of the work",
                                   2 * ToSize(problem.model->num_states()) + std::size(kFactors));
  const ProposalOptions options{1, command.estimate_noise, command.estimate_disturbance,
                                ColumnsBy(command.by, *problem.model), [&] { progress->Advance(); }};
  ProposedDeclaration learned;
  try {
    learned =
        Propose(problem.declaration, ObserveForProposal(problem, RowsOf(problem.transitions, split.learn)), options);
  } catch (const Unexplained& found) {
    progress.reset();
    std::cerr << "forereach: " << config.path << ": in the learning blocks: " << Explain(found, config, options)
              << std::endl;
    return 1;
  }
  const std::vector<Commands> commands = CommandsOf(problem.transitions, config.period, split, command.steps);
  std::vector<Trial> trials;
  for (const double factor : kFactors) {
    Declaration declaration = learned.declaration;
    declaration.lipschitz *= factor;
    for (std::size_t k = 0; k < learned.rows.size(); ++k)
      if (options.estimate_disturbance && learned.rows[k].scatter > 0)
        declaration.disturbance[static_cast<Eigen::Index>(k)] *= factor;
    Trial& trial = trials.emplace_back();
    trial.factor = factor;
    trial.found = CountContradictions(problem, declaration, split);
    trial.block_upper = ProbabilityUpper(trial.found.blocks_contradicting, trial.found.blocks, command.confidence);
    CertifyWindows(config, declaration, split, commands, command.jobs, trial);
    progress->Advance();
  }
  progress.reset();
  if (command.json)
    std::cout << JsonText(ToJson(trials, command)) << std::endl;
  else
    PrintForPeople(trials, command, split);
  WarnOfLeft(trials);
  for (const std::string& file : pictures) DrawChart(ChartOf(trials, command), file);
  return 0;
}

HeldOutSteps JudgeByHeldOut(const Config& config, const Declaration& declaration, unsigned jobs) {
  constexpr int kBlocks = 20;
  constexpr std::size_t kMostStretches = 200;
  HeldOutSteps found;
  const Transitions& transitions = config.problem->transitions;
  if (transitions.size() < 2) return found;
  const Split split = SplitByTime(transitions.size(), std::min(kBlocks, transitions.size()));
  std::vector<Commands> commands;
  // Shorter stretches where the record has no longer ones.
  for (found.steps = 10; commands.empty() && found.steps > 0; --found.steps)
    commands = CommandsOf(transitions, config.period, split, found.steps);
  ++found.steps;
  const std::size_t count = std::min(commands.size(), kMostStretches);
  std::vector<Commands> chosen;
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(commands[i * commands.size() / count]);
  Trial trial;
  CertifyWindows(config, declaration, split, chosen, jobs, trial);
  found.stretches = trial.windows;
  found.inside = trial.found_in[0], found.consistent = trial.found_in[1], found.left = trial.left();
  found.half_width = trial.half_width;
  return found;
}

HeldOutSteps JudgeTask(const std::string& path) {
  try {
    const Config config = LoadConfig(path);
    return JudgeByHeldOut(config, config.problem->declaration, 1);
  } catch (const ConfigError&) {
    return {};
  }
}

std::string TextOf(const HeldOutSteps& found) {
  return fmt::format("of {} recorded steps, {} inside their slices, {} consistent, {} left", found.slices(),
                     found.inside, found.consistent, found.left);
}

Json ToJson(const HeldOutSteps& found) {
  return {{"stretches", found.stretches},
          {"steps", found.steps},
          {"inside", found.inside},
          {"consistent", found.consistent},
          {"left", found.left}};
}

std::string WarningOf(const HeldOutSteps& found) {
  if (found.left == 0) return "";
  return fmt::format(
      "{} have left the slices that the declaration promises from the other half of the transitions ({} stretches of "
      "{} steps): it is false, whatever it certifies. What is no function of state and input is a disturbance",
      LeftText(found.left, found.slices()), found.stretches, found.steps);
}

}  // namespace forereach
