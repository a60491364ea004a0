#include "identify/declare_by.h"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

#include "command_line/nearest.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "task/wrapped_angle.h"

namespace forereach {
namespace {

int IndexOf(const std::string& name, const std::vector<std::string>& names) {
  const auto at = std::ranges::find(names, name);
  if (at == names.end()) throw ConfigError("--by: the model has no '{}'; {}", name, Suggestion(name, names));
  return static_cast<int>(at - names.begin());
}

std::string List(const Eigen::VectorXd& values) {
  return "[" + Joined(values, [](double value) { return ToText(value); }) + "]";
}

}  // namespace

std::vector<std::vector<int>> ColumnsBy(const std::vector<std::string>& by, const NominalModel& model) {
  const std::vector<std::string>& states = model.state_names();
  const std::vector<std::string> variables = model.variable_names();
  std::vector<int> all(variables.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<std::vector<int>> columns(states.size(), all);
  std::vector<bool> said(states.size(), false);
  for (const std::string& text : by) {
    const std::size_t at = text.find('=');
    const bool for_one = at != std::string::npos;
    std::vector<int> chosen;
    for (const std::string& name : SplitAtCommas(for_one ? text.substr(at + 1) : text))
      chosen.push_back(IndexOf(name, variables));
    if (for_one) {
      const auto k = ToSize(IndexOf(text.substr(0, at), states));
      if (said[k]) throw ConfigError("--by: {} is given twice", states[k]);
      said[k] = true;
      columns[k] = chosen;
    } else {
      for (std::size_t k = 0; k < states.size(); ++k)
        if (!said[k]) columns[k] = chosen;
    }
  }
  return columns;
}

std::string Explain(const Unexplained& found, const Config& config, const ProposalOptions& options) {
  const NominalModel& model = *config.problem->model;
  const std::vector<std::string> variables = model.variable_names();
  const std::string columns =
      Joined(options.columns[ToSize(found.coordinate)], [&](int l) { return variables[ToSize(l)]; });
  return fmt::format(
      "no L is consistent: two transitions {}, and their residuals of {} differ by {} more than noise_bound and "
      "disturbance allow. If the robot does not always do the same there, that is a disturbance (--disturbance "
      "estimated); if the residual depends on more, name it (--by); if the sensor errs by half of that, raise "
      "noise_bound (--noise estimated)",
      columns.empty() ? std::string("of a residual that may depend on nothing") : fmt::format("agree in {}", columns),
      model.state_names()[ToSize(found.coordinate)], RoundedDown(found.pair.difference, 4));
}

Config LoadForSlopes(const std::string& path) {
  Config config = LoadConfig(path);
  if (!config.problem->declaration.affine.rows.empty())
    throw ConfigError(
        "{}: declaration.affine: slopes are proposed for all rows or for none. Take it out, and put it "
        "back in place of the proposed rows",
        config.path);
  if (!config.problem->declaration.regions.empty())
    throw ConfigError("{}: declaration.regions: slopes are proposed for the whole domain. Take the regions out first",
                      config.path);
  RequireNoWrappedAngle(config.path, config.transitions, *config.problem->model, config.problem->transitions);
  return config;
}

std::string DeclarationYaml(const Declaration& declaration, const NominalModel& model) {
  const std::vector<std::string>& states = model.state_names();
  const std::vector<std::string> variables = model.variable_names();
  const auto by_names = [&](const Eigen::MatrixXd& slopes) {
    return Joined(states, [&](const std::string& state) {
      const std::string row = Joined(variables, [&](const std::string& variable) {
        const double slope = slopes(&state - states.data(), &variable - variables.data());
        return slope > 0 ? fmt::format("{}: {}", variable, ToText(slope)) : "";
      });
      return row.empty() ? "" : fmt::format("{}: {{{}}}", state, row);
    });
  };
  std::string text = fmt::format("  lipschitz: {{{}}}\n  noise_bound: {}\n", by_names(declaration.lipschitz),
                                 List(declaration.noise_bound));
  if (const auto& [rows, columns, rest] = declaration.affine; !rows.empty())
    text += fmt::format("  affine: {{rows: [{}], columns: [{}]{}}}\n",
                        Joined(rows, [&](int k) { return states[ToSize(k)]; }),
                        Joined(columns, [&](int l) { return variables[ToSize(l)]; }),
                        rest.isZero(0) ? "" : fmt::format(", rest: {{{}}}", by_names(rest)));
  if (declaration.growing) {
    text += "  disturbance:\n";
    for (Eigen::Index k = 0; k < std::ssize(states); ++k)
      if (const std::string bound = declaration.DisturbanceText(k); declaration.Grows(k))
        text += fmt::format("    {}: \"{}\"\n", states[ToSize(k)], bound);
      else if (bound != "0")
        text += fmt::format("    {}: {}\n", states[ToSize(k)], bound);
  } else if (declaration.IsDisturbed()) {
    text += fmt::format("  disturbance: {}\n", List(declaration.disturbance));
  }
  if (!declaration.regions.empty()) text += "  regions:\n";
  for (const Region& region : declaration.regions) {
    const std::string box = Joined(region.box, [&](const Region::Side& side) {
      return fmt::format("{}: [{}, {}]", variables[ToSize(side.variable)], ToText(side.range.lower),
                         ToText(side.range.upper));
    });
    std::string bounds;
    for (Eigen::Index k = 0; k < region.disturbance.size(); ++k)
      if (const double w = region.disturbance[k]; w < kInfinity)
        bounds += fmt::format("{}{}: {}", bounds.empty() ? "" : ", ", states[ToSize(k)], ToText(w));
    text += fmt::format("    - {{in: {{{}}}, disturbance: {{{}}}}}\n", box, bounds);
  }
  if (declaration.DeclaresStateError()) text += fmt::format("  state_error: {}\n", List(declaration.state_error));
  if (declaration.input_error.size() > 0) text += fmt::format("  input_error: {}\n", List(declaration.input_error));
  return text;
}

}  // namespace forereach
