#include "identify/command_delay.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "forereach/numerics/size.h"

namespace forereach {
namespace {

// What the model's next state is off in each step, by the line that the step starts in. @param size of the states.
std::map<int, Eigen::VectorXd> ErrorsOf(const ImportedLog& log, const NominalModel& model, Eigen::VectorXd& size) {
  std::map<int, Eigen::VectorXd> errors;
  for (Eigen::Index i = 0; i < log.transitions.size(); ++i) {
    const Eigen::VectorXd z = log.transitions.z.row(i);
    Eigen::VectorXd error(model.num_states());
    model.Evaluate({z.data(), ToSize(z.size())}, {error.data(), ToSize(error.size())});
    error = log.transitions.x_next.row(i).transpose() - error;
    size = size.cwiseMax(log.transitions.x_next.row(i).transpose().cwiseAbs());
    for (const int k : model.angles()) error[k] = std::remainder(error[k], 2 * std::numbers::pi);
    if (error.allFinite()) errors.emplace(log.lines[ToSize(i)], error);
  }
  return errors;
}

// The first rows of a log.
LogTable Beginning(const LogTable& table, Eigen::Index rows) {
  LogTable first = table;
  first.values.conservativeResize(rows, Eigen::NoChange);
  first.lines.resize(ToSize(rows));
  first.after_loss.resize(ToSize(rows));
  return first;
}

// The root mean square without the mean, over the lines that all have. @return their number.
int AddSpreads(const std::vector<std::map<int, Eigen::VectorXd>>& by_delay, std::vector<Eigen::MatrixXd>& sums) {
  int count = 0;
  for (const auto& entry : by_delay.back()) {
    const int line = entry.first;
    // Each delay loses other lines, and only the same lines can be compared.
    if (!std::ranges::all_of(by_delay, [&](const auto& errors) { return errors.contains(line); })) continue;
    ++count;
    for (std::size_t d = 0; d < by_delay.size(); ++d) {
      const Eigen::VectorXd& error = by_delay[d].at(line);
      sums[d].col(0) += error;
      sums[d].col(1) += error.cwiseAbs2();
    }
  }
  return count;
}

void Compare(CommandDelay& delay, const Eigen::VectorXd& size) {
  const Eigen::Index n = delay.error.front().size();
  Eigen::VectorXd most = Eigen::VectorXd::Zero(n);
  for (const Eigen::VectorXd& error : delay.error) most = most.cwiseMax(error);
  constexpr double kExact = 1e-9;  // below it is the rounding of the log's decimals
  std::vector<double> logs;
  for (const Eigen::VectorXd& error : delay.error) {
    double& sum = logs.emplace_back(0);
    for (Eigen::Index k = 0; k < n; ++k)
      if (most[k] > 0) sum += 2 * std::log(std::max(error[k], kExact * size[k]));
  }
  delay.best = static_cast<int>(std::ranges::min_element(logs) - logs.begin());
  // All delays that the log does not tell from the best.
  delay.least = delay.largest = delay.best;
  for (int d = 0; d < static_cast<int>(logs.size()); ++d)
    if (const double apart = logs[ToSize(d)] - logs[ToSize(delay.best)];
        !(apart > CommandDelay::kLeast && delay.steps / 2 * apart > CommandDelay::kOdds))
      delay.least = std::min(delay.least, d), delay.largest = std::max(delay.largest, d);
}

}  // namespace

CommandDelay EstimateDelay(std::span<const LogTable* const> tables, const Problem& problem, ImportOptions options,
                           int most) {
  const int n = problem.model->num_states();
  options.overlapping = options.input_mean = true;  // a command that acts late changes within a step
  std::vector<Eigen::MatrixXd> sums(ToSize(most) + 1, Eigen::MatrixXd::Zero(n, 2));
  CommandDelay delay;
  Eigen::VectorXd size = Eigen::VectorXd::Zero(n);
  int count = 0;
  Eigen::Index left = CommandDelay::kMostRows;
  for (const LogTable* whole : tables) {
    const Eigen::Index rows = std::min(left, whole->values.rows());
    if (rows == 0) continue;
    left -= rows;
    const LogTable table = Beginning(*whole, rows);
    std::vector<std::map<int, Eigen::VectorXd>> by_delay;
    double rows_in_step = 1;
    for (options.command_delay = 0; options.command_delay <= most; ++options.command_delay) {
      const ImportedLog log = Import(table, problem, options);
      by_delay.push_back(ErrorsOf(log, *problem.model, size));
      if (log.typical_spacing > 0) rows_in_step = std::max(options.period / log.typical_spacing, 1.0);
    }
    const int found = AddSpreads(by_delay, sums);
    count += found;
    delay.steps += found / rows_in_step;
  }
  if (count < 2) return delay;
  for (const Eigen::MatrixXd& sum : sums) {
    const Eigen::ArrayXd mean = sum.col(0).array() / count;
    delay.error.emplace_back((sum.col(1).array() / count - mean.square()).max(0).sqrt().matrix());
  }
  Compare(delay, size);
  return delay;
}

}  // namespace forereach
