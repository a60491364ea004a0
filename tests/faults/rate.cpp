// A thousand full-size candidates a second through the certifier's process on a real loopback bus: what is answered,
// what the bus loses, how long an answer takes. Writes a table.
#include <algorithm>
#include <optional>
#include <sstream>

#include "bus/authentic.h"
#include "certifier/gate/candidate_message.h"
#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "forereach/decision_t.hpp"
#include "lcmtypes/names.h"
#include "tests/faults/demo_task.h"
#include "tests/faults/flood.h"
#include "tests/faults/load.h"
#include "tests/faults/report.h"
#include "tests/keys.h"
#include "tests/process/process_fixture.h"

namespace forereach {
namespace {

// Without a robot, and patient with a busy machine.
constexpr const char* kGate =
    "{max_age_ms: 20000, certificate_lifetime_ms: 60000, arming: none, max_clock_jump_ms: 10000,\n"
    "  obstacles: task, require_stop: false}";

struct Options {
  double seconds = 20, rate = 1000, flood = 0;
  std::string report = "docs/reliability.md";
};

struct Row {
  std::string name;
  double flood_per_s = 0;  // reached
  double asked = 0;
  std::int64_t sent = 0, answered = 0, again = 0, answers_lost = 0;
  double p50_us = 0, p99_us = 0, worst_us = 0;
  certifier_status_t status{};
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
    if (certifier.Certify(PlanOf(candidate), InitialSetOf(candidate), config.obstacles, tube).outcome ==
        Outcome::kCertified)
      return steps;
  }
  throw std::runtime_error("nothing is certified");
}

using Payloads = std::vector<std::vector<std::uint8_t>>;

// What a stranger can send: unsigned and random trailers, genuine messages once more, genuine trailers behind altered
// bodies.
Payloads Forgeries(const Config& config, const Payloads& genuine, std::size_t body_bytes) {
  constexpr int kEach = 32;
  Payloads payloads;
  Signer stranger(TestKeys("stranger"), config.bus.bus_name());
  const std::vector<std::uint8_t> body(body_bytes);
  for (int i = 0; i < kEach; ++i) {
    payloads.push_back(stranger.Sign(Role::kPlanner, config.bus.candidate, body, WallClockUs()));
    payloads.push_back(body);
    if (genuine.empty() || body_bytes < genuine.front().size() / 2) continue;
    payloads.push_back(genuine[static_cast<std::size_t>(i) % genuine.size()]);
    payloads.push_back(payloads.back());
    payloads.back()[100] ^= 1;
  }
  return payloads;
}

Row Measure(const Options& options, const std::string& name, Config config, int steps, std::size_t flood_bytes = 0) {
  Row row{.name = name};
  std::vector<std::string> command{FOREREACH_CERTIFIER, "--config", config.path,           "--lcm-url",
                                   config.bus.url,      "--state",  config.path + ".state"};
  if (!config.bus.key.empty()) command.insert(command.end(), {"--key", config.bus.key});
  ChildProcess certifier(command);
  if (!certifier.WaitForLog("ready on")) throw std::runtime_error(certifier.error());
  Load load(config, [&](std::int64_t) { return Standing(config, steps); });
  Payloads genuine;  // candidates as they are on the bus
  auto ear = OpenBus(config.bus.url);
  if (flood_bytes > 0)
    ear->Subscribe(config.bus.candidate, [&](const Received& r) { genuine.emplace_back(r.raw.begin(), r.raw.end()); });
  load.Begin();
  ear->Dispatch(50);
  ear.reset();
  std::optional<ForgedFlood> flood;
  if (flood_bytes > 0)
    flood.emplace(config.bus.url, config.bus.candidate, Forgeries(config, genuine, flood_bytes), options.flood);
  const std::int64_t begin = SteadyClockUs();
  load.Start(options.rate);
  load.ListenUntil(begin + static_cast<std::int64_t>(options.seconds * 1e6));
  row.asked = options.rate * static_cast<double>(SteadyClockUs() - begin) * 1e-6;
  if (flood)
    row.flood_per_s = static_cast<double>(flood->sent()) / (static_cast<double>(SteadyClockUs() - begin) * 1e-6);
  flood.reset();
  load.Finish();
  std::vector<double> latencies = load.TakeLatencies();
  row.p50_us = Percentile(latencies, 0.5), row.p99_us = Percentile(latencies, 0.99),
  row.worst_us = Percentile(latencies, 1);
  row.sent = load.sent(), row.answered = load.answered(), row.again = load.answered_again();
  row.answers_lost = load.answers_lost();
  row.status = load.status();
  return row;
}

// Counted by cause.
std::string OtherAnswers(const certifier_status_t& status) {
  std::string text;
  for (std::size_t cause = 1; cause < std::size(status.by_cause); ++cause)
    if (status.by_cause[cause] > 0)
      text += (text.empty() ? "" : ", ") + std::to_string(status.by_cause[cause]) + " " +
              std::string(CauseName(static_cast<std::int16_t>(cause)));
  return text.empty() ? "0" : text;
}

std::string Table(const Options& options, int steps, const std::vector<Row>& rows) {
  std::ostringstream text;
  text << "Made by `scripts/faults rate --seconds " << options.seconds << " --rate " << options.rate
       << "`: candidates of " << steps << " steps, all certifiable, from one process to the\n"
       << "certifier's. *Lost there*: candidates, by the certifier's count of gaps. *Lost back*: decisions, by gaps in "
          "their sequence.\n"
       << "Latency is from a candidate's stamp to the arrival of its answer; *gate* is the certifier's part of it, "
          "over the last 1024.\n"
       << "\n"
       << "| | sent | certified | other answers | answered twice | lost there | lost back | unaccounted | p50 us | p99 "
          "us "
       << "| worst us | gate p50 us | gate p99 us "
          "|\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
  for (const Row& row : rows) {
    const certifier_status_t& status = row.status;
    const std::int64_t unaccounted = row.sent - row.answered - status.candidates_lost - row.answers_lost;
    text << "| " << row.name << " | " << row.sent << " | " << status.by_outcome[decision_t::CERTIFIED] << " | "
         << OtherAnswers(status) << " | " << row.again << " | " << status.candidates_lost << " | " << row.answers_lost
         << " | " << unaccounted << " | " << row.p50_us << " | " << row.p99_us << " | " << row.worst_us << " | "
         << status.elapsed_p50_us << " | " << status.elapsed_p99_us << " |\n";
  }
  return text.str();
}

std::string FloodTable(const Options& options, const std::vector<Row>& rows) {
  std::ostringstream text;
  text << "Made by `scripts/faults rate --flood " << options.flood << " --rate " << options.rate << " --seconds "
       << options.seconds << "`: signed candidates of 12 steps to the certifier's process, while\n"
       << "a sender without a key floods the same channel with forged messages: with another robot's signatures, "
          "without signatures, and, where\n"
       << "they are as long as a candidate, also repeated genuine ones and altered bodies with genuine trailers. "
          "*Forged*: the rate reached, a\n"
       << "second. *Lost*: candidates, by the certifier's count of gaps, and decisions, by gaps in their sequence.\n"
       << "\n"
       << "| flood | forged | refused | sent | certified | other answers | lost there | lost back | p50 us | p99 us | "
          "worst us |\n"
       << "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
  for (const Row& row : rows) {
    const certifier_status_t& status = row.status;
    text << "| " << row.name << " | " << static_cast<std::int64_t>(row.flood_per_s) << " | "
         << status.refused_unsigned + status.refused_forged + status.refused_replayed << " | " << row.sent << " | "
         << status.by_outcome[decision_t::CERTIFIED] << " | " << OtherAnswers(status) << " | " << status.candidates_lost
         << " | " << row.answers_lost << " | " << row.p50_us << " | " << row.p99_us << " | " << row.worst_us << " |\n";
  }
  return text.str();
}

int MeasureFlood(const Options& options, Config config) {
  const ScratchDirectory scratch;
  config.bus.url = PrivateBusUrl();
  config.bus.key = MakeTestKeys(scratch / "keys");
  constexpr int kSteps = 12;
  std::vector<Row> rows{Measure(options, "none", config, kSteps)};
  for (const std::size_t bytes : {std::size_t{64}, std::size_t{1000}, EncodedSize<candidate_plan_t>()})
    rows.push_back(Measure(options, std::to_string(bytes) + " bytes", config, kSteps, bytes));
  Publish(options.report, "forged flood", FloodTable(options, rows));
  return std::ranges::all_of(
             rows, [](const Row& row) { return row.again == 0 && row.status.by_outcome[decision_t::CERTIFIED] > 0; })
             ? 0
             : 1;
}

// What is sent is answered once or counted as lost. In a short run a busy machine may have kept the load below what was
// asked.
bool AddsUp(const Options& options, const Row& row) {
  const bool whole_load = options.seconds < 10 || static_cast<double>(row.sent) >= 0.99 * row.asked;
  return row.again == 0 && row.answered + row.answers_lost == row.status.candidates &&
         row.status.candidates + row.status.candidates_lost == row.sent && whole_load;
}

int Main(int argc, char** argv) {
  Options options;
  const Command program{
      .name = "forereach_rate_processes",
      .purpose =
          "Full-size candidates at a steady rate through the certifier; says what is answered and what the bus "
          "loses.",
      .options = {{.name = "--seconds", .variable = &options.seconds, .help = "How long, for each row"},
                  {.name = "--rate", .variable = &options.rate, .help = "Candidates a second"},
                  {.name = "--flood",
                   .variable = &options.flood,
                   .help = "Forged messages a second beside them: says what becomes of the honest ones"},
                  ReportOption(options.report)}};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  const ScratchDirectory scratch;
  Config config = LoadConfig(scratch.Write("task.yaml", DemoTaskWithGate(kGate)));
  if (options.flood > 0) return MeasureFlood(options, config);
  const int steps = MostSteps(config);
  const std::string key = MakeTestKeys(scratch / "keys"), url = PrivateBusUrl();
  std::vector<Row> rows;
  for (const bool small : {false, true})
    for (const bool is_signed : {false, true}) {
      config.bus.url = url + (small ? "&recv_buf_size=212992" : "");
      config.bus.key = is_signed ? key : "";
      const std::string name =
          std::string(is_signed ? "signed" : "unsigned") + (small ? ", receive buffers of 208 kB" : "");
      rows.push_back(Measure(options, name, config, steps));
    }
  Publish(options.report, "rate", Table(options, steps, rows));
  return std::ranges::all_of(rows, [&](const Row& row) { return AddsUp(options, row); }) ? 0 : 1;
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) { return forereach::Main(argc, argv); }
