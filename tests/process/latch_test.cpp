// What a certifier does not forget when it ends: faults and contradictions, on disks that work and on disks that do
// not.
#include <sys/stat.h>
#include <unistd.h>

#include "tests/test.h"

#include "certifier/process/certifier_node.h"
#include "certifier/process/faults.h"
#include "tests/certifier/small_task.h"
#include "tests/file_size_limit.h"
#include "tests/small_disk.h"

namespace forereach::latch_test {

void WriteFile(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }
using Harm = std::function<void(const std::string& file)>;

struct LatchTest : testing::Test {
  LatchTest() { config_.gate.needs_robot_state = true; }

  // Ends a certifier without a word, as SIGKILL does, and begins the next.
  void Begin() {
    node_.reset();
    faults_.clear();
    certified_ = 0;
    status_ = {};
    bus_ = OpenBus("memq://", clock_);
    Hear(*bus_, "FAULT", faults_);
    Hear(*bus_, "PLAN_DECISION", decision_);
    bus_->Subscribe("PLAN_CERTIFIED", [this](const Received&) { ++certified_; });
    Hear(*bus_, "PLAN_WITHDRAWN", withdrawal_);
    Hear(*bus_, "CERTIFIER_STATUS", status_);
    node_ = std::make_unique<CertifierNode>(config_, *bus_, Clocks{clock_, clock_}, 0,
                                            std::make_unique<LatchFile>(directory_));
    Run();
  }
  void Run() {
    bus_->Dispatch(0);
    node_->Tick(now_us_);
    bus_->Dispatch(0);
  }
  void Heartbeat() {
    now_us_ += CertifierNode::kHeartbeatUs;
    SayState();
  }
  void SayState(std::int64_t executing = -1) {
    bus_->Publish("ROBOT_STATE", StateOf(now_us_, sequence_++, executing, executing < 0 ? -1 : 0));
    Run();
  }
  const decision_t& Ask() {
    bus_->Publish("PLAN_CANDIDATE", Candidate(next_plan_id_++, kAccelerationThatCertifies, now_us_));
    Run();
    return decision_;
  }
  // The robot's state is lost.
  void Fault() {
    SayState();
    now_us_ += 1'000'001;
    Run();
  }
  // Leaves a fault and one contradiction in the latch, and no certifier.
  void FalsifyAndEnd() {
    Begin();
    SayState();
    Falsify();
    node_.reset();
  }
  void Falsify(std::int64_t duration_us = 150'000) {
    transition_t transition = Executed(*config_.problem->model, Vec({1, 1, 0.5, 0.5, 0, 0}), 0.01);
    transition.duration_us = duration_us;
    bus_->Publish("TRANSITION", transition);
    Run();
  }
  void Reset(std::int64_t utime) {
    bus_->Publish("COMMAND", ResetAt(utime));
    Run();
  }
  void Reset() {
    now_us_ += 1;
    Reset(now_us_);
  }
  // The next certifier, on a reset and a state: whether it finds the declaration false.
  bool IsFalsifiedAfterARestart() {
    Begin();
    Reset();
    SayState();
    return Ask().outcome == decision_t::ABSTAIN_FALSIFIED;
  }
  void ExpectFalsified() {
    Begin();
    SayState();
    EXPECT_EQ(Ask().outcome, decision_t::ABSTAIN_FALSIFIED);
  }
  void Declare(double noise_bound) { Own(config_.problem).declaration.noise_bound.setConstant(noise_bound); }
  void ExpectNotArmed(const std::string& why) {
    SayState();
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_LATCH_UNWRITABLE);
    EXPECT_EQ(decision_.outcome, decision_t::REJECTED);
    EXPECT_THAT(GetText(decision_.message), StartsWith("rejected: no fault could be stored: "));
    Heartbeat();
    EXPECT_FIELDS(status_, (state, certifier_status_t::DISARMED), (level, certifier_status_t::ERROR),
                  (latch, certifier_status_t::LATCH_UNWRITABLE));
    EXPECT_THAT(node_->watch().Lacks(Watch::Need::kLatch), HasSubstr(why));
    EXPECT_EQ(certified_, 0);
  }
  void ExpectArmed() {
    Heartbeat();
    EXPECT_EQ(Ask().outcome, decision_t::CERTIFIED) << GetText(decision_.message);
    Heartbeat();
    EXPECT_EQ(status_.level, certifier_status_t::OK) << GetText(status_.message);
    EXPECT_EQ(status_.latch, certifier_status_t::LATCH_NONE);
  }

  std::int64_t now_us_ = kNow;
  const Clock clock_ = [this] { return now_us_; };
  const ScratchDirectory scratch_;
  const std::string directory_ = scratch_ / "state", file_ = directory_ + "/latch.json";
  Config config_ = SmallTask();
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<CertifierNode> node_;
  std::vector<fault_t> faults_;
  decision_t decision_{};
  certifier_status_t status_{};
  withdrawal_t withdrawal_{};
  int certified_ = 0;
  std::int64_t next_plan_id_ = 1, sequence_ = 0;
};

TEST_F(LatchTest, WithoutAFaultTheNextCertifierArmsByItself) {
  for (int i = 0; i < 3; ++i) {
    Begin();
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_NOT_ARMED);
    ExpectArmed();
    EXPECT_TRUE(faults_.empty());
    EXPECT_EQ(std::filesystem::file_size(file_), LatchFile::kBytes);
  }
}

// Of an affine row no pair decides, and nothing allows a difference.
TEST(DeclarationFalsified, SaysWhatContradictsOfEachKindOfDeclaration) {
  const auto why = [](const Violation& violation) {
    return DeclarationFalsified(violation, {.rows = {2}, .columns = {4}}).why;
  };
  EXPECT_THAT(why({3, 40, 1, 0.5, 0.25}), EndsWith("with observation 3 its residual 1 differs by 0.5, the declaration "
                                                   "allows 0.25"));
  EXPECT_THAT(why({3, 40, 2, 0.5, 0}),
              AllOf(HasSubstr("transition 40 contradicts the declaration: no affine residual 2 agrees with it, "
                              "observation 3 and a few others; one is 0.5 off"),
                    Not(HasSubstr("allows"))));
  EXPECT_THAT(why({40, -1, 2, 0.5, 0.25}), EndsWith("changes by at least 0.5 a second, 0.25 is declared"));
}

TEST_F(LatchTest, AFaultOutlivesTheProcessUntilAReset) {
  Begin();
  Fault();
  const fault_t fault = Only(faults_);
  const std::string sentence = GetText(Ask().message);
  for (int i = 0; i < 3; ++i) {
    now_us_ += 10'000;
    Begin();
    ASSERT_FALSE(faults_.empty()) << "said at once";
    Heartbeat();
    EXPECT_GE(faults_.size(), 2u) << "and again";
    for (const fault_t& said : faults_) EXPECT_EQ(Encode(said), Encode(fault));
    EXPECT_FIELDS(status_, (state, certifier_status_t::FAULT), (fault, fault_t::ROBOT_STATE_LOST),
                  (fault_utime, fault.utime), (latch, certifier_status_t::LATCH_WRITTEN));
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_FAULT);
    EXPECT_EQ(GetText(decision_.message), sentence);
    EXPECT_EQ(certified_, 0);
  }
  Begin();
  for (const std::int64_t utime : {fault.utime - 1, fault.utime}) {
    now_us_ = fault.utime + 1000;
    Reset(utime);
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_FAULT) << "a reset from before it";
  }
  Reset();
  ExpectArmed();
  Begin();
  EXPECT_TRUE(faults_.empty());
  ExpectArmed();
}

TEST_F(LatchTest, AResetMayComeAfterTheClockWasSetBack) {
  Begin();
  Fault();
  now_us_ -= 3'600'000'000;
  Begin();
  EXPECT_EQ(status_.state, certifier_status_t::FAULT);
  Reset();
  Begin();
  EXPECT_TRUE(faults_.empty());
}

TEST_F(LatchTest, OfTwoFaultsTheGraverIsKept) {
  Begin();
  Fault();
  Falsify();
  Begin();
  ASSERT_FALSE(faults_.empty());
  EXPECT_EQ(faults_.back().cause, fault_t::DECLARATION_FALSIFIED);
}

TEST_F(LatchTest, AFalsifiedDeclarationStaysSoOverRestartsAndResets) {
  Begin();
  SayState();
  Falsify();
  for (int i = 0; i < 2; ++i) {
    Begin();
    EXPECT_EQ(status_.fault, i == 0 ? fault_t::DECLARATION_FALSIFIED : 0);
    Reset();
    SayState();
    EXPECT_EQ(Ask().outcome, decision_t::ABSTAIN_FALSIFIED);
    EXPECT_EQ(decision_.cause, decision_t::CAUSE_PAIRWISE);
    Heartbeat();
    EXPECT_EQ(status_.level, certifier_status_t::ERROR);
    EXPECT_THAT(GetText(status_.message), HasSubstr("contradict"));
  }
  Declare(0.004);  // 0.01 is the difference, twice this is allowed
  ExpectFalsified();
  Declare(0.006);
  Begin();
  ExpectArmed();
  Declare(0);
  ExpectFalsified();  // nor is it forgotten after another
  config_.grounds.model = DigestOf(std::string_view("another model"));
  Begin();
  ExpectArmed();
}

// What a transition shows depends on the errors that are declared of what is recorded and of when.
TEST_F(LatchTest, ADeclarationOfLargerErrorsIsNotHeldAgainstWhatWasSeenUnderSmallerOnes) {
  Own(config_.problem).timing = {.error = 0.01, .set_at_steps = {2}};
  config_.gate.step_error_ms = 10;
  Begin();
  SayState();
  Falsify(170'000);  // vx by 0.01, in a step that lasted 0.02 s longer, which counts nothing for vx here
  const Problem exact = *config_.problem;
  const auto is_falsified = [&](const std::function<void(Problem&)>& declare) {
    declare(Own(config_.problem) = exact);
    return IsFalsifiedAfterARestart();
  };
  const auto with_state_error = [&](double e, bool given_are_exact) {
    return is_falsified([&](Problem& problem) {
      problem.declaration.state_error.setConstant(e);
      problem.declaration.given_are_exact = given_are_exact;
    });
  };
  EXPECT_TRUE(with_state_error(0.0024, false)) << "before and after each of the two steps";
  EXPECT_FALSE(with_state_error(0.0026, false));
  EXPECT_TRUE(with_state_error(0.0048, true)) << "of the learned one alone";
  EXPECT_FALSE(with_state_error(0.0052, true));
  const auto with_input_error = [&](double e) {
    return is_falsified([&](Problem& problem) { problem.declaration.input_error = Vec({e, 0}); });
  };
  EXPECT_TRUE(with_input_error(0.03)) << "times dt, of two";
  EXPECT_FALSE(with_input_error(0.035));
  const auto with_timing = [&](double error, double rate) {
    return is_falsified([&](Problem& problem) {
      problem.timing = {.error = error, .rate_bound = Vec({kInfinity, kInfinity, rate, kInfinity})};
    });
  };
  EXPECT_TRUE(with_timing(0.02, 0.48));
  EXPECT_FALSE(with_timing(0.02, 0.52)) << "it may have done so in 0.02 s";
  EXPECT_FALSE(with_timing(0.009, 0.48)) << "no step of such a task lasts so long";
  EXPECT_FALSE(is_falsified([](Problem& problem) { problem.timing.error = 0; })) << "and all of this one last dt";
  EXPECT_TRUE(is_falsified([](Problem&) {})) << "nothing is forgotten";
}

// Steps are on time, and a file's step took 2 ms longer: its column dt_error says so under any task.
TEST_F(LatchTest, WhatAFileSaysOfADurationIsNoReasonToForgetWhatItContradicts) {
  Problem& problem = Own(config_.problem);
  problem.timing = {.set_at_steps = {0, 1, 2, 3}};
  problem.transitions.longer.setConstant(problem.transitions.size(), 0.002);
  Begin();
  SayState();
  Falsify();
  EXPECT_TRUE(IsFalsifiedAfterARestart());
}

// Nobody looks at a clock, and the equations say what another duration does.
TEST_F(LatchTest, AStepOfAnyDurationContradictsWhereItCounts) {
  Begin();
  SayState();
  Falsify(170'000);
  EXPECT_TRUE(IsFalsifiedAfterARestart());
  config_.gate.step_error_ms = 0;
  EXPECT_FALSE(IsFalsifiedAfterARestart()) << "all steps last dt";
}

TEST_F(LatchTest, ATransitionOutsideTheDomainSaysNothing) {
  FalsifyAndEnd();
  Own(config_.problem).domain.state = Within({9, 9, 9, 9});
  EXPECT_TRUE(IsFalsifiedAfterARestart());
  Problem& problem = Own(config_.problem);
  problem.domain.state = Box(Vec({-9, -9, -9, 0.4}), Vec({9, 9, 9, 9}));  // the file's first transition
  problem.transitions.z = problem.transitions.z.bottomRows(1).eval();
  problem.transitions.x_next = problem.transitions.x_next.bottomRows(1).eval();
  EXPECT_FALSE(IsFalsifiedAfterARestart());
}

// The guard leaves a plan whose certificate names the digest of the file's transitions.
TEST_F(LatchTest, NoPlanOfAPredecessorStandsUnderAFalsifiedDeclaration) {
  Begin();
  SayState(99);
  EXPECT_EQ(withdrawal_.cause, withdrawal_t::UNKNOWN_PLAN);
  EXPECT_EQ(GetDigest(withdrawal_.observations_digest), config_.grounds.observations);
  FalsifyAndEnd();
  Begin();
  Reset();
  withdrawal_ = {};
  SayState(99);
  EXPECT_EQ(withdrawal_.cause, withdrawal_t::UNKNOWN_PLAN);
  EXPECT_EQ(GetDigest(withdrawal_.observations_digest), Digest{});
}

TEST_F(LatchTest, OneContradictionOfADeclarationIsEnough) {
  Begin();
  SayState();
  for (int i = 0; i < 3; ++i) {
    Falsify();
    Begin();
    Reset();
    SayState();
  }
  node_.reset();
  EXPECT_EQ(LatchFile(directory_).Read().value().contradictions.size(), 1u);
}

TEST_F(LatchTest, IsNotReadyWithMoreContradictionsThanFit) {
  FalsifyAndEnd();
  LatchFile file(directory_);
  LatchFile::Content content = file.Read().value();
  content.contradictions.resize(LatchFile::kMostContradictions, content.contradictions[0]);
  EXPECT_TRUE(file.Put(content) && file.Flush());
  content.contradictions.push_back(content.contradictions[0]);
  EXPECT_FALSE(file.Put(content));
  EXPECT_FALSE(file.ready());
  EXPECT_THAT(file.why_not(), HasSubstr("holds at most 16 contradictions"));
  const auto held = file.Read();
  EXPECT_TRUE(held && held->fault) << "the fault that was stored before stays";
}

TEST_F(LatchTest, AFaultThatDoesNotFitIsNotForgottenByARestart) {
  FalsifyAndEnd();
  {
    LatchFile file(directory_);
    LatchFile::Content content = file.Read().value();
    const auto fault = std::exchange(content.fault, std::nullopt);
    EXPECT_TRUE(file.Put(content) && file.Flush());
    content.fault = fault;
    content.contradictions.resize(LatchFile::kMostContradictions + 1, content.contradictions[0]);
    EXPECT_FALSE(file.Put(content));
  }
  Begin();
  ExpectNotArmed("has 0 bytes");
}

// The largest model there can be, with numbers of many digits.
TEST_F(LatchTest, AsManyContradictionsFitAsAreAllowed) {
  LatchFile file(directory_);
  LatchFile::Content content = file.Read().value();
  const double longest = -std::nextafter(1.2345678901234567e-301, 1.0);
  content.why = std::string(400, '"');
  content.fault.emplace();
  std::ranges::fill(content.fault->message, 255);
  const Transitions rows{Eigen::MatrixXd::Constant(2, 24, longest), Eigen::MatrixXd::Constant(2, 16, longest),
                         Eigen::VectorXd::Constant(2, longest), 1};
  content.contradictions.resize(LatchFile::kMostContradictions, {Digest{255}, rows});
  ASSERT_TRUE(file.Put(content) && file.Flush()) << file.why_not();
  const auto read = file.Read();
  ASSERT_TRUE(read) << file.why_not();
  EXPECT_EQ(read->why, content.why);
  const Transitions& back = read->contradictions.back().rows;
  EXPECT_FIELDS(back, (z, rows.z), (x_next, rows.x_next), (longer, rows.longer), (num_learned, 1));
}

// A transition that changes vx by 2 m/s in a step contradicts a bound on its rate, and its residual nothing.
TEST_F(LatchTest, ADeclaredRateThatATransitionContradictsStaysSoOverRestartsAndResets) {
  const auto declare = [&](double rate) {
    Own(config_.problem).timing.rate_bound = Eigen::Vector4d(INFINITY, INFINITY, rate, INFINITY);
  };
  declare(1);
  Begin();
  SayState();
  bus_->Publish("TRANSITION", Executed(*config_.problem->model, Vec({0, 0, 0, 0, 2, 0})));
  Run();
  ASSERT_FALSE(faults_.empty());
  EXPECT_EQ(faults_.back().cause, fault_t::DECLARATION_FALSIFIED);
  EXPECT_THAT(GetText(faults_.back().message), HasSubstr("contradicts a declared rate"));
  EXPECT_EQ(faults_.back().second_observation, -1);
  Reset();
  SayState();
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_BOUND);
  EXPECT_TRUE(IsFalsifiedAfterARestart());
  declare(2 - 1e-9);
  ExpectFalsified();
  declare(2);
  Begin();
  ExpectArmed();
}

TEST_F(LatchTest, ABoundOfARegionThatATransitionContradictsStaysSoOverRestartsAndResets) {
  const auto declare = [&](double bound) {
    Declaration& declaration = Own(config_.problem).declaration;
    declaration.lipschitz(2, 2) = 0.1;
    declaration.regions = {{{{2, {-0.5, 0.5}}}, declaration.lipschitz}};
    declaration.regions[0].bound = Vec({kInfinity, kInfinity, bound, kInfinity});
  };
  declare(0.005);
  Begin();
  SayState();
  bus_->Publish("TRANSITION", Executed(*config_.problem->model, Vec({0, 0, 0, 0, 0, 0}), 0.01));
  Run();
  ASSERT_FALSE(faults_.empty());
  EXPECT_EQ(faults_.back().cause, fault_t::DECLARATION_FALSIFIED);
  EXPECT_THAT(GetText(faults_.back().message), HasSubstr("contradicts declaration.regions[0]: residual coordinate 2"));
  EXPECT_EQ(faults_.back().second_observation, -2);
  Reset();
  SayState();
  EXPECT_EQ(Ask().cause, decision_t::CAUSE_BOUND);
  EXPECT_TRUE(IsFalsifiedAfterARestart());
  declare(0.01 - 1e-9);
  ExpectFalsified();
  declare(0.01 + 1e-9);
  Begin();
  ExpectArmed();
}

TEST_F(LatchTest, RefusesADirectoryThatAnotherCertifierUses) {
  Begin();
  EXPECT_THAT([&] { const LatchFile second(directory_); },
              ThrowsMessage<BadInput>(HasSubstr(directory_ + ": another certifier keeps its state there")));
  node_.reset();
  EXPECT_NO_THROW(LatchFile{directory_});
}

// What cannot be trusted is not taken for "no fault", and no reset mends it.
struct Damage {
  const char* name;
  Harm harm;
  const char* says;
  friend void PrintTo(const Damage& damage, std::ostream* out) { *out << damage.name; }
};
class DamagedLatchTest : public LatchTest, public testing::WithParamInterface<Damage> {};

TEST_P(DamagedLatchTest, ADamagedLatchFileDoesNotArm) {
  Begin();
  Fault();
  node_.reset();
  GetParam().harm(file_);
  Begin();
  EXPECT_TRUE(faults_.empty());
  ExpectNotArmed(GetParam().says);
  Reset();
  ExpectNotArmed(GetParam().says);
  Begin();
  ExpectNotArmed(file_);
  std::filesystem::remove_all(file_);  // by a person
  ExpectArmed();
}

Harm Edit(const std::string& from, const std::string& to) {
  return [=](const std::string& file) {
    std::string text = Replaced(Read(file), from, to);
    text.resize(LatchFile::kBytes, ' ');
    WriteFile(file, text);
  };
}
Harm Write(const std::string& text) {
  return [text](const std::string& file) { WriteFile(file, text); };
}
Harm Resize(std::uintmax_t size) {
  return [size](const std::string& file) { std::filesystem::resize_file(file, size); };
}
// Something else takes the place of the file.
Harm Replace(int (*make)(const char* path)) {
  return [make](const std::string& file) {
    std::filesystem::rename(file, file + "2");
    ASSERT_EQ(make(file.c_str()), 0);
  };
}

INSTANTIATE_TEST_SUITE_P(
    Any, DamagedLatchTest,
    testing::Values(
        Damage{"Empty", Write(""), "has 0 bytes, has to have 65536"}, Damage{"Short", Resize(65535), "65535 bytes"},
        Damage{"Huge", Resize(std::uintmax_t{1} << 40), "bytes"},
        Damage{"Zeros", Write(std::string(65536, '\0')), "is damaged"},
        Damage{"Spaces", Write(std::string(65536, ' ')), "is damaged"},
        Damage{"Deep", Write(std::string(65536, '[')), "is damaged"},
        Damage{"Half", [](const std::string& file) { WriteFile(file, Read(file).replace(400, 65136, 65136, '\0')); },
               "is damaged"},
        Damage{"NoFault", Edit("\"fault\":{", "\"fault\":null,\"no\":{"), "digest"},
        Damage{"AnotherDigit", Edit("\"fault_t\":[", "\"fault_t\":[1"), "digest"},
        Damage{"AnotherVersion", Edit("\"version\":1", "\"version\":2"), "it has version 2, this certifier knows 1"},
        Damage{"AnotherFormat", Edit("forereach latch", "forereach match"), "it has another format"},
        Damage{"Fifo", Replace([](const char* path) { return mkfifo(path, 0600); }), "is no regular file"},
        Damage{"Directory", Replace([](const char* path) { return mkdir(path, 0700); }), "is no regular file"},
        Damage{"Link", Replace([](const char* path) { return symlink((path + std::string("2")).c_str(), path); }),
               "is a symbolic link"},
        Damage{"OthersMayWrite", [](const std::string& file) { ASSERT_EQ(chmod(file.c_str(), 0622), 0); },
               "others than its owner may write it"}),
    [](const auto& of) { return of.param.name; });

TEST_F(LatchTest, NoAlteredByteIsTakenForAnythingElse) {
  FalsifyAndEnd();
  const std::string good = Read(file_);
  const std::size_t used = good.find_last_not_of(" \n") + 1;
  const auto held = LatchFile(directory_).Read();
  ASSERT_TRUE(held && held->fault && held->contradictions.size() == 1);
  for (std::size_t at = 0; at < used + 3; at += at < 200 ? 1 : 17) {
    for (const char bit : {char{1}, char{4}, char{32}}) {
      std::string bad = good;
      bad[at] = static_cast<char>(bad[at] ^ bit);
      WriteFile(file_, bad);
      const auto read = LatchFile(directory_).Read();
      if (!read) continue;
      EXPECT_EQ(Encode(*read->fault), Encode(*held->fault)) << at;  // white space
    }
  }
}

TEST_F(LatchTest, ADeletedFileIsMadeAgainWithWhatItHeld) {
  Begin();
  ExpectArmed();
  std::filesystem::remove_all(directory_);
  Fault();
  Heartbeat();
  Begin();
  EXPECT_EQ(status_.fault, fault_t::ROBOT_STATE_LOST);
}

TEST_F(LatchTest, AFaultInAFileOrDirectoryThatTakesItsPlaceIsTakenOver) {
  Begin();
  Fault();
  const std::string other = scratch_ / "other";
  std::filesystem::create_directory(other);
  std::filesystem::copy_file(file_, other + "/" + LatchFile::kName);
  const auto expect_fault = [&] {
    Heartbeat();
    EXPECT_EQ(status_.fault, fault_t::ROBOT_STATE_LOST);
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_FAULT);
    Reset();
    ExpectArmed();
  };
  Reset();
  ExpectArmed();
  std::filesystem::copy_file(other + "/" + LatchFile::kName, file_ + "2");
  std::filesystem::rename(file_ + "2", file_);
  expect_fault();
  std::filesystem::rename(directory_, scratch_ / "old");
  std::filesystem::rename(other, directory_);
  expect_fault();
}

TEST_F(LatchTest, AFaultThatCannotBeWrittenIsNotForgottenByARestart) {
  Begin();
  ExpectArmed();
  {
    const FileSizeLimit no_writes(0);
    Fault();
    ASSERT_EQ(faults_.size(), 1u) << "it is said all the same";
    Heartbeat();
    EXPECT_EQ(status_.state, certifier_status_t::FAULT);
    EXPECT_THAT(GetText(status_.message), HasSubstr("not stored"));
    Reset();
    EXPECT_TRUE(node_->watch().fault()) << "nor can the reset be written";
    node_.reset();
  }
  Begin();
  ExpectNotArmed("has 0 bytes");
}

TEST_F(LatchTest, AFaultIsWrittenOnceTheDiskTakesIt) {
  Begin();
  ExpectArmed();
  {
    const FileSizeLimit no_writes(0);
    Fault();
  }
  Heartbeat();
  EXPECT_THAT(GetText(status_.message), Not(HasSubstr("not stored")));
  Begin();
  EXPECT_EQ(status_.fault, fault_t::ROBOT_STATE_LOST);
}

TEST_F(LatchTest, AResetThatCannotBeWrittenClearsNothing) {
  Begin();
  Fault();
  {
    const FileSizeLimit no_writes(0);
    Reset();
    EXPECT_TRUE(node_->watch().fault());
    EXPECT_EQ(Ask().cause, decision_t::CAUSE_FAULT);
    Heartbeat();
    EXPECT_EQ(status_.messages_refused, 1);
  }
  Begin();
  EXPECT_EQ(status_.state, certifier_status_t::FAULT);
  Reset();
  Begin();
  ExpectArmed();
}

TEST_F(LatchTest, StoresAFaultOnAFullDiskOrDoesNotArm) {
  const SmallDisk disk(directory_, "size=256k");
  if (!disk.mounted) GTEST_SKIP() << "no right to mount a small disk here";
  const std::string filler = directory_ + "/filler";
  const auto fill = [&] { WriteFile(filler, std::string(1 << 20, 'x')); };
  fill();
  Begin();
  ExpectNotArmed("No space left on device");
  std::filesystem::remove(filler);
  ExpectArmed();
  fill();
  Fault();
  Heartbeat();
  EXPECT_THAT(GetText(status_.message), Not(HasSubstr("not stored")));
  Begin();
  EXPECT_EQ(status_.fault, fault_t::ROBOT_STATE_LOST) << "full from before it on";
  Reset();
  Begin();
  ExpectArmed();
}

TEST_F(LatchTest, DoesNotArmOnAReadOnlyDiskAndSaysWhy) {
  const SmallDisk disk(directory_, "size=256k");
  if (!disk.mounted) GTEST_SKIP() << "no right to mount a small disk here";
  ASSERT_TRUE(disk.Remount(MS_RDONLY));
  Begin();
  ExpectNotArmed("Read-only file system");
  node_.reset();
  ASSERT_TRUE(disk.Remount(0));
  Begin();
  Fault();
  node_.reset();
  ASSERT_TRUE(disk.Remount(MS_RDONLY));
  Begin();
  EXPECT_EQ(status_.fault, fault_t::ROBOT_STATE_LOST) << "reading needs no right to write";
  EXPECT_FALSE(faults_.empty());
  Reset();
  EXPECT_TRUE(node_->watch().fault()) << "it could not be written";
  ASSERT_TRUE(disk.Remount(0));
  Heartbeat();
  Reset();
  ExpectArmed();
}

}  // namespace forereach::latch_test
