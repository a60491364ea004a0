// What the certifier adds to a round trip on the bus.
//   bus_round_trip [--rounds N]        prints one JSON document, microseconds
// Two processes answer candidates on loopback UDP multicast, each on a port of its own: the certifier's node with its
// gate, and an echo that sends messages of the same sizes back without looking at what came. This process asks one,
// then the other, and so on, so both see the same machine. Two questions: a plan that is certified (the answer is
// decision_t and certified_plan_t) and one that is not (decision_t alone). Then the first question after pauses.
#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bench/candidates.h"
#include "bench/latencies.h"
#include "bench/measurement.h"
#include "certifier/process/certifier_node.h"

namespace forereach::bench {
namespace {

constexpr int kObservations = 400;
constexpr int kPatienceMs = 2000, kWarmUp = 200;

// Answers each candidate with as many bytes as the certifier would.
class EchoNode final : public Node {
 public:
  EchoNode(const BusOptions& channels, Bus& bus, bool certifies)
      : channels_(channels), bus_(bus), certifies_(certifies) {
    bus_.Subscribe(channels_.candidate, [this](const Received& received) {
      waiting_.push_back({received.bytes.begin(), received.bytes.end()});
    });
  }

  void Tick(std::int64_t) override {
    for (std::size_t i = 0; i < waiting_.size(); ++i) {
      if (certifies_) bus_.Publish(channels_.certified, Bytes(certified_));
      bus_.Publish(channels_.decision, Bytes(decision_));
    }
    waiting_.clear();
  }

 private:
  const BusOptions channels_;
  Bus& bus_;
  const bool certifies_;
  std::vector<std::vector<std::uint8_t>> waiting_;
  const std::vector<std::uint8_t> certified_ = Encode(certified_plan_t{}), decision_ = Encode(decision_t{});
};

// The asking end of one bus.
class Asker {
 public:
  Asker(const std::string& url, const BusOptions& channels, std::int16_t expected)
      : channels_(channels), expected_(expected), bus_(OpenBus(url)) {
    bus_->Subscribe(channels_.decision, [this](const Received& received) {
      ++answers_;
      last_ = Decoded<decision_t>(received.bytes);
    });
  }

  // Until an answer comes: the other process may still be starting.
  void Reach(candidate_plan_t& candidate) {
    for (int attempt = 0; attempt < 50; ++attempt)
      if (Ask(candidate, kPatienceMs / 20) >= 0) return;
    throw std::runtime_error("no answer on the bus");
  }

  // Microseconds from publishing to having the decision; negative if none came in time.
  double Ask(candidate_plan_t& candidate, int patience_ms = kPatienceMs) {
    Stamp(candidate, ++plan_id_, WallClockUs());
    const std::vector<std::uint8_t> bytes = Encode(candidate);
    const int before = answers_;
    const auto begin = std::chrono::steady_clock::now();
    const auto deadline = begin + std::chrono::milliseconds(patience_ms);
    bus_->Publish(channels_.candidate, Bytes(bytes));
    while (answers_ == before) {
      bus_->Dispatch(patience_ms);
      if (answers_ == before && std::chrono::steady_clock::now() > deadline) return -1;
    }
    const std::chrono::duration<double, std::micro> elapsed = std::chrono::steady_clock::now() - begin;
    if (!last_ || last_->outcome != expected_) ++unexpected_;
    if (last_) gate_us_ = last_->elapsed_us;
    return elapsed.count();
  }

  [[nodiscard]] int unexpected() const { return unexpected_; }
  // The gate's time for the last decision, from the message.
  [[nodiscard]] double gate_us() const { return gate_us_; }

 private:
  const BusOptions channels_;
  const std::int16_t expected_;
  std::int64_t plan_id_ = 0;
  int answers_ = 0, unexpected_ = 0;
  double gate_us_ = 0;
  std::optional<decision_t> last_;
  std::unique_ptr<Bus> bus_;
};

struct Results {
  Latencies echo, certifier, gate;
  int lost = 0, unexpected = 0;
};

void Alternate(int rounds, candidate_plan_t& candidate, Asker& echo, Asker& certifier, Results& results) {
  for (int round = -kWarmUp; round < rounds; ++round) {
    const double bare = echo.Ask(candidate), gated = certifier.Ask(candidate);
    if (bare < 0 || gated < 0) {
      ++results.lost;
    } else if (round >= 0) {
      results.echo.Add(bare);
      results.certifier.Add(gated);
      results.gate.Add(certifier.gate_us());
    }
  }
}

nlohmann::json Compare(const Task& task, bool certifies, int rounds, int ports) {
  const Config config = MakeConfig(task);
  const std::string echo_url = PortUrl(ports), gate_url = PortUrl(ports + 1);
  const Child echo_process(echo_url, false,
                           [&](Bus& bus) { return std::make_unique<EchoNode>(config.bus, bus, certifies); });
  const Child gate_process(gate_url, false, [&](Bus& bus) { return std::make_unique<CertifierNode>(config, bus); });

  const std::int16_t expected = certifies ? decision_t::CERTIFIED : decision_t::ABSTAIN_SAFETY;
  Asker echo(echo_url, config.bus, 0), certifier(gate_url, config.bus, expected);
  candidate_plan_t candidate = MakeCandidate(task);
  echo.Reach(candidate);
  certifier.Reach(candidate);

  const auto expected_rounds = static_cast<std::size_t>(rounds);
  Results results{Latencies(expected_rounds), Latencies(expected_rounds), Latencies(expected_rounds)};
  Alternate(rounds, candidate, echo, certifier, results);
  return {{"echo", results.echo.ToJson()},
          {"certifier", results.certifier.ToJson()},
          {"gate", results.gate.ToJson()},
          {"added_p50", results.certifier.Percentile(0.5) - results.echo.Percentile(0.5)},
          {"added_p99", results.certifier.Percentile(0.99) - results.echo.Percentile(0.99)},
          {"ratio_p50", results.certifier.Percentile(0.5) / results.echo.Percentile(0.5)},
          {"ratio_p99", results.certifier.Percentile(0.99) / results.echo.Percentile(0.99)},
          {"lost", results.lost},
          {"unexpected", certifier.unexpected()}};
}

// Uses the caches as a planner does between two candidates.
void Search(std::vector<char>& memory) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(10);
  for (std::size_t i = 0; std::chrono::steady_clock::now() < end; i = (i + 64) % memory.size()) ++memory[i];
}

// The gate's work on candidates that come one after a search each; to a certifier that keeps warm, and to one that does
// not, in turn.
nlohmann::json AfterPauses(const Task& task, int rounds, int ports) {
  Config config = MakeConfig(task);
  const std::string cold_url = PortUrl(ports), warm_url = PortUrl(ports + 1);
  const auto make = [&](Bus& bus) { return std::make_unique<CertifierNode>(config, bus); };
  const Child cold_process(cold_url, false, make);
  config.realtime.keep_warm = true;
  const Child warm_process(warm_url, false, make);
  Asker cold(cold_url, config.bus, decision_t::CERTIFIED), warm(warm_url, config.bus, decision_t::CERTIFIED);
  candidate_plan_t candidate = MakeCandidate(task);
  cold.Reach(candidate);
  warm.Reach(candidate);
  std::vector<char> memory(std::size_t{32} << 20);
  Latencies of_cold(static_cast<std::size_t>(rounds)), of_warm(static_cast<std::size_t>(rounds));
  for (int round = 0; round < rounds; ++round)
    for (const auto& [asker, latencies] : {std::pair(&cold, &of_cold), {&warm, &of_warm}}) {
      Search(memory);
      if (asker->Ask(candidate) >= 0) latencies->Add(asker->gate_us());
    }
  return {{"cold", of_cold.ToJson()}, {"kept_warm", of_warm.ToJson()}};
}

}  // namespace
}  // namespace forereach::bench

int main(int argc, char** argv) {
  using namespace forereach;
  using namespace forereach::bench;
  int rounds = 20'000;
  const Command program{.name = "bus_round_trip",
                        .purpose = "Round trips on the bus, by a bare echo and by the certifier: percentiles as JSON",
                        .options = {{"--rounds", &rounds, "", "round trips of each kind", NumberRange{1, 10'000'000}}}};
  return Print(program, argc, argv, [&]() -> nlohmann::json {
    return {{"candidate_bytes", EncodedSize<candidate_plan_t>()},
            {"decision_bytes", EncodedSize<decision_t>()},
            {"certified_bytes", EncodedSize<certified_plan_t>()},
            {"certified", Compare(MakeTask(Scenario::kBicycle, kObservations), true, rounds, 0)},
            {"abstained", Compare(MakeBlockedTask(Scenario::kBicycle, kObservations), false, rounds, 2)},
            {"after_pauses", AfterPauses(MakeTask(Scenario::kBicycle, kObservations), std::max(rounds / 20, 5), 4)}};
  });
}
