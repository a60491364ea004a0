/** Two logs of one run at two rates: states, and the commands that held meanwhile. */
#pragma once

#include "identify/log_table.h"

namespace forereach {

/** The rows of `states` with the commands that hold at their stamps, and between them a row without states for each
command that begins there. A command holds from its stamp until the next one's. It is NaN before the first and from the
last command on, while commands of one stamp differ, and from the command before a row that was left out: what held then
is not known.
@param states columns: the stamp, then states. @param commands columns: the stamp in the same unit and of the same
clock, then inputs.
@return columns: the stamp, the states, the inputs. Its lines are those of `states`; of rows without states, of
`commands`.
@throws ConfigError with file and line if stamps go back. Cost: linear. */
[[nodiscard]] LogTable Joined(LogTable states, const LogTable& commands);

}  // namespace forereach
