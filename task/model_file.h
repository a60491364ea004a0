/** Where the model files are that task files include, and the task files' schema. */
#pragma once

#include <string>

#include "forereach/dynamics/model_text.h"

namespace forereach {

/** The path of the model file that a task file names: relative to the task file's directory, or, if there is none,
relative to the installed config directory, share/forereach/config of the prefix of the running program.
@param named_by prefix of the message. @throws ConfigError if there is none in either, with the nearest file name. */
[[nodiscard]] std::string FindModelFile(const std::string& task, const std::string& name, const std::string& named_by);

/** The path of the installed JSON Schema of task files, share/forereach/task.schema.json; "" if there is none. */
[[nodiscard]] std::string InstalledSchema();

/** The text of a model file; its name is the file's without the ending. The expressions are not parsed yet.
@param named_by prefix of the message that it cannot be read. @param bytes receives those of the file.
@throws ConfigError with file, line and key. */
[[nodiscard]] ModelText LoadModelFile(const std::string& path, const std::string& named_by = "",
                                      std::string* bytes = nullptr);

}  // namespace forereach
