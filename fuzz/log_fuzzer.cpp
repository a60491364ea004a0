// Logs of other recorders: any bytes are a table whose rows and samples are all accounted for, as a transition inside
// the domain or under one cause, or refused with a ConfigError. The first byte chooses how the log is read.
#include <numeric>

#include "forereach/dynamics/text_model.h"
#include "fuzz/fuzz.h"
#include "fuzz/text_mutator.h"
#include "identify/import.h"
#include "task/config_error.h"

namespace forereach {
namespace {

Problem Turning() {
  ModelText text;
  text.name = "turning";
  text.states = {{"x", "m"}, {"theta", "rad"}};
  text.inputs = {{"u", "m/s"}};
  text.parameters = {{"dt", 0.1, 0.1}};
  text.equations = {{"x + dt*u*cos(theta)"}, {"theta"}};
  text.angles = {"theta"};
  Problem problem;
  problem.model = MakeTextModel(text);
  problem.domain.state = Box(Eigen::Vector2d(-100, -4), Eigen::Vector2d(100, 4));
  problem.domain.input = Box(Eigen::VectorXd::Constant(1, -1), Eigen::VectorXd::Constant(1, 1));
  return problem;
}

std::int64_t Sum(const ImportedLog& log, std::initializer_list<Dropped> causes) {
  return std::accumulate(causes.begin(), causes.end(), std::int64_t{0},
                         [&](std::int64_t sum, Dropped cause) { return sum + log.At(cause).count; });
}

}  // namespace

bool Try(Bytes data) {
  static MemoryFile file;
  static const Problem problem = Turning();
  const unsigned choice = data.empty() ? 0 : data[0];
  LogFormat format;
  if (choice & 1) format.delimiter = ';';
  if (choice & 2) format.comment = "";
  if (choice & 4) format.header = {"t", "x", "theta", "u"};
  ImportOptions options;
  options.period = 0.1;
  options.tolerance = 0.02;
  options.factors.assign(3, choice & 8 ? 0.01L : 1);
  options.input_tolerance = Eigen::VectorXd::Constant(1, 0.5);
  options.input_mean = choice & 16;
  options.overlapping = true;
  if (choice & 32) options.unwrapped = {1};
  const std::string& path = file.Write(data.subspan(data.empty() ? 0 : 1));
  return IsTaken([&] {
    const LogTable table = ReadLog(path, {"t", "x", "theta", "u"}, format);
    Require(std::ssize(table.lines) == table.values.rows() && table.after_loss.size() == table.lines.size());
    const ImportedLog log = Import(table, problem, options);
    using enum Dropped;
    Require(table.values.rows() == log.samples + Sum(log, {kNoStamp, kRepeatedRow, kRepeatedStamp, kOutsideWindow}));
    Require(log.samples ==
            log.transitions.size() + Sum(log, {kEnd, kGap, kNoState, kNoInput, kInputChanges, kOutsideDomain,
                                               kNearTheEdge, kNoNominalValue, kAmbiguousAngle}));
    Require(std::ssize(log.lines) == log.transitions.size());
    Require(log.largest_offset <= options.tolerance + static_cast<double>(ImportOptions::kRounding) * options.period);
    Require(0 <= log.rows_used && log.rows_used <= log.rows);
    for (Eigen::Index i = 0; i < log.transitions.size(); ++i) {
      Require(problem.domain.state.Contains(log.transitions.z.row(i).head(2).transpose()) &&
              problem.domain.input.Contains(log.transitions.z.row(i).tail(1).transpose()) &&
              log.transitions.x_next.row(i).allFinite());
    }
    if (log.transitions.size() == 0) throw ConfigError("no transitions");  // it did not go deep
  });
}

}  // namespace forereach
