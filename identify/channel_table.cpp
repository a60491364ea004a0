#include "identify/channel_table.h"

#include <cmath>
#include <limits>
#include <utility>

#include "command_line/nearest.h"
#include "forereach/numerics/text.h"
#include "task/config_error.h"

namespace forereach {
namespace {

constexpr const char* kRecorded = "recorded";

}  // namespace

std::string ChannelOf(const std::vector<std::string>& wanted) {
  std::string channel;
  for (const std::string& text : wanted) {
    const WantedColumn column(text);
    for (const std::string& name : column.names()) {
      if (name == kRecorded) continue;
      const std::string own = name.substr(0, name.find('.'));
      if (own == name || own.empty())
        throw ConfigError(
            "'{}' has to be CHANNEL.field, of a message in the log, as in --state x=ODOMETRY.x; if the log "
            "has no such channel, its channels are named",
            name);
      if (!channel.empty() && own != channel)
        throw ConfigError("columns of two channels, {} and {}: one has the states, and one may have the inputs",
                          channel, own);
      channel = own;
    }
  }
  return channel;
}

ChannelTable::ChannelTable(const std::string& path, const std::vector<std::string>& wanted)
    : path_(path), channel_(ChannelOf(wanted)) {
  if (channel_.empty()) throw ConfigError("{}: no column names a channel, as CHANNEL.field does", path);
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

bool ChannelTable::Takes(const std::string& channel) {
  ++counts_[channel];
  messages_ += channel == channel_ ? 1 : 0;
  return channel == channel_;
}

void ChannelTable::Add(const std::vector<double>& values, double recorded_s) {
  for (std::size_t j = 0; j < sources_.size(); ++j) {
    std::vector<double> parts;
    for (const int at : sources_[j].at) parts.push_back(at < 0 ? recorded_s : values[static_cast<std::size_t>(at)]);
    const double value = sources_[j].column.Of(parts);
    numbers_.push_back(std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN());
    if (!std::isfinite(value)) table_.not_a_number[j].Add(messages_, ToText(parts.front()));
  }
  table_.lines.push_back(messages_);
  table_.after_loss.push_back(std::exchange(lost_, false));
}

void ChannelTable::Lose(const std::string& why) {
  table_.lost.Add(messages_, why);
  lost_ = true;
}

LogTable ChannelTable::Finish() {
  if (messages_ == 0) {
    const std::string channels = Joined(counts_, [](const auto& channel) { return channel.first; });
    throw ConfigError("{}: has no message on {}; its channels are {}", path_, channel_,
                      channels.empty() ? "none" : channels);
  }
  using RowMajor = decltype(table_.values);
  table_.values = Eigen::Map<const RowMajor>(numbers_.data(), std::ssize(table_.lines), std::ssize(sources_));
  return std::move(table_);
}

}  // namespace forereach
