// What the supervisor does when the robot's program throws: at a send, a measurement, a hold, a brake law, an
// allocation or a clock, once or always, in any order of calls.
#include "tests/test.h"

#include <new>

#include "robot/supervisor.h"
#include "tests/messages.h"
#include "tests/robot/sealed_plan.h"
#include "tests/tries.h"

namespace {

enum Site { kSend, kState, kHold, kBrake, kReload, kClock, kAllocation, kSites };

// Which calls throw: one call of a site, every call of it from that one on, or any call with some probability.
struct Trouble {
  int site = kSites;
  long at = 0;
  bool lasts = false;
  double rate = 0;
  std::mt19937_64* random = nullptr;
  std::array<long, kSites> calls{};
  bool struck = false, struck_inside = false;  // inside: elsewhere than at a send
  bool is_inside = false;                      // of a call of the supervisor: allocations elsewhere are the test's own

  bool Strikes(Site of) {
    const long call = calls[of]++;
    const bool is_it = site == of && (lasts ? call >= at : call == at);
    const bool strikes = is_it || (rate > 0 && std::uniform_real_distribution<>(0, 1)(*random) < rate);
    struck = struck || strikes;
    struck_inside = struck_inside || (strikes && of != kSend);
    return strikes;
  }
  void Strike(Site of) {
    if (!Strikes(of)) return;
    const long kind = calls[of] % 3;
    if (kind == 0) throw 7;
    if (kind == 1) throw std::bad_alloc();
    throw std::exception();
  }
} trouble;

}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  if (trouble.is_inside && trouble.Strikes(kAllocation)) throw std::bad_alloc();
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace forereach::supervisor_exceptions_test {

constexpr std::int64_t kJitterUs = 3000;

SupervisorOptions OnTime() {
  SupervisorOptions options;
  options.guard.num_states = 2;
  options.guard.num_inputs = 1;
  options.guard.step_us = kPlanStepUs;
  return options;
}

// The slices of all steps are (1 +- 0.1) x (-2 +- 0.1).
certified_plan_t NarrowPlan(std::int64_t plan_id = 7, std::int64_t start_utime = kPlanStart) {
  certified_plan_t certified = SmallPlan(plan_id, kJitterUs);
  certified.plan.start_utime = start_utime;
  certified.expires_utime = start_utime + kPlanStepUs;
  for (int t = 0; t <= 3; ++t)
    for (int k = 0; k < 2; ++k) {
      certified.slice_lower[t][k] = (k == 0 ? 1 : -2) - 0.1;
      certified.slice_upper[t][k] = (k == 0 ? 1 : -2) + 0.1;
    }
  return certified;
}

std::int64_t At(int boundary) { return kPlanStart + boundary * kPlanStepUs; }

// A robot whose Send throws once, at the first report of a kind.
class SendsBadlyOnce final : public Supervisor::Robot {
 public:
  explicit SendsBadlyOnce(std::int16_t kind) : kind_(kind) {}
  std::span<const double> state() const override { return state_; }
  void Hold() override { ++holds_; }
  void Reload() override {}
  void Send(const std::string&, Bytes message) override {
    const auto event = Decoded<execution_event_t>(message);
    const bool strikes = event ? event->kind == kind_ : kind_ == 0 && Decoded<transition_t>(message).has_value();
    if (strikes && !std::exchange(struck_, true)) throw std::runtime_error("the radio is off");
    if (event) kinds_.push_back(event->kind);
  }

  std::array<double, 2> state_{1, -2};
  int holds_ = 0;
  bool struck_ = false;
  std::vector<std::int16_t> kinds_;

 private:
  const std::int16_t kind_;  // 0: a transition
};

constexpr std::array<std::int16_t, 3> kReports{execution_event_t::STARTED, 0, execution_event_t::STEP_INSIDE};

TEST(SupervisorExceptions, NoControlIsGivenForAnUncheckedStateAfterASendThatThrew) {
  for (const std::int16_t kind : kReports) {
    SendsBadlyOnce robot(kind);
    Supervisor supervisor(OnTime(), robot);
    supervisor.OnCertified(Sealed(NarrowPlan()), At(0) - 1000);
    for (int j = 0; j < 2 && !robot.struck_; ++j) {
      try {
        (void)supervisor.Boundary(At(j), At(j));
      } catch (const std::runtime_error&) {
      }
    }
    ASSERT_TRUE(robot.struck_) << kind;
    robot.state_ = {77, -2};
    EXPECT_TRUE(supervisor.Boundary(At(2), At(2) + 100'000).empty()) << kind;
    EXPECT_EQ(robot.holds_, 1) << kind;
  }
}

// Sets trouble.is_inside for a scope.
class Inside final {
 public:
  explicit Inside(bool is_inside) : before_(std::exchange(trouble.is_inside, is_inside)) {}
  ~Inside() { trouble.is_inside = before_; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

 private:
  const bool before_;
};

// A robot in trouble, and the program around its supervisor. It knows by itself which controls may be applied: control
// t of plan i is 10 i + t.
class TroubledRobot final : public Supervisor::Robot {
 public:
  TroubledRobot() : supervisor_(OnTime(), *this) { trouble = {}; }
  ~TroubledRobot() override { trouble = {}; }

  std::span<const double> state() const override {
    const Inside outside(false);
    state_threw_ = true;
    trouble.Strike(kState);
    state_threw_ = false;
    Meddle();
    return state_;
  }
  void Hold() override {
    const Inside outside(false);
    hold_threw_ = true;
    trouble.Strike(kHold);
    hold_threw_ = false;
    holds_ = true;
    Meddle();
  }
  int StepsToRest(std::span<const double>, std::span<const double>) const override {
    const Inside outside(false);
    trouble.Strike(kBrake);
    Meddle();
    return 1;
  }
  void Reload() override {
    const Inside outside(false);
    trouble.Strike(kReload);
    supervisor_.Expect(DigestOf("config"), DigestOf("model"));
  }
  void Send(const std::string& channel, Bytes message) override {
    const Inside outside(false);
    if (!decided_unmeasured_) decided_unmeasured_ = state_threw_;
    trouble.Strike(kSend);
    if (const auto event = Decoded<execution_event_t>(message)) kinds_.insert(event->kind);
    // Of each type the sequence comes first after the fingerprint and the time.
    sent_[channel].push_back(FromBigEndian<std::int64_t>(message.subspan(16)));
    if (!from_send_) return;
    const bool hold_threw = hold_threw_;  // in the call that sends
    const auto unmeasured = decided_unmeasured_;
    std::exchange(from_send_, nullptr)(*this);
    decided_unmeasured_ = unmeasured;
    hold_threw_ = hold_threw_ || hold_threw;
  }

  void Boundary(int j, std::int64_t late_us = 0) {
    Call(
        [&](std::int64_t now) {
          const std::int64_t before = supervisor_.counts().boundaries;
          const std::span<const double> control = supervisor_.Boundary(At(j), now);
          const Inside outside(false);
          const bool is_from_send = supervisor_.counts().boundaries == before;
          unmeasured_ += !is_from_send && decided_unmeasured_.value_or(state_threw_);
          if (is_from_send) {
            EXPECT_TRUE(control.empty());
          } else if (control.empty()) {
            EXPECT_TRUE(holds_ || hold_threw_);
          } else {
            Judge(control, now);
          }
        },
        At(j) + late_us);
  }
  void FinishStep(int j, std::int64_t late_us = 0) {
    Call([&](std::int64_t now) { supervisor_.FinishStep(At(j), now); }, At(j) + late_us);
  }
  void Certify(int j, bool is_for_now = true) {
    const std::int64_t id = next_id_++;
    certified_plan_t plan = NarrowPlan(id, At(j));
    for (int t = 0; t < 3; ++t) plan.plan.control[t][0] = static_cast<double>(10 * id + t);
    plan.plan.progress_steps = 2;
    Seal(plan);
    plans_[id] = plan;
    stands_[id] = 3;
    const auto bytes = Encode(plan);
    Call([&](std::int64_t now) { supervisor_.OnCertified(bytes, now); }, At(j) - (is_for_now ? 1000 : kPlanStepUs));
  }
  void Withdraw(std::int64_t id, int valid, int j) {
    const certified_plan_t& plan = plans_.at(id);
    withdrawal_t message{.utime = At(j),
                         .plan_id = id,
                         .expires_utime = plan.expires_utime,
                         .cause = withdrawal_t::OBSTACLE,
                         .valid_steps = static_cast<std::int16_t>(valid)};
    SetGrounds(message, GroundsOf(plan));
    SetDigest(message.certificate_digest, GetDigest(plan.certificate_digest));
    SetText(message.message, "a wall that is long enough for a sentence on the heap");
    const auto bytes = Encode(message);
    trouble.struck_inside = false;
    Call([&](std::int64_t now) { supervisor_.OnWithdrawn(bytes, now); }, At(j) + 1000);
    if (!trouble.struck_inside) stands_[id] = std::min(stands_[id], valid);  // otherwise it may not have got there
  }
  void Fault(int j) {
    fault_t fault{.utime = At(j), .cause = fault_t::SLICE_LEFT};
    SetText(fault.message, "a slice was left, which is long enough for a sentence on the heap");
    const auto bytes = Encode(fault);
    Call([&](std::int64_t now) { supervisor_.OnFault(bytes, now); }, At(j) + 1000);
  }
  void Command(std::int16_t kind, int j) {
    command_t command{.utime = At(j) + 2000, .kind = kind};
    SetText(command.source, "an operator whose name is long");
    const auto bytes = Encode(command);
    Call([&](std::int64_t now) { (void)supervisor_.OnCommand(bytes, now); }, At(j) + 2000);
  }
  void Report(int j) {
    Call([&](std::int64_t now) { supervisor_.Report(now, execution_event_t::CONTACT, -1, "a curb"); }, At(j));
  }

  // Every report was sent once and in order, or is a gap that is counted.
  void ExpectEachReportOnceOrCounted() {
    trouble.rate = 0;
    trouble.site = kSites;
    Boundary(1000);
    Report(1000);
    EXPECT_EQ(supervisor_.reports_waiting(), 0u);
    std::int64_t missing = 0;
    for (const auto& [channel, sequences] : sent_) {
      EXPECT_TRUE(std::ranges::is_sorted(sequences, std::less_equal{})) << channel;
      missing += sequences.back() + 1 - std::ssize(sequences);
    }
    EXPECT_EQ(missing, supervisor_.counts().reports_lost + unmeasured_);
    EXPECT_EQ(sent_["EXECUTION_EVENT"].size() + sent_["TRANSITION"].size() + sent_["ROBOT_STATE"].size() + missing,
              static_cast<std::size_t>(sent_["EXECUTION_EVENT"].back() + 1 + supervisor_.counts().steps +
                                       supervisor_.counts().boundaries));
  }

  std::array<double, 2> state_{1, -2};
  std::int64_t next_id_ = 1;
  int controls_ = 0;
  std::set<std::int16_t> kinds_;
  std::map<std::string, std::vector<std::int64_t>> sent_;
  void (*from_send_)(TroubledRobot&) = nullptr;  // called in the next Send
  bool meddles_ = false;                         // the next other function calls what it may not
  Supervisor supervisor_;

 private:
  // Calls the supervisor at `utime`, as a program does that holds if its clock throws.
  template <class Body>
  void Call(const Body& body, std::int64_t utime) {
    hold_threw_ = false;
    decided_unmeasured_.reset();
    try {
      const Inside outside(false);
      trouble.Strike(kClock);
    } catch (...) {
      holds_ = true;
      return;
    }
    const Inside inside(true);
    body(utime);
  }
  void Meddle() const {
    if (!std::exchange(const_cast<bool&>(meddles_), false)) return;
    auto& supervisor = const_cast<Supervisor&>(supervisor_);
    EXPECT_TRUE(supervisor.Boundary(At(0), At(0)).empty());
    supervisor.FinishStep(At(0), At(0));
    supervisor.OnCertified({}, 0);
    EXPECT_EQ(supervisor.OnCommand({}, 0), "not obeyed");
  }
  void Judge(std::span<const double> control, std::int64_t now) {
    const auto number = static_cast<std::int64_t>(Only(control));
    const std::int64_t id = number / 10, step = number % 10;
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_LE(plans_.at(id).slice_lower[step][k], state_[k]);
      EXPECT_LE(state_[k], plans_.at(id).slice_upper[step][k]);
    }
    EXPECT_LE(std::abs(now - plans_.at(id).plan.start_utime - step * kPlanStepUs), kJitterUs);
    EXPECT_LT(step, stands_.at(id));
    EXPECT_FALSE(supervisor_.halted());
    EXPECT_EQ(supervisor_.control().data(), control.data());
    holds_ = false;
    ++controls_;
  }

  std::map<std::int64_t, certified_plan_t> plans_;
  std::map<std::int64_t, int> stands_;      // controls that were not withdrawn
  std::int64_t unmeasured_ = 0;             // boundaries that had no state to send
  std::optional<bool> decided_unmeasured_;  // when this call began to send
  bool holds_ = true;
  mutable bool state_threw_ = false, hold_threw_ = false;
};

// Two plans to their ends, a withdrawal, a fault, a reset, a reload. After the first strike the program tries a
// boundary again, 100 ms late and with a state far outside.
void Drive(TroubledRobot& robot, bool tries_again) {
  bool tried = !tries_again;
  const auto then = [&](int j) {
    if (!trouble.struck || std::exchange(tried, true)) return;
    const std::array<double, 2> before = std::exchange(robot.state_, {77, -2});
    robot.Boundary(j, 100'000);
    robot.state_ = before;
  };
  const auto boundaries = [&](int from, int to) {
    for (int j = from; j <= to; ++j) robot.Boundary(j), then(j);
  };
  robot.Certify(0), then(0);
  boundaries(0, 0);
  robot.Certify(2, false), then(1);
  robot.FinishStep(1), then(1);
  robot.Report(1), then(1);
  boundaries(1, 3);
  robot.Withdraw(2, 2, 3), then(3);
  boundaries(4, 5);
  robot.Certify(6), then(5);
  boundaries(6, 6);
  robot.Fault(6), then(6);
  EXPECT_TRUE(robot.supervisor_.halted() || (trouble.struck && trouble.site == kClock));
  boundaries(7, 7);
  robot.Command(command_t::RESET, 7), then(7);
  robot.Command(command_t::RELOAD, 7), then(7);
  robot.Certify(8), then(8);
  boundaries(8, 12);
}

TEST(SupervisorExceptions, WithoutAnyTheDriveOfTheseTestsGoesThroughEachKindOfCall) {
  TroubledRobot robot;
  Drive(robot, false);
  EXPECT_EQ(robot.controls_, 2 + 2 + 1 + 3);
  for (const std::int16_t kind :
       {execution_event_t::ACCEPTED, execution_event_t::STARTED, execution_event_t::STEP_INSIDE,
        execution_event_t::TAIL_BEGUN, execution_event_t::STANDING, execution_event_t::CONTACT,
        execution_event_t::HALTED, execution_event_t::RESET, execution_event_t::WITHDRAWN,
        execution_event_t::EMERGENCY_STOP})
    EXPECT_EQ(robot.kinds_.count(kind), 1u) << kind;
  for (int site = 0; site < kSites; ++site) EXPECT_GT(trouble.calls[static_cast<std::size_t>(site)], 0) << site;
  EXPECT_EQ(robot.supervisor_.counts().errors, 0);
  robot.ExpectEachReportOnceOrCounted();
}

TEST(SupervisorExceptions, AtEachCallInTurnOnlyCheckedControlsAreGiven) {
  for (int site = 0; site < kSites; ++site)
    for (const bool lasts : {false, true})
      for (const bool tries_again : {false, true}) {
        bool strikes = true;
        for (long at = 0; strikes && !testing::Test::HasFailure(); ++at) {
          SCOPED_TRACE("site " + std::to_string(site) + ", call " + std::to_string(at) + (lasts ? " and on" : "") +
                       (tries_again ? ", and again" : ""));
          TroubledRobot robot;
          trouble.site = site;
          trouble.at = at;
          trouble.lasts = lasts;
          Drive(robot, tries_again);
          strikes = trouble.struck;
          const Supervisor::Counts& counts = robot.supervisor_.counts();
          EXPECT_EQ(counts.failed_sends > 0, strikes && site == kSend);
          if (strikes && (site == kState || site == kHold || site == kBrake || site == kReload))
            EXPECT_GT(counts.errors, 0);
          if (site == kSend || site == kClock) EXPECT_EQ(counts.errors, 0);
          if (site == kSend && !tries_again) EXPECT_EQ(robot.controls_, 8) << "a send that throws stops nobody";
          robot.ExpectEachReportOnceOrCounted();
        }
      }
}

TEST(SupervisorExceptions, InAnyOrderOfCallsOnlyCheckedControlsAreGiven) {
  constexpr std::uint64_t kSeed = 20260611;
  std::cout << "seed " << kSeed << "\n";
  std::int64_t controls = 0, errors = 0, failed = 0, withdrawn = 0, halted = 0;
  const int tries = Tries(1500);
  for (int i = 0; i < tries && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE("try " + std::to_string(i));
    std::mt19937_64 random(kSeed + static_cast<std::uint64_t>(i));
    const auto one_of = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    TroubledRobot robot;
    std::mt19937_64 strikes(random());
    trouble.random = &strikes;
    trouble.rate = std::array{0.0, 0.002, 0.02, 0.2}[i % 4];
    int j = 0;
    for (int call = 0; call < 80; ++call) {
      robot.state_ = one_of(12) == 0 ? std::array{one_of(2) == 0 ? 77 : 1.11, -2.0} : std::array{1.05, -1.95};
      const std::int64_t late = one_of(10) == 0 ? 100'000 : one_of(8) == 0 ? -3001 : one_of(6001) - 3000;
      if (one_of(20) == 0) robot.meddles_ = true;
      if (one_of(10) == 0)
        robot.from_send_ = std::array<void (*)(TroubledRobot&), 4>{
            [](TroubledRobot& r) { r.Report(3); }, [](TroubledRobot& r) { r.Fault(3); },
            [](TroubledRobot& r) { r.Certify(4); }, [](TroubledRobot& r) { r.Boundary(4); }}[one_of(4)];
      switch (one_of(16)) {
        case 0: robot.FinishStep(j, late); break;
        case 1:
          if (robot.next_id_ > 1) robot.Withdraw(robot.next_id_ - 1 - one_of(2) % (robot.next_id_ - 1), one_of(4), j);
          break;
        case 2:
          if (one_of(3) == 0) robot.Fault(j);
          break;
        case 3: robot.Command(command_t::RESET, j); break;
        case 4: robot.Command(command_t::RELOAD, j); break;
        case 5: robot.Report(j); break;
        case 6: robot.Boundary(j + one_of(3) - 1, late); break;
        case 7:
        case 8:
        case 9: robot.Certify(j + one_of(2)); break;
        default: robot.Boundary(j++, late);
      }
    }
    controls += robot.controls_;
    errors += robot.supervisor_.counts().errors;
    failed += robot.supervisor_.counts().failed_sends;
    withdrawn += robot.supervisor_.counts().emergency_stops;
    halted += robot.kinds_.count(execution_event_t::HALTED);
    robot.ExpectEachReportOnceOrCounted();
  }
  EXPECT_GT(controls, tries);
  EXPECT_GT(errors, tries / 10);
  EXPECT_GT(failed, tries / 10);
  EXPECT_GT(withdrawn, tries / 100);
  EXPECT_GT(halted, tries / 100);
}

// What a robot is told and what it sends, with each function as the test sets it.
struct OddRobot final : Supervisor::Robot {
  OddRobot() { trouble = {}; }
  std::span<const double> state() const override { return measure(); }
  void Hold() override { hold(); }
  int StepsToRest(std::span<const double>, std::span<const double>) const override { return 0; }
  void Reload() override { throw std::runtime_error("the task cannot be read"); }
  void Send(const std::string& channel, Bytes message) override {
    send(channel);
    if (const auto event = Decoded<execution_event_t>(message)) events.push_back(*event);
    if (const auto state = Decoded<robot_state_t>(message)) states.push_back(*state);
    if (const auto transition = Decoded<transition_t>(message)) transitions.push_back(*transition);
  }
  [[nodiscard]] std::vector<std::int16_t> Kinds() const {
    std::vector<std::int16_t> kinds;
    for (const execution_event_t& event : events) kinds.push_back(event.kind);
    return kinds;
  }
  // From boundary 0 on.
  void Start(std::int64_t plan_id = 7, int boundary = 0) {
    supervisor.OnCertified(Sealed(NarrowPlan(plan_id, At(boundary))), At(boundary) - 1000);
    EXPECT_FALSE(supervisor.Boundary(At(boundary), At(boundary)).empty());
  }

  std::array<double, 2> x{1, -2};
  int holds = 0;
  std::function<std::span<const double>()> measure = [this]() -> std::span<const double> { return x; };
  std::function<void()> hold = [this] { ++holds; };
  std::function<void(const std::string&)> send = [](const std::string&) {};
  std::vector<execution_event_t> events;
  std::vector<robot_state_t> states;
  std::vector<transition_t> transitions;
  Supervisor supervisor{OnTime(), *this};
};

template <class Message>
std::vector<std::int64_t> SequencesOf(const std::vector<Message>& messages) {
  std::vector<std::int64_t> sequences;
  for (const Message& message : messages) sequences.push_back(message.sequence);
  return sequences;
}

TEST(SupervisorSends, AReportThatCannotBeSentIsCountedAndSentAgainInItsOrder) {
  OddRobot robot;
  robot.send = [](const std::string&) { throw 7; };
  robot.Start();
  EXPECT_FALSE(robot.supervisor.Boundary(At(1), At(1)).empty());
  EXPECT_EQ(robot.supervisor.reports_waiting(), 4u + 1 + 2);
  EXPECT_EQ(robot.supervisor.counts().failed_sends, 1 + 2 + 3) << "one of each channel in each call";
  robot.send = [](const std::string&) {};
  EXPECT_FALSE(robot.supervisor.Boundary(At(2), At(2)).empty());
  EXPECT_EQ(robot.supervisor.reports_waiting(), 0u);
  EXPECT_THAT(robot.Kinds(),
              ElementsAre(execution_event_t::ACCEPTED, execution_event_t::STARTED, execution_event_t::STEP_INSIDE,
                          execution_event_t::TAIL_BEGUN, execution_event_t::STEP_INSIDE));
  EXPECT_THAT(SequencesOf(robot.events), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(SequencesOf(robot.states), ElementsAre(0, 1, 2));
  EXPECT_THAT(SequencesOf(robot.transitions), ElementsAre(0, 1));
  EXPECT_EQ(robot.states[0].utime, At(0)) << "when it was measured, not when it was sent";
  EXPECT_EQ(robot.holds, 0);
}

TEST(SupervisorSends, AChannelThatFailsHoldsUpNoOther) {
  OddRobot robot;
  robot.send = [](const std::string& channel) {
    if (channel == "EXECUTION_EVENT") throw std::runtime_error("this channel has no room");
  };
  robot.Start();
  (void)robot.supervisor.Boundary(At(1), At(1));
  EXPECT_THAT(SequencesOf(robot.states), ElementsAre(0, 1));
  EXPECT_THAT(SequencesOf(robot.transitions), ElementsAre(0));
  EXPECT_THAT(robot.events, IsEmpty());
}

TEST(SupervisorSends, OfMoreThanFitTheOldestAreLostAndAGapSaysHowMany) {
  constexpr int kMost = static_cast<int>(ReportQueue::kMostWaiting);
  for (const int more : {0, 1, 1000}) {
    OddRobot robot;
    robot.send = [](const std::string&) { throw 7; };
    for (int j = 0; j < kMost + more; ++j) EXPECT_TRUE(robot.supervisor.Boundary(At(j), At(j)).empty());
    EXPECT_FIELDS(robot.supervisor, (reports_waiting(), ReportQueue::kMostWaiting), (counts().reports_lost, more));
    robot.send = [](const std::string&) {};
    robot.supervisor.Report(At(0), execution_event_t::CONTACT, 0, "a curb");
    ASSERT_EQ(std::ssize(robot.states), kMost);
    EXPECT_FIELDS(robot.states, (front().sequence, more), (back().sequence, kMost + more - 1));
  }
}

TEST(SupervisorSends, ASendThatReportsWithoutEndEnds) {
  OddRobot robot;
  robot.send = [&](const std::string&) { robot.supervisor.Report(At(0), execution_event_t::CONTACT, 0, "a curb"); };
  robot.supervisor.Report(At(0), execution_event_t::CONTACT, 0, "a curb");
  EXPECT_EQ(robot.events.size(), 1u);
  EXPECT_EQ(robot.supervisor.reports_waiting(), 1u) << "it is sent in the next call";
}

TEST(SupervisorSends, AFaultThatArrivesInASendStopsTheRobotBeforeTheCallReturns) {
  OddRobot robot;
  robot.Start();
  fault_t fault{.utime = At(1), .cause = fault_t::SLICE_LEFT};
  robot.send = [&](const std::string&) { robot.supervisor.OnFault(Encode(fault), At(1)); };
  EXPECT_TRUE(robot.supervisor.Boundary(At(1), At(1)).empty());
  EXPECT_EQ(robot.holds, 1);
  EXPECT_TRUE(robot.supervisor.halted());
}

TEST(SupervisorSends, ABoundaryInASendGivesNoControlAndEndsThePlan) {
  OddRobot robot;
  robot.Start();
  bool is_first = true;
  robot.send = [&](const std::string&) {
    if (!std::exchange(is_first, false)) return;
    EXPECT_TRUE(robot.supervisor.Boundary(At(2), At(2)).empty());
  };
  EXPECT_TRUE(robot.supervisor.Boundary(At(1), At(1)).empty());
  EXPECT_FIELDS(robot, (holds, 1), (supervisor.counts().boundaries, 2));
}

TEST(SupervisorExceptions, ThePlanEndsAndItsCauseIsReportedWithoutAHalt) {
  for (const bool is_standard : {false, true}) {
    OddRobot robot;
    robot.Start();
    robot.measure = [&]() -> std::span<const double> {
      if (is_standard) throw std::runtime_error("no scan");
      throw 7;
    };
    EXPECT_TRUE(robot.supervisor.Boundary(At(1), At(1)).empty());
    EXPECT_EQ(robot.holds, 1);
    EXPECT_THAT(SequencesOf(robot.states), ElementsAre(0)) << "there is no state to send";
    EXPECT_FIELDS(robot.events.back(), (kind, execution_event_t::ERROR_STOP), (plan_id, 7));
    EXPECT_THAT(GetText(robot.events.back().message),
                HasSubstr(is_standard ? "threw an exception: no scan" : "threw what is no std::exception"));
    EXPECT_FALSE(robot.supervisor.halted());
    robot.measure = [&]() -> std::span<const double> { return robot.x; };
    EXPECT_TRUE(robot.supervisor.Boundary(At(2), At(2)).empty()) << "that plan does not go on";
    EXPECT_THAT(SequencesOf(robot.states), ElementsAre(0, 2)) << "a gap for the boundary without a state";
    robot.Start(8, 3);
    EXPECT_EQ(robot.supervisor.counts().errors, 1);
  }
}

// Between an exception and the next boundary.
TEST(SupervisorExceptions, APlanThatArrivesAfterOneStartsAsAnyOther) {
  for (const double x : {1.0, 77.0}) {
    OddRobot robot;
    robot.Start();
    const auto measure = std::exchange(robot.measure, []() -> std::span<const double> { throw std::bad_alloc(); });
    EXPECT_TRUE(robot.supervisor.Boundary(At(1), At(1)).empty());
    robot.supervisor.OnCertified(Sealed(NarrowPlan(8, At(2))), At(1) + 1000);
    robot.measure = measure;
    robot.x[0] = x;
    EXPECT_EQ(robot.supervisor.Boundary(At(2), At(2)).empty(), x == 77);
    EXPECT_EQ(robot.supervisor.counts().started, x == 77 ? 1 : 2);
  }
}

TEST(SupervisorExceptions, AHoldThatThrowsIsCalledAgainBeforeAnythingStarts) {
  OddRobot robot;
  robot.Start();
  robot.hold = [] { throw std::runtime_error("no pressure"); };
  robot.x[0] = 77;
  EXPECT_TRUE(robot.supervisor.Boundary(At(1), At(1)).empty());
  EXPECT_EQ(robot.events.back().kind, execution_event_t::ERROR_STOP);
  robot.x[0] = 1;
  command_t reset{.utime = At(1) + 1, .kind = command_t::RESET};
  EXPECT_EQ(robot.supervisor.OnCommand(Encode(reset), At(1) + 2), "") << "a reset is a reset, whatever the brakes do";
  robot.supervisor.OnCertified(Sealed(NarrowPlan(8, At(2))), At(1) + 1000);
  EXPECT_TRUE(robot.supervisor.Boundary(At(2), At(2)).empty());
  robot.hold = [&] { ++robot.holds; };
  robot.supervisor.Report(At(3), execution_event_t::CONTACT, 0, "a curb");
  EXPECT_EQ(robot.holds, 1);
  robot.supervisor.Report(At(3), execution_event_t::CONTACT, 0, "a curb");
  EXPECT_EQ(robot.holds, 1);
  robot.Start(9, 4);
}

TEST(SupervisorExceptions, AFaultHaltsARobotThatCanNeitherMeasureNorHold) {
  OddRobot robot;
  robot.Start();
  robot.measure = []() -> std::span<const double> { throw 7; };
  robot.hold = [] { throw 7; };
  robot.supervisor.OnFault(Encode(fault_t{.utime = At(1), .cause = fault_t::SLICE_LEFT}), At(1));
  EXPECT_TRUE(robot.supervisor.halted());
  EXPECT_TRUE(robot.supervisor.control().empty());
  const auto halted = std::ranges::find(robot.events, execution_event_t::HALTED, &execution_event_t::kind);
  ASSERT_NE(halted, robot.events.end()) << "nobody else says that it needs a reset";
  EXPECT_FIELDS(*halted, (plan_id, 7), (step, 0), (num_states, 2));
  EXPECT_EQ(halted->state[0], 1) << "measured last";
  EXPECT_EQ(robot.events.back().kind, execution_event_t::ERROR_STOP);
}

TEST(SupervisorExceptions, AStateOutsideItsSliceHaltsARobotWithoutMemory) {
  OddRobot robot;
  robot.Start();
  robot.x[0] = 77;
  trouble.site = kAllocation;
  trouble.at = trouble.calls[kAllocation];
  trouble.lasts = true;
  {
    const Inside inside(true);
    EXPECT_TRUE(robot.supervisor.Boundary(At(1), At(1)).empty());
  }
  EXPECT_TRUE(trouble.struck);
  trouble = {};
  EXPECT_TRUE(robot.supervisor.halted());
  EXPECT_EQ(robot.holds, 1);
}

TEST(SupervisorExceptions, AReloadThatThrowsEndsThePlan) {
  OddRobot robot;
  robot.Start();
  command_t reload{.utime = At(0), .kind = command_t::RELOAD};
  EXPECT_EQ(robot.supervisor.OnCommand(Encode(reload), At(0)), "not obeyed");
  EXPECT_EQ(robot.holds, 1);
  EXPECT_TRUE(robot.supervisor.Boundary(At(1), At(1)).empty());
}

TEST(SupervisorExceptions, BoundaryChecksTheStateAndTheTimeOfAStepThatWasFinishedBefore) {
  struct {
    double x;
    std::int64_t late_us;
    bool passes;
  } const cases[] = {{1.1, 3000, true}, {1.11, 0, false}, {1, 3001, false}, {1, kPlanStepUs, false}};
  for (const auto& [x, late_us, passes] : cases) {
    OddRobot robot;
    robot.Start();
    robot.supervisor.FinishStep(At(1), At(1));
    EXPECT_TRUE(robot.supervisor.control().empty()) << "no boundary has returned it";
    robot.x[0] = x;
    EXPECT_EQ(!robot.supervisor.Boundary(At(1), At(1) + late_us).empty(), passes) << x << " " << late_us;
    EXPECT_FIELDS(robot, (holds, passes ? 0 : 1), (transitions.size(), 1u), (supervisor.halted(), x == 1.11));
  }
}

TEST(SupervisorExceptions, AStateOfAnotherSizeIsNotGivenToTheBrakeLaw) {
  OddRobot robot;
  robot.Start();
  const std::array<double, 1> one{1};
  robot.measure = [&]() -> std::span<const double> { return one; };
  certified_plan_t plan = NarrowPlan();
  Seal(plan);
  withdrawal_t message{.plan_id = 7, .cause = withdrawal_t::OBSTACLE};
  SetDigest(message.certificate_digest, GetDigest(plan.certificate_digest));
  robot.supervisor.OnWithdrawn(Encode(message), At(0) + 1000);
  EXPECT_EQ(robot.events.back().kind, execution_event_t::EMERGENCY_STOP);
  EXPECT_EQ(robot.events.back().value, -1) << "the steps are unknown";
  EXPECT_EQ(robot.holds, 1);
}

}  // namespace forereach::supervisor_exceptions_test
