// The soak: certifier and logger under a steady load of signed candidates, interval by interval. Memory has to stay
// flat, latency not to drift, and all counters to add up. Writes a table; what does not hold is an error.
#include <algorithm>
#include <csignal>
#include <iostream>
#include <sstream>

#include <unistd.h>
#include "records/database.h"
#include "tests/faults/load.h"
#include "tests/faults/report.h"
#include "tests/keys.h"
#include "tests/messages.h"
#include "tests/process/process_fixture.h"

namespace forereach {
namespace {

constexpr int kIntervals = 60;
constexpr double kJudgedFromMinutes = 10;  // shorter runs are all warming up
// The last fifth of the run against the second, by medians.
constexpr double kCertifierMayGrowKb = 2048, kLoggerMayGrowKb = 8192;
constexpr double kLatencyMayGrowBy = 1.5, kAndByUs = 100;
// Between a candidate's stamp and its answer's two threads of the certifier wake up, and the kernel's own between them:
// the 99th percentile may grow by three times what a thread that only sleeps is woken later.
constexpr double kWakings = 3;

struct Options {
  double minutes = 60, rate = 200;
  std::string report = "docs/reliability.md";
};

struct Interval {
  double ended_min = 0, p50_us = 0, p99_us = 0, worst_us = 0, late_p99_us = 0, certifier_kb = 0, logger_kb = 0;
};

// What the logger's database knows of the certifier's decisions.
struct Recorded {
  std::int64_t decisions = 0, decisions_lost = 0;
};

Recorded ReadDatabase(const std::filesystem::path& directory, const std::string& channel) {
  Database database((directory / "decisions.sqlite").string());
  Recorded recorded;
  for (const RunRow& run : database.Runs()) {
    const Rows rows = database.Read(run.log_file);
    recorded.decisions += static_cast<std::int64_t>(rows.decisions.size());
    for (const GapRow& gap : rows.gaps)
      if (gap.channel == channel) recorded.decisions_lost += gap.lost;
  }
  return recorded;
}

class Soak final {
 public:
  explicit Soak(const Options& options) : options_(options) {
    // Of 27 GB that an hour writes the newest are kept.
    const std::string task = scratch_.Write("task.yaml", PatientTask() + "logger: {rotate_mb: 256, quota_mb: 2048}\n");
    config_ = LoadConfig(task);
    config_.bus.url = PrivateBusUrl();
    config_.bus.key = MakeTestKeys(scratch_ / "keys");
    load_ = std::make_unique<Load>(config_, [this](std::int64_t number) {
      return CandidateFor(config_, 0, Eigen::Vector2d(0.2, number % 3 != 0 ? 0 : 2.5), 12, std::chrono::seconds(1));
    });
    load_->bus().Subscribe(config_.bus.logger_status, [this](const Received& r) {
      if (const auto status = Decoded<logger_status_t>(r.bytes)) logger_ = *status;
    });
  }

  void Run() {
    const std::vector<std::string> common{"--config",      config_.path, "--lcm-url",
                                          config_.bus.url, "--key",      config_.bus.key};
    std::vector<std::string> of_logger{FOREREACH_LOGGER, "--directory", log().string()},
        of_certifier{FOREREACH_CERTIFIER};
    of_logger.insert(of_logger.end(), common.begin(), common.end());
    of_certifier.insert(of_certifier.end(), common.begin(), common.end());
    ChildProcess logger(of_logger), certifier(of_certifier);
    if (!logger.WaitForLog("ready on") || !certifier.WaitForLog("ready on"))
      throw std::runtime_error(logger.error() + certifier.error());
    load_->Begin();
    const std::int64_t begin = SteadyClockUs();
    load_->Start(options_.rate);
    for (int i = 1; i <= kIntervals; ++i) {
      const double minutes = options_.minutes * i / kIntervals;
      load_->ListenUntil(begin + static_cast<std::int64_t>(minutes * 60e6));
      EndInterval(minutes, certifier.pid(), logger.pid());
    }
    wanted_ = options_.rate * static_cast<double>(SteadyClockUs() - begin) * 1e-6;
    load_->Finish();
    all_ran_ = !certifier.WaitForEnd(std::chrono::milliseconds(0)) && !logger.WaitForEnd(std::chrono::milliseconds(0));
    logger.Signal(SIGTERM);
    all_ran_ &= logger.WaitForExit(std::chrono::seconds(60)) == 0;
    recorded_ = ReadDatabase(log(), config_.bus.decision);
  }

  /** One line for each thing that does not hold. */
  [[nodiscard]] std::vector<std::string> Judge() const;
  [[nodiscard]] std::string Table(const std::vector<std::string>& faults) const;

 private:
  [[nodiscard]] std::filesystem::path log() const { return scratch_ / "log"; }

  void EndInterval(double minutes, pid_t certifier, pid_t logger) {
    std::vector<double> latencies = load_->TakeLatencies(), lateness = load_->TakeLateness();
    const Interval now{minutes,
                       Percentile(latencies, 0.5),
                       Percentile(latencies, 0.99),
                       Percentile(latencies, 1),
                       Percentile(lateness, 0.99),
                       ResidentBytes(certifier) / 1024,
                       ResidentBytes(logger) / 1024};
    intervals_.push_back(now);
    if (intervals_.size() % (kIntervals / 12) == 0)
      std::cerr << "minute " << minutes << ": p50 " << now.p50_us << " us, p99 " << now.p99_us << " us, a sleeper's "
                << now.late_p99_us << " us, certifier " << now.certifier_kb << " kB, logger " << now.logger_kb
                << " kB\n";
  }

  // Medians over the second and the last fifth of the run.
  [[nodiscard]] std::pair<double, double> EarlyAndLate(double Interval::*value) const {
    const auto median = [&](std::size_t from) {
      std::vector<double> values;
      for (std::size_t i = from; i < from + kIntervals / 5; ++i) values.push_back(intervals_[i].*value);
      return Percentile(values, 0.5);
    };
    return {median(kIntervals / 5), median(kIntervals - kIntervals / 5)};
  }

  const Options options_;
  ScratchDirectory scratch_;
  Config config_;
  std::unique_ptr<Load> load_;
  logger_status_t logger_{};
  std::vector<Interval> intervals_;
  double wanted_ = 0;
  bool all_ran_ = false;
  Recorded recorded_;
};

std::string Soak::Table(const std::vector<std::string>& faults) const {
  std::ostringstream text;
  text << "Made by `scripts/faults soak --minutes " << options_.minutes << " --rate " << options_.rate
       << "`: signed candidates of 12 steps, two of three certified, while the\n"
       << "logger records. Microseconds from a candidate's stamp to the arrival of its answer; the wake-up delay "
          "of a thread\n"
       << "that only sleeps, on the same machine at the same time; resident memory.\n\n"
       << "| minute | p50 us | p99 us | worst us | sleeper p99 us | certifier kB | logger kB |\n"
       << "|---:|---:|---:|---:|---:|---:|---:|\n";
  for (std::size_t i = 0; i < intervals_.size(); ++i)
    if (i == 0 || (i + 1) % (kIntervals / 6) == 0)
      text << "| " << intervals_[i].ended_min << " | " << intervals_[i].p50_us << " | " << intervals_[i].p99_us << " | "
           << intervals_[i].worst_us << " | " << intervals_[i].late_p99_us << " | " << intervals_[i].certifier_kb
           << " | " << intervals_[i].logger_kb << " |\n";
  const certifier_status_t& certifier = load_->status();
  text << "\nSent " << load_->sent() << ", answered " << load_->answered() << ", of these twice "
       << load_->answered_again() << "; answers lost on the way " << load_->answers_lost() << ".\nThe certifier counts "
       << certifier.candidates << " decided on, " << certifier.candidates_lost << " lost on the way and "
       << certifier.page_faults << " page faults while deciding;\nthe logger " << logger_.events_written
       << " events written and " << logger_.events_lost << " lost; its database holds " << recorded_.decisions
       << " decisions and " << recorded_.decisions_lost << " as gaps.\n";
  text << "Judgement: " << (faults.empty() ? "all holds" : "does not hold");
  if (options_.minutes < kJudgedFromMinutes) text << "; too short to look at load, growth and drift";
  for (const std::string& fault : faults) text << "\n- " << fault;
  text << "\n";
  return text.str();
}

std::vector<std::string> Soak::Judge() const {
  std::vector<std::string> faults;
  const auto demand = [&](bool holds, const std::string& otherwise) {
    if (!holds) faults.push_back(otherwise);
  };
  const auto equal = [&](std::int64_t a, std::int64_t b, const std::string& what) {
    demand(a == b, what + ": " + std::to_string(a) + " and " + std::to_string(b));
  };
  const certifier_status_t& certifier = load_->status();
  std::int64_t outcomes = 0;
  for (const std::int64_t count : certifier.by_outcome) outcomes += count;
  demand(all_ran_, "a process ended before its time, or not well");
  equal(load_->sent(), certifier.candidates + certifier.candidates_lost, "sent, and decided on or counted as lost");
  equal(certifier.candidates, outcomes, "decided on, and decisions by outcome");
  equal(certifier.candidates, load_->answered() + load_->answers_lost(), "decided on, and answers heard or missing");
  equal(load_->answered_again(), 0, "answered twice, at most");
  equal(logger_.events_lost, 0, "events lost by the logger, at most");
  equal(certifier.candidates, recorded_.decisions + recorded_.decisions_lost,
        "decided on, and decisions recorded or a gap");
  if (options_.minutes < kJudgedFromMinutes) return faults;
  const auto sent = static_cast<double>(load_->sent());
  demand(sent >= 0.99 * wanted_, "the load was less than asked for: the machine is too busy");
  demand(static_cast<double>(certifier.by_outcome[decision_t::CERTIFIED]) >= 0.6 * sent, "too few were certified");
  const auto flat = [&](double Interval::*value, double factor, double allowance, const std::string& what) {
    const auto [early, late] = EarlyAndLate(value);
    demand(late <= early * factor + allowance,
           what + ": " + std::to_string(early) + " early, " + std::to_string(late) + " late");
  };
  flat(&Interval::certifier_kb, 1, kCertifierMayGrowKb, "the certifier grows, kB");
  flat(&Interval::logger_kb, 1, kLoggerMayGrowKb, "the logger grows, kB");
  flat(&Interval::p50_us, kLatencyMayGrowBy, kAndByUs, "the median latency drifts, us");
  const auto [sleeper_early, sleeper_late] = EarlyAndLate(&Interval::late_p99_us);
  flat(&Interval::p99_us, kLatencyMayGrowBy, kAndByUs + kWakings * std::max(0.0, sleeper_late - sleeper_early),
       "the 99th percentile drifts more than the machine does, us");
  return faults;
}

int Main(int argc, char** argv) {
  Options options;
  const Command program{
      .name = "forereach_soak_processes",
      .purpose = "Certifier and logger under a steady load; says whether memory, latency and counters hold.",
      .options = {{.name = "--minutes", .variable = &options.minutes, .help = "How long"},
                  {.name = "--rate", .variable = &options.rate, .help = "Candidates a second"},
                  ReportOption(options.report)}};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  Soak soak(options);
  soak.Run();
  const std::vector<std::string> faults = soak.Judge();
  Publish(options.report, "soak", soak.Table(faults));
  return faults.empty() ? 0 : 1;
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) { return forereach::Main(argc, argv); }
