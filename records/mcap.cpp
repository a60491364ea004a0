#include "records/mcap.h"

#include <algorithm>
#include <concepts>
#include <limits>
#include <utility>

#include "records/mcap_format.h"

namespace forereach {
namespace {

using mcap::Crc, mcap::kMagic, mcap::Opcode;

constexpr std::size_t kChunkBytes = 1 << 20;

void Put(std::string& out, std::unsigned_integral auto value) {
  for (std::size_t i = 0; i < sizeof value; ++i) out.push_back(static_cast<char>(value >> (8 * i) & 0xff));
}
void Put(std::string& out, std::string_view text) {
  Put(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}
// A map or an array: the bytes of its entries, and the entries.
template <class Entries>
requires requires(const Entries& entries) { entries.begin()->first; }
void Put(std::string& out, const Entries& entries) {
  std::string bytes;
  for (const auto& [key, value] : entries) Put(bytes, key), Put(bytes, value);
  Put(out, std::string_view(bytes));
}

template <class... Field>
std::string BytesOf(const Field&... fields) {
  std::string bytes;
  (Put(bytes, fields), ...);
  return bytes;
}

std::string Record(Opcode op, std::string_view content) {
  return static_cast<char>(op) + BytesOf(std::uint64_t{content.size()}).append(content);
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
  Append(kMagic);
  const std::string_view no_profile;
  Append(Record(Opcode::kHeader, BytesOf(no_profile, std::string_view("forereach"))));
}

// To the data section, which has a checksum of its own.
void McapWriter::Append(std::string_view record) {
  data_crc_ = Crc(data_crc_, record);
  file_.Write(record);
}

std::uint16_t McapWriter::AddSchema(const std::string& name, const std::string& schema) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  records_ += schemas_.emplace_back(Record(Opcode::kSchema, BytesOf(id, name, std::string_view("jsonschema"), schema)));
  return id;
}

std::uint16_t McapWriter::AddChannel(std::uint16_t schema, const std::string& topic,
                                     const std::map<std::string, std::string>& metadata) {
  const auto id = static_cast<std::uint16_t>(channels_.size());
  records_ +=
      channels_.emplace_back(Record(Opcode::kChannel, BytesOf(id, schema, topic, std::string_view("json"), metadata)));
  return id;
}

void McapWriter::Write(std::uint16_t channel, std::uint32_t sequence, std::int64_t log_us, std::int64_t publish_us,
                       std::string_view json) {
  const std::uint64_t time = Nanoseconds(log_us);
  index_[channel].emplace_back(time, records_.size());
  records_ += Record(Opcode::kMessage, BytesOf(channel, sequence, time, Nanoseconds(publish_us)).append(json));
  ++counts_[channel];
  chunk_times_.Take(time);
  times_.Take(time);
  if (records_.size() >= kChunkBytes) EndChunk();
}

void McapWriter::EndChunk() {
  if (records_.empty()) return;
  const std::string_view no_compression;
  const std::uint64_t size = records_.size();
  Chunk chunk{chunk_times_, static_cast<std::uint64_t>(file_.size()), 0, {}, 0, size};
  Append(Record(
      Opcode::kChunk,
      BytesOf(chunk_times_.first, chunk_times_.last, size, Crc(0, records_), no_compression, size).append(records_)));
  const auto begin = static_cast<std::uint64_t>(file_.size());
  chunk.length = begin - chunk.at;
  for (const auto& [channel, entries] : index_) {
    chunk.indexes[channel] = static_cast<std::uint64_t>(file_.size());
    Append(Record(Opcode::kMessageIndex, BytesOf(channel, entries)));
  }
  chunk.indexes_length = static_cast<std::uint64_t>(file_.size()) - begin;
  chunks_.push_back(std::move(chunk));
  records_.clear();
  index_.clear();
  chunk_times_ = {};
}

void McapWriter::Finish() {
  EndChunk();
  file_.Write(Record(Opcode::kDataEnd, BytesOf(data_crc_)));

  const auto begin = static_cast<std::uint64_t>(file_.size());
  std::string summary, offsets;
  std::uint64_t group = begin;
  const auto end_group = [&](Opcode op) {
    const std::uint64_t end = begin + summary.size();
    if (end == group) return;
    offsets += Record(Opcode::kSummaryOffset, static_cast<char>(op) + BytesOf(group, end - group));
    group = end;
  };
  for (const std::string& schema : schemas_) summary += schema;
  end_group(Opcode::kSchema);
  for (const std::string& channel : channels_) summary += channel;
  end_group(Opcode::kChannel);
  const std::string_view no_compression;
  for (const Chunk& chunk : chunks_)
    summary +=
        Record(Opcode::kChunkIndex, BytesOf(chunk.times.first, chunk.times.last, chunk.at, chunk.length, chunk.indexes,
                                            chunk.indexes_length, no_compression, chunk.size, chunk.size));
  end_group(Opcode::kChunkIndex);
  const std::uint32_t no_attachments = 0, no_metadata = 0;
  summary += Record(Opcode::kStatistics,
                    BytesOf(times_.messages, static_cast<std::uint16_t>(schemas_.size()),
                            static_cast<std::uint32_t>(channels_.size()), no_attachments, no_metadata,
                            static_cast<std::uint32_t>(chunks_.size()), times_.first, times_.last, counts_));
  end_group(Opcode::kStatistics);

  const std::string footer = BytesOf(begin, begin + summary.size());
  // The checksum includes the beginning of the footer's record: its length is that of two places and the checksum.
  summary += offsets + static_cast<char>(Opcode::kFooter) + BytesOf(std::uint64_t{20}) + footer;
  summary += BytesOf(Crc(0, summary));
  file_.Write(summary);
  file_.Write(kMagic);
  file_.Close();
}

}  // namespace forereach
