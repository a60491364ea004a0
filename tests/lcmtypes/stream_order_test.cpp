// Every short history of messages against the rule as it is written down, over the list of messages alone.
#include "lcmtypes/stream_order.h"

#include "tests/test.h"

namespace forereach::stream_order_test {

constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min(), kMax = std::numeric_limits<std::int64_t>::max();

__extension__ using Wide = __int128;

struct Arrival {
  StreamPosition message;
  std::int64_t now;
};

// No later than max_ahead after its arrival; in wider arithmetic, where no sum overflows.
Wide Stamp(const Arrival& arrival, std::int64_t max_ahead) {
  return std::min<Wide>(arrival.message.utime, Wide{arrival.now} + max_ahead);
}

Succession Specified(const std::vector<Arrival>& taken, const Arrival& next, std::int64_t max_ahead) {
  if (taken.empty()) return Succession::kNewer;
  const StreamPosition message = next.message, newest = taken.back().message;
  if (message == newest) return Succession::kRepeated;
  if (message.sequence > newest.sequence) return Succession::kNewer;
  std::size_t began = taken.size() - 1;  // since then every sequence was larger than the one before
  while (began > 0 && taken[began].message.sequence > taken[began - 1].message.sequence) --began;
  Wide latest = Stamp(taken[began], max_ahead);
  for (std::size_t i = began; i < taken.size(); ++i) latest = std::max(latest, Stamp(taken[i], max_ahead));
  if (message.sequence == 0)
    for (std::size_t i = taken.size(); i-- > 0;) {
      if (taken[i].message.sequence != 0) continue;
      if (taken[i].message.utime == message.utime) return Succession::kRepeated;
      break;
    }
  if (Stamp(next, max_ahead) > latest) return Succession::kRestarted;
  if (latest > Wide{next.now} + max_ahead) return Succession::kRestarted;
  return message.sequence == 0 ? Succession::kRewound : Succession::kLate;
}

// Which answers a receiver takes: one that acts on messages, and a reader of records.
using Takes = bool (*)(Succession);
bool Reads(Succession succession) { return IsNews(succession) || succession == Succession::kRewound; }
bool AnyAtAll(Succession) { return true; }

class Histories {
 public:
  Histories(std::vector<Arrival> alphabet, std::int64_t max_ahead, Takes takes)
      : alphabet_(std::move(alphabet)), max_ahead_(max_ahead), takes_(takes) {}

  void Try(int length) { Try(StreamOrder(), length); }
  [[nodiscard]] const std::array<std::int64_t, 5>& seen() const { return seen_; }

 private:
  void Try(const StreamOrder& order, int left) {
    for (const Arrival& next : alphabet_) {
      const std::int64_t horizon = StreamOrder::Horizon(next.now, max_ahead_);
      const Succession answer = order.Compare(next.message, horizon);
      ++seen_[static_cast<std::size_t>(answer)];
      if (answer != Specified(taken_, next, max_ahead_)) {
        ADD_FAILURE() << taken_.size() << " taken, then sequence " << next.message.sequence << ", stamp "
                      << next.message.utime << ", now " << next.now << ", ahead " << max_ahead_;
        continue;
      }
      if (left == 1 || !takes_(answer)) continue;
      StreamOrder after = order;
      after.Take(next.message, horizon);
      ASSERT_EQ(after.newest(), next.message);
      taken_.push_back(next);
      Try(after, left - 1);
      taken_.pop_back();
    }
  }

  std::vector<Arrival> alphabet_;
  std::int64_t max_ahead_;
  Takes takes_;
  std::vector<Arrival> taken_;
  std::array<std::int64_t, 5> seen_{};
};

std::vector<Arrival> Alphabet(const std::vector<std::int64_t>& sequences, const std::vector<std::int64_t>& stamps,
                              const std::vector<std::int64_t>& times) {
  std::vector<Arrival> alphabet;
  for (const std::int64_t sequence : sequences)
    for (const std::int64_t stamp : stamps)
      for (const std::int64_t now : times) alphabet.push_back({{sequence, stamp}, now});
  return alphabet;
}

TEST(StreamOrderTest, EveryShortHistoryIsAnsweredAsSpecified) {
  for (const Takes takes : {IsNews, Reads, AnyAtAll})
    for (const std::int64_t ahead : {0, 1, 5}) {
      Histories histories(Alphabet({0, 1, 2}, {0, 1, 2}, {0, 1, 3}), ahead, takes);
      histories.Try(4);
      for (const std::int64_t count : histories.seen()) EXPECT_GT(count, 0);
    }
}

TEST(StreamOrderTest, EveryLongerHistoryWithoutAHorizonIsAnsweredAsSpecified) {
  for (const Takes takes : {IsNews, Reads, AnyAtAll}) {
    Histories histories(Alphabet({0, 1, 2}, {0, 1, 2}, {StreamOrder::kNoHorizon}), 0, takes);
    histories.Try(6);
    for (const std::int64_t count : histories.seen()) EXPECT_GT(count, 0);
  }
}

TEST(StreamOrderTest, EveryHistoryOfExtremeNumbersIsAnsweredAsSpecified) {
  for (const std::int64_t ahead : {std::int64_t{0}, std::int64_t{1}, kMax}) {
    Histories histories(Alphabet({kMin, 0, kMax}, {kMin, 0, kMax - 1, kMax}, {kMin, 0, kMax - 1, kMax}), ahead,
                        AnyAtAll);
    histories.Try(3);
  }
}

TEST(StreamOrderTest, AReceiverThatActsNeverGoesBackToAnOlderStampOfThisStream) {
  StreamOrder order;
  for (const StreamPosition taken : {StreamPosition{0, 10}, {1, 20}, {2, 30}}) order.Take(taken, taken.utime);
  for (const StreamPosition old : {StreamPosition{0, 9}, {0, 10}, {0, 30}, {1, 20}, {1, 30}, {2, 29}, {2, 30}})
    EXPECT_FALSE(IsNews(order.Compare(old, 30))) << old.sequence << " " << old.utime;
  EXPECT_EQ(order.Compare({0, 31}, 31), Succession::kRestarted);
  EXPECT_EQ(order.Compare({0, 9}, 29), Succession::kRestarted) << "the clock was set back";
}

TEST(SumOfLostTest, EndsAtTheLargestNumber) {
  EXPECT_EQ(SumOfLost(2, 3), 5);
  EXPECT_EQ(SumOfLost(kMax, kMax), kMax);
  EXPECT_EQ(SumOfLost(0, kMin), 0);
}

}  // namespace forereach::stream_order_test
