// Real logs, damaged at random: the reader ends, stays within its memory, and returns every record that is undamaged.
#include <new>

#include <malloc.h>

#include "tests/records/course.h"
#include "tests/records/logs.h"

// This program counts what it holds on the heap. Inlined, the compiler would see new end in free and warn.
namespace {
std::size_t live_bytes = 0, peak_bytes = 0;
}

[[gnu::noinline]] void* operator new(std::size_t size) {
  void* block = std::malloc(size);
  if (!block) throw std::bad_alloc();
  live_bytes += malloc_usable_size(block);
  peak_bytes = std::max(peak_bytes, live_bytes);
  return block;
}
[[gnu::noinline]] void operator delete(void* block) noexcept {
  if (block) live_bytes -= malloc_usable_size(block);
  std::free(block);
}
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept { operator delete(block); }

namespace forereach::hostile_log_test {

constexpr std::size_t kMemory = kMaxLogDataBytes + (1 << 16);  // one event, its channel and the reader itself

/** Bytes, and for each the place in the undamaged log it was copied from, or -1. */
struct Damaged {
  std::vector<std::uint8_t> bytes;
  std::vector<std::int64_t> origin;

  void Erase(std::size_t at, std::size_t count) {
    const auto begin = static_cast<std::ptrdiff_t>(at),
               end = static_cast<std::ptrdiff_t>(std::min(at + count, bytes.size()));
    bytes.erase(bytes.begin() + begin, bytes.begin() + end);
    origin.erase(origin.begin() + begin, origin.begin() + end);
  }
  void Insert(std::size_t at, const std::vector<std::uint8_t>& more, const std::vector<std::int64_t>& from) {
    bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), more.begin(), more.end());
    origin.insert(origin.begin() + static_cast<std::ptrdiff_t>(at), from.begin(), from.end());
  }
  void Set(std::size_t at, std::uint8_t value) {
    if (bytes[at] != value) origin[at] = -1;
    bytes[at] = value;
  }
  /** A sync word or the end of the file, also one that cuts a sync word. */
  [[nodiscard]] bool EndsARecord(std::size_t at) const {
    static constexpr std::array<std::uint8_t, 4> kSync{0xED, 0xA1, 0xDA, 0x01};
    return std::equal(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                      bytes.begin() + static_cast<std::ptrdiff_t>(std::min(at + 4, bytes.size())), kSync.begin());
  }
};

struct HostileLog : testing::Test {
  // Reads all that can be read, one event's room for all; `after_each` event and damage, until it fails.
  template <class AfterEach>
  static int CountEvents(EventLogReader& reader, LogEvent& event, AfterEach after_each) {
    int events = 0;
    while (!testing::Test::HasFatalFailure()) {
      const LogStatus status = reader.Next(event);
      if (status != LogStatus::kEvent && status != LogStatus::kCorrupt) break;
      events += status == LogStatus::kEvent;
      after_each();
    }
    return events;
  }

  std::size_t Below(std::size_t bound) { return std::uniform_int_distribution<std::size_t>(0, bound - 1)(random_); }

  /** The records of `path` from the `first` on, `count` at most, as one log; `ends_` gets where each ends, by its
  start. */
  Damaged Window(const std::string& path, std::size_t first, std::size_t count) {
    const std::vector<std::uint8_t> whole = ReadBytes(path);
    EventLogReader reader(path);
    LogEvent event;
    Damaged log;
    ends_.clear();
    for (std::size_t i = 0; i < first + count && reader.Next(event) == LogStatus::kEvent; ++i) {
      if (i < first) continue;
      const auto begin = whole.begin() + (reader.offset() - RecordBytes(event));
      const std::int64_t start = std::ssize(log.bytes);
      log.bytes.insert(log.bytes.end(), begin, whole.begin() + reader.offset());
      ends_[start] = std::ssize(log.bytes);
    }
    log.origin.resize(log.bytes.size());
    std::iota(log.origin.begin(), log.origin.end(), 0);
    return log;
  }

  void Harm(Damaged& log) {
    const std::size_t at = Below(log.bytes.size());
    switch (Below(7)) {
      case 0: return log.Set(at, static_cast<std::uint8_t>(log.bytes[at] ^ 1u << Below(8)));
      case 1: return log.Erase(at, 1 + Below(Below(2) ? 8 : 6000));
      case 2: {  // splice: a part of the log again
        const std::size_t from = Below(log.bytes.size()), count = std::min(1 + Below(20000), log.bytes.size() - from);
        const auto begin = static_cast<std::ptrdiff_t>(from), end = static_cast<std::ptrdiff_t>(from + count);
        return log.Insert(at, {log.bytes.begin() + begin, log.bytes.begin() + end},
                          {log.origin.begin() + begin, log.origin.begin() + end});
      }
      case 3: {  // a length field, huge, negative or anything
        const std::size_t field = StartNear(at) + (Below(2) ? 20 : 24);
        const std::uint32_t values[] = {0x7fffffff, 0xffffffff, 1u << 24, (1u << 24) + 1,
                                        static_cast<std::uint32_t>(random_())};
        const std::uint32_t value = values[Below(std::size(values))];
        for (std::size_t i = 0; i < 4 && field + i < log.bytes.size(); ++i)
          log.Set(field + i, static_cast<std::uint8_t>(value >> (24 - 8 * i)));
        return;
      }
      case 4: {
        const std::vector<std::uint8_t> sync{0xED, 0xA1, 0xDA, 0x01, 0, 0, 0};
        return log.Insert(at, sync, std::vector<std::int64_t>(sync.size(), -1));
      }
      case 5: {
        std::vector<std::uint8_t> garbage(1 + Below(300));
        for (std::uint8_t& byte : garbage) byte = static_cast<std::uint8_t>(random_());
        return log.Insert(at, garbage, std::vector<std::int64_t>(garbage.size(), -1));
      }
      default:
        if (Below(4) == 0) log.Erase(at, log.bytes.size());
    }
  }

  // The start of some record at or before a place of the undamaged log.
  [[nodiscard]] std::size_t StartNear(std::size_t at) const {
    auto next = ends_.upper_bound(static_cast<std::int64_t>(at));
    return static_cast<std::size_t>(next == ends_.begin() ? 0 : std::prev(next)->first);
  }

  /** Where undamaged records begin. */
  [[nodiscard]] std::vector<std::int64_t> Undamaged(const Damaged& log) const {
    std::vector<std::int64_t> starts;
    const std::vector<std::int64_t>& origin = log.origin;
    for (auto begin = origin.begin(), end = begin; begin != origin.end(); begin = end) {
      end = std::adjacent_find(begin, origin.end(), [](std::int64_t a, std::int64_t b) { return b != a + 1; });
      if (end != origin.end()) ++end;
      const std::int64_t first = *begin, last = first + (end - begin);  // of one piece in the undamaged log, too
      for (auto record = ends_.lower_bound(first); record != ends_.end() && record->second <= last; ++record)
        starts.push_back(begin - origin.begin() + record->first - first);
    }
    return starts;
  }

  /** Where the records that the reader returns begin and end. */
  static std::map<std::int64_t, std::int64_t> Returned(const std::string& path) {
    std::map<std::int64_t, std::int64_t> returned;
    EventLogReader reader(path);
    LogEvent event;
    LogStatus status;
    while ((status = reader.Next(event)) == LogStatus::kEvent || status == LogStatus::kCorrupt)
      if (status == LogStatus::kEvent) returned[reader.offset() - RecordBytes(event)] = reader.offset();
    return returned;
  }

  // What the format leaves open: damage that made a length point exactly at a later record hides those between.
  static bool IsHidden(const Damaged& log, const std::map<std::int64_t, std::int64_t>& returned, std::int64_t start) {
    const auto next = returned.upper_bound(start);
    if (next == returned.begin()) return false;
    const std::int64_t end = std::prev(next)->second;
    return end > start && log.EndsARecord(static_cast<std::size_t>(end));
  }

  FreshRandom random_;
  std::map<std::int64_t, std::int64_t> ends_;
  const ScratchDirectory scratch_;
};

TEST_F(HostileLog, EveryUndamagedRecordIsRecovered) {
  std::size_t undamaged = 0, hidden = 0, damaged_rounds = 0;
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE(testing::Message() << "round " << round);
    Damaged log = Window(kCourseLog, Below(380), 1 + Below(45));
    for (std::size_t harms = 1 + Below(8); harms > 0 && !log.bytes.empty(); --harms) Harm(log);
    WriteBytes(scratch_ / "bad", log.bytes);
    const auto returned = Returned(scratch_ / "bad");
    const std::vector<std::int64_t> expected = Undamaged(log);
    for (const std::int64_t start : expected) {
      if (returned.contains(start)) continue;
      ++hidden;
      ASSERT_TRUE(IsHidden(log, returned, start)) << "the undamaged record at " << start << " is lost";
    }
    undamaged += expected.size();
    damaged_rounds += expected.size() < ends_.size();
  }
  EXPECT_GT(undamaged, 1000u);
  EXPECT_GT(damaged_rounds, 100u);
  EXPECT_LE(hidden, undamaged / 100);
}

TEST_F(HostileLog, LengthsDoNotFillTheMemory) {
  {
    EventLogWriter writer(scratch_ / "log");
    for (const std::size_t bytes :
         {std::size_t{100}, std::size_t{10} << 20, std::size_t{kMaxLogDataBytes}, std::size_t{5}})
      writer.Append(1, "LARGE", std::vector<std::uint8_t>(bytes, 7));
    ASSERT_TRUE(writer.Flush());
  }
  std::vector<std::uint8_t> bytes = ReadBytes(scratch_ / "log");
  const std::size_t end = bytes.size();
  bytes.insert(bytes.end(), bytes.begin(), bytes.begin() + 100);
  for (std::size_t i = 0; i < 4; ++i) bytes[end + 24 + i] = i == 0 ? 0x7f : 0xff;
  WriteBytes(scratch_ / "log", bytes);
  bytes = {};
  EventLogReader reader(scratch_ / "log");
  LogEvent event;
  const std::size_t before = peak_bytes = live_bytes;
  EXPECT_EQ(CountEvents(reader, event, [] {}), 4);
  EXPECT_GE(peak_bytes - before, std::size_t{kMaxLogDataBytes});
  EXPECT_LE(peak_bytes - before, kMemory);
}

// Claims of 16 MiB before every tiny record, each of which the file is long enough for: none is believed.
TEST_F(HostileLog, RefusedLengthsTakeNoMemory) {
  constexpr int kRecords = 10'000;
  std::vector<std::uint8_t> claim{0xED, 0xA1, 0xDA, 0x01};
  claim.resize(28);
  claim[23] = 1;  // one byte of channel
  std::vector<std::uint8_t> tiny = claim;
  claim[24] = 1;  // kMaxLogDataBytes
  tiny.push_back('T');
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < kRecords; ++i) {
    bytes.insert(bytes.end(), claim.begin(), claim.end());
    bytes.insert(bytes.end(), tiny.begin(), tiny.end());
  }
  bytes.resize(bytes.size() + kMaxLogDataBytes + 100);
  WriteBytes(scratch_ / "claims", bytes);
  bytes = {};
  EventLogReader reader(scratch_ / "claims");
  LogEvent event;
  const std::size_t before = peak_bytes = live_bytes;
  EXPECT_EQ(CountEvents(reader, event, [&] { ASSERT_EQ(event.data.capacity(), 0u); }), kRecords);
  EXPECT_EQ(reader.damage().places, kRecords + 1) << "the claims, and what is behind them";
  EXPECT_LE(peak_bytes - before, std::size_t{1} << 16);
}

// Headers that each claim what follows them make the reader look again and again; that may not cost more than the
// bytes.
TEST_F(HostileLog, NestedClaimsTakeNoLongerThanTheirBytes) {
  std::vector<std::uint8_t> header{0xED, 0xA1, 0xDA, 0x01};
  header.resize(28);
  header[23] = 1;  // one byte of channel
  header[25] = 1;  // 65536 of data
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 50'000; ++i) bytes.insert(bytes.end(), header.begin(), header.end());
  bytes.push_back(0);  // no claim ends at a sync word
  WriteBytes(scratch_ / "nested", bytes);
  EventLogReader reader(scratch_ / "nested");
  ForEachEvent(reader, [](const LogEvent&) {});
  EXPECT_GT(reader.damage().places, 25'000);
}

}  // namespace forereach::hostile_log_test
