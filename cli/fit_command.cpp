#include <cmath>
#include <iostream>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "command_line/nearest.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "identify/fit.h"
#include "records/chart.h"
#include "task/config.h"
#include "task/json_text.h"
#include "task/wrapped_angle.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

constexpr int kFitDigits = 6;

struct FitArguments {
  std::string config, names, picture;
  bool json = false;
};

// The parameters to fit: those that are named, or all but dt.
std::vector<std::string> NamesOf(const std::string& given, const ModelText& text) {
  std::vector<std::string> names = SplitAtCommas(given);
  if (given.empty())
    for (const ModelText::Parameter& parameter : text.parameters)
      // The step is the task's, and the data were imported with it.
      if (parameter.name != "dt") names.push_back(parameter.name);
  return names;
}

double RootMeanSquare(const Eigen::MatrixXd& errors, Eigen::Index k) {
  return std::sqrt(errors.col(k).squaredNorm() / static_cast<double>(errors.rows()));
}

std::string Short(double value) { return fmt::format("{:.{}g}", value, kFitDigits); }

std::string DeviationText(const FittedParameter& parameter) {
  if (std::isnan(parameter.deviation)) return "none: no informative number is left over to show the noise";
  if (std::isfinite(parameter.deviation)) return Short(parameter.deviation);
  if (!parameter.together.empty())
    return fmt::format("not determined, only together with {}", Joined(parameter.together));
  return parameter.elsewhere
             ? fmt::format("not determined: it has no effect near {}; begin elsewhere", Short(parameter.after))
             : "not determined: it has no effect on these transitions";
}

std::string Yaml(const Fit& fit) {
  return fmt::format("parameters: {{{}}}", Joined(fit.parameters, [](const FittedParameter& each) {
                       return fmt::format("{}: {}", each.name, Short(each.after));
                     }));
}

Json ToJson(const Fit& fit, const NominalModel& model) {
  Json document{{"converged", fit.converged},
                {"evaluations", fit.evaluations},
                {"yaml", Yaml(fit)},
                {"parameters", Json::array()},
                {"states", Json::array()}};
  for (const FittedParameter& each : fit.parameters)
    document["parameters"].push_back(
        {{"name", each.name},
         {"before", each.before},
         {"after", each.after},
         {"deviation", std::isfinite(each.deviation) ? Json(each.deviation) : Json(nullptr)},
         {"why_no_deviation", std::isfinite(each.deviation) ? Json(nullptr) : Json(DeviationText(each))},
         {"undetermined_with", each.together}});
  for (Eigen::Index k = 0; k < fit.after.cols(); ++k)
    document["states"].push_back({{"name", model.state_names()[ToSize(k)]},
                                  {"rms_before", RootMeanSquare(fit.before, k)},
                                  {"rms_after", RootMeanSquare(fit.after, k)},
                                  {"largest_before", fit.before.col(k).cwiseAbs().maxCoeff()},
                                  {"largest_after", fit.after.col(k).cwiseAbs().maxCoeff()}});
  return document;
}

void PrintForPeople(const Fit& fit, const Config& config) {
  const NominalModel& model = *config.problem->model;
  const auto parameters = [](const auto&... cells) { return fmt::format("  {:<18}{:<13}{:<13}{}\n", cells...); };
  const auto errors = [](const auto&... cells) { return fmt::format("  {:<18}{:<13}{:<13}{:<16}{}\n", cells...); };
  std::string text = fmt::format("fit: {} parameters to {} transitions of {}{}\n", fit.parameters.size(),
                                 fit.after.rows(), config.path, fit.converged ? "" : "; stopped before it converged") +
                     parameters("parameter", "before", "after", "standard error");
  for (const FittedParameter& each : fit.parameters)
    text += parameters(each.name, Short(each.before), Short(each.after), DeviationText(each));
  text += "\n" + errors("one-step error", "rms before", "rms after", "largest before", "largest after");
  for (Eigen::Index k = 0; k < fit.after.cols(); ++k)
    text += errors(model.state_names()[ToSize(k)], RoundedUp(RootMeanSquare(fit.before, k), 4),
                   RoundedUp(RootMeanSquare(fit.after, k), 4), RoundedUp(fit.before.col(k).cwiseAbs().maxCoeff(), 4),
                   RoundedUp(fit.after.col(k).cwiseAbs().maxCoeff(), 4));
  std::cout
      << text
      << "\nThe sum of squared errors of one step, each over its rms before, has a local minimum there. The standard "
         "errors assume\nindependent errors of measurement; what the equations lack is none. A model that fits better "
         "leaves a smaller residual,\nwhich still has to be declared, for the new parameters.\n\n"
         "model:\n  "
      << Yaml(fit) << std::endl;
}

int RunFit(const FitArguments& options) {
  const auto pictures = options.picture.empty() ? std::vector<std::string>() : PictureFiles(options.picture);
  // The model may have no value at some transition, as long as its parameters are not fitted.
  const Config config = LoadConfig(options.config, TransitionsFile::kIgnore);
  const Problem& problem = *config.problem;
  const ModelText* text = problem.model->text();
  if (!text)
    throw ConfigError("{}: model: {} is compiled; only the parameters of a model as text can be fitted", config.path,
                      problem.model->name());
  const Transitions transitions = LoadTransitions(config.transitions, *problem.model);
  RequireNoWrappedAngle(config.path, config.transitions, *problem.model, transitions);
  Fit fit;
  try {
    fit = FitParameters(*text, transitions, NamesOf(options.names, *text));
  } catch (const std::invalid_argument& error) {
    throw ConfigError("{}: {}", config.path, error.what());
  }
  if (options.json)
    std::cout << JsonText(ToJson(fit, *problem.model)) << std::endl;
  else
    PrintForPeople(fit, config);
  for (const std::string& file : pictures)
    DrawScatter({"Errors of one step against each coordinate", "before", "after", problem.model->variable_names(),
                 problem.model->state_names(), transitions.z, fit.before, fit.after},
                file);
  return fit.converged ? 0 : 1;
}

}  // namespace

Command FitCommand() {
  const auto options = std::make_shared<FitArguments>();
  return {
      .name = "fit",
      .footer =
          "The model has to be text in the task file or in a model file. Its parameters begin at their values, a range "
          "at its middle.\n"
          "Copy the last line into the task file: `model.parameters`. Then declare the residual that is left; see "
          "docs/data.md.\n\n"
          "Example:\n  forereach fit --config my_robot.yaml --parameters gain,drag --picture errors",
      .options = {TaskOption(options->config, "Task file (YAML) with a model as text, and transitions"),
                  {"--parameters", &options->names, "NAMES",
                   "Those to fit, with commas between; by default all but dt"},
                  {"--picture", &options->picture, "NAME",
                   "The errors before and after against each coordinate, as NAME.svg and NAME.png, or as one of them"},
                  JsonFlag(options->json)},
      .run = [options] { return RunFit(*options); }};
}

}  // namespace forereach
