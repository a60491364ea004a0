/** Writer and reader of the standard LCM event log, the file that lcm-logplayer plays.

A log is a sequence of records, all numbers big-endian:

    uint32 0xEDA1DA01 | int64 event number | int64 utime | int32 channel bytes | int32 data bytes | channel | data

LCM 1.3.1's own reader allocates the size that a length field claims and returns NULL both at the end and for damage.
This reader bounds every length before it allocates, distinguishes the end, a cut tail and damage, and continues after
damage. */
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/authentic.h"
#include "lcmtypes/bad_input.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/stream_order.h"

namespace forereach {

/** A log cannot be opened, locked or created; the text names the file and the reason. */
class LogError : public BadInput {
 public:
  using BadInput::BadInput;
};

struct LogEvent {
  std::int64_t number = 0;  ///< Counts the events of a file from 0. A number that is missing was lost to a full disk.
  std::int64_t utime = 0;   ///< Microseconds since the Unix epoch at which it was received.
  std::string channel;
  std::vector<std::uint8_t> data;  ///< As it was on the bus.

  /** The data without the signature, if there is one (bus/authentic.h). */
  [[nodiscard]] Bytes message() const { return WithoutSignature(data); }
};

/** The latest stamp that counts of the event's message (StreamOrder::Horizon): its sender's clock may be ahead of the
logger's by a second. */
[[nodiscard]] inline std::int64_t HorizonOf(const LogEvent& event) {
  return StreamOrder::Horizon(event.utime, 1'000'000);
}

/** BLAKE2b-256 of the event's record in the file, so every changed bit changes the digest. */
[[nodiscard]] Digest DigestOf(const LogEvent& event);
/** Bytes of that record. */
[[nodiscard]] std::int64_t RecordBytes(const LogEvent& event);

inline constexpr std::int32_t kMaxLogChannelBytes = 63;  ///< LCM's own limit.
inline constexpr std::int32_t kMaxLogDataBytes = 1 << 24;

enum class LogStatus {
  kEvent,    ///< One whole record was read.
  kEnd,      ///< The file ends behind a whole record.
  kCutTail,  ///< What is left is the beginning of one record: its writer was killed, or writes still.
  kCorrupt,  ///< Some bytes were not a record and have been skipped; the next call continues after them.
};

/** Damaged places of logs, and the bytes in them. */
struct LogDamage {
  std::int64_t places = 0, bytes = 0;
  friend LogDamage operator+(const LogDamage& a, const LogDamage& b) {
    return {a.places + b.places, a.bytes + b.bytes};
  }
};

class EventLogReader final {
 public:
  /** @throws LogError if the file cannot be read. */
  explicit EventLogReader(const std::string& path);

  /** Reads the next record; `event` is meaningful for kEvent only. kEnd and kCutTail repeat.
  Length fields are not believed blindly: one that points behind the end of the file is a cut tail only if no whole
  record follows, and one behind whose record no sync word stands is damaged if it hides another whole record. Room is
  made for records that are believed only.
  Cost: linear in the bytes passed; `event` never holds more than kMaxLogDataBytes beside its channel. */
  [[nodiscard]] LogStatus Next(LogEvent& event);

  /** Bytes from the beginning of the file to behind the last record or damage passed. */
  [[nodiscard]] std::int64_t offset() const { return offset_; }
  [[nodiscard]] std::int64_t size() const { return size_; }
  /** Passed so far. */
  [[nodiscard]] const LogDamage& damage() const { return damage_; }

 private:
  enum class Found { kWhole, kCut, kNothing };
  struct Header {
    std::int64_t number, utime;
    std::int32_t channel_bytes, data_bytes;
  };

  bool ReadAt(std::int64_t offset, void* out, std::int64_t bytes);
  Found Examine(std::int64_t offset, Header& header);
  bool SyncAt(std::int64_t offset);
  std::int64_t FindRecord(std::int64_t from, std::int64_t end);

  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::int64_t position_ = 0;  // of file_, so that reading on needs no seek
  std::int64_t offset_ = 0, size_ = 0;
  LogDamage damage_;
};

/** Calls `visit` for each event from where the reader stands to the end of the log; passes over damage, which the
reader counts. */
void ForEachEvent(EventLogReader& reader, const std::function<void(const LogEvent&)>& visit);

/** Calls `visit` with each event of several logs that follow one another, as the files of one run do, and the log's
path.
@throws LogError if one cannot be read. */
LogDamage ForEachEvent(const std::vector<std::string>& logs,
                       const std::function<void(const LogEvent&, const std::string&)>& visit);

/** What a writer found in a file that existed already. */
struct LogRecovery {
  std::int64_t events = 0;                       ///< Whole records kept.
  std::int64_t cut_bytes = 0;                    ///< Of a cut tail, removed.
  LogDamage damage;                              ///< Left as it is.
  std::int64_t first_utime = 0, last_utime = 0;  ///< Of the first and last whole record, 0 without one.
};

/** What became of a file that is being written: it may be moved, deleted, replaced or cut while its descriptor still
works. */
enum class FilePlace {
  kThere,      ///< Its path leads to it.
  kDeleted,    ///< No name leads to it any more.
  kElsewhere,  ///< It has a name, but its path leads to nothing or to another file.
  kCut,        ///< The file is at its path, but some bytes that the disk had confirmed are missing.
  kUnknown,    ///< Its path cannot be looked at, as without the permission to do so.
};

/** Which file a path leads to. */
struct FileIdentity {
  std::uint64_t device = 0, inode = 0;
  friend bool operator==(const FileIdentity&, const FileIdentity&) = default;
};

/** Nothing if the path leads to no file or cannot be looked at; errno then says why. */
[[nodiscard]] std::optional<FileIdentity> IdentityOf(const std::string& path);

class EventLogWriter final {
 public:
  /** Creates the file and has the disk confirm that it is in its directory, or recovers an existing one: keeps all
  whole records, removes a cut tail and nothing else, and continues the event numbers. Holds a lock on the file while it
  lives.
  @throws LogError if the file cannot be opened or another writer holds it. */
  explicit EventLogWriter(const std::string& path);
  ~EventLogWriter();
  EventLogWriter(const EventLogWriter&) = delete;
  EventLogWriter& operator=(const EventLogWriter&) = delete;

  /** Takes one event into memory and returns its number; Flush brings it to the file.
  @throws std::invalid_argument for a channel or data above the limits of this format. */
  std::int64_t Append(std::int64_t utime, const std::string& channel, Bytes data);

  /** Writes everything appended so far and has the disk confirm it. On failure the file is put back to its last
  whole record, the events since are lost and false is returned; `problem` then says why. Where it cannot be put back,
  the next Flush writes over what was left and confirms nothing before the file ends with its own last record. A file
  that was cut by somebody else is left as it is. */
  [[nodiscard]] bool Flush();

  /** Whether what Flush confirms can be read at the path. Cost: two looks at the file system and 28 bytes read. */
  [[nodiscard]] FilePlace Look() const;

  /** Takes over what `lost` holds in memory, with its event numbers; `lost` holds nothing afterwards. To be called
  before the first Append. */
  void TakeOver(EventLogWriter& lost);

  /** Forgets what waits in memory, and what the file held: it is lost. */
  void Abandon();

  [[nodiscard]] const LogRecovery& recovery() const { return recovery_; }
  [[nodiscard]] const std::string& problem() const { return problem_; }
  /** Bytes of the file after the last successful Flush, and those that wait in memory. */
  [[nodiscard]] std::int64_t offset() const { return offset_; }
  [[nodiscard]] std::int64_t pending_bytes() const { return static_cast<std::int64_t>(buffer_.size()); }
  [[nodiscard]] std::int64_t next_number() const { return next_number_; }

 private:
  void Recover(const std::string& path);
  [[nodiscard]] bool MarkStands() const;

  const std::string path_;
  int file_ = -1;
  bool is_torn_ = false;  // there may be bytes after offset_
  std::vector<std::uint8_t> buffer_;
  std::vector<std::uint8_t> mark_;  // the header of a record that the last Flush has written, which is not all zero
  std::int64_t mark_at_ = 0;
  std::int64_t offset_ = 0, next_number_ = 0;
  LogRecovery recovery_;
  std::string problem_;
};

}  // namespace forereach
