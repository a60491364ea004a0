/** Tables of the messages of one channel of a recording. */
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "identify/log_table.h"

namespace forereach {

/** The channel of columns `CHANNEL.place`; empty if none names one. @throws ConfigError if they name two. */
[[nodiscard]] std::string ChannelOf(const std::vector<std::string>& wanted);

class ChannelTable final {
 public:
  /** @param wanted `CHANNEL.place`, all of one channel, with what log_table.h makes of several; `recorded` is when the
  message was recorded, in seconds since 1970. @throws ConfigError if they name no channel or two. */
  ChannelTable(const std::string& path, const std::vector<std::string>& wanted);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& channel() const { return channel_; }
  /** The places of messages that are wanted. */
  [[nodiscard]] const std::vector<std::string>& places() const { return places_; }

  /** Whether a message of a channel belongs into the table. If so, Add or Lose follows. */
  [[nodiscard]] bool Takes(const std::string& channel);
  /** @param values one for each place, NaN for what is no number. */
  void Add(const std::vector<double>& values, double recorded_s);
  /** The message, or something of the log behind the last one. */
  void Lose(const std::string& why);

  /** Rows are counted as lines are: row i is the channel's message i, from 1. @throws ConfigError if there is none. */
  [[nodiscard]] LogTable Finish();

 private:
  // Which of the numbers read from a message each wanted column is made of.
  struct Source {
    WantedColumn column;
    std::vector<int> at;  // -1: when it was recorded
  };

  const std::string path_, channel_;
  std::vector<Source> sources_;
  std::vector<std::string> places_;
  std::map<std::string, std::int64_t> counts_;  // of each channel's messages
  LogTable table_;
  std::vector<double> numbers_;
  int messages_ = 0;  // of the channel
  bool lost_ = false;
};

}  // namespace forereach
