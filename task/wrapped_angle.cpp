#include "task/wrapped_angle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "forereach/dynamics/angles.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

constexpr double kEighth = kTurn.lower / 8;

// x+ - f0 of each transition in state k; infinite where the model has no value.
std::vector<double> Differences(const NominalModel& model, const Transitions& transitions, int k) {
  std::vector<double> differences;
  Linearization nominal;
  for (int i = 0; i < transitions.size(); ++i) {
    const Eigen::VectorXd z = transitions.z.row(i);
    model.Linearize({z.data(), ToSize(z.size())}, nominal);
    const Interval& value = nominal.value[ToSize(k)];
    differences.push_back(value.IsFinite() ? transitions.x_next(i, k) - value.Middle()
                                           : std::numeric_limits<double>::infinity());
  }
  return differences;
}

bool IsOneTurn(double difference) { return std::abs(std::abs(difference) - kTurn.lower) < kEighth; }

}  // namespace

std::optional<WrappedAngle> FindWrappedAngle(const NominalModel& model, const Transitions& transitions) {
  const std::optional<ModelText> text = TextOf(model);
  for (int k = 0; text && k < model.num_states(); ++k) {
    if (text->states[ToSize(k)].unit != "rad" || model.IsAngle(k)) continue;
    const std::vector<double> differences = Differences(model, transitions, k);
    const auto near = std::ranges::count_if(differences, [](double d) { return std::abs(d) < kEighth; });
    const auto turn = std::ranges::find_if(differences, IsOneTurn);
    if (turn == differences.end() || 2 * near <= std::ssize(differences)) continue;
    const std::string& name = model.state_names()[ToSize(k)];
    return WrappedAngle{
        static_cast<int>(turn - differences.begin()),
        fmt::format(
            "{} differs from the model's next value by {:.4g} rad, about one turn, and model.angles does not name it",
            name, std::abs(*turn)),
        fmt::format("write `angles: [{}]` under model; or unwrap the data, if it is no angle", name)};
  }
  return std::nullopt;
}

void RequireNoWrappedAngle(const std::string& config, const std::string& path, const NominalModel& model,
                           const Transitions& transitions) {
  if (const auto wrapped = FindWrappedAngle(model, transitions))
    throw ConfigError("{}: model.angles: {}:{}: {}; {}", config, path, wrapped->row + 2, wrapped->what,
                      wrapped->advice);
}

}  // namespace forereach
