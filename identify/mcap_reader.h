/** Reads MCAP files of others (https://mcap.dev/spec): messages, with what their channel says of them, in the order of
the file. Chunks are plain, or compressed with lz4 or zstd. Lengths are held against what is there before memory is
taken for them, checksums of chunks are compared, and indexes are not read. */
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "task/files.h"

namespace forereach {

struct McapChannel {
  std::string topic, encoding;  ///< Of its messages: "json", "cdr".
  struct Schema {
    std::string name, encoding, text;  ///< "nav_msgs/msg/Odometry", "ros2msg", its text.
  };
  const Schema* schema = nullptr;  ///< Null: it has none, or names one that is not in the file.
};

class McapReader final {
 public:
  /** @throws ConfigError if it cannot be read or does not begin as an MCAP file. */
  explicit McapReader(const std::string& path);

  enum class Status {
    kMessage,
    kDamage,  ///< damage() says what is lost; Next goes on behind it.
    kEnd,
  };
  /** @throws ConfigError if reading fails. */
  [[nodiscard]] Status Next();

  /** @name Of the message. The channel is there as long as the reader; the bytes are until Next. */
  ///@{
  [[nodiscard]] const McapChannel& channel() const { return *channel_; }
  [[nodiscard]] std::uint64_t log_ns() const { return log_ns_; }  ///< When it was recorded.
  [[nodiscard]] std::string_view bytes() const { return bytes_; }
  ///@}
  [[nodiscard]] const std::string& damage() const { return damage_; }

 private:
  [[nodiscard]] bool ReadRecord();
  [[nodiscard]] std::size_t ReadUpTo(std::uint64_t bytes, std::string& to);
  void Skip(std::uint64_t bytes);
  void OpenChunk(std::string_view content);
  void Describe(std::size_t bytes);
  [[nodiscard]] bool Take(std::uint8_t opcode, std::string_view content);

  InputFile file_;
  std::string record_, chunk_;
  std::string_view rest_;  // of the chunk's records
  bool has_ended_ = false;
  std::map<std::uint16_t, McapChannel::Schema> schemas_;
  std::size_t described_ = 0;  // bytes of schemas and channels
  std::map<std::uint16_t, McapChannel> channels_;
  const McapChannel* channel_ = nullptr;
  std::uint64_t log_ns_ = 0;
  std::string_view bytes_;
  std::string damage_;
};

}  // namespace forereach
