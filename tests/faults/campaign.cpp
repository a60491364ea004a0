// The fault campaign: real processes on a real loopback bus are killed, stopped, lied to, flooded and cut off, and
// after each try a witness says whether anything happened that may never happen. Writes a table.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <thread>

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>
#include "bus/process.h"
#include "certifier/gate/candidate_message.h"
#include "command_line/progress.h"
#include "forereach/advice_t.hpp"
#include "forereach/command_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/obstacles_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "tests/faults/demo_task.h"
#include "tests/faults/relay.h"
#include "tests/faults/report.h"
#include "tests/faults/rig.h"
#include "tests/keys.h"
#include "tests/paths.h"
#include "tests/process/raw_datagrams.h"

namespace forereach {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::chrono::seconds kAnewIfBackBy{-5};  // a shorter jump back is waited out
constexpr std::chrono::seconds kSaysSoon{3};       // some heartbeats
constexpr milliseconds kHeartbeat{600};            // at least one
constexpr std::size_t kMostHeard = 2000;           // messages that are kept to be sent again
constexpr double kMayGrowBy = 48 << 20;            // a queue full of honest messages is in it
constexpr std::chrono::seconds kStarts{10};        // a process that was started has spoken

struct Row {
  std::string fault;
  int tries = 0;                               // 0: it cannot be tried here, the remark says why
  std::size_t forbidden = 0;                   // what may never happen, and did
  std::optional<std::int64_t> lost_by_logger;  // Rig::TakeLost; nothing: no logger ran
  int recovered = 0, said_why = 0;             // of the tries
  std::string remark;
};

struct Options {
  int kills = 1000, floods = 100'000, others = 20;
  unsigned seed = 1;
  std::string report = "docs/reliability.md", only;
  bool allow_untried = false;
};

class Campaign final {
 public:
  explicit Campaign(const Options& options) : options_(options), random_(options.seed) {}

  using Kind = std::pair<const char*, void (Campaign::*)()>;
  /** What `--only` names. */
  static const std::vector<Kind> kKinds;

  std::vector<Row> Run() {
    for (const auto& [name, run] : kKinds)
      if (options_.only.empty() || options_.only == name) (this->*run)();
    return rows_;
  }

 private:
  using Heard = std::vector<std::pair<std::string, std::vector<std::uint8_t>>>;  // channel, bytes

  int Below(int bound) { return static_cast<int>(random_() % static_cast<unsigned>(bound)); }

  // `hurt` does something to a healthy system; then it has to heal. Where the bus loses messages it may lose decisions.
  void Try(Row& row, Rig& rig, const std::function<void()>& hurt, bool bus_loses) {
    ++row.tries;
    const std::int64_t before = rig.witness().unheard();
    hurt();
    DemandNothingForbidden(row, rig);
    const std::string why = rig.Heal();
    DemandNothingForbidden(row, rig);
    const std::int64_t unheard = rig.witness().unheard() - before;
    Demand(row, bus_loses || unheard <= 0, std::to_string(unheard) + " candidates counted, their decisions not heard");
    CountLost(row, rig);
    if (why.empty())
      ++row.recovered;
    else
      std::cerr << row.fault << ": " << why << "\n", Remark(row, why);
    progress_->Advance();
  }

  // So many of them, with a system that is healthy at first.
  void Tries(Row& row, Rig& rig, const std::function<void(int)>& hurt, int tries, bool bus_loses = false) {
    if (HealAtFirst(row, rig))
      for (int i = 0; i < tries; ++i)
        Try(
            row, rig, [&] { hurt(i); }, bus_loses);
    rig.EndAll();
    CountLost(row, rig);
    DemandNothingForbidden(row, rig);
    for (const std::string& amiss : rig.CheckRecords()) Demand(row, false, amiss);
  }

  static void CountLost(Row& row, Rig& rig) { row.lost_by_logger = row.lost_by_logger.value_or(0) + rig.TakeLost(); }

  // What has to be seen in a try.
  static void Demand(Row& row, bool seen, const std::string& what) {
    if (seen) return;
    std::cerr << row.fault << ": FORBIDDEN: " << what << "\n";
    ++row.forbidden;
  }

  // Nothing that the witness tells, and no process that ended by itself or badly.
  static void DemandNothingForbidden(Row& row, Rig& rig) {
    for (const std::string& violation : rig.witness().TakeViolations()) Demand(row, false, violation);
    for (const std::string& ending : rig.TakeBadEndings()) Demand(row, false, ending);
  }

  // The system has to be healthy before it can be hurt; if it is not, that is a try it has not recovered from.
  static bool HealAtFirst(Row& row, Rig& rig) {
    const std::string why = rig.Heal();
    DemandNothingForbidden(row, rig);
    if (why.empty()) return true;
    ++row.tries;
    Remark(row, "never began: " + why);
    return false;
  }

  static void Remark(Row& row, const std::string& text) { row.remark += (row.remark.empty() ? "" : "; ") + text; }

  Row& Begin(const std::string& fault, int tries) {
    std::cerr << fault << "\n";
    rows_.emplace_back().fault = fault;
    progress_ = std::make_unique<Progress>("tries", static_cast<std::size_t>(tries));
    return rows_.back();
  }

  void NotTried(const std::string& fault, const std::string& why) {
    rows_.emplace_back().fault = fault;
    Remark(rows_.back(), "not tried: " + why);
  }

  void Signals(const std::string& fault, int signal, int tries) {
    Rig rig(DemoTask());
    Row& row = Begin(fault, tries);
    Tries(
        row, rig,
        [&](int i) {
          const auto role = static_cast<Rig::Role>(i % Rig::kRoles);
          rig.Listen(milliseconds(Below(120)));
          if (signal == SIGKILL) return rig.End(role, SIGKILL);
          rig.Signal(role, signal);
          rig.Listen(milliseconds(Below(2000)));
          rig.Signal(role, SIGCONT);
        },
        tries);
  }

  void Kills() { Signals("SIGKILL at a random moment", SIGKILL, options_.kills); }
  void Stops() { Signals("SIGSTOP for up to 2 s", SIGSTOP, options_.others * 2); }

  // 0.3 s to an hour, forward or backward.
  microseconds Jump() {
    const double seconds = 0.3 * std::pow(3600 / 0.3, std::uniform_real_distribution<double>(0, 1)(random_));
    return microseconds(std::llround((Below(2) == 0 ? 1e6 : -1e6) * seconds));
  }

  // It is said on FAULT, and nothing certified until the reset that Heal sends.
  static void DemandLatched(Row& row, Rig& rig, std::int16_t cause) {
    const auto& fault = rig.witness().fault();
    Demand(row, fault && fault->cause == cause, "the certifier latched no " + std::string(FaultName(cause)));
    Demand(row, rig.witness().certificates_since_fault() == 0, "it certified before the reset");
  }

  void Clocks() {
    for (const Rig::Role role : {Rig::kCertifier, Rig::kPlanner, Rig::kRobot, Rig::kLogger}) OneClock(role);
    AllClocks();
  }

  // For a second one process is at odds with the others.
  void OneClock(Rig::Role role) {
    Rig rig(DemoTask(), {.settable_clocks = true});
    Row& row = Begin(std::string("The clock of the ") + Rig::kNames[role] + " jumps by 0.3 s to an hour, and back",
                     options_.others);
    Tries(
        row, rig,
        [&](int) {
          rig.SetClock(role, Jump());
          rig.Listen(milliseconds(1000));
          rig.SetClock(role, microseconds(0));
          rig.Listen(milliseconds(200));
          if (role == Rig::kCertifier) DemandLatched(row, rig, fault_t::CLOCK_JUMP);
        },
        options_.others);
  }

  // As when the machine's clock is set. Whoever begins after it went back signs with times that were used before it
  // did, so all begin anew.
  void AllClocks() {
    Rig rig(DemoTask(), {.settable_clocks = true});
    Row& row = Begin("All clocks jump by 0.3 s to an hour, and stay", options_.others);
    microseconds offset(0);
    int anew = 0;
    Tries(
        row, rig,
        [&](int) {
          const microseconds jump = Jump();
          rig.SetClocks(offset += jump);
          rig.Listen(milliseconds(1000));
          DemandLatched(row, rig, fault_t::CLOCK_JUMP);
          if (jump < kAnewIfBackBy) rig.EndAll(), ++anew;
        },
        options_.others);
    Remark(row, std::to_string(anew) + " times back by more than 5 s: all started again");
  }

  void BadNetwork() {
    const std::vector<std::pair<std::string, Weather>> weathers{{"one message in five dropped", {.drop = 0.2}},
                                                                {"one in five sent twice", {.repeat = 0.2}},
                                                                {"one in five delayed by 60 ms", {.delay = 0.2}},
                                                                {"one in five overtaken", {.swap = 0.2}},
                                                                {"one in five with a bit flipped", {.corrupt = 0.2}},
                                                                {"all of these", {0.1, 0.1, 0.1, 0.1, 0.1, 60}},
                                                                {"none arrives for a second", {.drop = 1}}};
    for (const auto& [name, weather] : weathers) {
      Rig rig(DemoTask(), {.relayed = true});
      const BusOptions& channels = rig.config().bus;
      Relay relay(rig.url(Rig::kPlanner), rig.url(Rig::kCertifier),
                  {channels.candidate, channels.robot_state, channels.transition, channels.event, channels.command,
                   channels.obstacles},
                  options_.seed);
      std::atomic<bool> stop = false;
      std::mutex mutex;
      std::thread passing([&] {
        while (!stop) {
          const std::lock_guard lock(mutex);
          relay.Pass();
          std::this_thread::sleep_for(microseconds(200));
        }
      });
      const auto set = [&](const Weather& now) {
        const std::lock_guard lock(mutex);
        relay.SetWeather(now);
      };
      Row& row = Begin("Datagrams: " + name, options_.others);
      Tries(
          row, rig,
          [&, now = weather](int) {
            set(now);
            rig.Listen(milliseconds(1000));
            set({});
            rig.Listen(
                milliseconds(100));  // no altered message is still on its way when the heartbeats are believed again
          },
          options_.others, true);
      stop = true;
      passing.join();
      Remark(row, std::to_string(relay.spoiled()) + " messages spoiled");
    }
  }

  robot_state_t State(const Rig& rig) const {
    robot_state_t state{};
    state.utime = WallClockUs();
    state.mode = robot_state_t::STANDING;
    state.executing_plan_id = state.executing_step = -1;
    state.num_states = static_cast<std::int16_t>(rig.config().problem->model->num_states());
    return state;
  }

  // It executes the plan certified last, from a state outside its slice, by the least or by some metres.
  robot_state_t StateOutside(Rig& rig) {
    robot_state_t state = State(rig);
    const certified_plan_t& certified = *rig.witness().last_certified();
    const int step = Below(certified.plan.num_steps), k = Below(state.num_states);
    state.mode = robot_state_t::EXECUTING;
    state.executing_plan_id = certified.plan.plan_id;
    state.executing_step = static_cast<std::int16_t>(step);
    std::copy_n(certified.slice_lower[step], state.num_states, state.state);
    constexpr double kEverything = std::numeric_limits<double>::infinity();
    const double by = Below(2) * 5.0;
    state.state[k] = Below(2) == 0 ? std::nextafter(certified.slice_lower[step][k] - by, -kEverything)
                                   : std::nextafter(certified.slice_upper[step][k] + by, kEverything);
    return state;
  }

  // Signed: the liar has the key.
  void Lies() {
    Rig rig(DemoTask());
    Row& row = Begin("A robot that lies about its state (signed)", options_.others);
    std::int64_t sequence = Witness::kFirstLie;
    Tries(
        row, rig,
        [&](int) {
          for (int j = 0; j < 20; ++j) {
            robot_state_t state = State(rig);
            state.sequence = sequence++;
            state.executing_plan_id = j % 2 == 0 ? WallClockUs() : -1;
            for (int k = 0; k < state.num_states; ++k) state.state[k] = j % 5 == 4 ? 1e300 : Below(100) - 50;
            rig.bus().Publish(rig.config().bus.robot_state, state);
            rig.Listen(milliseconds(5));
          }
          robot_state_t state = StateOutside(rig);
          state.sequence = sequence++;
          rig.bus().Publish(rig.config().bus.robot_state, state);
          static_cast<void>(rig.ListenUntil([&] { return rig.witness().fault().has_value(); }, kSaysSoon));
          rig.Listen(kHeartbeat);
          DemandLatched(row, rig, fault_t::SLICE_LEFT);
        },
        options_.others);
  }

  // Until the reset that Heal sends.
  void DemandStillLatched(Row& row, Rig& rig, const fault_t& fault) {
    const std::int64_t certificates = rig.witness().certificates();
    rig.witness().Forget();
    const auto says_it = [&] {
      const auto& said = rig.witness().fault();
      const auto& status = rig.witness().status();
      return said && said->cause == fault.cause && said->utime == fault.utime &&
             GetText(said->message) == GetText(fault.message) && status && status->state == certifier_status_t::FAULT;
    };
    Demand(row, rig.ListenUntil(says_it, kStarts), "the next certifier does not say the fault again");
    rig.Listen(milliseconds(1000));
    Demand(row, rig.witness().certificates() == certificates, "the next certifier certified before the reset");
  }

  // A state outside its slice; FAULT is heard then.
  std::optional<fault_t> Provoke(Row& row, Rig& rig, std::int64_t sequence) {
    rig.witness().ForgetFault();
    robot_state_t state = StateOutside(rig);
    state.sequence = sequence;
    rig.bus().Publish(rig.config().bus.robot_state, state);
    static_cast<void>(rig.ListenUntil([&] { return rig.witness().fault().has_value(); }, kSaysSoon));
    DemandLatched(row, rig, fault_t::SLICE_LEFT);
    return rig.witness().fault();
  }

  void LatchedKills() {
    Rig rig(DemoTask());
    Row& row = Begin("SIGKILL of a certifier with a latched fault", options_.others);
    std::int64_t sequence = Witness::kFirstLie;
    Tries(
        row, rig,
        [&](int) {
          const std::optional<fault_t> fault = Provoke(row, rig, sequence++);
          rig.Listen(milliseconds(Below(30)));  // perhaps before it is on the disk
          rig.End(Rig::kCertifier, SIGKILL);
          rig.Start(Rig::kCertifier);
          if (fault) DemandStillLatched(row, rig, *fault);
        },
        options_.others);
  }

  void Strangers() {
    Rig rig(DemoTask());
    Row& row = Begin("A robot that executes what nobody certified (signed)", options_.others);
    std::int64_t sequence = Witness::kFirstLie;
    Tries(
        row, rig,
        [&](int i) {
          // As long as a plan of the certifier before it may run: 2 s, twice the age of a message, and 128 steps.
          if (i == 0) rig.Listen(std::chrono::seconds(17));
          if (i == 0 && !rig.Heal().empty()) return Demand(row, false, "it is not well after a while");
          rig.witness().ForgetFault();
          robot_state_t state = State(rig);
          state.mode = robot_state_t::EXECUTING;
          state.sequence = sequence++;
          const certified_plan_t& last = *rig.witness().last_certified();
          state.executing_plan_id = i % 2 == 0 ? WallClockUs() : last.plan.plan_id;
          state.executing_step = i % 2 == 0 ? 0 : last.plan.num_steps;
          if (i % 2 != 0) std::copy_n(last.slice_lower[last.plan.num_steps], state.num_states, state.state);
          rig.bus().Publish(rig.config().bus.robot_state, state);
          static_cast<void>(rig.ListenUntil([&] { return rig.witness().fault().has_value(); }, kSaysSoon));
          rig.Listen(kHeartbeat);
          DemandLatched(row, rig, fault_t::UNCERTIFIED_PLAN);
        },
        options_.others);
  }

  // While two senders are heard, and for the stream's timeout afterwards, every candidate is refused for that.
  void DemandNoneFor(Row& row, Rig& rig, milliseconds time, std::int16_t cause, std::int64_t& told) {
    const std::int64_t before = rig.witness().certificates();
    const auto end = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < end) {
      const auto answer = CauseOfACandidate(rig);
      Demand(row, answer == cause || answer == decision_t::CAUSE_FAULT || answer == decision_t::CAUSE_NOT_ARMED,
             "a candidate was answered " + std::string(answer ? CauseName(*answer) : "nothing") + " with two senders");
      told += answer == cause;
      rig.Listen(milliseconds(20));
    }
    Demand(row, rig.witness().certificates() == before, "it certified while two senders were heard");
  }

  static constexpr milliseconds kTwoAreThere{2000}, kIsHeard{50};
  static constexpr std::array<int, 3> kTimesTheRate{1, 3, 10};

  // The second one was left running, and sees nothing.
  void TwoPerceptions() {
    std::int64_t told = 0;
    ObstacleTries(
        "Two senders of OBSTACLES with one key, the second sees nothing, at 1, 3 and 10 times the rate (signed)",
        [&](Row& row, Rig& rig, int i) {
          GateOptions faster = rig.config().gate;
          faster.obstacles_timeout_ms /= kTimesTheRate[static_cast<std::size_t>(i) % kTimesTheRate.size()];
          const Perception second(OpenBusOfAllRoles(rig.config().bus), rig.config().bus.obstacles, faster, {});
          if (i % 2 == 1) rig.End(Rig::kCertifier, SIGKILL), rig.Start(Rig::kCertifier);
          rig.Listen(i % 2 == 1 ? milliseconds(800) : kIsHeard);
          DemandNoneFor(row, rig, kTwoAreThere, decision_t::CAUSE_NO_OBSTACLES, told);
        });
    Remark(rows_.back(), std::to_string(told) + " candidates answered no_obstacles while two were heard");
  }

  // The second one stands, at up to ten times the rate.
  void TwoRobots() {
    Rig rig(DemoTask());
    Row& row = Begin("A second robot under the same name, at 1, 3 and 10 times the rate (signed)", options_.others);
    std::int64_t told = 0, sequence = Witness::kFirstLie;
    Tries(
        row, rig,
        [&](int i) {
          const milliseconds period(150 / kTimesTheRate[static_cast<std::size_t>(i) % kTimesTheRate.size()]);
          std::atomic<bool> ends = false;
          std::thread second([&] {
            const auto bus = OpenBusOfAllRoles(rig.config().bus);
            for (; !ends; std::this_thread::sleep_for(period)) {
              robot_state_t state = State(rig);
              state.sequence = sequence++;
              bus->Publish(rig.config().bus.robot_state, state);
            }
          });
          rig.Listen(kIsHeard);
          DemandNoneFor(row, rig, kTwoAreThere, decision_t::CAUSE_NOT_ARMED, told);
          rig.Listen(kHeartbeat);
          const auto& status = rig.witness().status();
          Demand(row,
                 status && (status->fault != 0 || GetText(status->message).find("two senders") != std::string::npos),
                 "the heartbeat does not name two senders");
          ends = true;
          second.join();
        },
        options_.others);
    Remark(row, std::to_string(told) + " candidates answered not_armed while two were heard");
  }

  void Senders() {
    TwoPerceptions();
    TwoRobots();
    OldMessages();
  }
  void OldMessages();

  void StateDisks();

  void Nonsense() {
    Rig rig(DemoTask());
    Row& row = Begin("A planner that sends NaN, wrong sizes, garbage (signed)", options_.others);
    std::int64_t id = 1;
    Tries(
        row, rig,
        [&](int) {
          for (int j = 0; j < 50; ++j) {
            candidate_plan_t candidate = CandidateFor(rig.config(), id++, Eigen::Vector2d(0, 0), 6, milliseconds(100));
            SetText(candidate.source, "nonsense");
            if (j % 3 == 0) candidate.control[Below(6)][Below(2)] = std::numeric_limits<double>::quiet_NaN();
            if (j % 3 == 1) candidate.num_steps = static_cast<std::int16_t>(random_());
            if (j % 3 == 2) candidate.initial_half_width[Below(6)] = -1;
            std::vector<std::uint8_t> bytes = Encode(candidate);
            if (j % 7 == 0) bytes.resize(static_cast<std::size_t>(Below(20'000)));
            rig.bus().Publish(rig.config().bus.candidate, Bytes(bytes));
            if (j % 10 == 0) rig.Listen(milliseconds(5));
          }
        },
        options_.others);
  }

  using Sent = std::vector<std::uint8_t>;
  static constexpr std::int64_t kForgedSequence = std::int64_t{1} << 40;

  // For each channel a message that would do harm if it were believed; what was heard last where that is harm enough.
  std::map<std::string, Sent> HarmfulOf(const Rig& rig, const std::map<std::string, Sent>& heard) const {
    const BusOptions& channels = rig.config().bus;
    std::map<std::string, Sent> harmful;
    for (const auto& [channel, raw] : heard) {
      const Bytes message = WithoutSignature(raw);
      harmful[channel].assign(message.begin(), message.end());
    }
    command_t command{};
    command.utime = WallClockUs();
    command.kind = command_t::RELOAD;
    harmful[channels.command] = Encode(command);
    fault_t fault{};
    fault.utime = WallClockUs();
    fault.cause = fault_t::SLICE_LEFT;
    harmful[channels.fault] = Encode(fault);
    withdrawal_t withdrawal{};
    withdrawal.sequence = kForgedSequence;
    withdrawal.expires_utime = INT64_MAX;
    if (const certified_plan_t* certified = rig.witness().last_certified())
      withdrawal.plan_id = certified->plan.plan_id;
    harmful[channels.withdrawn] = Encode(withdrawal);
    advice_t advice{};  // the task asks for none
    advice.sequence = kForgedSequence;
    advice.num_changes = 1;
    harmful[channels.advice] = Encode(advice);
    obstacles_t nothing_there{};
    nothing_there.utime = WallClockUs();
    nothing_there.sequence = kForgedSequence;
    harmful[channels.obstacles] = Encode(nothing_there);
    if (const certified_plan_t* certified = rig.witness().last_certified())
      harmful[channels.certified] = Encode(Widened(*certified));
    return harmful;
  }

  // What an attacker's certificate looks like: slices that nothing leaves, for a plan that starts soon.
  static certified_plan_t Widened(certified_plan_t certified) {
    certified.utime = WallClockUs();
    certified.plan.plan_id += std::int64_t{1} << 32;
    certified.plan.start_utime = certified.utime + 200'000;
    certified.expires_utime = certified.utime + 1'000'000;
    for (int t = 0; t <= certified.plan.num_steps; ++t)
      for (int k = 0; k < certified.plan.num_states; ++k)
        certified.slice_lower[t][k] = -1e9, certified.slice_upper[t][k] = 1e9;
    SetDigest(certified.plan_digest, DigestOf(Encode(certified.plan)));
    SetDigest(certified.certificate_digest, CertificateDigest(certified));
    return certified;
  }

  // A stranger without keys; somebody with all keys but the one that counts; another robot's keys; this robot on
  // another bus.
  void Forgeries() {
    Rig rig(DemoTask());
    Row& row = Begin(
        "On each signed channel: unsigned, forged, replayed, signed by each other role, by another robot, for another "
        "bus",
        options_.others);
    const BusOptions& channels = rig.config().bus;
    const Speakers speakers = channels.speakers();
    std::map<std::string, Sent> heard;
    rig.open_bus().Subscribe(Bus::kEveryChannel, [&](const Received& r) {
      if (speakers.contains(r.channel)) heard[r.channel].assign(r.raw.begin(), r.raw.end());
    });
    std::int64_t obeyed = 0;  // by the robot: plans that nobody certified or withdrew, faults that nobody latched
    rig.Hear(channels.event, [&](const Received& r) {
      const auto event = Decoded<execution_event_t>(r.bytes);
      obeyed +=
          event &&
          (event->kind == execution_event_t::HALTED || event->kind == execution_event_t::RESET ||
           (event->kind == execution_event_t::WITHDRAWN && event->value == static_cast<double>(kForgedSequence)) ||
           (event->kind == execution_event_t::ACCEPTED && event->plan_id > WallClockUs() + (std::int64_t{1} << 31)));
    });
    Signer all(rig.keys(), channels.bus_name()), other_robot(TestKeys("another-robot"), channels.bus_name()),
        other_bus(rig.keys(), "another bus");
    std::int64_t sent = 0;
    std::set<std::string> tried;
    Tries(
        row, rig,
        [&](int) {
          rig.Listen(milliseconds(700));
          const auto before = rig.witness().status().value_or(certifier_status_t{});
          const std::int64_t obeyed_before = obeyed;
          const auto recorded = heard;
          for (const auto& [channel, message] : HarmfulOf(rig, recorded)) {
            const Role speaker = speakers.at(channel);
            tried.insert(channel);
            const auto send = [&, channel = channel](const Sent& bytes) {
              rig.open_bus().Publish(channel, Bytes(bytes)), ++sent;
            };
            send(message);
            for (const Role role : kAllRoles)
              if (role != speaker) send(all.Sign(role, channel, message, WallClockUs()));
            send(other_robot.Sign(speaker, channel, message, WallClockUs()));
            send(other_bus.Sign(speaker, channel, message, WallClockUs()));
            if (!recorded.contains(channel)) continue;
            Sent altered = recorded.at(channel);
            send(altered);  // once more
            altered[altered.size() / 2] ^= 1;
            send(altered);
          }
          rig.Listen(kHeartbeat);
          const auto& now = rig.witness().status();
          const auto refuses_all = [&] {
            return now && now->refused_unsigned > before.refused_unsigned &&
                   now->refused_forged > before.refused_forged && now->refused_replayed > before.refused_replayed;
          };
          Demand(row, rig.ListenUntil(refuses_all, kSaysSoon), "of unsigned, forged or replayed ones it refused none");
          Demand(row, !rig.witness().fault(), "a fault was believed or latched");
          Demand(row, obeyed == obeyed_before,
                 "the robot obeyed a fault, a reset, a certificate or a withdrawal that nobody made");
          Demand(row, now && now->version == before.version && now->failed_reloads == before.failed_reloads,
                 "a reload was obeyed");
          Demand(row, now && GetDigest(now->obstacles_digest) == GetDigest(before.obstacles_digest),
                 "obstacles were believed");
          Demand(row, now && now->messages_refused == before.messages_refused,
                 "the certifier looked into a message that nobody may send");
        },
        options_.others);
    Demand(row, tried.size() == speakers.size(), "only " + std::to_string(tried.size()) + " channels were tried");
    Remark(row, std::to_string(sent) + " sent on " + std::to_string(tried.size()) + " channels");
    if (rig.witness().status()) {
      const auto& s = *rig.witness().status();
      Remark(row, "refused by the certifier: " + std::to_string(s.refused_unsigned) + " unsigned, " +
                      std::to_string(s.refused_forged) + " forged or of another bus, " +
                      std::to_string(s.refused_replayed) + " replayed");
    }
    StolenKeys();
  }

  // The adversary of the gate itself: a learned planner that has its key file, or another role's.
  void StolenKeys() {
    Rig rig(DemoTask());
    Row& row = Begin(
        "Certificates with slices of +-1e9, signed with a stolen key of planner, perception, robot, operator, logger",
        options_.others);
    std::set<std::int64_t> forged, obeyed;
    rig.Hear(rig.config().bus.event, [&](const Received& r) {
      const auto event = Decoded<execution_event_t>(r.bytes);
      if (event && event->kind != execution_event_t::REFUSED && forged.contains(event->plan_id))
        obeyed.insert(event->plan_id);
    });
    Signer thief(rig.keys(), rig.config().bus.bus_name());
    Tries(
        row, rig,
        [&](int i) {
          const Role stolen = kAllRoles[1 + static_cast<std::size_t>(i) % (kAllRoles.size() - 1)];
          for (int j = 0; j < 20; ++j) {
            certified_plan_t certified = Widened(*rig.witness().last_certified());
            certified.plan.plan_id += j;
            certified.plan.start_utime += 40'000 * j;
            SetDigest(certified.plan_digest, DigestOf(Encode(certified.plan)));
            SetDigest(certified.certificate_digest, CertificateDigest(certified));
            forged.insert(certified.plan.plan_id);
            const std::string& channel = rig.config().bus.certified;
            rig.open_bus().Publish(channel, Bytes(thief.Sign(stolen, channel, Encode(certified), WallClockUs())));
            rig.Listen(milliseconds(20));
          }
          rig.Listen(milliseconds(500));
          Demand(row, obeyed.empty(), "the robot took a certificate that the certifier did not make");
        },
        options_.others);
    Remark(row, std::to_string(forged.size()) + " forged, " + std::to_string(obeyed.size()) + " executed");
  }

  void Flood() {
    Rig rig(DemoTask());
    Row& row = Begin("A flood of " + std::to_string(options_.floods) + " candidates (signed)", 1);
    std::int64_t candidates = 0;
    Tries(
        row, rig,
        [&](int) {
          candidate_plan_t candidate = CandidateFor(rig.config(), 1, Eigen::Vector2d(0, 0), 12, milliseconds(500));
          SetText(candidate.source, "flood");
          const std::int64_t before = rig.witness().decisions();
          for (int i = 0; i < options_.floods; ++i) {
            candidate.plan_id = i + 1;
            candidate.sequence = i;
            candidate.utime = WallClockUs();
            candidate.start_utime = candidate.utime + 500'000;
            rig.bus().Publish(rig.config().bus.candidate, candidate);
            if (i % 16 == 0) rig.Listen(milliseconds(0)), rig.open_bus().Dispatch(0);
          }
          rig.Listen(milliseconds(1500));
          candidates = rig.witness().decisions() - before;
        },
        1, true);
    if (rig.witness().status())
      Remark(row, std::to_string(candidates) + " decisions heard; the certifier counts " +
                      std::to_string(rig.witness().status()->candidates) + " decided on and " +
                      std::to_string(rig.witness().status()->candidates_lost) + " that the bus lost");
    if (rig.witness().unjudged() > 0)
      Remark(row, std::to_string(rig.witness().unjudged()) +
                      " executed plans not judged: the campaign lost messages itself");
  }

  // A stranger's, whatever their content: they do no more than any noise.
  void Throw(const std::string& what, const std::function<void(Rig&, const RawSender&, const Heard&)>& send) {
    Rig rig(DemoTask());
    Row& row = Begin("Raw datagrams: " + what, options_.others);
    const BusOptions& channels = rig.config().bus;
    const RawSender sender(rig.url(Rig::kCertifier));
    Heard heard;
    rig.open_bus().SubscribeUnchecked(Bus::kEveryChannel, [&](const Received& r) {
      if (channels.speakers().contains(r.channel) && heard.size() < kMostHeard)
        heard.push_back({r.channel, {r.raw.begin(), r.raw.end()}});
    });
    double most_grown = 0;
    Tries(
        row, rig,
        [&](int) {
          heard.clear();
          rig.Listen(milliseconds(300));
          std::array<double, Rig::kRoles> before{};
          for (int role = 0; role < Rig::kRoles; ++role)
            before[static_cast<std::size_t>(role)] = rig.Resident(Rig::Role(role));
          send(rig, sender, Heard(heard));
          rig.Listen(kHeartbeat);
          for (int role = 0; role < Rig::kRoles; ++role) {
            const double grown = rig.Resident(Rig::Role(role)) - before[static_cast<std::size_t>(role)];
            most_grown = std::max(most_grown, grown);
            Demand(row, grown < kMayGrowBy,
                   std::string("the ") + Rig::kNames[static_cast<std::size_t>(role)] + " grew by " +
                       std::to_string(std::lround(grown / (1 << 20))) + " MB");
          }
        },
        options_.others, true);
    Remark(row, "no process grew by more than " + std::to_string(std::lround(std::ceil(most_grown / (1 << 20)))) +
                    " MB in a try");
  }

  // Each of the first three ended LCM's own receiver, or took it memory by the gigabyte.
  void Datagrams() {
    const std::vector<std::string> channels{"ROBOT_STATE", "PLAN_CERTIFIED",
                                            "PLAN_CANDIDATE"};  // each process hears one
    const auto on_each = [&](auto make) {
      return [&channels, make](Rig&, const RawSender& sender, const Heard&) {
        for (const std::string& channel : channels) sender.Send(make(channel));
      };
    };
    Throw("a fragment that wraps around 2^32", on_each(WrappingFragment));
    Throw("fragments that claim 256 MB", on_each(HugeClaims));
    Throw("channels without an end", [](Rig&, const RawSender& sender, const Heard&) { sender.Send(EndlessNames()); });
    Throw("10000 fragments and 10000 of random bytes", [&](Rig& rig, const RawSender& sender, const Heard&) {
      for (std::size_t i = 0; i < 10'000; ++i) {
        sender.Send(Bytes(RandomFragment(random_, channels[i % channels.size()])));
        sender.Send(Bytes(RandomBytes(random_, 1500)));
        if (i % 16 == 0) rig.open_bus().Dispatch(0);
      }
    });
    Throw("what was heard, mutated, 50 times each", [&](Rig& rig, const RawSender& sender, const Heard& heard) {
      for (const auto& [channel, bytes] : heard) {
        for (int i = 0; i < 50; ++i) sender.Send(Bytes(Mutated(random_, ShortMessage(channel, bytes))));
        rig.open_bus().Dispatch(0);
      }
    });
  }

  // What a candidate is answered that would be certified from rest at the start; nothing if it is not answered.
  std::optional<std::int16_t> CauseOfACandidate(Rig& rig) {
    candidate_plan_t candidate =
        CandidateFor(rig.config(), next_own_id_++, Eigen::Vector2d(0, 0), 6, milliseconds(400));
    SetText(candidate.source, "campaign");
    rig.bus().Publish(rig.config().bus.candidate, candidate);
    const Digest digest = DigestOf(Encode(candidate));
    static_cast<void>(rig.ListenUntil([&] { return rig.witness().CauseOf(digest).has_value(); }, milliseconds(600)));
    return rig.witness().CauseOf(digest);
  }

  // The obstacles that are sent are not known to the certifier: every candidate is refused for that.
  void FallSilent(Row& row, Rig& rig) {
    rig.perception().SetSilent(true);
    rig.Listen(milliseconds(1100));  // gate.obstacles_timeout_ms is 1000
    const std::int64_t before = rig.witness().certificates();
    for (int j = 0; j < 3; ++j) DemandUnknown(row, rig, "after the timeout");
    Demand(row, rig.witness().certificates() == before, "it certified after the timeout");
    rig.perception().SetSilent(false);
  }
  void DemandUnknown(Row& row, Rig& rig, const std::string& when) {
    const auto cause = CauseOfACandidate(rig);
    const bool rejected = cause == decision_t::CAUSE_NO_OBSTACLES || cause == decision_t::CAUSE_NOT_ARMED ||
                          cause == decision_t::CAUSE_FAULT;
    Demand(row, rejected,
           "a candidate was answered " + std::string(cause ? CauseName(*cause) : "nothing") + " " + when);
    if (cause == decision_t::CAUSE_NO_OBSTACLES) ++told_unknown_;
  }

  // One rig whose obstacles are on the bus alone: any certificate under others, or none, is forbidden.
  void ObstacleTries(const std::string& fault, const std::function<void(Row&, Rig&, int)>& hurt) {
    const Config world = LoadConfig(world_.Write("world.yaml", DemoTask()));
    Rig rig(DemoTaskOnTheBus(), {.seen = world.obstacles});
    rig.witness().SetWorld({world.grounds.obstacles});
    Row& row = Begin(fault, options_.others);
    told_unknown_ = 0;
    Tries(
        row, rig, [&](int i) { hurt(row, rig, i); }, options_.others);
    if (told_unknown_ > 0) Remark(row, std::to_string(told_unknown_) + " candidates answered no_obstacles");
  }

  void Obstacles() {
    ObstacleTries("The certifier is killed and starts while nobody sends OBSTACLES", [&](Row& row, Rig& rig, int) {
      rig.End(Rig::kCertifier, SIGKILL);
      rig.perception().SetSilent(true);
      rig.Start(Rig::kCertifier);
      rig.witness().Forget();
      static_cast<void>(rig.ListenUntil([&] { return rig.witness().status().has_value(); }, std::chrono::seconds(10)));
      const std::int64_t before = rig.witness().certificates();
      rig.Listen(milliseconds(Below(500)));
      DemandUnknown(row, rig, "before the obstacles were heard");
      Demand(row, rig.witness().certificates() == before, "it certified before it had heard the obstacles");
      rig.perception().SetSilent(false);
    });
    ObstacleTries("OBSTACLES fall silent", [&](Row& row, Rig& rig, int) { FallSilent(row, rig); });
    ObstacleTries("OBSTACLES with gaps, NaN, wrong counts, from the future (signed)", [&](Row& row, Rig& rig, int i) {
      rig.perception().SetSilent(true);
      rig.perception().SayNow([](obstacles_t&) { return true; });
      rig.perception().SayNow([&](obstacles_t& message) {
        switch (i % 5) {
          case 0: return false;  // lost: the next one is a gap
          case 1: message.obstacle[0].shape.point[0][1] = std::numeric_limits<double>::quiet_NaN(); break;
          case 2: message.num_obstacles = 65; break;
          case 3: message.utime += 60'000'000; break;
          default: message.obstacle[message.num_obstacles - 1].shape.kind = 99; break;
        }
        return true;
      });
      if (i % 5 == 0) rig.perception().SayNow([](obstacles_t&) { return true; });
      rig.Listen(milliseconds(50));
      DemandUnknown(row, rig, "after a message that was lost or refused");
      rig.perception().SetSilent(false);
    });
    ObstacleTries("Two certifiers; one of them is killed or stopped for 3 s", [&](Row&, Rig& rig, int i) {
      if (!rig.SecondCertifierIsAlive()) rig.StartSecondCertifier();
      rig.Listen(milliseconds(1000 + Below(500)));
      switch (i % 3) {
        case 0: rig.End(Rig::kCertifier, SIGKILL); break;
        case 1: rig.EndSecondCertifier(); break;
        default:
          rig.Signal(Rig::kCertifier, SIGSTOP);
          rig.Listen(milliseconds(3000));
          rig.Signal(Rig::kCertifier, SIGCONT);
      }
      rig.Listen(milliseconds(Below(500)));
    });
  }

  // Beside the course, slowly away from it: so it heals for as long as the tries take.
  static Obstacle Drifting(double x, double y) {
    ObstacleMotion motion;
    motion.stamp_us = WallClockUs();
    motion.velocity.y() = 0.02;
    motion.uncertainty = 0.1;
    return Obstacle::Circle(Eigen::Vector2d(x, y), 0.5).Moving(motion);
  }

  // The same where one of the obstacles moves. `hurt` is told all of them.
  void MovingTries(const std::string& fault, const std::function<void(Row&, Rig&, int, std::vector<Obstacle>&)>& hurt) {
    std::vector<Obstacle> seen = LoadConfig(world_.Write("world.yaml", DemoTask())).obstacles;
    seen.push_back(Drifting(60, 14));
    Rig rig(DemoTaskOnTheBus(", max_clock_error_ms: 400"), {.seen = seen});
    rig.witness().SetWorld({ObstaclesDigest(seen)});
    Row& row = Begin(fault, options_.others);
    told_unknown_ = 0;
    Tries(
        row, rig, [&](int i) { hurt(row, rig, i, seen); }, options_.others);
    if (told_unknown_ > 0) Remark(row, std::to_string(told_unknown_) + " candidates answered no_obstacles");
  }

  // Of a piece of a prediction: each is refused as a whole message.
  static void Garble(obstacles_t& message, int way) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    obstacle_t& piece = message.obstacle[message.num_obstacles - 1];  // the one that moves
    switch (way) {
      case 0: piece.from_utime = message.utime + 1; return;  // it appears from nowhere
      case 1: piece.from_utime = kMost, piece.until_utime = -kMost; return;
      case 2: piece.growth = -1; return;
      case 3: piece.velocity[0] = std::numeric_limits<double>::quiet_NaN(); return;
      case 4: piece.utime = kMost; return;
      case 5: piece.uncertainty = std::numeric_limits<double>::infinity(); return;
      case 6: piece.gone = 2; return;
      default:  // a gap between two pieces
        obstacle_t& next = message.obstacle[message.num_obstacles++];
        next = piece;
        piece.until_utime = message.utime + 1'000'000;
        next.from_utime = message.utime + 1'000'001;
    }
  }

  // What the heartbeat says last.
  static bool Says(const Rig& rig, const std::string& what) {
    const auto& status = rig.witness().status();
    return status && GetText(status->message).find(what) != std::string::npos;
  }

  // A robot that starts with a clock that is off: its states come, and nothing is certified on them.
  void OffClock(const char* how, microseconds offset) {
    std::vector<Obstacle> seen = LoadConfig(world_.Write("world.yaml", DemoTask())).obstacles;
    seen.push_back(Drifting(60, 14));
    Rig rig(DemoTaskOnTheBus(", max_clock_error_ms: 200"), {.settable_clocks = true, .seen = seen});
    rig.witness().SetWorld({ObstaclesDigest(seen)});
    Row& row = Begin(std::string("The clock of the robot is 0.4 s ") + how + " from its start", options_.others);
    const auto start_with = [&](microseconds clock) {
      rig.End(Rig::kRobot);
      rig.SetClock(Rig::kRobot, clock);
      rig.Start(Rig::kRobot);
    };
    Tries(
        row, rig,
        [&](int) {
          start_with(offset);
          rig.witness().Forget();
          const auto says_so = [&] {
            // One that takes long to start is lost, which a person has to clear.
            if (rig.witness().fault()) rig.witness().ForgetFault(), rig.Command(command_t::RESET);
            return Says(rig, std::string("the robot's clock is ") + how);
          };
          Demand(row, rig.ListenUntil(says_so, kStarts), "the heartbeat does not say that the robot's clock is off");
          const std::int64_t before = rig.witness().certificates();
          for (int j = 0; j < 3; ++j) {
            const auto cause = CauseOfACandidate(rig);
            Demand(row, cause == decision_t::CAUSE_NOT_ARMED || cause == decision_t::CAUSE_FAULT,
                   "a candidate was answered " + std::string(cause ? CauseName(*cause) : "nothing"));
          }
          rig.Listen(kHeartbeat);
          Demand(row, rig.witness().certificates() == before, "it certified on states of a clock that is off");
          start_with(microseconds(0));
        },
        options_.others);
  }

  // The robot drives. From then on all that comes is a wall across its way, with stamps that are 2 s old.
  void StaleWall() {
    const std::vector<Obstacle> seen = LoadConfig(world_.Write("world.yaml", DemoTask())).obstacles;
    Rig rig(DemoTaskOnTheBus(), {.seen = seen});
    std::int64_t withdrawn = 0, stops = 0;
    rig.Hear(rig.config().bus.withdrawn, [&](const Received& r) {
      const auto message = Decoded<withdrawal_t>(r.bytes);
      withdrawn += message && message->cause == withdrawal_t::OBSTACLES_LOST;
    });
    rig.Hear(rig.config().bus.event, [&](const Received& r) {
      const auto event = Decoded<execution_event_t>(r.bytes);
      stops += event && event->kind == execution_event_t::EMERGENCY_STOP;
    });
    Row& row = Begin("A wall with stamps 2 s old while a plan is under way (signed)", options_.others);
    std::int64_t all_stops = 0;
    Tries(
        row, rig,
        [&](int) {
          withdrawn = stops = 0;
          // A plan of a robot that has just begun to drive may end before the obstacles are lost.
          for (int walls = 0; walls < 5 && stops == 0; ++walls) {
            if (walls > 0) rig.Listen(milliseconds(1000 + Below(1000)));
            SendStaleWall(row, rig, seen, [&] { return stops > 0; });
          }
          Demand(row, withdrawn > 0 && stops > 0, "no plan was withdrawn, or the robot did not stop");
          all_stops += stops;
        },
        options_.others);
    Remark(row, std::to_string(all_stops) + " emergency stops");
  }
  void SendStaleWall(Row& row, Rig& rig, const std::vector<Obstacle>& seen, const std::function<bool()>& stopped) {
    std::vector<Obstacle> with_wall = seen;
    with_wall.push_back(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 30));
    rig.perception().SetSilent(true);
    rig.perception().See(with_wall);
    std::int64_t before = 0;
    for (int j = 0; j < 20 && !stopped(); ++j) {
      rig.perception().SayNow([](obstacles_t& message) {
        message.utime -= 2'000'000;
        return true;
      });
      rig.Listen(milliseconds(100));
      if (j == 0) before = rig.witness().certificates();  // what was decided before has arrived
    }
    Demand(row, rig.witness().certificates() == before, "it certified after the wall was refused");
    rig.perception().See(seen);
    rig.perception().SetSilent(false);
  }

  // What it has not heard meanwhile, it has not heard because it did not run.
  void StoppedCertifier() {
    const std::vector<Obstacle> seen = LoadConfig(world_.Write("world.yaml", DemoTask())).obstacles;
    Rig rig(DemoTaskOnTheBus(), {.seen = seen});
    Row& row = Begin("The certifier is stopped for 2 s", options_.others);
    int faults = 0, explained = 0;
    Tries(
        row, rig,
        [&](int) {
          rig.witness().ForgetFault();
          rig.Signal(Rig::kCertifier, SIGSTOP);
          rig.Listen(milliseconds(2000));
          rig.Signal(Rig::kCertifier, SIGCONT);
          rig.Listen(kHeartbeat);
          const auto& fault = rig.witness().fault();
          if (!fault) return;
          ++faults;
          DemandLatched(row, rig, fault_t::ROBOT_STATE_LOST);
          const bool says_so = GetText(fault->message).find("this certifier itself did not run") != std::string::npos;
          Demand(row, says_so, "it blames the robot: " + GetText(fault->message));
          explained += says_so;
        },
        options_.others);
    Remark(row, std::to_string(faults) + " faults latched, " + std::to_string(explained) +
                    " of them say that the certifier did not run");
  }

  void Times() {
    OffClock("behind", microseconds(-400'000));
    OffClock("ahead", microseconds(400'000));
    StaleWall();
    StoppedCertifier();
  }

  void Moving() {
    MovingTries("Moving OBSTACLES fall silent", [&](Row& row, Rig& rig, int, auto&) { FallSilent(row, rig); });
    MovingTries("Moving OBSTACLES come too late (signed)", [&](Row& row, Rig& rig, int, auto&) {
      rig.perception().SetSilent(true);
      rig.perception().SayNow([](obstacles_t& message) {
        message.utime -= 600'000;  // gate.max_age_ms is 500
        return true;
      });
      rig.Listen(milliseconds(50));
      DemandUnknown(row, rig, "after a message that was too late");
      rig.perception().SetSilent(false);
    });
    MovingTries("Moving OBSTACLES with garbage in windows, motion and stamps, or of another type (signed)",
                [&](Row& row, Rig& rig, int i, auto&) {
                  rig.perception().SetSilent(true);
                  if (i % 9 == 8)
                    rig.bus().Publish(rig.config().bus.obstacles, transition_t{});
                  else
                    rig.perception().SayNow([&](obstacles_t& message) {
                      Garble(message, i % 9);
                      return true;
                    });
                  rig.Listen(milliseconds(50));
                  DemandUnknown(row, rig, "after a message that was garbage");
                  rig.perception().SetSilent(false);
                });
    MovingTries("A moving obstacle jumps in front of the robot, and away again", [&](Row&, Rig& rig, int, auto& seen) {
      const certified_plan_t* plan = rig.witness().last_certified();
      const double ahead = plan ? plan->plan.initial_center[0] + 8 + Below(12) : 20;
      const auto jump = [&](const Obstacle& to) {
        const Digest before = ObstaclesDigest(seen);
        seen.back() = to;
        rig.witness().SetWorld({before, ObstaclesDigest(seen)});
        rig.perception().See(seen);
        rig.Listen(milliseconds(500));  // what was decided before it was heard has arrived
        rig.witness().SetWorld({ObstaclesDigest(seen)});
        rig.Listen(milliseconds(500 + Below(500)));
      };
      jump(Drifting(ahead, Below(9) - 4.0));
      jump(Drifting(60, 14));
    });
    Walls();
  }

  // The plan that the robot drives is withdrawn, and what of it stands is used up.
  void Walls() {
    std::vector<Obstacle> seen = LoadConfig(world_.Write("world.yaml", DemoTask())).obstacles;
    Rig rig(DemoTaskOnTheBus(""), {.seen = seen});
    rig.witness().SetWorld({ObstaclesDigest(seen)});
    std::int64_t last_withdrawn = 0, withdrawn = 0, stops = 0, short_stops = 0;
    std::map<std::int64_t, int> standing;  // by plan
    rig.Hear(rig.config().bus.withdrawn, [&](const Received& r) {
      const auto message = Decoded<withdrawal_t>(r.bytes);
      if (message && std::exchange(last_withdrawn, message->plan_id) != message->plan_id) ++withdrawn;
    });
    rig.Hear(rig.config().bus.event, [&](const Received& r) {
      const auto event = Decoded<execution_event_t>(r.bytes);
      if (event && event->kind == execution_event_t::WITHDRAWN) standing[event->plan_id] = event->step;
      if (!event || event->kind != execution_event_t::EMERGENCY_STOP) return;
      ++stops;
      short_stops += event->value < 0 || event->step + event->value > standing[event->plan_id];
    });
    Row& row = Begin("A wall appears across the way of the robot, and goes", options_.others);
    Tries(
        row, rig,
        [&](int) {
          // A robot that has just begun to drive may end its plan before the wall.
          const std::int64_t before = withdrawn;
          for (int walls = 0; walls < 5 && withdrawn == before; ++walls) {
            rig.Listen(milliseconds(1500));
            const certified_plan_t* plan = rig.witness().last_certified();
            std::vector<Obstacle> walled = seen;
            const double ahead = (plan ? plan->plan.initial_center[0] : 0) + 2 + Below(6);
            walled.push_back(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), ahead));
            rig.witness().SetWorld({ObstaclesDigest(seen), ObstaclesDigest(walled)});
            rig.perception().See(walled);
            rig.Listen(milliseconds(1000));
            rig.witness().SetWorld({ObstaclesDigest(walled)});
            rig.Listen(milliseconds(500));
            rig.witness().SetWorld({ObstaclesDigest(seen), ObstaclesDigest(walled)});
            rig.perception().See(seen);
            rig.Listen(milliseconds(500));
            rig.witness().SetWorld({ObstaclesDigest(seen)});
          }
        },
        options_.others);
    Demand(row, withdrawn > 0, "no plan was withdrawn");
    Remark(row, std::to_string(withdrawn) + " plans withdrawn, " + std::to_string(stops) + " emergency stops, " +
                    std::to_string(short_stops) + " of them by a wall nearer than the brakes can stop");
  }

  void Disks();
  void Gone();
  void Routes() { NoNetwork(), LostRoute(); }
  void NoNetwork();
  void LostRoute();
  void BadReload();
  [[nodiscard]] std::string Spoilt(const std::string& task, int way);
  void ReloadOfNoFile(Rig& rig);
  static void PutNoFile(const std::string& path, int way);

  const Options options_;
  const ScratchDirectory world_;
  std::int64_t next_own_id_ = 1;
  int told_unknown_ = 0;
  std::mt19937 random_;
  std::vector<Row> rows_;
  std::unique_ptr<Progress> progress_;
};

const std::vector<Campaign::Kind> Campaign::kKinds{
    {"kill", &Campaign::Kills},          {"clock", &Campaign::Clocks},
    {"stop", &Campaign::Stops},          {"network", &Campaign::BadNetwork},
    {"lies", &Campaign::Lies},           {"nonsense", &Campaign::Nonsense},
    {"latch", &Campaign::LatchedKills},  {"statedisk", &Campaign::StateDisks},
    {"strangers", &Campaign::Strangers}, {"obstacles", &Campaign::Obstacles},
    {"moving", &Campaign::Moving},       {"times", &Campaign::Times},
    {"senders", &Campaign::Senders},     {"forgeries", &Campaign::Forgeries},
    {"flood", &Campaign::Flood},         {"datagrams", &Campaign::Datagrams},
    {"disks", &Campaign::Disks},         {"gone", &Campaign::Gone},
    {"route", &Campaign::Routes},        {"reload", &Campaign::BadReload}};

// Each channel's speaker has signed them: before the processes began, or ahead of their clocks. What was heard of the
// processes before them is sent again as it was.
void Campaign::OldMessages() {
  Rig rig(DemoTask());
  Row& row = Begin(
      "On each signed channel: signed by its speaker before the start of certifier and robot, or while a clock was "
      "ahead",
      options_.others);
  const BusOptions& channels = rig.config().bus;
  const Speakers speakers = channels.speakers();
  std::map<std::string, Sent> heard;
  rig.open_bus().Subscribe(Bus::kEveryChannel, [&](const Received& r) {
    if (speakers.contains(r.channel)) heard[r.channel].assign(r.raw.begin(), r.raw.end());
  });
  std::int64_t obeyed = 0, sent = 0, refused = 0;
  const std::int64_t rig_began = WallClockUs();
  rig.Hear(channels.event, [&](const Received& r) {
    const auto event = Decoded<execution_event_t>(r.bytes);
    obeyed +=
        event &&
        (event->kind == execution_event_t::HALTED || event->kind == execution_event_t::RESET ||
         (event->kind == execution_event_t::ACCEPTED && event->plan_id > WallClockUs() + (std::int64_t{1} << 31)));
  });
  Tries(
      row, rig,
      [&](int) {
        rig.Listen(milliseconds(700));
        const std::map<std::string, Sent> recorded = heard;
        auto harmful = HarmfulOf(rig, recorded);
        transition_t contradiction =
            heard.contains(channels.transition)
                ? Decoded<transition_t>(WithoutSignature(heard.at(channels.transition))).value_or(transition_t{})
                : transition_t{};
        contradiction.next_state[0] += 1;
        harmful[channels.transition] = Encode(contradiction);
        for (const Rig::Role role : {Rig::kCertifier, Rig::kRobot}) rig.End(role), rig.Start(role);
        rig.witness().Forget();
        const auto begun = [&] { return rig.witness().status().has_value(); };
        Demand(row, rig.ListenUntil(begun, kStarts), "the certifier did not start");
        rig.Listen(kHeartbeat);
        const auto before = rig.witness().status().value_or(certifier_status_t{});
        const std::int64_t obeyed_before = obeyed, now = WallClockUs();
        constexpr std::int64_t kHourUs = 3'600'000'000;
        for (const auto& [channel, raw] : recorded) rig.open_bus().Publish(channel, Bytes(raw)), ++sent;
        for (const auto& [channel, message] : harmful)
          for (const std::int64_t when : {now - kHourUs, rig_began - 5'000'000, now + 61'000'000, now + kHourUs})
            rig.open_bus().Publish(
                channel,
                Bytes(Signer(rig.keys(), channels.bus_name()).Sign(speakers.at(channel), channel, message, when))),
                ++sent;
        rig.Listen(kHeartbeat);
        const auto& status = rig.witness().status();
        const auto refuses = [&] { return status && status->refused_replayed > before.refused_replayed; };
        Demand(row, rig.ListenUntil(refuses, kSaysSoon), "it refused none");
        Demand(row, !rig.witness().fault(), "a fault was believed or latched");
        Demand(row, obeyed == obeyed_before, "the robot obeyed a fault, a reset or a certificate");
        Demand(row, status && status->version == before.version, "a reload was obeyed");
        if (status) refused += status->refused_replayed - before.refused_replayed;
      },
      options_.others);
  Remark(row, std::to_string(sent) + " sent, " + std::to_string(refused) +
                  " times the certifier refused one, on the channels that it hears");
}

// A small file system of its own for the log, filled, made read-only, and given back.
void Campaign::Disks() {
  const ScratchDirectory scratch;
  const std::string directory = scratch.path();
  constexpr const char* kSize = "size=32m";
  if (::mount("tmpfs", directory.c_str(), "tmpfs", 0, kSize) != 0)
    return NotTried("Full disk, read-only directory", "mounting a small file system needs root");
  {
    Rig rig(DemoTask("logger: {min_free_mb: 1}\n"));
    rig.SetDirectory(directory);
    rig.End(Rig::kLogger);  // it is started again there
    Row& full = Begin("Full disk", options_.others);
    Tries(
        full, rig,
        [&](int) {
          const std::string filler = directory + "/filler";  // as much as there is room for
          std::ofstream(filler) << std::string(32 << 20, 'x');
          rig.Listen(milliseconds(700));
          const auto says_so = [&] {
            const auto& logger = rig.witness().logger_status();
            return logger && logger->state == logger_status_t::ERROR;
          };
          Demand(full, rig.ListenUntil(says_so, kSaysSoon), "the disk was full, and the logger's state was not ERROR");
          std::filesystem::remove(filler);
        },
        options_.others);

    // While a file is open to be written the kernel refuses it, so it is done before the logger starts.
    Row& read_only = Begin("Log directory read-only at the logger's start", options_.others);
    const auto remount = [&](unsigned long how) {
      Demand(read_only, ::mount("tmpfs", directory.c_str(), "tmpfs", MS_REMOUNT | how, kSize) == 0, "no remount");
    };
    Tries(
        read_only, rig,
        [&](int) {
          rig.End(Rig::kLogger);
          remount(MS_RDONLY);
          ChildProcess logger({FOREREACH_LOGGER, "--config", rig.task_path(), "--lcm-url", rig.url(Rig::kLogger),
                               "--directory", directory});
          const bool says_why =
              logger.WaitForExit(std::chrono::seconds(10)) == 2 && logger.error().find(directory) != std::string::npos;
          Demand(read_only, says_why, "the logger did not end with the reason: " + logger.error());
          remount(0);
        },
        options_.others);
  }
  ::umount(directory.c_str());
}

// The same for the certifier's state.
void Campaign::StateDisks() {
  const ScratchDirectory scratch;
  const std::string directory = scratch.path(), filler = directory + "/filler", latch = directory + "/latch.json";
  constexpr const char* kSize = "size=1m";
  if (::mount("tmpfs", directory.c_str(), "tmpfs", 0, kSize) != 0)
    return NotTried("A full or read-only disk for the certifier's state", "mounting a small file system needs root");
  {
    Rig rig(DemoTask());
    rig.End(Rig::kCertifier);
    rig.SetState(directory);
    const auto fill = [&] { std::ofstream(filler) << std::string(2 << 20, 'x'); };
    const auto remount = [&](Row& row, unsigned long how) {
      Demand(row, ::mount("tmpfs", directory.c_str(), "tmpfs", MS_REMOUNT | how, kSize) == 0, "no remount");
    };
    // Nothing is certified, and it is said why.
    const auto demand_not_armed = [&](Row& row, const std::string& why) {
      const std::int64_t certificates = rig.witness().certificates();
      rig.witness().Forget();
      rig.Start(Rig::kCertifier);
      const auto says_so = [&] {
        const auto& status = rig.witness().status();
        return status && status->level == certifier_status_t::ERROR && status->state == certifier_status_t::DISARMED &&
               GetText(status->message).starts_with("no fault could be stored");
      };
      Demand(row, rig.ListenUntil(says_so, kStarts), why + ", and the certifier does not say so");
      rig.Listen(milliseconds(1000));
      Demand(row, rig.witness().certificates() == certificates, why + ", and the certifier certified");
    };
    Row& at_start = Begin("The certifier's state on a disk that is full at its start", options_.others);
    Tries(
        at_start, rig,
        [&](int) {
          rig.End(Rig::kCertifier);
          std::filesystem::remove(latch);
          fill();
          demand_not_armed(at_start, "no fault could be written");
          std::filesystem::remove(filler);
        },
        options_.others);

    Row& later =
        Begin("The certifier's state on a disk that is full when a fault is latched, then SIGKILL", options_.others);
    std::int64_t sequence = Witness::kFirstLie;
    Tries(
        later, rig,
        [&](int) {
          fill();
          const std::optional<fault_t> fault = Provoke(later, rig, sequence++);
          rig.End(Rig::kCertifier, SIGKILL);
          rig.Start(Rig::kCertifier);
          if (fault) DemandStillLatched(later, rig, *fault);
          std::filesystem::remove(filler);
        },
        options_.others);

    Row& read_only = Begin("The certifier's state read-only at its start", options_.others);
    Tries(
        read_only, rig,
        [&](int) {
          rig.End(Rig::kCertifier);
          remount(read_only, MS_RDONLY);
          demand_not_armed(read_only, "the disk was read-only");
          remount(read_only, 0);
        },
        options_.others);
  }
  ::umount(directory.c_str());
}

// What the logger writes is deleted while it writes. It says so, counts what had been confirmed, and records again.
void Campaign::Gone() {
  const auto remove_files = [](const std::string& directory, const std::string& part) {
    std::error_code error;
    for (const auto& file : std::filesystem::directory_iterator(directory, error))
      if (file.path().filename().string().find(part) != std::string::npos) std::filesystem::remove(file.path(), error);
  };
  const std::vector<std::pair<const char*, std::function<void(const std::string&)>>> kinds{
      {"Log file deleted", [&](const std::string& directory) { remove_files(directory, ".lcmlog"); }},
      {"Log directory deleted", [](const std::string& directory) { std::filesystem::remove_all(directory); }},
      {"Database deleted", [&](const std::string& directory) { remove_files(directory, "decisions.sqlite"); }}};
  for (const auto& kind : kinds) {
    const char* const fault = kind.first;
    const auto& take_away = kind.second;
    const bool is_database = &take_away == &kinds.back().second;
    Rig rig(DemoTask(), {.takes_logs_away = true});
    Row& row = Begin(fault, options_.others);
    std::int64_t gone = 0;
    const auto& logger = rig.witness().logger_status();
    Tries(
        row, rig,
        [&](int) {
          rig.Listen(kHeartbeat);
          const logger_status_t before = *logger;
          take_away(rig.directory());
          const auto goes_on = [&] {
            return logger->events_written > before.events_written + 50 && logger->state != logger_status_t::ERROR &&
                   (is_database ? logger->state == logger_status_t::STALE : logger->events_lost > before.events_lost);
          };
          Demand(row, rig.ListenUntil(goes_on, kSaysSoon),
                 "it does not record again, or does not say what is lost: " + GetText(logger->message));
          Demand(row, is_database || logger->events_lost - before.events_lost >= before.events_written - gone,
                 "it counts less as lost than it had confirmed");
          gone += logger->events_lost - before.events_lost;
          if (is_database) rig.End(Rig::kLogger), gone = 0;  // the next one makes the rows again
        },
        options_.others);
    Remark(row,
           is_database ? "the next start makes the rows again" : "lost are the events that were deleted, and counted");
    if (!is_database) row.lost_by_logger.reset();
  }
}

// A network of its own for this thread and what it starts from now on: the machine's routes stay as they are.
class OwnNetwork final {
 public:
  static constexpr const char* kNeeds = "a network of its own needs root and the command ip";

  OwnNetwork() : machines_(::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC)) {
    entered_ = machines_ >= 0 && ::unshare(CLONE_NEWNET) == 0;
    works_ = entered_ && Ip({"link", "set", "lo", "up"}) && SetRoute(true);
  }
  ~OwnNetwork() {
    if (entered_) static_cast<void>(::setns(machines_, CLONE_NEWNET));
    if (machines_ >= 0) ::close(machines_);
  }
  OwnNetwork(const OwnNetwork&) = delete;
  OwnNetwork& operator=(const OwnNetwork&) = delete;

  [[nodiscard]] bool works() const { return works_; }
  /** The only one to multicast. */
  [[nodiscard]] bool SetRoute(bool there) const {
    return Ip({"route", there ? "add" : "del", "224.0.0.0/4", "dev", "lo"});
  }

 private:
  static bool Ip(const std::vector<std::string>& arguments) {
    std::vector<std::string> command{"/usr/bin/env", "ip"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return ChildProcess(command).WaitForExit(std::chrono::seconds(10)) == 0;
  }

  const int machines_;
  bool entered_ = false, works_ = false;
};

// A process that starts without a network says what to do, and ends.
void Campaign::NoNetwork() {
  const std::string fault = "No multicast route at the start";
  const OwnNetwork network;
  if (!network.works()) return NotTried(fault, OwnNetwork::kNeeds);
  const ScratchDirectory scratch;
  const std::string task = scratch.Write("task.yaml", DemoTask()), url = PrivateBusUrl();
  Row& row = Begin(fault, Rig::kRoles);
  Demand(row, network.SetRoute(false), "the route stays");
  for (const char* program : {FOREREACH_CERTIFIER, FOREREACH_PLANNER, FOREREACH_LOGGER, FOREREACH_ROBOT_SIM}) {
    ++row.tries;
    std::vector<std::string> command{program, "--config", task, "--lcm-url", url};
    if (program == std::string(FOREREACH_LOGGER)) command.insert(command.end(), {"--directory", scratch / "log"});
    ChildProcess process(command);
    const auto code = process.WaitForExit(std::chrono::seconds(10));
    const std::string error = process.error();
    const auto says = [&error](const std::string& what) { return error.find(what) != std::string::npos; };
    if (code == 2 && says(url) && says("ip route add 224.0.0.0/4 dev lo") && !says("ready on")) ++row.said_why;
    progress_->Advance();
  }
  Remark(row, "exit 2 and advice");
}

void Campaign::LostRoute() {
  const std::string fault = "The multicast route goes for a second, and comes back";
  const OwnNetwork network;
  if (!network.works()) return NotTried(fault, OwnNetwork::kNeeds);
  Rig rig(DemoTask());
  Row& row = Begin(fault, options_.others);
  const auto not_sent = [&] { return rig.witness().status() ? rig.witness().status()->messages_not_sent : 0; };
  Tries(
      row, rig,
      [&](int) {
        const std::int64_t before = not_sent();
        Demand(row, network.SetRoute(false), "the route stays");
        rig.Listen(milliseconds(1000));
        Demand(row, network.SetRoute(true), "the route does not come back");
        const bool counted = rig.ListenUntil([&] { return not_sent() > before; }, kSaysSoon);
        Demand(row, counted, "the certifier counts no message that the bus refused");
      },
      options_.others, true);
}

// Certainly bad, each way in turn.
std::string Campaign::Spoilt(const std::string& task, int way) {
  const auto cut_before = [&](std::size_t end) { return task.substr(0, Below(static_cast<int>(end))); };
  const auto with = [&task](const std::string& good, const std::string& bad) {
    return std::string(task).replace(task.find(good), good.size(), bad);
  };
  switch (way % 4) {
    case 0: return cut_before(task.find("\ntask:"));  // which is required
    case 1: return cut_before(task.size()) + "\nno_such_key: 1\n";
    case 2: return with("dt: 0.1", "dt: .nan");
    default: return with("\ntransitions: ", "\ntransitions: /there_is_none");
  }
}

void Campaign::BadReload() {
  Rig rig(DemoTask());
  Row& row = Begin("Reload of a bad task file", options_.others);
  const std::string path = rig.task_path(), good = rig.task();
  Tries(
      row, rig,
      [&](int i) {
        const certifier_status_t before = *rig.witness().status();
        const auto& now = rig.witness().status();
        std::ofstream(path) << Spoilt(good, i / 2);
        if (i % 2 == 0)
          rig.Signal(Rig::kCertifier, SIGHUP);
        else
          rig.Command(command_t::RELOAD);
        const auto refused = [&] { return now->failed_reloads > before.failed_reloads; };
        Demand(row, rig.ListenUntil(refused, kSaysSoon), "it was not refused");
        const std::int64_t certificates = rig.witness().certificates();
        const auto certifies = [&] { return rig.witness().certificates() > certificates; };
        Demand(row, rig.ListenUntil(certifies, kSaysSoon), "nothing was certified after it");
        rig.Listen(kHeartbeat);
        Demand(row, now->failed_reloads == before.failed_reloads + 1, "it was not refused once");
        Demand(row, GetText(now->message).starts_with("the last reload failed"), "the heartbeat does not say so");
        Demand(row, now->version == before.version, "it raised the version");
        const Digest digest = GetDigest(rig.witness().last_certified()->config_digest);
        Demand(row, digest == GetDigest(before.config_digest), "plans were certified under another task");

        std::ofstream(path) << good;
        rig.Command(command_t::RELOAD);
        const auto taken = [&] { return now->version > before.version; };
        Demand(row, rig.ListenUntil(taken, kSaysSoon), "the good file was not taken after it");
      },
      options_.others);
  ReloadOfNoFile(rig);
}

// Each would make a plain open or read of it wait for ever, never end, or fail.
void Campaign::PutNoFile(const std::string& path, int way) {
  std::filesystem::remove_all(path);
  switch (way % 4) {
    case 0:
      if (::mkfifo(path.c_str(), 0600) != 0) throw std::runtime_error(path + ": no pipe can be made");
      return;
    case 1: return std::filesystem::create_symlink("/dev/zero", path);
    case 2: return (void)std::filesystem::create_directory(path);
    default: return std::filesystem::create_symlink(path, path);  // cannot be read, not even by root
  }
}

void Campaign::ReloadOfNoFile(Rig& rig) {
  Row& row = Begin("Reload of a pipe, /dev/zero, a directory, an unreadable file", options_.others);
  const std::string path = rig.task_path(), good = rig.task();
  Tries(
      row, rig,
      [&](int i) {
        const certifier_status_t before = *rig.witness().status();
        const auto& now = rig.witness().status();
        PutNoFile(path, i);
        rig.Signal(Rig::kRobot, SIGHUP);
        rig.Command(command_t::RELOAD);
        const auto refused = [&] { return now->failed_reloads > before.failed_reloads; };
        Demand(row, rig.ListenUntil(refused, kSaysSoon), "it was not refused");
        Demand(row, now->version == before.version, "it raised the version");
        const std::int64_t certificates = rig.witness().certificates();
        const auto certifies = [&] { return rig.witness().certificates() > certificates; };
        Demand(row, rig.ListenUntil(certifies, kSaysSoon), "nothing was certified after it");
        const bool ends = i / 4 % 2 == 1;
        if (ends) rig.End(Rig::kCertifier);  // that it ends in time is looked at after each try
        std::filesystem::remove_all(path);
        std::ofstream(path) << good;
        if (ends) return;
        rig.Command(command_t::RELOAD);
        const auto taken = [&] { return now->version > before.version; };
        Demand(row, rig.ListenUntil(taken, kSaysSoon), "the good file was not taken after it");
      },
      options_.others);
}

std::string Table(const std::vector<Row>& rows, const Options& options) {
  std::ostringstream text;
  text << "Made by `scripts/faults --kills " << options.kills << " --others " << options.others << " --flood "
       << options.floods << " --seed " << options.seed << (options.only.empty() ? "" : " --only " + options.only)
       << (options.allow_untried ? " --allow-untried" : "") << "`. *Forbidden* counts tries with one of these:\n"
       << "- the robot executed an uncertified plan, a control that is not of its plan, a control outside its "
          "slice, or one that was withdrawn;\n"
       << "- a candidate was answered twice, or was counted and not answered (not checked where messages are made to "
          "be lost);\n"
       << "- a process ended unexpectedly, or did not end properly within 5 s of SIGTERM;\n"
       << "- the certifier did not latch a jump of its clock or a state outside its slice, certified before the reset, "
          "forgot a\n"
       << "  fault at a restart, or certified while it could not write faults;\n"
       << "- a plan was certified under other obstacles than the perceived ones, or on states of a clock that is off;\n"
       << "- a required refusal or message was missing;\n"
       << "- the logs and the database disagreed at the end;\n"
       << "- a process grew by 48 MB under raw datagrams.\n"
       << "\n"
       << "*Lost* counts events that the logger had confirmed and that its log does not hold, after each try; for a "
          "logger that\n"
       << "ended, after the next one has repaired its logs. Events that a full disk refuses are never confirmed. `-`: "
          "no logger ran,\n"
       << "or its logs were removed. *Recovered*: within 20 s, after a reset where a fault was latched, the certifier "
          "is OK, the\n"
       << "robot executes a newly certified plan, and the logger records. *Said why*: a process that cannot start "
          "exits with the\n"
       << "reason.\n"
       << "\n"
       << "| fault | tries | forbidden | lost | recovered | said why | |\n|---|---|---|---|---|---|---|\n";
  for (const Row& row : rows)
    text << "| " << row.fault << " | " << row.tries << " | " << row.forbidden << " | "
         << (row.lost_by_logger ? std::to_string(*row.lost_by_logger) : "-") << " | " << row.recovered << " | "
         << row.said_why << " | " << row.remark << " |\n";
  return text.str();
}

bool IsClean(const Row& row, const Options& options) {
  if (row.tries == 0) return options.allow_untried;
  return row.forbidden == 0 && row.lost_by_logger.value_or(0) == 0 && row.recovered + row.said_why == row.tries;
}

int Main(int argc, char** argv) {
  Options options;
  const NumberRange some{1, 10'000'000};
  std::vector<std::string> kinds;
  for (const auto& [name, run] : Campaign::kKinds) kinds.emplace_back(name);
  const Command program{
      .name = "forereach_faults",
      .purpose = "Hurts the four processes in every way it knows, and says what happened.",
      .options = {{.name = "--kills", .variable = &options.kills, .help = "SIGKILLs in all", .range = some},
                  {.name = "--others", .variable = &options.others, .help = "Tries of each other fault", .range = some},
                  {.name = "--flood", .variable = &options.floods, .help = "Candidates in the flood", .range = some},
                  {.name = "--seed", .variable = &options.seed, .help = "Of the random moments"},
                  ReportOption(options.report),
                  {.name = "--only", .variable = &options.only, .help = "One kind of faults", .one_of = kinds},
                  {.name = "--allow-untried",
                   .variable = &options.allow_untried,
                   .help = "What cannot be tried here, without root, is no failure"}}};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  const std::vector<Row> rows = Campaign(options).Run();
  Publish(options.report, "faults", Table(rows, options));
  for (const Row& row : rows)
    if (row.tries == 0) std::cerr << row.fault << ": " << row.remark << "\n";
  return std::ranges::all_of(rows, [&](const Row& row) { return IsClean(row, options); }) ? 0 : 1;
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) { return forereach::Main(argc, argv); }
