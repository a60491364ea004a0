#include "identify/lcm_table.h"

#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "forereach/numerics/text.h"
#include "identify/log_table.h"
#include "records/event_log.h"
#include "task/config_error.h"

namespace forereach {
namespace {

constexpr const char* kRecorded = "recorded";

// Which of the numbers read from a message each wanted column is made of.
struct Source {
  WantedColumn column;
  std::vector<int> at;  // -1: when it was recorded
};

class LcmReader {
 public:
  LcmReader(const std::string& path, const std::vector<std::string>& wanted, const LcmTypes& types)
      : path_(path), channel_(ChannelOf(wanted)), types_(types) {
    if (channel_.empty()) throw ConfigError(path + ": no column names a channel, as CHANNEL.field does");
    for (const std::string& text : wanted) {
      Source source{WantedColumn(text), {}};
      for (const std::string& name : source.column.names()) {
        if (name == kRecorded) {
          source.at.push_back(-1);
          continue;
        }
        source.at.push_back(static_cast<int>(places_.size()));
        places_.push_back(name.substr(channel_.size() + 1));
      }
      sources_.push_back(std::move(source));
    }
    table_.path = path;
    table_.not_a_number.resize(wanted.size());
  }

  LogTable Read() {
    EventLogReader log(path_);
    LogEvent event;
    for (;;) {
      const LogStatus status = log.Next(event);
      if (status == LogStatus::kEnd || status == LogStatus::kCutTail) break;
      if (status == LogStatus::kCorrupt) {
        Lose("damage of the log");
        continue;
      }
      ++counts_[event.channel];
      if (event.channel == channel_) Take(event);
    }
    if (messages_ == 0) FailWithoutMessages();
    using RowMajor = decltype(table_.values);
    table_.values = Eigen::Map<const RowMajor>(numbers_.data(), std::ssize(table_.lines), std::ssize(sources_));
    return std::move(table_);
  }

 private:
  [[noreturn]] void FailWithoutMessages() const {
    std::string channels;
    for (const auto& [name, count] : counts_) channels += (channels.empty() ? "" : ", ") + name;
    throw ConfigError(fmt::format("{}: has no message on {}; its channels are {}", path_, channel_,
                                  channels.empty() ? "none" : channels));
  }

  void Lose(const std::string& why) {
    table_.lost.Add(messages_, why);
    lost_ = true;
  }

  void Take(const LogEvent& event) {
    ++messages_;
    const std::optional<std::string> type = types_.TypeOf(event.data);
    if (!type && !type_)
      throw ConfigError(fmt::format("{}: no type of the given .lcm files has the fingerprint of the messages on {}: {}",
                                    path_, channel_,
                                    types_.size() == 0 ? "give --lcm-types" : "theirs are others or older"));
    if (!type_) type_ = type;
    const auto values = type == type_ ? types_.Read(*type_, places_, event.data) : std::nullopt;
    if (!values) return Lose("a message of another type or length");
    for (std::size_t j = 0; j < sources_.size(); ++j) {
      std::vector<double> parts;
      for (const int at : sources_[j].at)
        parts.push_back(at < 0 ? static_cast<double>(event.utime) / 1e6 : (*values)[static_cast<std::size_t>(at)]);
      const double value = sources_[j].column.Of(parts);
      numbers_.push_back(std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN());
      if (!std::isfinite(value)) table_.not_a_number[j].Add(messages_, ToText(parts.front()));
    }
    table_.lines.push_back(messages_);
    table_.after_loss.push_back(std::exchange(lost_, false));
  }

  const std::string& path_;
  const std::string channel_;
  const LcmTypes& types_;
  std::vector<Source> sources_;
  std::vector<std::string> places_;
  std::map<std::string, std::int64_t> counts_;  // of each channel's messages
  std::optional<std::string> type_;
  LogTable table_;
  std::vector<double> numbers_;
  int messages_ = 0;  // of the channel
  bool lost_ = false;
};

}  // namespace

std::string ChannelOf(const std::vector<std::string>& wanted) {
  std::string channel;
  for (const std::string& text : wanted) {
    const WantedColumn column(text);
    for (const std::string& name : column.names()) {
      if (name == kRecorded) continue;
      const std::string own = name.substr(0, name.find('.'));
      if (own == name || own.empty())
        throw ConfigError("'" + name + "' has to be CHANNEL.field, of a message in the log");
      if (!channel.empty() && own != channel)
        throw ConfigError("columns of two channels, " + channel + " and " + own +
                          ": one has the states, and one may have the inputs");
      channel = own;
    }
  }
  return channel;
}

LogTable ReadLcmLog(const std::string& path, const std::vector<std::string>& wanted, const LcmTypes& types) {
  return LcmReader(path, wanted, types).Read();
}

}  // namespace forereach
