/** Writer and reader of the standard LCM event log, the file that lcm-logplayer plays.

A log is a sequence of records, all numbers big-endian:

    uint32 0xEDA1DA01 | int64 event number | int64 utime | int32 channel bytes | int32 data bytes | channel | data

LCM 1.3.1's own reader allocates the size that a length field claims and returns NULL both at the end and for damage.
This reader bounds every length before it allocates, distinguishes the end, a cut tail and damage, and continues after
damage. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/authentic.h"
#include "bus/descriptor.h"
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
  /** The sender in that signature. */
  [[nodiscard]] SenderId sender() const { return SenderOf(data); }
};

/** The latest stamp that is accepted in the event's message (StreamOrder::Horizon). The sender's clock may be one
second ahead of the logger's. */
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
  kCutTail,  ///< The rest is the beginning of a record: its writer was killed, or is still writing.
  kCorrupt,  ///< Some bytes were not a record and have been skipped; the next call continues after them.
};

/** Damaged places of logs, and the bytes in them. */
struct LogDamage {
  std::int64_t places = 0, bytes = 0;
  LogDamage& operator+=(const LogDamage& other) {
    places += other.places;
    bytes += other.bytes;
    return *this;
  }
};

class EventLogReader final {
 public:
  /** @throws LogError if the file cannot be read. */
  explicit EventLogReader(const std::string& path);

  /** Reads the next record. `event` is valid for kEvent only. kEnd and kCutTail repeat.
  A length field may be damaged. If it points behind the end of the file, the rest is a cut tail only if no whole record
  follows. If no sync word follows its record, the record is damaged if it contains another whole record. Memory is
  allocated for accepted records only.
  Cost: linear in the bytes read, and each byte of an undamaged log is read once; `event` never holds more than
  kMaxLogDataBytes beside its channel. */
  [[nodiscard]] LogStatus Next(LogEvent& event);

  /** The next record is the first whole one that begins at this offset or behind it. */
  void SkipTo(std::int64_t offset) { offset_ = FindRecord(offset, size_); }

  /** The offset behind the last record or damage. */
  [[nodiscard]] std::int64_t offset() const { return offset_; }
  [[nodiscard]] std::int64_t size() const { return size_; }
  /** The damage found so far. */
  [[nodiscard]] const LogDamage& damage() const { return damage_; }

 private:
  enum class Found { kWhole, kCut, kNothing };
  struct Header {
    std::int64_t number, utime;
    std::int32_t channel_bytes, data_bytes;
  };

  static constexpr std::int64_t kWindowBytes = 1 << 15;

  bool Fetch(std::int64_t offset, std::uint8_t* out, std::int64_t bytes);
  bool MoveWindow(std::int64_t offset);
  [[nodiscard]] bool IsInWindow(std::int64_t offset, std::int64_t bytes) const {
    return window_begin_ <= offset && offset + bytes <= window_begin_ + window_size_;
  }
  bool ReadAt(std::int64_t offset, void* out, std::int64_t bytes);
  Found Examine(std::int64_t offset, Header& header);
  bool SyncAt(std::int64_t offset);
  std::int64_t FindRecord(std::int64_t from, std::int64_t end);

  const Descriptor file_;
  std::vector<std::uint8_t> window_;  // bytes of the file around the offset
  std::int64_t window_begin_ = 0, window_size_ = 0;
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

/** The state of a file that is being written. It may be moved, deleted, replaced or cut while its descriptor still
works. */
enum class FilePlace {
  kThere,      ///< Its path leads to it.
  kDeleted,    ///< The file has no name any more.
  kElsewhere,  ///< It has a name, but its path leads to nothing or to another file.
  kCut,        ///< The file is at its path, but some bytes that the disk had confirmed are missing.
  kUnknown,    ///< Its path cannot be examined, for example without permission.
};

/** Identifies a file independently of its path. */
struct FileIdentity {
  std::uint64_t device = 0, inode = 0;
  friend bool operator==(const FileIdentity&, const FileIdentity&) = default;
};

/** The file at a path. Nothing if there is none or it cannot be examined; then errno has the reason. */
[[nodiscard]] std::optional<FileIdentity> IdentityOf(const std::string& path);

class EventLogWriter final {
 public:
  /** Creates the file, with its directory entry confirmed by the disk, or recovers an existing one: removes a cut tail,
  keeps everything else, and continues the event numbers. Holds a lock on the file until the destructor.
  @throws LogError if the file cannot be opened or another writer holds it. */
  explicit EventLogWriter(const std::string& path);

  /** Buffers one event and returns its number. Flush writes it to the file.
  @throws std::invalid_argument if channel or data exceed the limits of the format. */
  std::int64_t Append(std::int64_t utime, const std::string& channel, Bytes data);

  /** Writes all buffered events; the disk has confirmed them when the call returns true. On failure it truncates the
  file to its last whole record, drops the events since, and returns false; `problem` has the reason. If the truncation
  fails too, the next Flush overwrites the remainder and confirms nothing until the file ends with its own last record.
  It does not change a file that another program has cut. */
  [[nodiscard]] bool Flush();

  /** Checks that the confirmed events can be read at the path. Cost: two calls to the file system and 28 bytes read. */
  [[nodiscard]] FilePlace Look() const;

  /** Moves the buffered events of `lost` to this writer, with their event numbers. Call it before the first Append. */
  void TakeOver(EventLogWriter& lost);

  /** Drops the buffered events and gives up the file, whose content is lost. */
  void Abandon();

  [[nodiscard]] const LogRecovery& recovery() const { return recovery_; }
  [[nodiscard]] const std::string& problem() const { return problem_; }
  /** The bytes of the file after the last successful Flush, and the buffered bytes. */
  [[nodiscard]] std::int64_t offset() const { return offset_; }
  [[nodiscard]] std::int64_t pending_bytes() const { return static_cast<std::int64_t>(buffer_.size()); }
  [[nodiscard]] std::int64_t next_number() const { return next_number_; }

 private:
  void Recover(const std::string& path);
  [[nodiscard]] bool MarkStands() const;

  const std::string path_;
  const Descriptor file_;
  bool is_torn_ = false;  // there may be bytes after offset_
  std::vector<std::uint8_t> buffer_;
  std::vector<std::uint8_t> mark_;  // the header of a record that the last Flush has written, which is not all zero
  std::int64_t mark_at_ = 0;
  std::int64_t offset_ = 0, next_number_ = 0;
  LogRecovery recovery_;
  std::string problem_;
};

/** Adds a record to `out`. @pre the limits of the format, as EventLogReader keeps them. */
void PutRecord(std::vector<std::uint8_t>& out, std::int64_t number, std::int64_t utime, const std::string& channel,
               Bytes data);

}  // namespace forereach
