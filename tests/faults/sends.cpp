// A supervisor in the closed loop with the gate and a simulated robot, whose Send, clock and allocator throw at random
// calls: in this process, on a clock that is stepped.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <new>
#include <stdexcept>
#include <utility>

#include "bus/authentic.h"
#include "certifier/gate/gate.h"
#include "robot/supervisor.h"
#include "task/step_time.h"
#include "tests/certifier/small_task.h"
#include "tests/faults/kind.h"
#include "tests/keys.h"

namespace {

enum Site { kAtSend, kAtClock, kAtAllocation, kSites };

// Which calls throw, each with its rate; an allocation only where the supervisor is at work.
struct Mischief {
  std::array<double, kSites> rates{};
  std::array<std::int64_t, kSites> struck{};
  std::mt19937* random = nullptr;
  bool is_supervising = false;

  bool Strikes(Site site) {
    if (rates[site] == 0 || std::uniform_real_distribution<>(0, 1)(*random) >= rates[site]) return false;
    ++struck[site];
    return true;
  }
};
thread_local Mischief mischief;

}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  if (mischief.is_supervising && mischief.Strikes(kAtAllocation)) throw std::bad_alloc();
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace forereach {
namespace {

constexpr std::int64_t kStepUs = 150'000, kJitterUs = 3000;
constexpr int kBoundaries = 1000, kCalm = 40, kAhead = 2;
const std::string kBusName = "the campaign's";

class Supervising final {
 public:
  explicit Supervising(bool is_it) : before_(std::exchange(mischief.is_supervising, is_it)) {}
  ~Supervising() { mischief.is_supervising = before_; }
  Supervising(const Supervising&) = delete;
  Supervising& operator=(const Supervising&) = delete;

 private:
  const bool before_;
};

Config StepsWithinJitter(Config config) {
  config.gate.step_error_ms = kJitterUs * 1e-3;
  Own(config.problem).timing.error = StepErrorSeconds(config);
  return config;
}

SupervisorOptions OptionsFor(const Config& config) {
  SupervisorOptions options;
  options.guard = {config.problem->model->num_states(), config.problem->model->num_inputs(), kStepUs,
                   config.grounds.config, config.grounds.model};
  options.guard.keys = TestKeys("campaign");
  options.guard.bus_name = kBusName;
  return options;
}

// It drives about the origin, from certified plan to certified plan. What it notes is what may not happen.
class ThrowingRobot final : private Supervisor::Robot {
 public:
  explicit ThrowingRobot(std::mt19937& random) : random_(random), supervisor_(OptionsFor(config_), *this) {
    mischief = {};
    mischief.random = &random_;
  }
  ~ThrowingRobot() override { mischief = {}; }

  void Drive(int boundaries, const std::array<double, kSites>& rates) {
    mischief.rates = rates;
    for (int j = 0; j < boundaries; ++j) Boundary();
    mischief.rates = {};
  }
  /** Every report was sent once, in its order. */
  void CheckReports() {
    Note(supervisor_.reports_waiting() == 0 && supervisor_.counts().reports_lost == 0, "a report was lost");
    Note(std::ssize(sent_["ROBOT_STATE"]) == supervisor_.counts().boundaries, "not one state for each boundary");
    Note(std::ssize(sent_["TRANSITION"]) == supervisor_.counts().steps, "not one transition for each step");
    for (const auto& [channel, sequences] : sent_)
      for (std::size_t i = 0; i < sequences.size(); ++i)
        Note(sequences[i] == static_cast<std::int64_t>(i), channel + ": lost, doubled or out of order");
  }
  [[nodiscard]] std::vector<std::string> TakeViolations() { return std::exchange(violations_, {}); }
  [[nodiscard]] const Supervisor::Counts& counts() const { return supervisor_.counts(); }
  [[nodiscard]] std::int64_t controls() const { return controls_; }

 private:
  using State = std::array<double, 4>;

  std::span<const double> state() const override { return state_; }
  void Reload() override {}
  void Hold() override {
    state_[2] = state_[3] = 0;
    applied_ = nullptr;
  }
  void Send(const std::string& channel, Bytes message) override {
    const Supervising not_now(false);
    if (mischief.Strikes(kAtSend)) throw std::runtime_error("the radio is off");
    sent_[channel].push_back(FromBigEndian<std::int64_t>(message.subspan(16)));  // behind fingerprint and time
  }

  void Boundary() {
    utime_ += kStepUs;
    if (applied_) Move(state_, applied_);
    std::int64_t now_us = utime_;
    // A program whose clock throws holds, and looks again.
    while (mischief.Strikes(kAtClock)) Hold(), now_us += static_cast<std::int64_t>(random_() % (2 * kJitterUs));
    Apply(now_us);
    if (supervisor_.halted()) Reset(now_us + 1);
    if (certified_.rbegin() == certified_.rend() || certified_.rbegin()->second.plan.start_utime <= utime_) Propose();
  }

  void Apply(std::int64_t now_us) {
    applied_ = nullptr;
    const std::span<const double> control = [&] {
      const Supervising now(true);
      return supervisor_.Boundary(utime_, now_us);
    }();
    if (control.empty()) return;
    ++controls_;
    Note(std::abs(now_us - utime_) <= kJitterUs, "a step is off schedule");
    for (const auto& [id, certified] : certified_) {
      const std::int64_t step = (utime_ - certified.plan.start_utime) / kStepUs;
      if (certified.plan.start_utime <= utime_ && step < certified.plan.num_steps &&
          std::ranges::equal(control, std::span(certified.plan.control[step]).first(2)) && IsInside(certified, step))
        executing_ = id, applied_ = certified.plan.control[step];
    }
    Note(applied_ != nullptr, "a control goes out that is of no certified plan, or not from inside its slice");
  }

  [[nodiscard]] bool IsInside(const certified_plan_t& certified, std::int64_t step) const {
    for (std::size_t k = 0; k < state_.size(); ++k)
      if (!(certified.slice_lower[step][k] <= state_[k] && state_[k] <= certified.slice_upper[step][k])) return false;
    return true;
  }

  void Move(State& state, const double* control) const {
    const std::array<double, 6> z{state[0], state[1], state[2], state[3], control[0], control[1]};
    config_.problem->model->Evaluate(z, state);
  }

  // Where it will be if nothing throws, as a planner predicts it.
  [[nodiscard]] State Predicted() const {
    State state = state_;
    for (int ahead = 0; ahead < kAhead; ++ahead) {
      const std::int64_t at = utime_ + ahead * kStepUs;
      const candidate_plan_t* plan = applied_ ? &certified_.at(executing_).plan : nullptr;
      if (plan && (at - plan->start_utime) / kStepUs < plan->num_steps)
        Move(state, plan->control[(at - plan->start_utime) / kStepUs]);
      else
        state[2] = state[3] = 0;
    }
    return state;
  }

  void Propose() {
    const State from = Predicted();
    candidate_plan_t candidate = Candidate(next_id_++, 0, utime_);
    candidate.start_utime = utime_ + kAhead * kStepUs;
    candidate.num_steps = 6;
    candidate.progress_steps = 3;
    for (std::size_t k = 0; k < from.size(); ++k) candidate.initial_center[k] = from[k];
    for (std::size_t k = 0; k < 2; ++k) {
      const double some = std::uniform_real_distribution<>(-0.5, 0.5)(random_);
      for (int t = 0; t < candidate.num_steps; ++t)
        candidate.control[t][k] = std::clamp(-0.4 * from[k] - 0.8 * from[k + 2] + some, -2.0, 2.0);
    }
    const GateAnswer answer = gate_.Decide(Encode(candidate), utime_);
    if (!answer.certified) return;
    certified_[candidate.plan_id] = *answer.certified;
    const auto message = signer_.Sign(Role::kCertifier, "PLAN_CERTIFIED", Encode(*answer.certified), utime_);
    const Supervising now(true);
    supervisor_.OnCertified(message, utime_ + 1000);
  }

  void Reset(std::int64_t now_us) {
    command_t command{.utime = now_us, .kind = command_t::RESET};
    const auto message = signer_.Sign(Role::kOperator, "COMMAND", Encode(command), now_us);
    const Supervising now(true);
    (void)supervisor_.OnCommand(message, now_us);
  }

  void Note(bool holds, const std::string& what) {
    if (!holds) violations_.push_back(what);
  }

  std::mt19937& random_;
  const Config config_ = StepsWithinJitter(SmallTask());
  Gate gate_{config_};
  Signer signer_{TestKeys("campaign"), kBusName};
  State state_{};
  std::int64_t utime_ = kNow, next_id_ = 1, executing_ = 0, controls_ = 0;
  const double* applied_ = nullptr;  // the control, in certified_
  std::map<std::int64_t, certified_plan_t> certified_;
  std::map<std::string, std::vector<std::int64_t>> sent_;  // sequence numbers
  std::vector<std::string> violations_;
  Supervisor supervisor_;
};

struct Thrown final : Kind {
  using Kind::Kind;

  void AtRandomCalls() {
    Row& row = Begin("A robot whose Send, clock or allocator throws at random calls");
    std::array<std::int64_t, kSites> struck{};
    std::int64_t controls = 0, refused = 0;
    for (int i = 0; i < options_.others; ++i) {
      ++row.tries;
      ThrowingRobot robot(random_);
      robot.Drive(kBoundaries, {0.3, 0.02, 0.02});
      const std::int64_t started = robot.counts().started;
      for (std::size_t site = 0; site < kSites; ++site) struck[site] += mischief.struck[site];
      robot.Drive(kCalm, {});
      robot.CheckReports();
      for (const std::string& violation : robot.TakeViolations()) Demand(row, false, violation);
      row.recovered += robot.counts().started > started;
      controls += robot.controls();
      for (const auto& [cause, count] : robot.counts().refused) refused += count;
      progress_->Advance();
    }
    Demand(row, *std::ranges::min_element(struck) > 0, "one of the three never threw");
    Demand(row, controls > 0 && refused > 0, "nothing was driven, or nothing was refused");
    Remark(row, "a send threw " + std::to_string(struck[kAtSend]) + " times, the clock " +
                    std::to_string(struck[kAtClock]) + ", an allocation " + std::to_string(struck[kAtAllocation]) +
                    "; " + std::to_string(controls) + " controls, " + std::to_string(refused) +
                    " plans and steps refused");
  }
};

}  // namespace

void Sends(Campaign& campaign) { Thrown(campaign).AtRandomCalls(); }

}  // namespace forereach
