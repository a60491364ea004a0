// A thousand full-size candidates a second through the certifier's process on a real loopback bus: what is answered, what the
// bus loses, how long an answer takes. Writes a table.
#include <algorithm>
#include <iostream>
#include <sstream>

#include <CLI/CLI.hpp>

#include "certifier/certify/certifier.h"
#include "certifier/gate/candidate_message.h"
#include "forereach/decision_t.hpp"
#include "lcmtypes/names.h"
#include "tests/faults/demo_task.h"
#include "tests/faults/load.h"
#include "tests/faults/report.h"
#include "tests/keys.h"
#include "tests/process/process_fixture.h"

namespace forereach {
namespace {

// Without a robot, and patient with a busy machine.
constexpr const char* kGate =
    "gate: {max_age_ms: 20000, certificate_lifetime_ms: 60000, arming: none, max_clock_jump_ms: 10000}\n";

struct Options {
  double seconds = 20, rate = 1000;
  std::string report = "docs/reliability.md";
};

struct Row {
  std::string name;
  double asked = 0;
  std::int64_t sent = 0, answered = 0, again = 0, answers_lost = 0;
  double p50_us = 0, p99_us = 0, worst_us = 0;
  certifier_status_v2_t status{};
};

candidate_plan_t Standing(const Config& config, int steps) {
  return CandidateFor(config, 0, Eigen::Vector2d(0, 0), steps, std::chrono::seconds(1));
}

// The most steps of standing still that are certified.
int MostSteps(const Config& config) {
  const Certifier certifier(config.problem);
  for (int steps = kMaxSteps; steps > 0; --steps) {
    const candidate_plan_t candidate = Standing(config, steps);
    Tube tube;
    if (certifier.Certify(PlanOf(candidate), InitialSetOf(candidate), config.obstacles, tube).outcome == Outcome::kCertified)
      return steps;
  }
  throw std::runtime_error("nothing is certified");
}

Row Measure(const Options& options, const std::string& name, Config config, int steps) {
  Row row{.name = name};
  std::vector<std::string> command{FOREREACH_CERTIFIER, "--config", config.path, "--lcm-url", config.bus.url};
  if (!config.bus.key.empty()) command.insert(command.end(), {"--key", config.bus.key});
  ChildProcess certifier(command);
  if (!certifier.WaitForLog("ready on")) throw std::runtime_error(certifier.error());
  Load load(config, [&](std::int64_t) { return Standing(config, steps); });
  load.Begin();
  const std::int64_t begin = SteadyClockUs();
  load.Start(options.rate);
  load.ListenUntil(begin + static_cast<std::int64_t>(options.seconds * 1e6));
  row.asked = options.rate * static_cast<double>(SteadyClockUs() - begin) * 1e-6;
  load.Finish();
  std::vector<double> latencies = load.TakeLatencies();
  row.p50_us = Percentile(latencies, 0.5), row.p99_us = Percentile(latencies, 0.99), row.worst_us = Percentile(latencies, 1);
  row.sent = load.sent(), row.answered = load.answered(), row.again = load.answered_again();
  row.answers_lost = load.answers_lost();
  row.status = load.status();
  return row;
}

// Counted by cause.
std::string OtherAnswers(const certifier_status_v2_t& status) {
  std::string text;
  for (std::size_t cause = 1; cause < std::size(status.by_cause); ++cause)
    if (status.by_cause[cause] > 0)
      text += (text.empty() ? "" : ", ") + std::to_string(status.by_cause[cause]) + " " +
              std::string(CauseName(static_cast<std::int16_t>(cause)));
  return text.empty() ? "0" : text;
}

std::string Table(const Options& options, int steps, const std::vector<Row>& rows) {
  std::ostringstream text;
  text << "Made by `scripts/faults rate --seconds " << options.seconds << " --rate " << options.rate << "`: candidates of "
       << steps << " steps, all to be certified, from one process to the\n"
       << "certifier's. *Lost there*: candidates, by the certifier's count of gaps. *Lost back*: decisions, by gaps heard.\n"
       << "Latency from a candidate's stamp to the arrival of its answer; *gate*: of this the certifier's work on the last 1024.\n\n"
       << "| | sent | certified | other answers | answered twice | lost there | lost back | unaccounted | p50 us | p99 us "
       << "| worst us | gate p50 us | gate p99 us |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
  for (const Row& row : rows) {
    const certifier_status_v2_t& status = row.status;
    const std::int64_t unaccounted = row.sent - row.answered - status.candidates_lost - row.answers_lost;
    text << "| " << row.name << " | " << row.sent << " | " << status.by_outcome[decision_t::CERTIFIED] << " | "
         << OtherAnswers(status) << " | " << row.again << " | " << status.candidates_lost << " | " << row.answers_lost
         << " | " << unaccounted << " | " << row.p50_us << " | " << row.p99_us << " | " << row.worst_us << " | " << status.elapsed_p50_us << " | "
         << status.elapsed_p99_us << " |\n";
  }
  return text.str();
}

// What is sent is answered once or counted as lost. In a short run a busy machine may have kept the load below what was asked.
bool AddsUp(const Options& options, const Row& row) {
  const bool whole_load = options.seconds < 10 || static_cast<double>(row.sent) >= 0.99 * row.asked;
  return row.again == 0 && row.answered + row.answers_lost == row.status.candidates &&
         row.status.candidates + row.status.candidates_lost == row.sent && whole_load;
}

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("Full-size candidates at a steady rate through the certifier; says what is answered and what the bus loses.",
               "forereach_rate_processes");
  app.add_option("--seconds", options.seconds, "How long, for each row")->capture_default_str();
  app.add_option("--rate", options.rate, "Candidates a second")->capture_default_str();
  AddReportOption(app, options.report);
  CLI11_PARSE(app, argc, argv);
  const ScratchDirectory scratch;
  Config config = LoadConfig(scratch.Write("task.yaml", DemoTask(kGate)));
  const int steps = MostSteps(config);
  const std::string key = MakeTestKeys(scratch / "keys"), url = PrivateBusUrl();
  std::vector<Row> rows;
  for (const bool small : {false, true})
    for (const bool is_signed : {false, true}) {
      config.bus.url = url + (small ? "&recv_buf_size=212992" : "");
      config.bus.key = is_signed ? key : "";
      const std::string name = std::string(is_signed ? "signed" : "unsigned") + (small ? ", receive buffers of 208 kB" : "");
      rows.push_back(Measure(options, name, config, steps));
    }
  Publish(options.report, "rate", Table(options, steps, rows));
  return std::ranges::all_of(rows, [&](const Row& row) { return AddsUp(options, row); }) ? 0 : 1;
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) { return forereach::Main(argc, argv); }
