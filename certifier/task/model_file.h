/** Where the model files are that task files include. */
#pragma once

#include <string>

namespace forereach {

/** The path of the model file that a task file names: relative to the task file's directory, or, if there is none,
relative to the installed config directory, share/forereach/config of the prefix of the running program.
@param named_by prefix of the message. @throws ConfigError if there is none in either, with the nearest file name. */
[[nodiscard]] std::string FindModelFile(const std::string& task, const std::string& name, const std::string& named_by);

}  // namespace forereach
