/** The parts of the schema, in its order. */
#pragma once

#include <string>
#include <vector>

#include "task/draft.h"
#include "task/schema.h"

namespace forereach::key_rows {

std::vector<Key> ModelKeys();          ///< model
std::vector<Key> ModelFileKeys();      ///< model, of a model file
std::vector<Key> ProblemKeys();        ///< domain, declaration, residual, task, certifier
std::vector<Key> ResidualKeys();       ///< residual, among those
std::vector<Key> OptionKeys();         ///< gate, realtime, bus, planner, robot, logger
std::vector<Key> LawKeys();            ///< planner.let, stop, emergency_stop, hints, at_rest, among those
std::vector<Key> RobotResidualKeys();  ///< robot.residual, among those

/** @throws ConfigError if an expression of LawKeys, in `file`, is wrong. */
void CheckLaws(const std::string& file, const TaskDraft& draft);

}  // namespace forereach::key_rows
