/** Message types of ROS 2, as a recording describes them, and numbers read out of messages in CDR. */
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "identify/message_place.h"

namespace forereach {

class RosType final {
 public:
  /** @param name such as "nav_msgs/msg/Odometry". @param text a schema in the encoding ros2msg: the type's .msg file,
  and behind lines of "=" and "MSG: package/Type" those of the types in it. @throws ConfigError with the line for what
  is no .msg text, or a type that is missing. */
  RosType(std::string name, std::string_view text);

  /** @throws ConfigError with the type's members if there is no number, and no boolean, at a place. */
  void RequireNumber(const std::vector<PlaceStep>& place) const;

  /** The numbers at these places; NaN where an array is shorter. A boolean is 0 or 1. None if the message is shorter
  or longer than its type says, but for padding, or nests more than 32 types. @param message in CDR, as RTPS has it: 4
  bytes say the order of bytes (PLAIN_CDR).
  @pre RequireNumber accepts the places. Cost: linear in the bytes. */
  [[nodiscard]] std::optional<std::vector<double>> Read(const std::vector<std::vector<PlaceStep>>& places,
                                                        std::string_view message) const;

 private:
  struct Member {
    std::string type, name;
    enum class Count { kOne, kFixed, kCounted } count = Count::kOne;
    std::size_t size = 0;  // of kFixed
  };
  using Members = std::vector<Member>;
  class Walker;

  void AddText(const std::string& type, std::string_view text, int first_line);
  [[nodiscard]] const Members& MembersOf(const std::string& type) const { return types_.at(type); }

  std::string name_;
  std::map<std::string, Members> types_;  // by package/Type
};

}  // namespace forereach
