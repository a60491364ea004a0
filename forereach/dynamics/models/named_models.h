/** The nominal models that come with the library: how they are made, and a table of them for all that must not know
them by their names. */
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "forereach/dynamics/model.h"

namespace forereach {

/** The model of point_mass.h. @param dt step, s. @throws std::invalid_argument unless dt is positive and finite. */
[[nodiscard]] std::shared_ptr<const NominalModel> MakePointMass(double dt);

/** The model of kinematic_bicycle.h. @param dt step, s. @param wheelbase metres. @param angles the states that are
angles, by their indices, ascending: none, or theta.
@throws std::invalid_argument unless both are positive and finite, or for another angle. */
[[nodiscard]] std::shared_ptr<const NominalModel> MakeKinematicBicycle(double dt, double wheelbase,
                                                                       std::vector<int> angles = {});

/** The step of a model in s: its parameter dt, which every model of a task has. 0 if it has none. */
[[nodiscard]] double StepOf(const NominalModel& model);

/** A model that a task file names. The lists are of text, for task files, the declaration and the verifier; the bits of
a certificate are those of the equations that `make` compiles in. */
struct NamedModel {
  struct Parameter {
    std::string_view name, unit, meaning;
    double most;  ///< It is positive and at most this.
  };

  std::string_view name;
  std::vector<Parameter> parameters;  ///< After dt.
  std::vector<std::string_view> states;
  std::vector<std::string_view> standing;     ///< The states that are zero while the robot stands.
  std::vector<std::string_view> next, rates;  ///< Of each state an expression: after a step, and in continuous time.
  /** @param parameters dt, then the others. @param angles by their indices, ascending.
  @throws std::invalid_argument as the functions above. */
  std::shared_ptr<const NominalModel> (*make)(std::span<const double> parameters, std::vector<int> angles);
};

[[nodiscard]] const std::vector<NamedModel>& NamedModels();

/** The row of a model; null for one that is a text or that is not of this table. */
[[nodiscard]] const NamedModel* FindNamed(const NominalModel& model);

/** The equations of a model in continuous time, one for each state: those of its text or of its row. Empty if the text
says what the next state is. */
[[nodiscard]] std::vector<ExpressionText> RatesOf(const NominalModel& model);

/** The model as text: its own, or that of its row with its parameters. Not set if there is neither. */
[[nodiscard]] std::optional<ModelText> TextOf(const NominalModel& model);

/** How the ends of the model's steps move with their duration (step_rate.h), made at the first call for this model.
Null without a text. Any number of threads may call it. @throws as StepRate. */
[[nodiscard]] std::shared_ptr<const StepRate> RateOf(const NominalModel& model);

}  // namespace forereach
