/** What both commands of declare_data.h say about columns and about transitions that nothing explains. */
#pragma once

#include <string>
#include <vector>

#include "identify/proposal.h"
#include "task/config.h"

namespace forereach {

/** The columns for each state by the texts of --by. Without any, a state's residual may depend on every variable.
@throws ConfigError for a name that the model does not have, or a state that is given twice. */
[[nodiscard]] std::vector<std::vector<int>> ColumnsBy(const std::vector<std::string>& by, const NominalModel& model);

/** Which two lines of the transitions disagree, and what to change. `first_line` of observation 0. */
[[nodiscard]] std::string Explain(const Unexplained& found, const Config& config, const ProposalOptions& options);

/** A task for whose transitions slopes are proposed. @throws ConfigError as LoadConfig does; if rows of the residual
are declared affine, or regions, beside which no slopes are proposed; or if an angle was wrapped (wrapped_angle.h). */
[[nodiscard]] Config LoadForSlopes(const std::string& path);

/** "lipschitz: {...}", "noise_bound: [...]" and perhaps "affine: {...}", "disturbance: [...]", or by names, and the
disturbances of regions, a line each, indented by two. */
[[nodiscard]] std::string DeclarationYaml(const Declaration& declaration, const NominalModel& model);

}  // namespace forereach
