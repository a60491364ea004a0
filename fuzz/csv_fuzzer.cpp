// Transitions and plans: any bytes are finite numbers of the right shape, which come back to the last bit once written,
// or refused with a ConfigError.
#include "forereach/dynamics/text_model.h"
#include "fuzz/fuzz.h"
#include "fuzz/text_mutator.h"
#include "task/config.h"

static forereach::ModelText Text() {
  forereach::ModelText text;
  text.name = "any";
  text.states = {{"px", "m"}, {"py", "m"}, {"vx", "m/s"}, {"vy", "m/s"}};  // as in the corpus
  text.inputs = {{"ax", "m/s^2"}, {"ay", "m/s^2"}};
  text.parameters = {{"dt", 0.15, 0.15}};
  text.equations = {{"px"}, {"py"}, {"vx"}, {"vy"}};
  return text;
}

bool forereach::Try(Bytes data) {
  static MemoryFile file;
  static const auto model = MakeTextModel(Text());
  const std::string& path = file.Write(data);
  if (Transitions read; IsTaken([&] { read = LoadTransitions(path, *model); })) {
    Require(read.size() >= 1 && read.z.cols() == 6 && read.x_next.cols() == 4 && read.z.allFinite() &&
            read.x_next.allFinite());
    SaveTransitions(path, *model, read);
    const Transitions again = LoadTransitions(path, *model);
    Require(again.z == read.z && again.x_next == read.x_next);
    return true;
  }
  Eigen::MatrixXd plan;
  if (!IsTaken([&] { plan = LoadPlan(path, *model); })) return false;
  Require(plan.rows() == 2 && 1 <= plan.cols() && plan.cols() <= 128 && plan.allFinite());
  SavePlan(path, *model, plan);
  Require(LoadPlan(path, *model) == plan);
  return true;
}
