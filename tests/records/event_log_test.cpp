#include "records/event_log.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>
#include <lcm/lcm-cpp.hpp>

#include "tests/file_size_limit.h"
#include "tests/records/logs.h"

namespace forereach::event_log_test {

constexpr int kHeader = 28;

struct EventLog : testing::Test {
  const ScratchDirectory scratch_;
  const std::string log_ = scratch_ / "log";
};

void WriteSample(const std::string& path, int events = 5) {
  EventLogWriter writer(path);
  for (int i = 0; i < events; ++i) {
    const std::vector<std::uint8_t> data(static_cast<std::size_t>(10 * i), static_cast<std::uint8_t>(i));
    ASSERT_EQ(writer.Append(1'000'000 + i, "CHANNEL_" + std::to_string(i), data), i);
  }
  ASSERT_TRUE(writer.Flush());
}

/** Offset of record `index` of the sample. */
std::size_t RecordOffset(int index) {
  std::size_t offset = 0;
  for (int i = 0; i < index; ++i) offset += static_cast<std::size_t>(kHeader + 9 + 10 * i);
  return offset;
}

void PutLength(std::vector<std::uint8_t>& bytes, std::size_t at, std::uint32_t value) {
  for (int i = 0; i < 4; ++i)
    bytes[at + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

TEST_F(EventLog, EventsSurviveARoundTrip) {
  WriteSample(log_);
  const LogContents contents = ReadLog(log_);
  ASSERT_EQ(contents.events.size(), 5u);
  EXPECT_FIELDS(contents, (end, LogStatus::kEnd), (damage.places, 0));
  for (int i = 0; i < 5; ++i) {
    const LogEvent& event = contents.events[static_cast<std::size_t>(i)];
    EXPECT_FIELDS(event, (number, i), (utime, 1'000'000 + i), (channel, "CHANNEL_" + std::to_string(i)),
                  (data, std::vector<std::uint8_t>(static_cast<std::size_t>(10 * i), static_cast<std::uint8_t>(i))));
  }
}

TEST_F(EventLog, OffsetIsTheFileSizeAfterFlush) {
  EventLogWriter writer(log_);
  const std::vector<std::uint8_t> data(7);
  writer.Append(1, "C", data);
  EXPECT_FIELDS(writer, (offset(), 0), (pending_bytes(), kHeader + 1 + 7));
  ASSERT_TRUE(writer.Flush());
  EXPECT_EQ(writer.offset(), kHeader + 1 + 7);
  EXPECT_EQ(std::filesystem::file_size(log_), static_cast<std::uintmax_t>(writer.offset()));
}

TEST_F(EventLog, LcmReadsOurFile) {
  WriteSample(log_);
  lcm::LogFile file(log_, "r");
  ASSERT_TRUE(file.good());
  for (int i = 0; i < 5; ++i) {
    const lcm::LogEvent* event = file.readNextEvent();
    ASSERT_NE(event, nullptr) << i;
    EXPECT_FIELDS(*event, (eventnum, i), (timestamp, 1'000'000 + i), (channel, "CHANNEL_" + std::to_string(i)));
    ASSERT_EQ(event->datalen, 10 * i);
    for (int k = 0; k < event->datalen; ++k) EXPECT_EQ(static_cast<std::uint8_t*>(event->data)[k], i);
  }
  EXPECT_EQ(file.readNextEvent(), nullptr);
}

TEST_F(EventLog, WeReadLcmsFile) {
  std::string data = "payload";
  {
    lcm::LogFile file(log_, "w");
    ASSERT_TRUE(file.good());
    lcm::LogEvent event{};
    event.timestamp = 42;
    event.channel = "FROM_LCM";
    event.datalen = static_cast<std::int32_t>(data.size());
    event.data = data.data();
    for (int i = 0; i < 3; ++i) ASSERT_EQ(file.writeEvent(&event), 0);
  }
  const LogContents contents = ReadLog(log_);
  ASSERT_EQ(contents.events.size(), 3u);
  EXPECT_FIELDS(contents, (end, LogStatus::kEnd), (events[2].number, 2), (events[2].channel, "FROM_LCM"));
  EXPECT_EQ(std::string(contents.events[2].data.begin(), contents.events[2].data.end()), data);
}

TEST_F(EventLog, AnEmptyFileHasNoEventsAndAMissingOneIsAnError) {
  WriteBytes(log_, {});
  EXPECT_EQ(ReadLog(log_).end, LogStatus::kEnd);
  EXPECT_THROW(EventLogReader(scratch_ / "missing"), LogError);
  EXPECT_THROW(EventLogReader(scratch_.path()), LogError);
}

TEST_F(EventLog, ALogCutInsideItsLastRecordKeepsTheOthers) {
  WriteSample(log_);
  const std::vector<std::uint8_t> whole = ReadBytes(log_);
  const std::size_t last = RecordOffset(4);
  for (std::size_t size = last; size < whole.size(); ++size) {
    SCOPED_TRACE(size);
    WriteBytes(scratch_ / "cut", {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    const LogContents contents = ReadLog(scratch_ / "cut");
    EXPECT_FIELDS(contents, (events.size(), 4u), (end, size == last ? LogStatus::kEnd : LogStatus::kCutTail),
                  (damage.places, 0));

    EventLogWriter writer(scratch_ / "cut");
    EXPECT_FIELDS(writer.recovery(), (events, 4), (cut_bytes, static_cast<std::int64_t>(size - last)),
                  (damage.places, 0), (last_utime, 1'000'003));
    EXPECT_EQ(writer.Append(7, "AFTER", {}), 4);
    ASSERT_TRUE(writer.Flush());
    const LogContents mended = ReadLog(scratch_ / "cut");
    ASSERT_EQ(mended.events.size(), 5u);
    EXPECT_FIELDS(mended, (end, LogStatus::kEnd), (events[4].channel, "AFTER"));
  }
}

class CorruptLength : public EventLog, public testing::WithParamInterface<std::uint32_t> {};

TEST_P(CorruptLength, ARecordWithACorruptLengthIsTheOnlyOneLost) {
  WriteSample(log_);
  for (const std::size_t field : {20u, 24u}) {
    SCOPED_TRACE(field);
    std::vector<std::uint8_t> bytes = ReadBytes(log_);
    PutLength(bytes, RecordOffset(2) + field, GetParam());
    WriteBytes(scratch_ / "bad", bytes);
    const LogContents contents = ReadLog(scratch_ / "bad");
    EXPECT_FIELDS(contents, (end, LogStatus::kEnd), (damage.places, 1), (damage.bytes, kHeader + 9 + 20));
    ASSERT_EQ(contents.events.size(), 4u);
    EXPECT_FIELDS(contents, (events[2].number, 3), (events[3].number, 4));
  }
}

// Implausible ones, plausible ones that point behind the end, and one (60) that swallows the record behind it.
INSTANTIATE_TEST_SUITE_P(HugeNegativeAndSwallowing, CorruptLength,
                         testing::Values(0x7fffffffu, 0x80000000u, 0xffffffffu, 1u << 24, (1u << 24) + 1, 1u << 20,
                                         60u));

TEST_F(EventLog, ResynchronisesBehindDamagedSyncWord) {
  WriteSample(log_);
  std::vector<std::uint8_t> bytes = ReadBytes(log_);
  bytes[RecordOffset(3)] ^= 1;
  WriteBytes(log_, bytes);
  EventLogReader reader(log_);
  LogEvent event;
  for (int i = 0; i < 3; ++i) ASSERT_EQ(reader.Next(event), LogStatus::kEvent) << i;
  EXPECT_EQ(reader.Next(event), LogStatus::kCorrupt);
  EXPECT_EQ(reader.offset(), static_cast<std::int64_t>(RecordOffset(4)));
  ASSERT_EQ(reader.Next(event), LogStatus::kEvent);
  EXPECT_EQ(event.number, 4);
  EXPECT_EQ(reader.Next(event), LogStatus::kEnd);
  EXPECT_EQ(reader.damage().bytes, static_cast<std::int64_t>(RecordOffset(4) - RecordOffset(3)));
}

TEST_F(EventLog, FindsASyncWordWhereverItLies) {
  WriteSample(log_, 1);
  const std::vector<std::uint8_t> record = ReadBytes(log_);
  for (std::size_t garbage = 1; garbage < (1 << 18); garbage += garbage < 2000 ? 1 : 997) {
    std::vector<std::uint8_t> bytes(garbage, 0x55);
    bytes.insert(bytes.end(), record.begin(), record.end());
    WriteBytes(scratch_ / "bad", bytes);
    const LogContents contents = ReadLog(scratch_ / "bad");
    ASSERT_EQ(contents.events.size(), 1u) << garbage;
    ASSERT_EQ(contents.damage.bytes, static_cast<std::int64_t>(garbage));
  }
}

// A record that lost 1, 2, 3 bytes claims as many of the next one.
TEST_F(EventLog, BytesCutOutCostThatRecordOnly) {
  for (const int cut : {1, 2, 3, 4, 5}) {
    std::filesystem::remove(log_);
    WriteSample(log_);
    std::vector<std::uint8_t> bytes = ReadBytes(log_);
    const auto at = bytes.begin() + static_cast<std::ptrdiff_t>(RecordOffset(2) + kHeader + 12);
    bytes.erase(at, at + cut);
    WriteBytes(log_, bytes);
    const LogContents contents = ReadLog(log_);
    ASSERT_EQ(contents.events.size(), 4u) << cut;
    EXPECT_FIELDS(contents, (events[2].number, 3), (damage.places, 1));
  }
}

TEST_F(EventLog, TheDigestCoversEveryByteOfTheRecord) {
  WriteSample(log_, 3);
  const std::vector<std::uint8_t> bytes = ReadBytes(log_);
  const LogEvent event = ReadLog(log_).events[2];
  const Bytes record = Bytes(bytes).subspan(RecordOffset(2));
  EXPECT_EQ(DigestOf(event), DigestOf(record));
  EXPECT_EQ(RecordBytes(event), std::ssize(record));
}

TEST_F(EventLog, RecoveryKeepsWhatFollowsDamage) {
  WriteSample(log_);
  std::vector<std::uint8_t> bytes = ReadBytes(log_);
  PutLength(bytes, RecordOffset(1) + 24, 0x7fffffff);
  bytes.erase(bytes.end() - 3, bytes.end());
  WriteBytes(log_, bytes);
  const EventLogWriter writer(log_);
  EXPECT_FIELDS(writer.recovery(), (events, 3), (damage.places, 1), (cut_bytes, kHeader + 9 + 40 - 3));
  EXPECT_EQ(std::filesystem::file_size(log_), RecordOffset(4));
  EXPECT_EQ(writer.next_number(), 4);
}

TEST_F(EventLog, RecoveryRemovesNoGarbage) {
  WriteSample(log_);
  std::vector<std::uint8_t> bytes = ReadBytes(log_);
  const std::size_t size = bytes.size();
  bytes.resize(size + 100);
  WriteBytes(log_, bytes);
  EventLogWriter writer(log_);
  EXPECT_FIELDS(writer.recovery(), (cut_bytes, 0), (damage.bytes, 100));
  writer.Append(9, "AFTER", {});
  ASSERT_TRUE(writer.Flush());
  const LogContents contents = ReadLog(log_);
  ASSERT_EQ(contents.events.size(), 6u);
  EXPECT_EQ(contents.events[5].number, 5);
  EXPECT_GT(std::filesystem::file_size(log_), size + 100);
}

TEST_F(EventLog, RefusesASecondWriter) {
  const EventLogWriter writer(log_);
  EXPECT_THROW(EventLogWriter{log_}, LogError);
}

// A flush fails half-way, and the file cannot be cut back: it is sealed against that here.
TEST_F(EventLog, KeepsConfirmedEventsWhenAFailedFlushCannotBeUndone) {
  const int file = ::memfd_create("log", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  ASSERT_GE(file, 0);
  ASSERT_EQ(::fcntl(file, F_ADD_SEALS, F_SEAL_SHRINK), 0);
  const std::string path = "/proc/self/fd/" + std::to_string(file);
  const std::vector<std::uint8_t> data(100, 7);
  EventLogWriter writer(path);
  const auto flush = [&](const std::string& channel) {
    writer.Append(1, channel, data);
    return writer.Flush();
  };
  const auto flush_with_room_for_half = [&](const std::string& channel) {
    const FileSizeLimit limit(static_cast<std::uintmax_t>(writer.offset()) + 50);
    return flush(channel);
  };
  EXPECT_TRUE(flush("KEPT_1"));
  EXPECT_FALSE(flush_with_room_for_half("LOST_2"));
  EXPECT_NE(writer.problem().find("cannot put the file back"), std::string::npos) << writer.problem();
  EXPECT_TRUE(flush("KEPT_3"));
  EXPECT_FALSE(flush_with_room_for_half("LOST_4"));
  writer.Append(1, "S", {});
  EXPECT_FALSE(writer.Flush()) << "some of what failed would stay behind it";
  EXPECT_TRUE(flush("KEPT_5"));
  const LogContents contents = ReadLog(path);
  ::close(file);
  ASSERT_EQ(contents.events.size(), 3u);
  EXPECT_FIELDS(contents, (events[0].channel, "KEPT_1"), (events[1].channel, "KEPT_3"), (events[2].channel, "KEPT_5"),
                (end, LogStatus::kEnd), (damage.places, 0));
}

TEST_F(EventLog, RefusesWhatTheFormatCannotHold) {
  EventLogWriter writer(log_);
  EXPECT_NO_THROW(writer.Append(0, std::string(63, 'c'), {}));
  EXPECT_THROW(writer.Append(0, std::string(64, 'c'), {}), std::invalid_argument);
  EXPECT_THROW(writer.Append(0, "", {}), std::invalid_argument);
  const std::vector<std::uint8_t> large(static_cast<std::size_t>(kMaxLogDataBytes) + 1);
  EXPECT_THROW(writer.Append(0, "C", large), std::invalid_argument);
}

// Whatever is changed, the reader ends, accounts for every byte, and returns only records that are in the file.
TEST_F(EventLog, ReadsAnyMutationWithoutInventingRecords) {
  WriteSample(log_, 12);
  const std::vector<std::uint8_t> whole = ReadBytes(log_);
  const unsigned seed = std::random_device{}();
  RecordProperty("seed", std::to_string(seed));
  std::mt19937 random(seed);
  const auto below = [&random](std::size_t bound) {
    return std::uniform_int_distribution<std::size_t>(0, bound - 1)(random);
  };
  for (int round = 0; round < 1000; ++round) {
    SCOPED_TRACE(testing::Message() << "seed " << seed << " round " << round);
    std::vector<std::uint8_t> bytes = whole;
    for (std::size_t changes = 1 + below(6); changes > 0 && !bytes.empty(); --changes) {
      const auto at = static_cast<std::ptrdiff_t>(below(bytes.size()));
      switch (below(4)) {
        case 0: bytes[static_cast<std::size_t>(at)] ^= static_cast<std::uint8_t>(1u << below(8)); break;
        case 1:
          bytes.erase(bytes.begin() + at, bytes.begin() + std::min<std::ptrdiff_t>(at + 9, std::ssize(bytes)));
          break;
        case 2: bytes.insert(bytes.begin() + at, {0xED, 0xA1, 0xDA, 0x01, 0, 0, 0}); break;
        default: bytes.resize(static_cast<std::size_t>(at));
      }
    }
    WriteBytes(scratch_ / "bad", bytes);
    EventLogReader reader(scratch_ / "bad");
    LogEvent event;
    LogStatus status;
    std::int64_t passed = 0, skipped = 0;
    while ((status = reader.Next(event)) == LogStatus::kEvent || status == LogStatus::kCorrupt) {
      const std::int64_t record = kHeader + std::ssize(event.channel) + std::ssize(event.data);
      const std::int64_t expected =
          status == LogStatus::kEvent ? passed + record : passed + reader.damage().bytes - skipped;
      ASSERT_EQ(reader.offset(), expected);
      ASSERT_GT(reader.offset(), passed);
      passed = reader.offset();
      skipped = reader.damage().bytes;
    }
    ASSERT_LE(passed, reader.size());
    ASSERT_EQ(status == LogStatus::kEnd, passed == reader.size());
    ASSERT_EQ(reader.Next(event), status);
  }
}

}  // namespace forereach::event_log_test
