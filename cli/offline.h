/** The commands that `forereach` leaves to other programs. Those of forereach-offline need no robot, and OMPL, SQLite,
librsvg and MPFI, which the commands for a running system do not load. `live` is forereach-live, which loads a web
server: the commands that stop and start a robot do without. `ingest`, `report --database` and `import --database` are
forereach-fleet, which loads PostgreSQL's client and is a package of its own. `demo` is scripts/drive-demo. */
#pragma once

namespace forereach {

enum class OfflineProgram { kOffline, kLive, kFleet, kDemo };

struct OfflineCommand {
  const char *name, *purpose;
  OfflineProgram program = OfflineProgram::kOffline;
};

inline constexpr OfflineCommand kOfflineCommands[] = {
    {"certify", "Decide on one plan: exit 0 certificate, 1 abstention, 2 bad input"},
    {"init",
     "Write a commented task file to begin with, from a model of the library or the header of a transitions file"},
    {"import",
     "Make the transitions of a task from logs of states and inputs: exit 0 with a CSV file, 1 if there is none, 2 bad "
     "input"},
    {"import-world",
     "Make a task's obstacles of a ROS map, a CommonRoad scenario or GeoJSON: exit 0 with a YAML file, 1 if there are "
     "more than a task takes, 2 bad input"},
    {"check",
     "Examine one task file, say what to change, and draw it: exit 0 if a plan could be certified in principle, 1 with "
     "findings, 2 bad input"},
    {"fit",
     "Fit the parameters of a model as text to the task's transitions: exit 0 if the search converged, 1 if not, 2 bad "
     "input"},
    {"export-model", "Write the equations of a task's model as a C++ header, for a certifier with compiled equations"},
    {"plan",
     "Make a certified plan from task.initial_set towards planner.goal: exit 0 with a CSV file, 1 if none was found, 2 "
     "bad input"},
    {"declare",
     "Prove a declaration: bound the slopes of an analytic residual over the whole domain and all its parameters. Exit "
     "0 if every bound is within --gap of a slope that was found, 1 if --max-boxes was reached first, 2 bad input"},
    {"verify",
     "Verify recorded certificates in high precision, with an independent implementation: exit 0 if there are "
     "certificates and all are confirmed, 1 with the first that is not and its first failing step, 2 bad input"},
    {"replay", "Replay a recorded log through the gate: exit 0 if every decision equals the recorded one, otherwise 1"},
    {"merge",
     "Make one result of the files of a command with --shard: exit as the command without it, 2 if they do not belong "
     "together"},
    {"advise",
     "Find what would have turned abstentions into certificates: exit 0 if each has such a change, 1 if not, 2 bad "
     "input"},
    {"report",
     "Summarise a recorded log, and draw it: exit 0 if all of it could be read, 1 if it is damaged, 2 bad input"},
    {"check-log",
     "Check a logger's directory for consistency: exit 0 if the event of every row of the database is unchanged in its "
     "log, every row is the one that follows from its event, and no log is damaged or unknown to the database, "
     "otherwise 1; logs deleted for the quota are not errors"},
    {"run",
     "Run planner, certifier, robot and logger in this process, on an in-memory bus and a simulated clock: exit 0 if "
     "the robot reaches its goal, touches nothing, and keeps its limits and slices, otherwise 1"},
    {"export",
     "Write a recorded run for other programs: tables (csv, jsonl), tubes as NumPy arrays (npz), messages (mcap): exit "
     "0 if all of it could be read, otherwise 1"},
    {"log", "List, cut and merge LCM event logs: exit 0 if all of them could be read, 1 if one is damaged"},
    {"ingest",
     "Send the rows of recorded runs to the fleet's store, a PostgreSQL: exit 0 if it has all of them, 1 if some could "
     "not be read or sent",
     OfflineProgram::kFleet},
    {"live",
     "Show the running robot on a page for this machine's browsers, until Ctrl-C: it listens to the bus and sends "
     "nothing",
     OfflineProgram::kLive},
    {"demo", "Drive a car through circles and traffic, with a report and a picture in ./run", OfflineProgram::kDemo},
};

}  // namespace forereach
