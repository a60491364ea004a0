#include "identify/mcap_table.h"

#include <limits>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "identify/channel_table.h"
#include "identify/mcap_reader.h"
#include "identify/message_place.h"
#include "identify/ros_type.h"
#include "task/config_error.h"
#include "task/files.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kLargestJson = 16 * kMegabyte;  // of a message: in memory it is many times larger

const Json* Find(const Json& object, const std::vector<PlaceStep>& place) {
  const Json* at = &object;
  for (const PlaceStep& step : place) {
    if (step.name.empty() ? !at->is_array() || step.entry >= at->size() : !at->is_object() || !at->contains(step.name))
      return nullptr;
    at = step.name.empty() ? &(*at)[step.entry] : &(*at)[step.name];
  }
  return at;
}

class McapTableReader {
 public:
  McapTableReader(const std::string& path, const std::vector<std::string>& wanted) : table_(path, wanted), log_(path) {
    for (const std::string& place : table_.places()) places_.push_back(StepsOf(place));
    is_found_.resize(places_.size());
  }

  LogTable Read() {
    for (;;) {
      const McapReader::Status status = log_.Next();
      if (status == McapReader::Status::kEnd) break;
      if (status == McapReader::Status::kDamage) {
        table_.Lose(log_.damage());
        continue;
      }
      if (!table_.Takes(log_.channel().topic)) continue;
      if (const auto values = Values())
        table_.Add(*values, static_cast<double>(log_.log_ns()) / 1e9);
      else
        table_.Lose("a message of another type or length");
    }
    LogTable table = table_.Finish();
    for (std::size_t j = 0; j < places_.size(); ++j)
      if (!is_found_[j] && !table.lines.empty()) Fail(fmt::format("no message has a number {}", table_.places()[j]));
    return table;
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    throw ConfigError("{}: {}: {}", table_.path(), table_.channel(), what);
  }

  std::optional<std::vector<double>> Values() {
    const McapChannel& channel = log_.channel();
    if (!first_) {
      first_ = &channel;
      if (channel.encoding == "cdr") ReadSchema(channel);
      if (channel.encoding != "cdr" && channel.encoding != "json")
        Fail(fmt::format("its messages are encoded as '{}', json and cdr are read", channel.encoding));
    }
    const bool is_alike = channel.encoding == first_->encoding &&
                          (type_ ? channel.schema && channel.schema->text == first_->schema->text : true);
    if (!is_alike) return std::nullopt;
    return type_ ? type_->Read(places_, log_.bytes()) : JsonValues();
  }

  void ReadSchema(const McapChannel& channel) {
    const McapChannel::Schema* const schema = channel.schema;
    if (!schema || schema->encoding != "ros2msg")
      Fail(fmt::format("its messages have {}, ros2msg is read",
                       schema ? fmt::format("a schema in '{}'", schema->encoding) : std::string("no schema")));
    try {
      type_.emplace(schema->name, schema->text);
      for (const auto& place : places_) type_->RequireNumber(place);
    } catch (const ConfigError& error) {
      Fail(error.what());
    }
    is_found_.assign(places_.size(), true);
  }

  std::optional<std::vector<double>> JsonValues() {
    if (std::ssize(log_.bytes()) > kLargestJson) return std::nullopt;
    Json object;
    try {
      object = ParseJson(log_.bytes());
    } catch (const Json::exception&) {
      return std::nullopt;
    }
    std::vector<double> values;
    for (std::size_t j = 0; j < places_.size(); ++j) {
      const Json* const at = Find(object, places_[j]);
      const bool is_number = at && (at->is_number() || at->is_boolean());
      is_found_[j] = is_found_[j] || is_number;
      values.push_back(!is_number         ? std::numeric_limits<double>::quiet_NaN()
                       : at->is_boolean() ? (at->get<bool>() ? 1 : 0)
                                          : at->get<double>());
    }
    return values;
  }

  ChannelTable table_;
  McapReader log_;
  std::vector<std::vector<PlaceStep>> places_;
  std::vector<bool> is_found_;  // in some message
  const McapChannel* first_ = nullptr;
  std::optional<RosType> type_;
};

}  // namespace

LogTable ReadMcapLog(const std::string& path, const std::vector<std::string>& wanted) {
  return McapTableReader(path, wanted).Read();
}

}  // namespace forereach
