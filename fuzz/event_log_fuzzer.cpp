// The log reader and the writer's recovery over any bytes: they end, account for every byte, hold no more than one
// event of the allowed size, and recovery keeps as much as the reader read.
#include "fuzz/fuzz.h"
#include "records/event_log.h"

namespace forereach {
namespace {

std::int64_t ReadAll(const std::string& path, std::int64_t size) {
  EventLogReader reader(path);
  LogEvent event;
  LogStatus status;
  std::int64_t events = 0, bytes = 0;
  while ((status = reader.Next(event)) == LogStatus::kEvent || status == LogStatus::kCorrupt) {
    Require(event.data.capacity() <= static_cast<std::size_t>(kMaxLogDataBytes));
    if (status == LogStatus::kEvent) {
      ++events;
      bytes += RecordBytes(event);
    }
    Require(reader.offset() == bytes + reader.damage().bytes);
  }
  Require(reader.size() == size && (status == LogStatus::kEnd) == (reader.offset() == size));
  return events;
}

}  // namespace

bool Try(Bytes data) {
  static MemoryFile file;
  const std::string& path = file.Write(data);
  const auto size = static_cast<std::int64_t>(data.size());
  const std::int64_t events = ReadAll(path, size);
  EventLogWriter writer(path);
  Require(writer.recovery().events == events);
  const std::int64_t kept = size - writer.recovery().cut_bytes;
  Require(ReadAll(path, kept) >= events);  // a claim that reached into the tail no longer discredits one before it
  return events > 0;
}

}  // namespace forereach
