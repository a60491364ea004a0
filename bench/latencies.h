/** Every single latency of a run, and its percentiles: exact, without buckets. */
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <nlohmann/json.hpp>

namespace forereach::bench {

class Latencies {
 public:
  explicit Latencies(std::size_t expected) { microseconds_.reserve(expected); }

  void Add(double microseconds) { microseconds_.push_back(microseconds); }

  /** The smallest latency that at least `fraction` of all do not exceed. Sorts. */
  [[nodiscard]] double Percentile(double fraction) {
    std::ranges::sort(microseconds_);
    const double rank = fraction * static_cast<double>(microseconds_.size());
    const auto index = static_cast<std::size_t>(std::max(0.0, rank - 1e-9));
    return microseconds_.at(std::min(index, microseconds_.size() - 1));
  }

  [[nodiscard]] nlohmann::json ToJson() {
    return {{"count", microseconds_.size()}, {"p50", Percentile(0.5)},       {"p99", Percentile(0.99)},
            {"p99.9", Percentile(0.999)},    {"p99.99", Percentile(0.9999)}, {"max", Percentile(1)}};
  }

 private:
  std::vector<double> microseconds_;
};

}  // namespace forereach::bench
