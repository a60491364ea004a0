/** forereach_page_samples hostile|many|empty FILE.html [COUNT]: pages of invented runs, for tests in a browser.
forereach_page_samples any FILE.lcmlog SEED: a log of the recorded course, some of whose messages hold any numbers. */
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <limits>
#include <random>
#include <string>

#include "page/detail.h"
#include "page/write.h"
#include "tests/any_fields.h"
#include "tests/records/course.h"

namespace forereach {
namespace {

constexpr std::int64_t kBegin = 1'767'268'800'000'000;  // 2026-01-01 12:00 UTC

std::string Digest(std::mt19937_64& random) {
  std::string hex;
  for (int i = 0; i < 64; ++i) hex += "0123456789abcdef"[random() % 16];
  return hex;
}

PageRun Many(int count) {
  std::mt19937_64 random(1);
  std::lognormal_distribution<double> took(6, 0.8);
  PageRun run;
  run.name = "many";
  const std::string configs[] = {Digest(random), Digest(random)};
  for (int i = 0; i < count; ++i) {
    DecisionRow row{.event = {"events-20260101-120000-000000.lcmlog", 5 * i, Digest(random)},
                    .utime = kBegin + i * 400'000ll + static_cast<std::int64_t>(random() % 90'000)};
    row.sequence = row.plan_id = i;
    row.source = "planner " + std::to_string(random() % 3);
    row.elapsed_us = took(random);
    row.latency_us = row.elapsed_us + 200;
    row.plan_digest = Digest(random);
    row.grounds = {configs[i % 7 == 0], configs[0], configs[0], configs[1], configs[i % 100 == 0]};
    row.margin = 1e-3 * static_cast<double>(random() % 3000);
    row.threshold = 0.5;
    const auto kind = random() % 100;
    if (kind < 60) {
      row.outcome = "certified", row.cause = "none";
      row.obstacle = static_cast<int>(random() % 12);
    } else if (kind < 85) {
      row.outcome = "abstain_safety", row.cause = kind < 80 ? "obstacle" : "limit";
      row.obstacle = static_cast<int>(random() % 12), row.step = static_cast<int>(random() % 60);
    } else if (kind < 95) {
      row.outcome = "abstain_domain", row.cause = "domain_exit", row.coordinate = 4;
      row.step = static_cast<int>(random() % 60);
    } else {
      row.outcome = "rejected", row.cause = "stale";
    }
    row.message =
        row.outcome + " at step " + std::to_string(row.step) + ", margin " + std::to_string(row.margin) + " m";
    run.decisions.emplace_back(row);
  }
  return run;
}

// Texts that try to become elements, scripts and line ends, and numbers that are none.
PageRun Hostile() {
  const std::string evil =
      "</script><script>window.hacked=1</script><img src=x onerror='window.hacked=2'>\n\xe2\x80\xae\xff\x1b[31m";
  const double infinity = std::numeric_limits<double>::infinity();
  PageRun run = Many(20);
  run.name = evil;
  run.notes = {evil};
  for (PageDecision& row : run.decisions) {
    row.source = evil, row.message = evil, row.outcome = evil, row.cause = "__proto__";
    row.log_file = evil;
  }
  const auto at = [&](std::size_t i) -> PageDecision& { return run.decisions[i]; };
  at(0).utime = at(0).plan_id = std::numeric_limits<std::int64_t>::min();
  at(1).utime = at(1).plan_id = at(1).event_number = std::numeric_limits<std::int64_t>::max();
  at(2).margin = infinity, at(2).threshold = -infinity, at(2).elapsed_us = std::numeric_limits<float>::infinity();
  at(3).margin = at(3).latency_us = std::nanf("");
  at(4).step = std::numeric_limits<int>::max(), at(4).outcome = "abstain_safety";
  at(5).outcome = "constructor", at(5).coordinate = 77;
  at(6).obstacle = std::numeric_limits<int>::min(), at(6).step = std::numeric_limits<int>::min();
  run.faults.push_back({std::numeric_limits<std::int64_t>::min(), 3, evil, evil});
  run.withdrawals.push_back({0, -1, evil, evil, evil, 7});
  run.gaps.push_back({-1, std::numeric_limits<std::int64_t>::max(), evil, evil, evil});
  run.events.push_back({5, 7, evil});
  run.tasks = {{ToHex(at(0).grounds[0]), evil, {evil}, {evil}, evil, 2}};
  run.parts = {{evil, {{evil, evil}}, run.decisions.size()}};
  PageDetail detail{.decision = 4, .task = 0};
  detail.start_utime = detail.step_us = std::numeric_limits<std::int64_t>::max();
  detail.binding = detail.steps = std::numeric_limits<int>::max();
  detail.hull_lower = {-infinity}, detail.hull_upper = {infinity};
  detail.executed = {{3, 1e308, -1e308}};
  static_cast<void>(DrawTube(
      {{{{0, 0}, {1, 0}, {0, 1}}}, {}, {{{2, 2}}}}, {},
      {Obstacle::Circle(Eigen::Vector2d(1e300, 0), 1e300), Obstacle::HalfSpace(Eigen::Vector2d(1e-300, 1), 1e300)}, -1,
      detail));
  run.details.push_back(detail);
  detail.decision = 5;
  detail.missing = evil;
  run.details.push_back(detail);
  run.advice = {{4, "", {{evil, true, {evil, ""}}}}, {5, evil, {}}, {6, "", {}}};
  return run;
}

void WriteAny(const std::string& path, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  EventLogReader reader(kCourseLog);
  EventLogWriter writer(path);
  LogEvent event;
  while (reader.Next(event) == LogStatus::kEvent) {
    const LogEvent taken = random() % 4 ? event : AnyEvent(random, event);
    writer.Append(taken.utime, taken.channel, taken.data);
  }
  if (!writer.Flush()) throw LogError(writer.problem());
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) {
  using namespace forereach;
  const std::string kind = argc > 2 ? argv[1] : "";
  if (kind != "hostile" && kind != "many" && kind != "empty" && (kind != "any" || argc < 4)) {
    std::cerr << "usage: forereach_page_samples hostile|many|empty FILE.html [COUNT], or any FILE.lcmlog SEED\n";
    return 2;
  }
  if (kind == "any") return WriteAny(argv[2], std::stoull(argv[3])), 0;
  const PageRun run = kind == "hostile" ? Hostile()
                      : kind == "many"  ? Many(argc > 3 ? std::stoi(argv[3]) : 100'000)
                                        : PageRun{};
  std::ofstream(argv[2], std::ios::binary) << PageHtml(run);
  return 0;
}
