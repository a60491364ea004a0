// The fault campaign: real processes on a real loopback bus are killed, stopped, lied to, flooded and cut off, and
// after each try a witness says whether anything happened that may never happen. Writes a table.
#include <algorithm>
#include <iostream>
#include <sstream>
#include <utility>

#include "tests/faults/kind.h"
#include "tests/faults/report.h"

namespace forereach {
namespace {

struct Options {
  std::string report = "docs/reliability.md", only;
  bool allow_untried = false;
};

// What `--only` names. CMakeLists.txt reads this table: each kind is a test.
const std::vector<std::pair<const char*, void (*)(Campaign&)>> kKinds{
    {"kill", Kills},          {"clock", Clocks},        {"stop", Stops},         {"network", Networks},
    {"lies", Lies},           {"nonsense", Nonsense},   {"latch", LatchedKills}, {"statedisk", StateDisks},
    {"strangers", Strangers}, {"obstacles", Obstacles}, {"moving", Moving},      {"times", Times},
    {"senders", Senders},     {"forgeries", Forgeries}, {"keys", Keys},          {"send", Sends},
    {"flood", Floods},        {"datagrams", Datagrams}, {"disks", Disks},        {"gone", Gone},
    {"route", Routes},        {"reload", Reloads}};

// What is not as in a clean row, then its remark.
std::string OutcomeInWords(const Row& row) {
  std::string text;
  const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
  if (row.forbidden > 0) add("FORBIDDEN in " + std::to_string(row.forbidden));
  if (!row.lost_by_logger) add("no log to compare");
  if (row.lost_by_logger.value_or(0) != 0) add(std::to_string(*row.lost_by_logger) + " LOST");
  if (row.said_why > 0) add(std::to_string(row.said_why) + " did not start and said why");
  if (row.recovered + row.said_why != row.tries) add("only " + std::to_string(row.recovered) + " RECOVERED");
  if (!row.remark.empty()) add(row.remark);
  return text;
}

std::string Table(const Campaign& campaign, const Options& options) {
  std::ostringstream text;
  text << "Made by `scripts/faults --kills " << campaign.kills << " --others " << campaign.others << " --flood "
       << campaign.floods << " --seed " << campaign.seed << (options.only.empty() ? "" : " --only " + options.only)
       << (options.allow_untried ? " --allow-untried" : "") << R"(`. *Forbidden* is one of these:
- the robot executed an uncertified plan, or a control that is not of its plan, outside its slice, or withdrawn;
- a candidate was answered twice, or not at all where the bus loses nothing;
- a process ended unexpectedly, or not properly within 5 s of SIGTERM;
- the certifier did not latch a jump of its clock or a state outside its slice, certified before the reset or while it
  could not write faults, or forgot a fault at a restart;
- a plan was certified under other obstacles than the perceived ones, or on states of a clock that is off;
- a required refusal or message was missing, or the logs and the database disagreed at the end;
- a process grew by 48 MB under raw datagrams (its row says so if one grew by more than 1 MB).

*Lost* is an event that the logger had confirmed and that its repaired logs do not hold. *Recovered*: within 20 s, after a
reset where a fault was latched, the certifier is OK, the robot executes a newly certified plan, and the logger records.
**Unless its row says otherwise, nothing forbidden happened in any try, nothing was lost, and all tries recovered.**

| fault | tries | |
|---|---:|---|
)";
  for (const Row& row : campaign.rows)
    text << "| " << row.fault << " | " << row.tries << " | " << OutcomeInWords(row) << " |\n";
  return text.str();
}

bool IsClean(const Row& row, const Options& options) {
  if (row.tries == 0) return options.allow_untried;
  return row.forbidden == 0 && row.lost_by_logger.value_or(0) == 0 && row.recovered + row.said_why == row.tries;
}

int Main(int argc, char** argv) {
  Campaign campaign;
  Options options;
  const NumberRange some{1, 10'000'000};
  std::vector<std::string> kinds;
  for (const auto& [name, run] : kKinds) kinds.emplace_back(name);
  const Command program{
      .name = "forereach_faults",
      .purpose = "Hurts the four processes in every way it knows, and says what happened.",
      .options = {
          {.name = "--kills", .variable = &campaign.kills, .help = "SIGKILLs in all", .range = some},
          {.name = "--others", .variable = &campaign.others, .help = "Tries of each other fault", .range = some},
          {.name = "--flood", .variable = &campaign.floods, .help = "Candidates in the flood", .range = some},
          {.name = "--seed", .variable = &campaign.seed, .help = "Of the random moments"},
          ReportOption(options.report),
          {.name = "--only", .variable = &options.only, .help = "One kind of faults", .one_of = kinds},
          {.name = "--allow-untried",
           .variable = &options.allow_untried,
           .help = "What cannot be tried here, without root, is no failure"}}};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  campaign.random.seed(campaign.seed);
  for (const auto& [name, run] : kKinds)
    if (options.only.empty() || options.only == name) run(campaign);
  Publish(options.report, "faults", Table(campaign, options));
  for (const Row& row : campaign.rows)
    if (row.tries == 0) std::cerr << row.fault << ": " << row.remark << "\n";
  return std::ranges::all_of(campaign.rows, [&](const Row& row) { return IsClean(row, options); }) ? 0 : 1;
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) { return forereach::Main(argc, argv); }
