/** The commands that `forereach` leaves to the program forereach-offline: they need no robot, and OMPL, SQLite, cairo
and MPFI, which the commands for a running system do not load. */
#pragma once

namespace forereach {

struct OfflineCommand {
  const char* name;
  const char* purpose;
};

inline constexpr OfflineCommand kPlan{"plan",
                                      "Make a certified plan from task.initial_set towards planner.goal: exit 0 with a "
                                      "CSV file, 1 if none was found, 2 bad input"};
inline constexpr OfflineCommand kDeclare{
    "declare",
    "Bound how fast an analytic residual changes, over the whole domain and all its parameters: a declaration that is "
    "proved. Exit 0 if every bound is within --gap of a point found, 1 if --max-boxes came first, 2 bad input"};
inline constexpr OfflineCommand kVerify{
    "verify",
    "Derive recorded certificates anew, in high precision and with code of its own: exit 0 if there are any and all "
    "are confirmed, 1 with the first that is not and the first step of it that fails, 2 bad input"};
inline constexpr OfflineCommand kReplay{
    "replay", "Put a recorded log through the same gate again: exit 0 if every decision is the recorded one, else 1"};
inline constexpr OfflineCommand kReport{"report", "Sum up a recorded log, and draw it"};
inline constexpr OfflineCommand kCheckLog{
    "check-log",
    "Hold a logger's directory against itself: exit 0 if every event that a row of the database comes from is in its "
    "log unchanged and no log is damaged or unknown to it, else 1; logs deleted for the quota are no fault"};
inline constexpr OfflineCommand kRun{
    "run", "Planner, certifier, robot and logger in this one process, on LCM's in-memory bus and a simulated clock"};

inline constexpr OfflineCommand kOfflineCommands[] = {kPlan, kDeclare, kVerify, kReplay, kReport, kCheckLog, kRun};

}  // namespace forereach
