/** forereach_hostile_page [any|crowd]: serves a live page of messages whose texts try to become elements and scripts,
and whose numbers are the largest there are. Prints its address, and ends with its standard input. With `any` it answers
each line of that, a seed, with a line of news, after messages whose fields hold any numbers. With `crowd` it prints the
most memory that a page takes for 200,000 learned transitions, and then for sets of 4,096 obstacles, each another one;
the exit is 1 above 256 MiB. */
#include <cstdio>
#include <iostream>
#include <limits>
#include <random>
#include <string>
#include <string_view>

#include <sys/resource.h>

#include "live/web_server.h"
#include "tests/any_fields.h"
#include "tests/live/live_fixture.h"
#include "tests/messages.h"
#include "tests/records/long_course.h"
#include "tests/scratch.h"

namespace forereach {
namespace {

constexpr const char* kEvil = "</script><img src=x onerror=window.hacked=1>";

template <class Message>
LogEvent EventOf(const std::string& channel, const Message& message) {
  const auto bytes = Encode(message);
  return {0, 1, channel, {bytes.begin(), bytes.end()}};
}

void SendHostile(Watcher& watcher) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  decision_t decision{};
  fault_t fault{};
  withdrawal_t withdrawal{};
  execution_event_t event{};
  candidate_plan_t candidate{};
  certifier_status_t status{};
  logger_status_t logger{};
  SetText(decision.source, kEvil), SetText(decision.message, kEvil), SetText(fault.message, kEvil);
  SetText(withdrawal.message, kEvil), SetText(event.message, kEvil), SetText(candidate.source, kEvil);
  SetText(status.message, kEvil), SetText(logger.message, kEvil);
  status.state = certifier_status_t::ARMED, status.level = certifier_status_t::ERROR;
  for (std::int64_t sequence : {std::int64_t{0}, std::int64_t{7}, kMost}) {
    for (const std::int16_t outcome : std::initializer_list<std::int16_t>{0, 1, 2, 3, 4, 5, 6, 7, 99}) {
      decision.utime = decision.plan_id = decision.sequence = sequence;
      decision.outcome = decision.cause = outcome;
      decision.step = decision.obstacle = std::numeric_limits<std::int16_t>::max();
      decision.margin = std::numeric_limits<double>::infinity();
      decision.elapsed_us = std::numeric_limits<double>::quiet_NaN();
      watcher.Take(EventOf("PLAN_DECISION", decision));
    }
    fault.utime = fault.sequence = withdrawal.utime = withdrawal.sequence = event.utime = event.sequence = sequence;
    candidate.utime = candidate.sequence = status.utime = status.sequence = sequence;
    withdrawal.plan_id = sequence;
    watcher.Take(EventOf("FAULT", fault));
    watcher.Take(EventOf("PLAN_WITHDRAWN", withdrawal));
    watcher.Take(EventOf("EXECUTION_EVENT", event));
    watcher.Take(EventOf("PLAN_CANDIDATE", candidate));
    watcher.Take(EventOf("CERTIFIER_STATUS", status));
    watcher.Take(EventOf("LOGGER_STATUS", logger));
  }
  for (const double far : {1e308, -1e308, 1e12, 1.0}) {
    robot_state_t state{.mode = robot_state_t::EXECUTING,
                        .num_states = static_cast<std::int16_t>(CourseTask().problem->model->num_states())};
    state.executing_plan_id = state.sequence = kMost;
    std::fill_n(state.state, state.num_states, far);
    watcher.Take(EventOf("ROBOT_STATE", state));
    watcher.Tick(static_cast<std::int64_t>(far > 0 ? kMost : -kMost));
  }
}

// News of the recorded course, some of whose messages hold any numbers.
void TellAny(Watcher& watcher) {
  const std::vector<LogEvent> events = CourseEvents();
  Watcher::Cursor cursor;
  std::string line;
  for (std::size_t next = 0; std::getline(std::cin, line);) {
    std::mt19937_64 random(std::stoull(line));
    for (std::size_t count = 1 + random() % 16; count > 0; --count) {
      const LogEvent& event = events[next++ % events.size()];
      watcher.Take(random() % 2 ? event : AnyEvent(random, event));
    }
    watcher.Tick(random() % 4 ? events[next % events.size()].utime : static_cast<std::int64_t>(random()));
    std::cout << watcher.Since(cursor) << std::endl;
  }
}

bool HasRoomForACrowd(Watcher& watcher) {
  const ScratchDirectory scratch;
  const std::string log = scratch / "long.lcmlog";
  WriteLongCourse(log, 2'703, nullptr, Rounds::kLearn);  // of 74 transitions that are learned
  std::vector<LogEvent> last;
  std::int64_t tick = 0;
  static_cast<void>(ForEachEvent({log}, [&](const LogEvent& event, const std::string&) {
    watcher.Take(event);
    if (event.utime >= tick) watcher.Tick(tick = event.utime), tick += 10 * Watcher::kTickUs;
    if (event.channel == "PLAN_DECISION") last = {event};
  }));
  const auto most = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss >> 10;
  };
  const auto learned = most();
  Crowd crowd(watcher, 4096, last);
  for (int i = 0; i < 300; ++i) {
    crowd.Decide();
    if (i % 10 == 0) watcher.Tick(tick += Watcher::kTickUs);
  }
  std::printf("%ld MiB, then %ld MiB\n", learned, most());
  return most() <= 256;
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) {
  using namespace forereach;
  Config task = CourseTask();
  task.path = kEvil;
  Watcher watcher(task, {}, CourseTask);
  watcher.Tick(1);
  if (argc > 1 && std::string_view(argv[1]) == "crowd") return HasRoomForACrowd(watcher) ? 0 : 1;
  const WebServer server(watcher, 0);
  std::cout << "http://127.0.0.1:" << server.port() << "/" << std::endl;
  if (argc > 1) return TellAny(watcher), 0;
  SendHostile(watcher);
  std::cin.get();
}
