/** Writes MCAP files (https://mcap.dev/spec), which PlotJuggler and Foxglove open: messages in JSON with a schema for
each type, in chunks with indexes, and a summary with statistics. Nothing is compressed. */
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "records/output_file.h"

namespace forereach {

class McapWriter final {
 public:
  /** All throw OutputError if the file cannot be written. */
  explicit McapWriter(OutputFile file);

  /** @param name of a type. @param schema a JSON Schema of an object. @return the number for AddChannel. */
  [[nodiscard]] std::uint16_t AddSchema(const std::string& name, const std::string& schema);
  /** @param metadata names and texts. @return the number for Write. */
  [[nodiscard]] std::uint16_t AddChannel(std::uint16_t schema, const std::string& topic,
                                         const std::map<std::string, std::string>& metadata = {});
  /** @param log_us, publish_us microseconds since the Unix epoch; times after the year 2554 become that year's.
  @param json one object. */
  void Write(std::uint16_t channel, std::uint32_t sequence, std::int64_t log_us, std::int64_t publish_us,
             std::string_view json);

  /** Writes the summary and closes the file. Without it nothing is left of the file. */
  void Finish();

 private:
  struct Range {
    std::uint64_t first = 0, last = 0, messages = 0;
    void Take(std::uint64_t time);
  };
  struct Chunk {
    Range times;
    std::uint64_t at, length;                        // of the record in the file
    std::map<std::uint16_t, std::uint64_t> indexes;  // places of the index of each channel
    std::uint64_t indexes_length, size;
  };
  using Index = std::vector<std::pair<std::uint64_t, std::uint64_t>>;  // time, place in the chunk

  void EndChunk();
  void Append(std::string_view record);

  OutputFile file_;
  std::uint32_t data_crc_ = 0;
  std::vector<std::string> schemas_, channels_;  // their records
  std::string records_;                          // of the chunk that has begun
  Range chunk_times_, times_;
  std::map<std::uint16_t, Index> index_;
  std::vector<Chunk> chunks_;
  std::map<std::uint16_t, std::uint64_t> counts_;
};

}  // namespace forereach
