#include "records/mcap.h"

#include <algorithm>
#include <concepts>
#include <limits>
#include <utility>

#include <zlib.h>

namespace forereach {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kChunkBytes = 1 << 20;

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

// All numbers are little-endian, and texts have their length before them.
template <std::unsigned_integral Integer>
void PutInteger(std::string& out, Integer value) {
  for (std::size_t i = 0; i < sizeof value; ++i) out.push_back(static_cast<char>(value >> (8 * i) & 0xff));
}

void PutText(std::string& out, std::string_view text) {
  PutInteger(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

// A map or an array: the bytes of its entries, and the entries.
template <class Entries, class PutEntry>
void PutEntries(std::string& out, const Entries& entries, PutEntry put) {
  std::string bytes;
  for (const auto& [key, value] : entries) put(bytes, key, value);
  PutText(out, bytes);
}

void PutCounts(std::string& out, const std::map<std::uint16_t, std::uint64_t>& counts) {
  PutEntries(out, counts, [](std::string& bytes, std::uint16_t key, std::uint64_t value) {
    PutInteger(bytes, key);
    PutInteger(bytes, value);
  });
}

std::string Record(Opcode op, std::string_view content) {
  std::string record(1, static_cast<char>(op));
  PutInteger(record, static_cast<std::uint64_t>(content.size()));
  record += content;
  return record;
}

std::uint32_t Crc(std::uint32_t before, std::string_view bytes) {
  return static_cast<std::uint32_t>(crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::uint64_t Nanoseconds(std::int64_t us) {
  constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max() / 1000;
  return std::min(static_cast<std::uint64_t>(std::max<std::int64_t>(us, 0)), most) * 1000;
}

}  // namespace

void McapWriter::Range::Take(std::uint64_t time) {
  first = messages == 0 ? time : std::min(first, time);
  last = std::max(last, time);
  ++messages;
}

McapWriter::McapWriter(OutputFile file) : file_(std::move(file)) {
  Put(kMagic);
  std::string header;
  PutText(header, "");  // no profile
  PutText(header, "forereach");
  Put(Record(Opcode::kHeader, header));
}

// Of the data section, which has a checksum of its own.
void McapWriter::Put(std::string_view record) {
  data_crc_ = Crc(data_crc_, record);
  file_.Write(record);
}

std::uint16_t McapWriter::AddSchema(const std::string& name, const std::string& schema) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  std::string content;
  PutInteger(content, id);
  PutText(content, name);
  PutText(content, "jsonschema");
  PutText(content, schema);
  records_ += schemas_.emplace_back(Record(Opcode::kSchema, content));
  return id;
}

std::uint16_t McapWriter::AddChannel(std::uint16_t schema, const std::string& topic,
                                     const std::map<std::string, std::string>& metadata) {
  const auto id = static_cast<std::uint16_t>(channels_.size());
  std::string content;
  PutInteger(content, id);
  PutInteger(content, schema);
  PutText(content, topic);
  PutText(content, "json");
  PutEntries(content, metadata, [](std::string& bytes, const std::string& key, const std::string& value) {
    PutText(bytes, key);
    PutText(bytes, value);
  });
  records_ += channels_.emplace_back(Record(Opcode::kChannel, content));
  return id;
}

void McapWriter::Write(std::uint16_t channel, std::uint32_t sequence, std::int64_t log_us, std::int64_t publish_us,
                       std::string_view json) {
  const std::uint64_t time = Nanoseconds(log_us);
  std::string content;
  PutInteger(content, channel);
  PutInteger(content, sequence);
  PutInteger(content, time);
  PutInteger(content, Nanoseconds(publish_us));
  content += json;
  index_[channel].emplace_back(time, records_.size());
  records_ += Record(Opcode::kMessage, content);
  ++counts_[channel];
  chunk_times_.Take(time);
  times_.Take(time);
  if (records_.size() >= kChunkBytes) EndChunk();
}

void McapWriter::EndChunk() {
  if (records_.empty()) return;
  std::string content;
  PutInteger(content, chunk_times_.first);
  PutInteger(content, chunk_times_.last);
  PutInteger(content, static_cast<std::uint64_t>(records_.size()));
  PutInteger(content, Crc(0, records_));
  PutText(content, "");  // no compression
  PutInteger(content, static_cast<std::uint64_t>(records_.size()));
  content += records_;
  Chunk chunk{chunk_times_, static_cast<std::uint64_t>(file_.size()), 0, {}, 0, records_.size()};
  Put(Record(Opcode::kChunk, content));
  const auto begin = static_cast<std::uint64_t>(file_.size());
  chunk.length = begin - chunk.at;
  for (const auto& [channel, entries] : index_) {
    std::string index;
    PutInteger(index, channel);
    PutEntries(index, entries, [](std::string& bytes, std::uint64_t time, std::uint64_t place) {
      PutInteger(bytes, time);
      PutInteger(bytes, place);
    });
    chunk.indexes[channel] = static_cast<std::uint64_t>(file_.size());
    Put(Record(Opcode::kMessageIndex, index));
  }
  chunk.indexes_length = static_cast<std::uint64_t>(file_.size()) - begin;
  chunks_.push_back(std::move(chunk));
  records_.clear();
  index_.clear();
  chunk_times_ = {};
}

void McapWriter::Finish() {
  EndChunk();
  std::string content;
  PutInteger(content, data_crc_);
  file_.Write(Record(Opcode::kDataEnd, content));

  const auto begin = static_cast<std::uint64_t>(file_.size());
  std::string summary, offsets;
  std::uint64_t group = begin;
  const auto end_group = [&](Opcode op) {
    const std::uint64_t end = begin + summary.size();
    if (end == group) return;
    std::string offset(1, static_cast<char>(op));
    PutInteger(offset, group);
    PutInteger(offset, end - group);
    offsets += Record(Opcode::kSummaryOffset, offset);
    group = end;
  };
  for (const std::string& schema : schemas_) summary += schema;
  end_group(Opcode::kSchema);
  for (const std::string& channel : channels_) summary += channel;
  end_group(Opcode::kChannel);
  for (const Chunk& chunk : chunks_) {
    std::string index;
    PutInteger(index, chunk.times.first);
    PutInteger(index, chunk.times.last);
    PutInteger(index, chunk.at);
    PutInteger(index, chunk.length);
    PutCounts(index, chunk.indexes);
    PutInteger(index, chunk.indexes_length);
    PutText(index, "");
    PutInteger(index, chunk.size);
    PutInteger(index, chunk.size);
    summary += Record(Opcode::kChunkIndex, index);
  }
  end_group(Opcode::kChunkIndex);
  std::string statistics;
  PutInteger(statistics, times_.messages);
  PutInteger(statistics, static_cast<std::uint16_t>(schemas_.size()));
  PutInteger(statistics, static_cast<std::uint32_t>(channels_.size()));
  PutInteger(statistics, std::uint32_t{0});  // attachments
  PutInteger(statistics, std::uint32_t{0});  // metadata
  PutInteger(statistics, static_cast<std::uint32_t>(chunks_.size()));
  PutInteger(statistics, times_.first);
  PutInteger(statistics, times_.last);
  PutCounts(statistics, counts_);
  summary += Record(Opcode::kStatistics, statistics);
  end_group(Opcode::kStatistics);

  std::string footer;
  PutInteger(footer, begin);
  PutInteger(footer, begin + summary.size());
  summary += offsets;
  // The checksum includes the beginning of the footer's record: its length is that of two places and the checksum.
  std::string head(1, static_cast<char>(Opcode::kFooter));
  PutInteger(head, std::uint64_t{20});
  summary += head + footer;
  const std::uint32_t crc = Crc(0, summary);
  PutInteger(summary, crc);
  file_.Write(summary);
  file_.Write(kMagic);
  file_.Close();
}

}  // namespace forereach
