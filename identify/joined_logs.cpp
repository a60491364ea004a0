#include "identify/joined_logs.h"

#include <cmath>
#include <limits>
#include <utility>

#include "forereach/numerics/size.h"
#include "task/config_error.h"

namespace forereach {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

void RequireSorted(const LogTable& table) {
  double last = -std::numeric_limits<double>::infinity();
  for (Eigen::Index row = 0; row < table.values.rows(); ++row) {
    const double stamp = table.values(row, 0);
    if (std::isnan(stamp)) continue;
    if (stamp < last)
      throw ConfigError("{}:{}: the stamps go back; only rows in the order of their stamps can be joined", table.path,
                        table.lines[ToSize(row)]);
    last = stamp;
  }
}

// What holds from a stamp until the next one's.
struct Command {
  double stamp;
  int line;
  Eigen::RowVectorXd inputs;
};

std::vector<Command> CommandsOf(const LogTable& table) {
  std::vector<Command> commands;
  bool is_lost = false;  // a row behind the last command
  for (Eigen::Index row = 0; row < table.values.rows(); ++row) {
    const double stamp = table.values(row, 0);
    const Eigen::RowVectorXd inputs = table.values.row(row).tail(table.values.cols() - 1);
    is_lost |= table.after_loss[ToSize(row)] || std::isnan(stamp);
    if (is_lost && !commands.empty()) commands.back().inputs.setConstant(kUnknown);
    if (std::isnan(stamp)) continue;
    is_lost = false;
    if (commands.empty() || commands.back().stamp < stamp)
      commands.push_back({stamp, table.lines[ToSize(row)], inputs});
    // Of two commands at one time nobody knows which one holds.
    else if (commands.back().inputs != inputs)
      commands.back().inputs.setConstant(kUnknown);
  }
  if (!commands.empty()) commands.back().inputs.setConstant(kUnknown);
  return commands;
}

class LogJoiner {
 public:
  LogJoiner(LogTable states, const LogTable& commands)
      : states_(std::move(states)),
        commands_(CommandsOf(commands)),
        held_(Eigen::RowVectorXd::Constant(commands.values.cols() - 1, kUnknown)) {
    states_.not_a_number.insert(states_.not_a_number.end(), commands.not_a_number.begin() + 1,
                                commands.not_a_number.end());
    states_.dates.count += commands.dates.count;
    if (states_.decimal_commas.count == 0) states_.decimal_commas = commands.decimal_commas;
  }

  LogTable Join() {
    const Eigen::Index columns = states_.values.cols();
    Eigen::RowVectorXd nothing = Eigen::RowVectorXd::Constant(columns, kUnknown);
    for (Eigen::Index row = 0; row < states_.values.rows(); ++row) {
      const double stamp = states_.values(row, 0);
      for (; next_ < commands_.size() && commands_[next_].stamp <= stamp; ++next_) {  // not for NaN
        held_ = commands_[next_].inputs;
        nothing[0] = commands_[next_].stamp;
        // A row of its own, so that a command that changes within a step is seen.
        if (row > 0 && commands_[next_].stamp < stamp) Add(nothing, commands_[next_].line, false, true);
      }
      Add(states_.values.row(row), states_.lines[ToSize(row)], states_.after_loss[ToSize(row)], false);
    }
    using RowMajor = decltype(states_.values);
    states_.values = Eigen::Map<const RowMajor>(numbers_.data(), std::ssize(lines_), columns + held_.size());
    states_.lines = std::move(lines_);
    states_.after_loss = std::move(after_loss_);
    states_.is_command = std::move(is_command_);
    return std::move(states_);
  }

 private:
  void Add(const Eigen::RowVectorXd& row, int line, bool after_loss, bool is_command) {
    numbers_.insert(numbers_.end(), row.begin(), row.end());
    numbers_.insert(numbers_.end(), held_.begin(), held_.end());
    lines_.push_back(line);
    after_loss_.push_back(after_loss);
    is_command_.push_back(is_command);
  }

  LogTable states_;
  const std::vector<Command> commands_;
  Eigen::RowVectorXd held_;
  std::size_t next_ = 0;  // the first command that has not begun
  std::vector<double> numbers_;
  std::vector<int> lines_;
  std::vector<bool> after_loss_, is_command_;
};

}  // namespace

LogTable Joined(LogTable states, const LogTable& commands) {
  RequireSorted(states);
  RequireSorted(commands);
  return LogJoiner(std::move(states), commands).Join();
}

}  // namespace forereach
