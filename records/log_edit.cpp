#include "records/log_edit.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "lcmtypes/printable.h"
#include "records/event_log.h"
#include "records/log_survey.h"
#include "records/output_file.h"
#include "task/date.h"

namespace forereach {
namespace {

constexpr double kLongestSeconds = 1e9;
constexpr std::int64_t kMostHeldBytes = 64 << 20;

// A whole text as a number.
template <class Number>
std::optional<Number> Parse(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

// A log that is being read: the next event, and what was damaged before it.
class Source final {
 public:
  explicit Source(const std::string& path) : path_(path), reader_(path) {}

  // False at the end.
  bool Next(const std::function<void(const DamagedPlace&)>& on_damage, LogEditResult& result) {
    while (true) {
      const std::int64_t offset = reader_.offset();
      switch (reader_.Next(event_)) {
        case LogStatus::kEvent: ++result.events; return true;
        case LogStatus::kEnd: return false;
        case LogStatus::kCutTail:
          ++result.cut_ends;
          if (on_damage) on_damage({path_, offset, reader_.size() - offset, true});
          return false;
        case LogStatus::kCorrupt:
          result.damage += {1, reader_.offset() - offset};
          if (on_damage) on_damage({path_, offset, reader_.offset() - offset, false});
          break;
      }
    }
  }
  [[nodiscard]] const LogEvent& event() const { return event_; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  const std::string path_;
  EventLogReader reader_;
  LogEvent event_;
};

void ForEachInOrder(const std::vector<std::string>& logs, const std::function<void(const DamagedPlace&)>& on_damage,
                    LogEditResult& result, const std::function<void(const Source&)>& visit) {
  for (const std::string& log : logs)
    for (Source source(log); source.Next(on_damage, result);) visit(source);
}

void ForEachByTime(const std::vector<std::string>& logs, const std::function<void(const DamagedPlace&)>& on_damage,
                   LogEditResult& result, const std::function<void(const Source&)>& visit) {
  std::vector<std::unique_ptr<Source>> sources;
  for (const std::string& log : logs) {
    auto source = std::make_unique<Source>(log);
    if (source->Next(on_damage, result)) sources.push_back(std::move(source));
  }
  while (!sources.empty()) {
    const auto first = std::ranges::min_element(sources, {}, [](const auto& source) { return source->event().utime; });
    visit(**first);
    if (!(*first)->Next(on_damage, result)) sources.erase(first);
  }
}

// A channel that was chosen by a name that is none says nothing of the log.
void RequireChannels(const LogSelection& selection, const std::set<std::string>& seen) {
  for (const std::string& channel : selection.channels) {
    if (seen.contains(channel) || seen.size() == LogEditResult::kMostChannels) continue;
    std::string names;
    for (const std::string& name : seen) names += (names.empty() ? "" : ", ") + Printable(name);
    throw LogError(fmt::format("{}: no event has this channel; {}", Printable(channel),
                               names.empty() ? "there are no events" : fmt::format("the channels are {}", names)));
  }
}

std::int64_t FirstUtime(const std::vector<std::string>& logs) {
  LogEditResult ignored;
  for (const std::string& log : logs)
    if (Source source(log); source.Next({}, ignored)) return source.event().utime;
  return 0;
}

bool IsDecision(const MessageSummary& summary) { return summary.type == "decision_t"; }

class Selector final {
 public:
  Selector(const LogSelection& selection, const std::vector<std::string>& logs) : selection_(selection) {
    const std::int64_t first = selection.from.empty() && selection.to.empty() ? 0 : FirstUtime(logs);
    if (!selection.from.empty()) from_ = ParseLogTime(selection.from, first);
    if (!selection.to.empty()) to_ = ParseLogTime(selection.to, first);
  }

  [[nodiscard]] bool Takes(const LogEvent& event, const std::optional<MessageSummary>& summary) const {
    if ((from_ && event.utime < *from_) || (to_ && event.utime >= *to_)) return false;
    if (!selection_.channels.empty() &&
        std::ranges::find(selection_.channels, event.channel) == selection_.channels.end())
      return false;
    if (selection_.outcome.empty()) return true;
    if (!summary || !summary->is_of_plan) return !selection_.drops_others;
    // Of a candidate that came twice, each decision has an outcome of its own.
    return !IsDecision(*summary) || summary->what == selection_.outcome;
  }

 private:
  const LogSelection& selection_;
  std::optional<std::int64_t> from_, to_;
};

// Passes chosen events on in their order. With an outcome, what is about a plan waits for the decision on it.
class Queue final {
 public:
  Queue(const LogSelection& selection, const LogUser& user, std::int64_t& passed)
      : outcome_(selection.outcome), user_(user), passed_(passed) {}

  // Also of an event that was not chosen.
  void Heed(const MessageSummary& summary) {
    if (outcome_.empty() || !IsDecision(summary)) return;
    const bool has_outcome = summary.what == outcome_;
    if (has_outcome) plans_.insert(summary.plan);
    const auto [first, last] = waiting_.equal_range(summary.plan);
    for (auto each = first; each != last; ++each) each->second->waits = false, each->second->goes = has_outcome;
    waiting_.erase(first, last);
    PassOn();
  }
  void Add(const LogEvent& event, const std::optional<MessageSummary>& summary, const std::string& log) {
    const bool is_in_question = !outcome_.empty() && summary && summary->is_of_plan && !plans_.contains(summary->plan);
    const bool waits = is_in_question && summary->type != "advice_t";  // which is given after the decision
    if (is_in_question && !waits) return;
    if (held_.empty() && !waits) return Pass(event, summary, log);
    Held& held = held_.emplace_back(Held{event, summary, log, waits, !waits});
    if (waits) waiting_.emplace(summary->plan, &held);
    bytes_ += RecordBytes(event);
    while (bytes_ > kMostHeldBytes) PassFirst(), PassOn();
  }
  void End() {
    while (!held_.empty()) PassFirst();
  }

 private:
  struct Held {
    LogEvent event;
    std::optional<MessageSummary> summary;
    std::string log;
    bool waits, goes;
  };

  void PassOn() {
    while (!held_.empty() && !held_.front().waits) PassFirst();
  }
  void PassFirst() {
    if (held_.front().waits) Forget(held_.front());
    const Held first = std::move(held_.front());
    held_.pop_front();
    bytes_ -= RecordBytes(first.event);
    if (first.goes) Pass(first.event, first.summary, first.log);
  }
  void Forget(const Held& held) {
    auto each = waiting_.find(held.summary->plan);
    while (each->second != &held) ++each;
    waiting_.erase(each);
  }
  void Pass(const LogEvent& event, const std::optional<MessageSummary>& summary, const std::string& log) {
    ++passed_;
    user_.on_event(event, summary, log);
  }

  const std::string& outcome_;
  const LogUser& user_;
  std::int64_t& passed_;
  std::set<Digest> plans_;                // with the outcome
  std::deque<Held> held_;                 // the first of them waits
  std::multimap<Digest, Held*> waiting_;  // by plan: a decision looks at no others
  std::int64_t bytes_ = 0;
};

}  // namespace

std::int64_t ParseLogTime(const std::string& text, std::int64_t first_utime) {
  if (text.starts_with('+')) {
    const auto seconds = Parse<double>(std::string_view(text).substr(1));
    if (seconds && *seconds >= 0 && *seconds <= kLongestSeconds)
      return first_utime + std::min(std::llround(*seconds * 1e6), INT64_MAX - std::max<long long>(first_utime, 0));
  } else if (const auto utime = Parse<std::int64_t>(text); utime && *utime >= 0) {
    return *utime;
  } else if (const auto seconds = SecondsOfDate(text); seconds && *seconds >= 0) {
    return std::llround(*seconds * 1e6L);
  }
  throw LogError(
      fmt::format("{}: is no time; write microseconds since the Unix epoch, a time in UTC as 2026-01-01T12:00:00, or "
                  "+SECONDS after the first event",
                  text));
}

LogEditResult ReadLogs(const std::vector<std::string>& logs, const LogSelection& selection, LogSequence sequence,
                       const LogUser& user) {
  RequireLogs(logs);
  const Selector selector(selection, logs);
  LogEditResult result;
  Queue queue(selection, user, result.chosen);
  const auto visit = [&](const Source& source) {
    if (result.channels.size() < LogEditResult::kMostChannels) result.channels.insert(source.event().channel);
    const auto summary = Summarize(source.event().message());
    if (summary) queue.Heed(*summary);
    if (selector.Takes(source.event(), summary)) queue.Add(source.event(), summary, source.path());
  };
  (sequence == LogSequence::kByTime ? ForEachByTime : ForEachInOrder)(logs, user.on_damage, result, visit);
  queue.End();
  RequireChannels(selection, result.channels);
  return result;
}

LogEditResult WriteLog(const std::vector<std::string>& logs, const LogSelection& selection, LogSequence sequence,
                       const std::string& output, const std::function<void(const DamagedPlace&)>& on_damage) {
  OutputFile file(output);
  std::int64_t next = 0;
  std::vector<std::uint8_t> record;
  const auto write = [&](const LogEvent& event, const std::optional<MessageSummary>&, const std::string&) {
    record.clear();
    PutRecord(record, logs.size() == 1 ? event.number : next++, event.utime, event.channel, event.data);
    file.Write({reinterpret_cast<const char*>(record.data()), record.size()});
  };
  const LogEditResult result = ReadLogs(logs, selection, sequence, {write, on_damage});
  file.Close();
  return result;
}

}  // namespace forereach
