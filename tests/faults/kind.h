/** What the kinds of faults share: tries at a system of real processes, what is demanded in them, and the rows of the
table. Each family of kinds is a file with a class of its own, which knows nothing of the others. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "command_line/progress.h"
#include "tests/faults/rig.h"

namespace forereach {

using std::chrono::microseconds, std::chrono::milliseconds;

inline constexpr std::chrono::seconds kSaysSoon{3};  // some heartbeats
inline constexpr milliseconds kHeartbeat{600};       // at least one
inline constexpr std::chrono::seconds kStarts{10};   // a process that was started has spoken

struct Row {
  std::string fault;
  int wanted = 0;                              // tries
  bool bus_loses = false;                      // messages, so decisions too
  int tries = 0;                               // 0: it cannot be tried here, the remark says why
  std::size_t forbidden = 0;                   // what may never happen, and did
  std::optional<std::int64_t> lost_by_logger;  // Rig::TakeLost; nothing: no logger ran
  int recovered = 0, said_why = 0;             // of the tries
  std::string remark;
};

struct Campaign {
  int kills = 1000, floods = 100'000, others = 20;
  unsigned seed = 1;
  std::mt19937 random{};
  std::vector<Row> rows{};
};

/** One function for each kind: it adds its rows. The files are their families. */
void Kills(Campaign& campaign);  // processes.cpp
void Stops(Campaign& campaign);
void LatchedKills(Campaign& campaign);
void Reloads(Campaign& campaign);
void Clocks(Campaign& campaign);  // clocks.cpp
void Times(Campaign& campaign);
void Networks(Campaign& campaign);  // network.cpp
void Datagrams(Campaign& campaign);
void Routes(Campaign& campaign);
void Lies(Campaign& campaign);  // lies.cpp
void Strangers(Campaign& campaign);
void Nonsense(Campaign& campaign);
void Floods(Campaign& campaign);
void Senders(Campaign& campaign);
void Obstacles(Campaign& campaign);  // obstacles.cpp
void Moving(Campaign& campaign);
void Forgeries(Campaign& campaign);  // forgeries.cpp
void Keys(Campaign& campaign);
void Disks(Campaign& campaign);  // disks.cpp
void StateDisks(Campaign& campaign);
void Gone(Campaign& campaign);
void Sends(Campaign& campaign);  // sends.cpp

class Kind {
 public:
  explicit Kind(Campaign& campaign) : options_(campaign), random_(campaign.random), rows_(campaign.rows) {}

 protected:
  [[nodiscard]] int Below(int bound) { return static_cast<int>(random_() % static_cast<unsigned>(bound)); }

  /** @param tries so many, or Campaign::others. */
  Row& Begin(const std::string& fault, std::optional<int> tries = {});
  void NotTried(const std::string& fault, const std::string& why);
  static void Remark(Row& row, const std::string& text) { row.remark += (row.remark.empty() ? "" : "; ") + text; }

  /** What has to be seen in a try. */
  static void Demand(Row& row, bool seen, const std::string& what);
  /** Nothing that the witness tells, and no process that ended by itself or badly. */
  static void DemandNothingForbidden(Row& row, Rig& rig);
  static void CountLost(Row& row, Rig& rig) { row.lost_by_logger = row.lost_by_logger.value_or(0) + rig.TakeLost(); }

  /** The row's tries with a system that is healthy at first. `hurt` does something to it; then it has to heal. */
  void Tries(Row& row, Rig& rig, const std::function<void(int)>& hurt);
  /** With a rig whose obstacles are on the bus alone: any certificate under others, or none, is forbidden. */
  void ObstacleTries(const std::string& fault, const std::function<void(Row&, Rig&, int)>& hurt);

  [[nodiscard]] robot_state_t State(const Rig& rig) const;
  /** It executes the plan certified last, from a state outside its slice, by the least or by some metres. */
  [[nodiscard]] robot_state_t StateOutside(Rig& rig);
  /** Sends such a state; FAULT is heard then. */
  std::optional<fault_t> Provoke(Row& row, Rig& rig, std::int64_t sequence);
  /** It is said on FAULT, and nothing certified until the reset that heals. */
  static void DemandLatched(Row& row, Rig& rig, std::int16_t cause);
  /** The same of the next certifier. */
  static void DemandStillLatched(Row& row, Rig& rig, const fault_t& fault);

  /** What a candidate is answered that would be certified from rest at the start; nothing if it is not answered. */
  std::optional<std::int16_t> CauseOfACandidate(Rig& rig);
  /** A candidate is refused because the obstacles are not known, or because nothing may be certified. */
  void DemandUnknown(Row& row, Rig& rig, const std::string& when);

  /** The obstacles of the course; and with one beside it, slowly away from it: so it heals for as long as the tries
  take. */
  [[nodiscard]] static std::vector<Obstacle> OfTheCourse();
  [[nodiscard]] static std::vector<Obstacle> WithADriftingOne();
  [[nodiscard]] static Obstacle Drifting(double x, double y);

  const Campaign& options_;
  std::mt19937& random_;
  std::vector<Row>& rows_;
  std::unique_ptr<Progress> progress_;
  int told_unknown_ = 0;

 private:
  [[nodiscard]] static bool HealAtFirst(Row& row, Rig& rig);
  void Try(Row& row, Rig& rig, const std::function<void()>& hurt);

  std::int64_t next_own_id_ = 1;
};

}  // namespace forereach
