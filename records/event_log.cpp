#include "records/event_log.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "task/files.h"

namespace forereach {
namespace {

constexpr std::array<std::uint8_t, 4> kSync{0xED, 0xA1, 0xDA, 0x01};
constexpr std::int64_t kHeaderBytes = 28;
constexpr std::int64_t kMaxNumber = std::int64_t{1} << 62;

std::string Reason(const std::string& what, const std::string& path) {
  return fmt::format("{}{}: {}", what, path, std::strerror(errno));
}

}  // namespace

void PutRecord(std::vector<std::uint8_t>& out, std::int64_t number, std::int64_t utime, const std::string& channel,
               Bytes data) {
  const auto put = [&out](const auto& part) { out.insert(out.end(), part.begin(), part.end()); };
  put(kSync);
  put(BigEndian(number));
  put(BigEndian(utime));
  put(BigEndian(static_cast<std::int32_t>(channel.size())));
  put(BigEndian(static_cast<std::int32_t>(data.size())));
  put(channel);
  put(data);
}

Digest DigestOf(const LogEvent& event) {
  std::vector<std::uint8_t> record;
  record.reserve(static_cast<std::size_t>(RecordBytes(event)));
  PutRecord(record, event.number, event.utime, event.channel, event.data);
  return DigestOf(Bytes(record));
}

std::int64_t RecordBytes(const LogEvent& event) {
  return kHeaderBytes + std::ssize(event.channel) + std::ssize(event.data);
}

EventLogReader::EventLogReader(const std::string& path)
    // Opening a pipe without a writer may not wait.
    : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)), window_(kWindowBytes) {
  struct stat status {};
  if (file_.get() < 0 || ::fstat(file_.get(), &status) != 0) throw LogError(Reason("log: cannot read ", path));
  if (!S_ISREG(status.st_mode)) throw LogError(fmt::format("log: cannot read {}: not a regular file", path));
  size_ = status.st_size;
}

bool EventLogReader::Fetch(std::int64_t offset, std::uint8_t* out, std::int64_t bytes) {
  while (bytes > 0) {
    const ssize_t read = ::pread(file_.get(), out, static_cast<std::size_t>(bytes), offset);
    if (read < 0 && errno == EINTR) continue;
    if (read <= 0) return false;
    offset += read;
    out += read;
    bytes -= read;
  }
  return true;
}

// Moves the window on to `offset`. What it has from there on is not read again.
bool EventLogReader::MoveWindow(std::int64_t offset) {
  const std::int64_t end = window_begin_ + window_size_;
  const std::int64_t kept = window_begin_ <= offset && offset < end ? end - offset : 0;
  std::copy_n(window_.begin() + (window_size_ - kept), kept, window_.begin());
  const std::int64_t wanted = std::min<std::int64_t>(kWindowBytes, size_ - offset) - kept;
  window_begin_ = offset;
  window_size_ = Fetch(offset + kept, window_.data() + kept, wanted) ? kept + wanted : kept;
  return wanted >= 0 && window_size_ == kept + wanted;
}

bool EventLogReader::ReadAt(std::int64_t offset, void* out, std::int64_t bytes) {
  if (bytes > size_ - offset) return false;
  auto* to = static_cast<std::uint8_t*>(out);
  if (bytes < kWindowBytes / 2 && !IsInWindow(offset, bytes) && !MoveWindow(offset)) return false;
  const std::int64_t end = window_begin_ + window_size_;
  const std::int64_t from_window =
      window_begin_ <= offset && offset < end ? std::min<std::int64_t>(end - offset, bytes) : 0;
  std::copy_n(window_.begin() + (from_window > 0 ? offset - window_begin_ : 0), from_window, to);
  return from_window == bytes || Fetch(offset + from_window, to + from_window, bytes - from_window);
}

// A record begins at `offset` if its sync word and the plausible header behind it do; kCut if the file ends first.
EventLogReader::Found EventLogReader::Examine(std::int64_t offset, Header& header) {
  const std::int64_t left = std::min(size_ - offset, kHeaderBytes);
  std::array<std::uint8_t, kHeaderBytes> bytes;
  if (!ReadAt(offset, bytes.data(), left)) return Found::kNothing;
  if (!std::equal(kSync.begin(), kSync.begin() + std::min<std::int64_t>(left, 4), bytes.begin()))
    return Found::kNothing;
  if (left < kHeaderBytes) return Found::kCut;
  header.number = FromBigEndian<std::int64_t>(Bytes(bytes).subspan(4));
  header.utime = FromBigEndian<std::int64_t>(Bytes(bytes).subspan(12));
  header.channel_bytes = FromBigEndian<std::int32_t>(Bytes(bytes).subspan(20));
  header.data_bytes = FromBigEndian<std::int32_t>(Bytes(bytes).subspan(24));
  const bool plausible = header.number >= 0 && header.number < kMaxNumber && header.utime >= 0 &&
                         header.channel_bytes > 0 && header.channel_bytes <= kMaxLogChannelBytes &&
                         header.data_bytes >= 0 && header.data_bytes <= kMaxLogDataBytes;
  if (!plausible) return Found::kNothing;
  return size_ - offset - kHeaderBytes >= header.channel_bytes + header.data_bytes ? Found::kWhole : Found::kCut;
}

// True at the end of the file, at a sync word, and at the beginning of a cut one.
bool EventLogReader::SyncAt(std::int64_t offset) {
  std::array<std::uint8_t, 4> bytes{};
  const std::int64_t left = std::min<std::int64_t>(size_ - offset, 4);
  // The window stays where it is, since what lies before is read next.
  const bool is_read =
      IsInWindow(offset, left) ? ReadAt(offset, bytes.data(), left) : Fetch(offset, bytes.data(), left);
  return is_read && std::equal(bytes.begin(), bytes.begin() + left, kSync.begin());
}

// The offset of the first whole record that begins in [from, end), or end.
std::int64_t EventLogReader::FindRecord(std::int64_t from, std::int64_t end) {
  std::array<std::uint8_t, 1 << 16> block;
  const std::int64_t limit = std::min<std::int64_t>(end + 3, size_);  // the sync word may reach beyond the end
  std::int64_t step = 256;  // doubled, so that a log of nothing but damage costs no more than it has bytes
  for (; limit - from >= std::ssize(kSync); step = std::min<std::int64_t>(2 * step, std::ssize(block))) {
    const std::int64_t bytes = std::min(limit - from, step);
    if (!ReadAt(from, block.data(), bytes)) break;
    const auto block_end = block.begin() + bytes;
    for (auto at = block.begin(); (at = std::search(at, block_end, kSync.begin(), kSync.end())) != block_end; ++at) {
      Header header{};
      if (Examine(from + (at - block.begin()), header) == Found::kWhole) return from + (at - block.begin());
    }
    from += bytes - 3;  // a sync word may lie across two blocks
  }
  return end;
}

LogStatus EventLogReader::Next(LogEvent& event) {
  if (offset_ >= size_) return LogStatus::kEnd;
  Header header{};
  const Found found = Examine(offset_, header);
  std::int64_t next = size_;
  if (found == Found::kWhole) {
    const std::int64_t channel = offset_ + kHeaderBytes, data = channel + header.channel_bytes;
    const std::int64_t end = data + header.data_bytes;
    next = SyncAt(end) ? end : FindRecord(offset_ + 1, end);
    if (next == end) {  // otherwise the length is not trusted, and nothing is allocated for it
      event.number = header.number;
      event.utime = header.utime;
      event.channel.resize(static_cast<std::size_t>(header.channel_bytes));
      const auto data_bytes = static_cast<std::size_t>(header.data_bytes);
      // Growing the buffer would hold the old and the new bytes at once.
      if (event.data.capacity() < data_bytes) std::vector<std::uint8_t>().swap(event.data);
      event.data.resize(data_bytes);
      if (ReadAt(channel, event.channel.data(), header.channel_bytes) &&
          ReadAt(data, event.data.data(), header.data_bytes)) {
        offset_ = end;
        return LogStatus::kEvent;
      }
    }
  } else {
    next = FindRecord(offset_ + 1, size_);
    if (found == Found::kCut && next == size_) return LogStatus::kCutTail;
  }
  damage_ += {1, next - offset_};
  offset_ = next;
  return LogStatus::kCorrupt;
}

void ForEachEvent(EventLogReader& reader, const std::function<void(const LogEvent&)>& visit) {
  LogEvent event;
  for (;;) {
    switch (reader.Next(event)) {
      case LogStatus::kEvent: visit(event); break;
      case LogStatus::kCorrupt: break;
      case LogStatus::kEnd:
      case LogStatus::kCutTail: return;
    }
  }
}

LogDamage ForEachEvent(const std::vector<std::string>& logs,
                       const std::function<void(const LogEvent&, const std::string&)>& visit) {
  LogDamage damage;
  for (const std::string& log : logs) {
    EventLogReader reader(log);
    ForEachEvent(reader, [&](const LogEvent& event) { visit(event, log); });
    damage += reader.damage();
  }
  return damage;
}

std::optional<FileIdentity> IdentityOf(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return FileIdentity{status.st_dev, status.st_ino};
}

EventLogWriter::EventLogWriter(const std::string& path)
    : path_(path), file_(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
  if (file_.get() < 0) throw LogError(Reason("log: cannot write ", path));
  if (::flock(file_.get(), LOCK_EX | LOCK_NB) != 0)
    throw LogError(fmt::format("log: {} is being written by another process", path));
  if (!ConfirmDirectory(std::filesystem::path(path).parent_path().string()))
    throw LogError(Reason("log: cannot write ", path));
  Recover(path);
}

void EventLogWriter::Recover(const std::string& path) {
  EventLogReader reader(path);
  ForEachEvent(reader, [this](const LogEvent& event) {
    if (recovery_.events++ == 0) recovery_.first_utime = event.utime;
    recovery_.last_utime = event.utime;
    next_number_ = std::max(next_number_, event.number + 1);
  });
  offset_ = reader.offset();
  recovery_.cut_bytes = reader.size() - offset_;
  recovery_.damage = reader.damage();
  if (recovery_.cut_bytes > 0 && ::ftruncate(file_.get(), offset_) != 0)
    throw LogError(Reason("log: cannot recover ", path));
}

std::int64_t EventLogWriter::Append(std::int64_t utime, const std::string& channel, Bytes data) {
  if (channel.empty() || channel.size() > kMaxLogChannelBytes || data.size() > kMaxLogDataBytes)
    throw std::invalid_argument(fmt::format(
        "log: a channel has 1 to 63 bytes and a message at most 16777216, not {} and {}", channel.size(), data.size()));
  PutRecord(buffer_, next_number_, std::max<std::int64_t>(utime, 0), channel, data);
  return next_number_++;
}

FilePlace EventLogWriter::Look() const {
  struct stat status {};
  if (::fstat(file_.get(), &status) != 0) return FilePlace::kUnknown;
  if (status.st_nlink == 0) return FilePlace::kDeleted;
  const std::optional<FileIdentity> found = IdentityOf(path_);
  if (!found && errno != ENOENT && errno != ENOTDIR) return FilePlace::kUnknown;
  if (found != FileIdentity{status.st_dev, status.st_ino}) return FilePlace::kElsewhere;
  return status.st_size < offset_ || !MarkStands() ? FilePlace::kCut : FilePlace::kThere;
}

// A file that was cut and has grown again, by a write behind the cut, has zeros where its last records were.
bool EventLogWriter::MarkStands() const {
  std::array<std::uint8_t, kHeaderBytes> bytes{};
  return ::pread(file_.get(), bytes.data(), mark_.size(), mark_at_) == std::ssize(mark_) &&
         std::equal(mark_.begin(), mark_.end(), bytes.begin());
}

void EventLogWriter::TakeOver(EventLogWriter& lost) {
  buffer_ = std::exchange(lost.buffer_, {});
  next_number_ = lost.next_number_;
}

void EventLogWriter::Abandon() {
  buffer_.clear();
  mark_.clear();
  offset_ = 0;
}

bool EventLogWriter::Flush() {
  if (buffer_.empty()) return true;
  const std::int64_t end = offset_ + pending_bytes();
  const std::string_view bytes(reinterpret_cast<const char*>(buffer_.data()), buffer_.size());
  const bool confirmed = WriteAt(file_.get(), bytes, offset_) && (!is_torn_ || ::ftruncate(file_.get(), end) == 0) &&
                         ::fdatasync(file_.get()) == 0;
  const bool is_cut = !MarkStands();  // since the last look
  if (confirmed && !is_cut) {
    mark_.assign(buffer_.begin(), buffer_.begin() + kHeaderBytes);
    mark_at_ = std::exchange(offset_, end);
    is_torn_ = false;
  } else if (is_cut) {
    problem_ = fmt::format("log: {} was cut short while it was written", path_);
  } else {
    problem_ = fmt::format("log: cannot write: {}", std::strerror(errno));
    // A torn record in the middle of the file would read as damage.
    is_torn_ = ::ftruncate(file_.get(), offset_) != 0;
    if (is_torn_) problem_ += fmt::format("; cannot put the file back: {}", std::strerror(errno));
  }
  buffer_.clear();
  return confirmed && !is_cut;
}

}  // namespace forereach
