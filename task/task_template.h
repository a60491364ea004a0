/** The text of a task file to begin with. */
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace forereach {

/** A state or an input, its unit ("" if it is not known), and the range proposed for it. */
struct TemplateVariable {
  std::string name, unit;
  double lower = 0, upper = 0;
  bool from_data = false;  ///< The range is that of data, widened; otherwise a placeholder.
};

/** How a robot of a model of the library stops and is steered, as the task says it that drives this model. */
struct KnownLaws {
  std::string task;                                  ///< The path of this task.
  std::string lines;                                 ///< Its laws: lines of the map `planner`, with their comments.
  bool has_at_rest = false;                          ///< Among the lines is planner.at_rest.
  std::vector<std::pair<std::string, double>> rest;  ///< States and bounds of its task.rest; none if it has none.
  std::vector<std::string> held;                     ///< The states that are zero while the robot stands.
};

struct TaskTemplate {
  std::string path;     ///< Where the file will be, for the commands that it suggests.
  std::string command;  ///< What makes this text.
  std::string schema;   ///< The path of a JSON Schema, by which editors complete and check it; "" for none.
  std::string model;    ///< The lines of the key `model`, each with a line break.
  std::vector<TemplateVariable> states, inputs;
  std::vector<double> center;  ///< Of the initial set, one for each state.
  std::string transitions;     ///< Relative to the file.
  bool transitions_exist = false;
  std::optional<KnownLaws> laws;
};

/** The task file, each line or block with a comment. It is a valid task. Where nothing is known it has placeholders
that keep plans from being certified rather than let them be: a declaration that allows nearly everything, obstacles
that have to be heard. Those lines say PLACEHOLDER. */
[[nodiscard]] std::string TaskText(const TaskTemplate& task);

/** The states that say where the robot is: three, two or one with the unit m, or named as positions are; otherwise the
first two. */
[[nodiscard]] std::vector<std::string> PositionStates(const std::vector<TemplateVariable>& states);

/** Widened by a tenth of its width at each end, or by 0.1 if it has none, to few digits. */
[[nodiscard]] TemplateVariable RangeAround(const std::string& name, double least, double largest);

/** A text in YAML, quoted if it has to be. */
[[nodiscard]] std::string YamlText(const std::string& text);

}  // namespace forereach
