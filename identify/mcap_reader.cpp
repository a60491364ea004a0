#include "identify/mcap_reader.h"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <concepts>
#include <memory>
#include <span>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "records/mcap_format.h"
#include "task/config_error.h"

namespace forereach {
namespace {

using mcap::Opcode;

constexpr std::int64_t kLargestMcap = std::int64_t{1} << 42;
constexpr std::uint64_t kLargestRecord = 256 * kMegabyte;  // also of a chunk's records
constexpr std::size_t kMostDescribed = 64 * kMegabyte;     // of all schemas and channels
constexpr std::size_t kBlock = kMegabyte;

class Damage : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Takes fields from the front of a record.
class Fields {
 public:
  explicit Fields(std::string_view rest) : rest_(rest) {}

  template <std::unsigned_integral Number>
  Number Take() {
    Number number = 0;
    const std::string_view bytes = Bytes(sizeof number);
    for (std::size_t i = sizeof number; i-- > 0;)
      number = static_cast<Number>(number << 7 << 1 | static_cast<unsigned char>(bytes[i]));
    return number;
  }
  std::string Text() { return std::string(Bytes(Take<std::uint32_t>())); }
  std::string_view Bytes(std::uint64_t count) {
    if (count > rest_.size()) throw Damage("a record that ends inside a field");
    const std::string_view bytes = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return bytes;
  }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

// Sets `to` to what was compressed, if it has its size.
void Unpack(const std::string& compression, std::string_view packed, std::span<char> to) {
  std::size_t size = 0;
  if (compression == "zstd") {
    size = ZSTD_decompress(to.data(), to.size(), packed.data(), packed.size());
    if (ZSTD_isError(size)) throw Damage("a chunk that zstd cannot unpack");
  } else if (compression == "lz4") {
    LZ4F_dctx* made = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION))) throw std::bad_alloc();
    const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(made,
                                                                                       &LZ4F_freeDecompressionContext);
    for (std::size_t more = 1; more > 0;) {
      std::size_t out = to.size() - size, in = packed.size();
      more = LZ4F_decompress(made, to.data() + size, &out, packed.data(), &in, nullptr);
      if (LZ4F_isError(more) || (more > 0 && out == 0 && in == 0)) throw Damage("a chunk that lz4 cannot unpack");
      size += out;
      packed.remove_prefix(in);
    }
  } else {
    throw Damage(fmt::format("a chunk compressed by {}, which is none of lz4 and zstd", compression));
  }
  if (size != to.size()) throw Damage("a chunk of another size than it says");
}

}  // namespace

McapReader::McapReader(const std::string& path) : file_(path, kLargestMcap) {
  std::string magic;
  if (ReadUpTo(mcap::kMagic.size(), magic) < mcap::kMagic.size() || magic != mcap::kMagic)
    throw ConfigError("{}: does not begin as an MCAP file does", path);
}

McapReader::Status McapReader::Next() {
  try {
    while (!has_ended_) {
      if (rest_.empty()) {
        if (ReadRecord()) return Status::kMessage;
        continue;
      }
      Fields fields(std::exchange(rest_, {}));  // nothing is left if a length in it is wrong
      const auto opcode = fields.Take<std::uint8_t>();
      const std::string_view content = fields.Bytes(fields.Take<std::uint64_t>());
      rest_ = fields.rest();
      if (Take(opcode, content)) return Status::kMessage;
    }
    return Status::kEnd;
  } catch (const Damage& damage) {
    damage_ = damage.what();
    return Status::kDamage;
  }
}

// Appends at most so many bytes, as they come: a length that lies takes no memory.
std::size_t McapReader::ReadUpTo(std::uint64_t bytes, std::string& to) {
  const std::size_t before = to.size();
  while (to.size() - before < bytes) {
    const std::size_t at = to.size();
    to.resize(at + static_cast<std::size_t>(std::min<std::uint64_t>(kBlock, bytes - (at - before))));
    const std::size_t got = file_.Read(to.data() + at, to.size() - at);
    to.resize(at + got);
    if (got == 0) break;
  }
  return to.size() - before;
}

void McapReader::Skip(std::uint64_t bytes) {
  while (bytes > 0) {
    record_.clear();
    const std::size_t got = ReadUpTo(std::min<std::uint64_t>(bytes, kBlock), record_);
    bytes -= got;
    if (got == 0) has_ended_ = true, throw Damage("the end of the file, which is cut off");
  }
}

// One record of the file itself. Whether it is a message.
bool McapReader::ReadRecord() {
  constexpr std::size_t kHead = 9;
  record_.clear();
  const std::size_t got = ReadUpTo(kHead, record_);
  if (got < kHead) has_ended_ = true, throw Damage("the end of the file, which is cut off");
  Fields head(record_);
  const auto opcode = head.Take<std::uint8_t>();
  const auto length = head.Take<std::uint64_t>();
  const auto op = static_cast<Opcode>(opcode);
  if (opcode == 0) has_ended_ = true, throw Damage("all from bytes on that are no record");
  if (op == Opcode::kDataEnd || op == Opcode::kFooter) {  // a summary repeats what was read
    has_ended_ = true;
    return false;
  }
  const bool is_used =
      op == Opcode::kSchema || op == Opcode::kChannel || op == Opcode::kMessage || op == Opcode::kChunk;
  if (!is_used || length > kLargestRecord) {
    Skip(length);
    if (is_used) throw Damage(fmt::format("a record of {} bytes, at most {} are read", length, kLargestRecord));
    return false;
  }
  record_.clear();
  if (ReadUpTo(length, record_) < length) has_ended_ = true, throw Damage("the end of the file, which is cut off");
  if (op != Opcode::kChunk) return Take(opcode, record_);
  OpenChunk(record_);
  return false;
}

void McapReader::OpenChunk(std::string_view content) {
  Fields fields(content);
  fields.Bytes(16);  // its first and last time
  const auto size = fields.Take<std::uint64_t>();
  const auto crc = fields.Take<std::uint32_t>();
  const std::string compression = fields.Text();
  const std::string_view packed = fields.Bytes(fields.Take<std::uint64_t>());
  if (size > kLargestRecord)
    throw Damage(fmt::format("a chunk of {} bytes, at most {} are read", size, kLargestRecord));
  std::string_view records = packed;
  if (!compression.empty()) {
    if (chunk_.size() < size) chunk_.resize(static_cast<std::size_t>(size));
    const std::span<char> to(chunk_.data(), static_cast<std::size_t>(size));
    Unpack(compression, packed, to);
    records = {to.data(), to.size()};
  }
  if (crc != 0 && mcap::Crc(0, records) != crc) throw Damage("a chunk with another checksum");
  rest_ = records;
}

void McapReader::Describe(std::size_t bytes) {
  described_ += bytes;
  if (described_ > kMostDescribed) throw Damage("schemas and channels beyond 64 MiB");
}

// Whether a record is a message.
bool McapReader::Take(std::uint8_t opcode, std::string_view content) {
  Fields fields(content);
  switch (static_cast<Opcode>(opcode)) {
    case Opcode::kSchema: {
      const auto id = fields.Take<std::uint16_t>();
      if (schemas_.contains(id)) return false;
      Describe(content.size());
      std::string name = fields.Text(), encoding = fields.Text(), text = fields.Text();
      schemas_[id] = {std::move(name), std::move(encoding), std::move(text)};
      return false;
    }
    case Opcode::kChannel: {
      const auto id = fields.Take<std::uint16_t>(), schema = fields.Take<std::uint16_t>();
      if (channels_.contains(id)) return false;
      Describe(content.size());
      std::string topic = fields.Text(), encoding = fields.Text();
      const auto found = schemas_.find(schema);
      channels_[id] = {std::move(topic), std::move(encoding), found == schemas_.end() ? nullptr : &found->second};
      return false;
    }
    case Opcode::kMessage: {
      const auto channel = channels_.find(fields.Take<std::uint16_t>());
      fields.Take<std::uint32_t>();  // its sequence number
      log_ns_ = fields.Take<std::uint64_t>();
      fields.Take<std::uint64_t>();  // when it was sent
      if (channel == channels_.end()) throw Damage("a message of a channel that the file does not describe");
      channel_ = &channel->second;
      bytes_ = fields.rest();
      return true;
    }
    default: return false;
  }
}

}  // namespace forereach
