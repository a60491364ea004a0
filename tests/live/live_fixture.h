/** A watcher of the recorded course, and what a reader of its page has read. */
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "certifier/gate/obstacle_sender.h"
#include "certifier/gate/obstacles_in_force.h"
#include "lcmtypes/seal.h"
#include "live/watcher.h"
#include "tests/records/course.h"

namespace forereach {

inline Config CourseTask() { return LoadConfig(kCourseTask); }

/** The events of the recorded course. */
inline std::vector<LogEvent> CourseEvents() {
  std::vector<LogEvent> events;
  ForEachEvent({kCourseLog}, [&](const LogEvent& event, const std::string&) { events.push_back(event); });
  return events;
}

/** Sends a watcher decisions as the last one of a run, each under another set of so many obstacles. */
class Crowd {
 public:
  Crowd(Watcher& watcher, std::size_t size, const std::vector<LogEvent>& run = CourseEvents())
      : watcher_(watcher), size_(size) {
    for (const LogEvent& event : run)
      if (const auto decision = Decoded<decision_t>(event.message())) decision_ = *decision, now_ = event.utime;
  }

  void Decide() {
    sender_.Set(std::vector(size_, Obstacle::Circle(Eigen::Vector2d(x_++, 90), 1)));
    do {
      const auto message = Encode(*sender_.Due(now_ += ObstacleSender::kBurstUs));
      EXPECT_EQ(in_force_.Update(message, now_), "");
      Send("OBSTACLES", message);
    } while (in_force_.is_partial());
    ++decision_.sequence;
    SetDigest(decision_.obstacles_digest, in_force_.digest());
    Send("PLAN_DECISION", Encode(decision_));
  }

 private:
  void Send(const std::string& channel, std::vector<std::uint8_t> bytes) {
    watcher_.Take({0, now_, channel, std::move(bytes)});
  }

  Watcher& watcher_;
  const std::size_t size_;
  decision_t decision_{};
  std::int64_t now_ = 0;
  double x_ = 0;
  const Config task_ = CourseTask();
  ObstaclesInForce in_force_{task_};
  ObstacleSender sender_{ObstacleSender::PeriodUs(task_.gate)};
};

/** Collects all that a watcher tells. */
struct Reader {
  Watcher::Cursor cursor;
  nlohmann::json now, obstacles;
  std::vector<nlohmann::json> decisions, faults, withdrawals, events, gaps, places;

  /** @return bytes of the news. */
  std::size_t Read(const Watcher& watcher) {
    const std::string text = watcher.Since(cursor);
    if (text.empty()) return 0;
    const auto news = nlohmann::json::parse(text);
    now = news.at("now");
    if (news.contains("obstacles")) obstacles = news.at("obstacles");
    for (const auto& [name, all] : {std::pair{"decisions", &decisions},
                                    {"faults", &faults},
                                    {"events", &events},
                                    {"withdrawals", &withdrawals},
                                    {"gaps", &gaps},
                                    {"places", &places}})
      if (news.contains(name))
        for (const auto& each : news.at(name)) all->push_back(each);
    return text.size();
  }
};

/** Plays events with a tick every kTickUs of their times. */
inline void Play(const std::vector<LogEvent>& events, Watcher& watcher, Reader* reader = nullptr) {
  std::int64_t next = events.front().utime;
  for (const LogEvent& event : events) {
    for (; event.utime >= next; next += Watcher::kTickUs) {
      watcher.Tick(next);
      if (reader) reader->Read(watcher);
    }
    watcher.Take(event);
  }
  watcher.Tick(next);
  if (reader) reader->Read(watcher);
}

}  // namespace forereach
