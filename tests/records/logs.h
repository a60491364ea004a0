/** What the logger's tests share: files as bytes, logs as lists, and messages. */
#pragma once

#include "forereach/candidate_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "lcmtypes/codec.h"
#include "lcmtypes/seal.h"
#include "records/event_log.h"
#include "records/interpreter.h"
#include "tests/test.h"

namespace forereach {

inline std::vector<std::uint8_t> ReadBytes(const std::string& path) {
  std::error_code none;
  const std::uintmax_t size = std::filesystem::file_size(path, none);
  std::vector<std::uint8_t> bytes(none ? 0 : size);
  std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(bytes.data()), std::ssize(bytes));
  return bytes;
}

inline void WriteBytes(const std::string& path, const std::vector<std::uint8_t>& bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

/** The place of the first record that begins at `from` or after it, by its sync word. */
inline std::size_t RecordFrom(const std::vector<std::uint8_t>& bytes, std::size_t from) {
  constexpr std::uint8_t kSync[] = {0xED, 0xA1, 0xDA, 0x01};
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(from);
  return static_cast<std::size_t>(std::search(begin, bytes.end(), std::begin(kSync), std::end(kSync)) - bytes.begin());
}

/** All that can be read of a log, and how it ended. */
struct LogContents {
  std::vector<LogEvent> events;
  LogStatus end = LogStatus::kEnd;
  LogDamage damage;
};

inline LogContents ReadLog(const std::string& path) {
  EventLogReader reader(path);
  LogContents contents;
  LogEvent event;
  while ((contents.end = reader.Next(event)) == LogStatus::kEvent || contents.end == LogStatus::kCorrupt)
    if (contents.end == LogStatus::kEvent) contents.events.push_back(event);
  contents.damage = reader.damage();
  return contents;
}

/** What a log makes of rows, as one of this name. */
inline Rows RowsOf(const std::string& path, const std::string& name, const BusOptions& channels = {}) {
  Interpreter interpreter(channels, name);
  Rows rows;
  for (const LogEvent& event : ReadLog(path).events) interpreter.Observe(event, rows);
  return rows;
}

/** Copies a log, each event changed by `edit`, which leaves it out where it returns false. */
template <class Edit>
void CopyLog(const std::string& from, const std::string& to, Edit edit) {
  EventLogReader reader(from);
  EventLogWriter writer(to);
  LogEvent event;
  while (reader.Next(event) == LogStatus::kEvent)
    if (edit(event)) writer.Append(event.utime, event.channel, event.data);
  EXPECT_TRUE(writer.Flush());
}

/** An edit of CopyLog: changes the first message of a type, or leaves it out where `edit` returns false. */
template <class Message, class Edit>
auto OfFirst(Edit edit) {
  return [edit, done = false](LogEvent& event) mutable {
    auto message = Decoded<Message>(event.data);
    if (!message || std::exchange(done, true)) return true;
    if constexpr (std::is_same_v<decltype(edit(*message)), bool>) {
      if (!edit(*message)) return false;
    } else {
      edit(*message);
    }
    event.data = Encode(*message);
    return true;
  };
}

inline candidate_plan_t MakeCandidate(std::int64_t sequence, std::int64_t plan_id, const std::string& source = "test") {
  candidate_plan_t candidate{.sequence = sequence, .plan_id = plan_id};
  SetText(candidate.source, source);
  return candidate;
}

inline decision_t MakeDecision(const candidate_plan_t& candidate, std::int64_t sequence, std::int16_t outcome,
                               std::int16_t cause) {
  decision_t decision{.sequence = sequence, .plan_id = candidate.plan_id};
  SetText(decision.source, GetText(candidate.source));
  decision.outcome = outcome;
  decision.cause = cause;
  SetDigest(decision.plan_digest, PlanDigest(candidate));
  return decision;
}

inline execution_event_t MakeEvent(std::int64_t sequence, std::int16_t kind, std::int64_t plan_id = 0, int step = 0) {
  return {.sequence = sequence, .plan_id = plan_id, .kind = kind, .step = static_cast<std::int16_t>(step)};
}

}  // namespace forereach
