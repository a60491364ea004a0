/** The recorded course, driven again and again: a log of any length, of which every decision can be made again. Either
there is a reload of the task before each round, so that the certifier forgets what it learned; or there is none, and a
later round has the transitions of the course, which tell nothing new, and what was decided when all were known. */
#pragma once

#include <string_view>

#include "lcmtypes/message_fields.h"
#include "lcmtypes/seal.h"
#include "records/database.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"

namespace forereach {

/** A visitor of lcmtypes/message_fields.h that brings a message of the course to its place in a later round. */
struct LaterRound {
  std::int64_t shift_us, sequence;  ///< And how many messages of its stream there were before.

  void operator()(std::string_view name, const std::int64_t& value) const {
    auto& changed = const_cast<std::int64_t&>(value);
    if (name == "sequence") changed += sequence;
    // The course's planner names its plans by the time.
    if (name.ends_with("utime") || (name.ends_with("plan_id") && value >= 0)) changed += shift_us;
  }
  void operator()(std::string_view, const auto&) const {}
  void Nested(auto&&...) const {}
  void Code(auto&&...) const {}
  void Text(auto&&...) const {}
  void Digest(auto&&...) const {}
  void Row(auto&&...) const {}
  void Rows(auto&&...) const {}
  void List(auto&&...) const {}
};

enum class Rounds { kReload, kLearn };

/** The events of a later round that only learns: transitions first. */
inline std::vector<LogEvent> OnlyLearning(const std::vector<LogEvent>& course) {
  Digest known{};
  std::set<Digest> plans;  // that were decided with the last of them known
  for (const LogEvent& event : course)
    if (const auto decision = Decoded<decision_t>(event.data)) {
      if (std::exchange(known, GroundsOf(*decision).observations) != GroundsOf(*decision).observations) plans.clear();
      plans.insert(GetDigest(decision->plan_digest));
    }
  std::vector<LogEvent> learning, decided;
  for (const LogEvent& event : course) {
    if (Decoded<transition_t>(event.data)) learning.push_back(event);
    const auto decision = Decoded<decision_t>(event.data);
    const auto certified = Decoded<certified_plan_t>(event.data);
    if (Decoded<candidate_plan_t>(event.data) ? plans.contains(PlanDigest(Bytes(event.data)))
        : decision                            ? plans.contains(GetDigest(decision->plan_digest))
                                              : certified && plans.contains(GetDigest(certified->plan_digest)))
      decided.push_back(event);
  }
  learning.insert(learning.end(), decided.begin(), decided.end());
  return learning;
}

/** Writes `rounds` of them, and the rows of a logger's database if there is one. Cost: 3 MB and 97 decisions a round
with a reload; otherwise 50 kB, 112 transitions and a decision. */
inline void WriteLongCourse(const std::string& path, std::int64_t rounds, Database* database = nullptr,
                            Rounds kind = Rounds::kReload) {
  const std::vector<LogEvent> course = ReadLog(kCourseLog).events, learning = OnlyLearning(course);
  Digest known = LoadConfig(kCourseTask).grounds.observations;
  const std::string file = std::filesystem::path(path).filename();
  EventLogWriter writer(path);
  Interpreter interpreter(BusOptions(), file);
  if (database) database->BeginRun(file, course.front().utime);
  for (std::int64_t round = 0; round < rounds; ++round) {
    std::map<Digest, candidate_plan_t> candidates;  // of this round, by the digest in the course
    Rows rows;
    for (LogEvent event : round > 0 && kind == Rounds::kLearn ? learning : course) {
      if (Decoded<transition_t>(event.data)) known = ChainedDigest(known, Bytes(event.data));
      LaterRound later{round * 10'000'000, round * std::ranges::count(course, event.channel, &LogEvent::channel)};
      const auto change = [&](auto message, const auto& more) {
        if (!message) return false;
        Fields(*message, later);
        more(*message);
        event.data = Encode(*message);
        return true;
      };
      const auto change_only = [&](auto message) { return change(message, [](auto&) {}); };
      const auto of = [&](const auto& answer) { return candidates.at(GetDigest(answer.plan_digest)); };
      const auto digest_of = [&](const auto& answer) { return PlanDigest(of(answer)); };
      const auto know = [&](auto& answer) {
        if (round > 0 && kind == Rounds::kLearn) SetDigest(answer.observations_digest, known);
      };
      // Transitions are sent as they were: decisions name the digest of these bytes.
      static_cast<void>(
          change(Decoded<candidate_plan_t>(event.data),
                 [&](const candidate_plan_t& plan) { candidates[PlanDigest(Bytes(event.data))] = plan; }) ||
          change(Decoded<decision_t>(event.data),
                 [&](decision_t& decision) {
                   SetDigest(decision.plan_digest, digest_of(decision));
                   know(decision);
                 }) ||
          change(Decoded<certified_plan_t>(event.data),
                 [&](certified_plan_t& certified) {
                   certified.plan = of(certified);
                   SetDigest(certified.plan_digest, digest_of(certified));
                   know(certified);
                   SetDigest(certified.certificate_digest, CertificateDigest(certified));
                 }) ||
          change(Decoded<certifier_status_t>(event.data),
                 [&](certifier_status_t& status) { status.version += round; }) ||
          change_only(Decoded<execution_event_t>(event.data)) || change_only(Decoded<robot_state_t>(event.data)) ||
          change_only(Decoded<obstacles_t>(event.data)) || change_only(Decoded<logger_status_t>(event.data)));
      event.utime += later.shift_us;
      event.number = writer.Append(event.utime, event.channel, event.data);
      if (database) interpreter.Observe(event, rows);
    }
    if (database) EXPECT_TRUE(database->Write(rows, file, writer.next_number()));
    EXPECT_TRUE(writer.Flush());
  }
  if (database) database->EndRun(file, course.back().utime);
}

}  // namespace forereach
