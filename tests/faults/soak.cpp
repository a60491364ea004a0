// The soak: certifier and logger under a steady load of signed candidates, minute by minute. Memory has to stay flat, latency
// not to drift, and all counters to add up. Writes a table.
#include <algorithm>
#include <fstream>
#include <iostream>
#include <sstream>
#include <unordered_map>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "certifier/task/process.h"
#include "forereach/certifier_status_v2_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/logger_status_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/authentic.h"
#include "tests/faults/report.h"
#include "tests/process/process_fixture.h"

namespace forereach {
namespace {

struct Options {
  double minutes = 60, rate = 200;
  std::string report = "docs/reliability.md";
};

struct Minute {
  double p50_us = 0, p99_us = 0, worst_us = 0;
  std::int64_t certifier_kb = 0, logger_kb = 0, sent = 0, answered = 0;
};

std::int64_t ResidentKb(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
  std::int64_t size = 0, resident = 0;
  file >> size >> resident;
  return resident * (::sysconf(_SC_PAGESIZE) / 1024);
}

double Percentile(std::vector<double>& sorted, double fraction) {
  if (sorted.empty()) return 0;
  std::ranges::sort(sorted);
  return sorted[static_cast<std::size_t>(fraction * static_cast<double>(sorted.size() - 1))];
}

class Soak final {
 public:
  explicit Soak(const Options& options) : options_(options) {
    task_ = scratch_.Write("task.yaml", PatientTask());
    key_ = (scratch_.path() / "key").string();
    MakeKeyFile(key_);
    config_ = LoadConfig(task_);
    config_.bus.url = PrivateBusUrl();
    config_.bus.key = key_;
    bus_ = OpenBus(config_.bus, "soak");
    bus_->Subscribe(config_.bus.decision, [this](const Received& r) { OnDecision(r); });
    bus_->Subscribe(config_.bus.status, [this](const Received& r) { Keep(r, status_); });
    bus_->Subscribe(config_.bus.logger_status, [this](const Received& r) { Keep(r, logger_); });
  }

  std::vector<Minute> Run() {
    const std::vector<std::string> common{"--config", task_, "--lcm-url", config_.bus.url, "--key", key_};
    const auto command = [&](const char* program, std::vector<std::string> more) {
      std::vector<std::string> all{program};
      all.insert(all.end(), common.begin(), common.end());
      all.insert(all.end(), more.begin(), more.end());
      return all;
    };
    ChildProcess logger(command(FOREREACH_LOGGER, {"--directory", (scratch_.path() / "log").string()}));
    ChildProcess certifier(command(FOREREACH_CERTIFIER, {}));
    if (!logger.WaitForLog("ready on") || !certifier.WaitForLog("ready on")) throw std::runtime_error(certifier.error());
    const std::int64_t begin = SteadyClockUs();
    const auto period = static_cast<std::int64_t>(1e6 / options_.rate);
    const auto total = static_cast<std::int64_t>(options_.minutes * 60e6);
    std::vector<Minute> minutes;
    std::int64_t next = begin, next_minute = begin + 60'000'000;
    while (SteadyClockUs() - begin < total) {
      if (SteadyClockUs() >= next) {
        Send();
        next += period;
      }
      bus_->Dispatch(SteadyClockUs() < next ? 1 : 0);
      if (SteadyClockUs() < next_minute && SteadyClockUs() - begin < total) continue;
      next_minute += 60'000'000;
      minutes.push_back(EndMinute(certifier.pid(), logger.pid()));
      std::cerr << "minute " << minutes.size() << ": p50 " << minutes.back().p50_us << " us, p99 " << minutes.back().p99_us
                << " us, certifier " << minutes.back().certifier_kb << " kB, logger " << minutes.back().logger_kb << " kB\n";
    }
    for (int i = 0; i < 200; ++i) bus_->Dispatch(10);
    return minutes;
  }

  [[nodiscard]] std::int64_t sent() const { return sent_; }
  [[nodiscard]] std::int64_t answered() const { return answered_; }
  [[nodiscard]] const certifier_status_v2_t& status() const { return status_; }
  [[nodiscard]] const logger_status_t& logger() const { return logger_; }

 private:
  template <class Message>
  static void Keep(const Received& received, Message& message) {
    if (const auto heard = Decoded<Message>(received.bytes)) message = *heard;
  }

  void Send() {
    const bool clear = sent_ % 3 != 0;
    candidate_plan_t candidate =
        CandidateFor(config_, WallClockUs(), Eigen::Vector2d(0.2, clear ? 0 : 2.5), 12, std::chrono::seconds(1));
    candidate.sequence = sent_++;
    sent_at_[candidate.plan_id] = SteadyClockUs();
    bus_->Publish(config_.bus.candidate, candidate);
  }

  void OnDecision(const Received& received) {
    const auto decision = Decoded<decision_t>(received.bytes);
    const auto sent = decision ? sent_at_.find(decision->plan_id) : sent_at_.end();
    if (sent == sent_at_.end()) return;
    latencies_.push_back(static_cast<double>(SteadyClockUs() - sent->second));
    sent_at_.erase(sent);
    ++answered_;
  }

  Minute EndMinute(pid_t certifier, pid_t logger) {
    Minute minute;
    minute.p50_us = Percentile(latencies_, 0.5);
    minute.p99_us = Percentile(latencies_, 0.99);
    minute.worst_us = Percentile(latencies_, 1);
    minute.certifier_kb = ResidentKb(certifier);
    minute.logger_kb = ResidentKb(logger);
    minute.sent = sent_;
    minute.answered = answered_;
    latencies_.clear();
    return minute;
  }

  const Options options_;
  ScratchDirectory scratch_;
  std::string task_, key_;
  Config config_;
  std::unique_ptr<Bus> bus_;
  std::unordered_map<std::int64_t, std::int64_t> sent_at_;
  std::vector<double> latencies_;
  certifier_status_v2_t status_{};
  logger_status_t logger_{};
  std::int64_t sent_ = 0, answered_ = 0;
};

std::string Table(const Options& options, const std::vector<Minute>& minutes, const Soak& soak) {
  std::ostringstream text;
  text << "Made by `build/release/tests/faults/forereach_soak_processes --minutes " << options.minutes << " --rate "
       << options.rate << "`: signed candidates of full size, two of three certified, while the logger records.\n\n"
       << "| minute | p50 us | p99 us | worst us | certifier kB | logger kB |\n|---|---|---|---|---|---|\n";
  const std::size_t step = std::max<std::size_t>(1, minutes.size() / 6);
  for (std::size_t i = 0; i < minutes.size(); ++i)
    if (i == 0 || (i + 1) % step == 0 || i + 1 == minutes.size())
      text << "| " << i + 1 << " | " << minutes[i].p50_us << " | " << minutes[i].p99_us << " | " << minutes[i].worst_us
           << " | " << minutes[i].certifier_kb << " | " << minutes[i].logger_kb << " |\n";
  text << "\nSent " << soak.sent() << ", answers heard " << soak.answered() << "; the certifier counts "
       << soak.status().candidates << " decided on, " << soak.status().candidates_lost << " lost by the bus and "
       << soak.status().page_faults << " page faults while deciding; the logger " << soak.logger().events_written
       << " events written, " << soak.logger().events_lost << " lost.\n";
  return text.str();
}

// What a leak or a drift would show: the last fifth against the second.
bool IsSteady(const std::vector<Minute>& minutes, const Soak& soak) {
  std::int64_t sum = 0;
  for (const std::int64_t count : soak.status().by_outcome) sum += count;
  bool good = sum == soak.status().candidates && soak.logger().events_lost == 0 &&
              soak.sent() == soak.status().candidates + soak.status().candidates_lost &&
              soak.answered() == soak.status().candidates;
  if (minutes.size() >= 10) {
    const Minute &early = minutes[minutes.size() / 5], &late = minutes.back();
    good = good && late.certifier_kb < early.certifier_kb + 2048 && late.logger_kb < early.logger_kb + 8192;
  }
  return good;
}

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("Certifier and logger under a steady load; says whether memory, latency and counters hold.",
               "forereach_soak_processes");
  app.add_option("--minutes", options.minutes, "How long")->capture_default_str();
  app.add_option("--rate", options.rate, "Candidates a second")->capture_default_str();
  app.add_option("--report", options.report, "Where the table goes; empty: to standard output alone")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  Soak soak(options);
  const std::vector<Minute> minutes = soak.Run();
  const std::string table = Table(options, minutes, soak);
  std::cout << table << std::flush;
  if (!options.report.empty()) ReplaceBetween(options.report, "soak", table);
  return IsSteady(minutes, soak) ? 0 : 1;
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) { return forereach::Main(argc, argv); }
