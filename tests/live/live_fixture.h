/** A watcher of the recorded course, and what a reader of its page has read. */
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

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
