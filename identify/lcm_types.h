/** LCM's message types of others, as their .lcm files define them: fingerprints, and numbers read out of messages. */
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/codec.h"

namespace forereach {

class LcmTypes final {
 public:
  /** Adds the types of a file. @throws ConfigError with file and line if it cannot be read as LCM's language. */
  void Add(const std::string& path);
  /** The same of a text. */
  void AddText(const std::string& path, const std::string& text);

  /** The name of the type with the fingerprint that a message begins with; none if no type has it.
  @throws ConfigError if a type is incomplete, or nests more types than a fingerprint is computed of. */
  [[nodiscard]] std::optional<std::string> TypeOf(Bytes message) const;

  /** The numbers at these places of a message, such as "pose.position[0]"; NaN where an array is shorter. A boolean is
  0 or
  1. None if the message is shorter or longer than its type says, or a length in it is negative.
  @throws ConfigError if the type has no number at a place, or the type is incomplete: a type that it uses is not
  defined. */
  [[nodiscard]] std::optional<std::vector<double>> Read(const std::string& type, const std::vector<std::string>& places,
                                                        Bytes message) const;

  [[nodiscard]] std::size_t size() const { return structs_.size(); }

 private:
  struct Dimension {
    bool is_constant;
    std::string size;  // a number, a constant or the name of a member before it
    std::int64_t value;
  };
  struct Member {
    std::string type, name;
    std::vector<Dimension> dimensions;
  };
  struct Struct {
    std::vector<Member> members;
  };
  class Parser;
  class Walker;

  [[nodiscard]] std::uint64_t HashOf(const std::string& type, std::vector<std::string>& outer, int& hashed) const;
  [[nodiscard]] std::string Resolved(const std::string& type, const std::string& user) const;

  std::map<std::string, Struct> structs_;  // by package.name
  mutable std::map<std::uint64_t, std::string> by_fingerprint_;
};

}  // namespace forereach
