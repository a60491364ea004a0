#include "simulator/drive_counts.h"

#include <nlohmann/json.hpp>

#include "bus/log.h"

namespace forereach {

DriveCounts& DriveCounts::operator+=(const DriveCounts& other) {
  using Counts = DriveCounts;
  for (const auto member :
       {&Counts::drives, &Counts::goals, &Counts::contacts, &Counts::limits, &Counts::steps, &Counts::outside,
        &Counts::consistent, &Counts::stops, &Counts::emergency_stops, &Counts::proposed, &Counts::certified,
        &Counts::searches, &Counts::rounds, &Counts::lost_rounds})
    this->*member += other.*member;
  seconds_to_goal += other.seconds_to_goal;
  for (const auto& [cause, count] : other.abstained) abstained[cause] += count;
  for (const auto& [cause, count] : other.rejected) rejected[cause] += count;
  return *this;
}

DriveCounts CountsOf(const Lockstep& lockstep) {
  const auto robot = nlohmann::json::parse(lockstep.robot().Summary());
  const auto planner = nlohmann::json::parse(lockstep.planner().Summary());
  const auto of = [](const nlohmann::json& summary, const char* key) { return summary.at(key).get<std::int64_t>(); };
  DriveCounts counts;
  counts.drives = 1;
  counts.goals = robot.at("goal_reached").get<bool>() ? 1 : 0;
  if (counts.goals > 0)
    counts.seconds_to_goal =
        static_cast<double>(of(robot, "boundaries")) * lockstep.config().robot.step_period_ms / 1e3;
  counts.contacts = of(robot, "contacts");
  counts.limits = of(robot, "limits_exceeded");
  counts.steps = of(robot, "steps_executed");
  counts.consistent = of(robot, "steps_consistent");
  counts.outside = counts.steps - of(robot, "steps_inside_slice") - counts.consistent;
  counts.stops = of(robot, "stops");
  counts.emergency_stops = of(robot, "emergency_stops");
  counts.proposed = of(planner, "proposed");
  counts.certified = of(planner, "certified");
  counts.searches = counts.proposed + of(planner, "searches_without_result");
  counts.rounds = of(planner, "rounds");
  counts.lost_rounds = of(planner, "rounds_without_certificate");
  counts.abstained = planner.at("abstained").get<std::map<std::string, std::int64_t>>();
  counts.rejected = planner.at("rejected").get<std::map<std::string, std::int64_t>>();
  return counts;
}

void SilenceLog() { logging::Silence(); }

}  // namespace forereach
