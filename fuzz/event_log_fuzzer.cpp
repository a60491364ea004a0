// The log reader and the writer's recovery over any bytes: they end, account for every byte, hold no more than one event of
// the allowed size, and recovery keeps as much as the reader read.
#include "fuzz/fuzz.h"
#include "logger/event_log.h"

namespace {

using namespace forereach;

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
    Require(reader.offset() == bytes + reader.skipped_bytes());
  }
  Require(reader.size() == size && (status == LogStatus::kEnd) == (reader.offset() == size));
  return events;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static MemoryFile file;
  const std::string path = file.Write(Bytes(data, size));
  const std::int64_t events = ReadAll(path, static_cast<std::int64_t>(size));
  EventLogWriter writer(path);
  Require(writer.recovery().events == events);
  const auto kept = static_cast<std::int64_t>(size) - writer.recovery().cut_bytes;
  Require(ReadAll(path, kept) >= events);  // a claim that reached into the tail no longer discredits one before it
  return 0;
}
