// `forereach verify` on event logs and decision databases: recorded ones, and ones with one message changed.
#include <cmath>
#include <cstdio>
#include <functional>
#include <regex>

#include "certifier/gate/gate.h"
#include "certifier/gate/plan_ledger.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/text.h"
#include "lcmtypes/seal.h"
#include "tests/certifier/gap_task.h"
#include "tests/cli/program.h"
#include "tests/messages.h"
#include "tests/records/certificates.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"
#include "tests/records/signed_log.h"
#include "tests/verifier/is_confirmed.h"

namespace forereach::verify_log_test {

using verifier::Status;
using verifier::Verdict;

constexpr std::int64_t kStart = 1'700'000'000'000'000;

Verdict Judge(const CertificateFile& file, std::size_t i) {
  return verifier::Verifier(file.config.problem, verifier::MethodOf(*file.config.problem))
      .Verify(file.certificates[i].certificate);
}

// The first certificate has one mismatch.
void ExpectMismatch(const CertificateFile& file, const testing::Matcher<std::string>& what) {
  ASSERT_EQ(file.certificates.at(0).mismatches.size(), 1u);
  EXPECT_THAT(file.certificates[0].mismatches[0].what, what);
}

// A copy of the recorded log, as CopyLog changes it.
std::string Edited(const ScratchDirectory& scratch, const std::function<bool(LogEvent&)>& edit) {
  const std::string path = scratch / "edited.lcmlog";
  std::filesystem::remove(path);
  CopyLog(kCourseLog, path, edit);
  return path;
}

// Changes the first certified plan, and if asked makes its digest good again.
std::string EditedCertificate(const ScratchDirectory& scratch, bool reseal,
                              const std::function<void(certified_plan_t&)>& edit) {
  return Edited(scratch, OfFirst<certified_plan_t>([&](certified_plan_t& certified) {
                  edit(certified);
                  if (reseal) SetDigest(certified.certificate_digest, CertificateDigest(certified));
                }));
}

TEST(VerifyLog, RecordedCourseIsConfirmed) {
  const CertificateFile file = ReadCertificates(kCourseLog, kCourseTask);
  EXPECT_GE(file.certificates.size(), 10u);
  EXPECT_GT(file.not_certificates, 0u);
  for (std::size_t i = 0; i < file.certificates.size(); ++i) {
    EXPECT_TRUE(file.certificates[i].mismatches.empty()) << file.certificates[i].name;
    const Verdict verdict = Judge(file, i);
    EXPECT_EQ(verdict.status, Status::kConfirmed) << file.certificates[i].name << ": " << verdict.failure.what;
  }
}

TEST(VerifyLog, NoticesASliceShrunkenByOneUlp) {
  ScratchDirectory scratch;
  const auto path = EditedCertificate(scratch, false, [](certified_plan_t& certified) {
    certified.slice_upper[9][0] = std::nextafter(certified.slice_upper[9][0], -HUGE_VAL);
  });
  const auto file = ReadCertificates(path, kCourseTask);
  ExpectMismatch(file, HasSubstr("altered"));
  EXPECT_TRUE(file.certificates[1].mismatches.empty());
}

// The seal made good again covers no entry beyond those in use: these have to be zero.
TEST(VerifyLog, NoticesAnUnusedEntryThatIsNotZero) {
  ScratchDirectory scratch;
  const auto path = EditedCertificate(
      scratch, true, [](certified_plan_t& certified) { certified.slice_lower[certified.plan.num_steps + 1][2] = 0.5; });
  const auto file = ReadCertificates(path, kCourseTask);
  ExpectMismatch(file, AllOf(HasSubstr("altered"), HasSubstr("slice_lower[")));
  EXPECT_EQ(file.certificates[0].mismatches[0].found, "0.5");
  EXPECT_EQ(Judge(file, 0).status, Status::kConfirmed) << "the mathematics does not see it";
}

TEST(VerifyLog, NoticesALaterExpiry) {
  ScratchDirectory scratch;
  const auto path =
      EditedCertificate(scratch, false, [](certified_plan_t& certified) { certified.expires_utime += 1'000'000; });
  ExpectMismatch(ReadCertificates(path, kCourseTask), HasSubstr("certificate_digest"));
}

TEST(VerifyLog, RefutesASliceThatWasShrunkenAndResealed) {
  ScratchDirectory scratch;
  const auto path =
      EditedCertificate(scratch, true, [](certified_plan_t& certified) { certified.slice_upper[9][0] -= 1e-9; });
  const auto file = ReadCertificates(path, kCourseTask);
  EXPECT_TRUE(file.certificates[0].mismatches.empty());
  const Verdict verdict = Judge(file, 0);
  EXPECT_FIELDS(verdict, (status, Status::kRefuted), (failure.step, 9));
  EXPECT_THAT(verdict.failure.what, HasSubstr("contains x"));
}

TEST(VerifyLog, NoticesAChangedControlOfTheCertifiedPlan) {
  ScratchDirectory scratch;
  const auto path =
      EditedCertificate(scratch, true, [](certified_plan_t& certified) { certified.plan.control[4][0] += 0.01; });
  const auto file = ReadCertificates(path, kCourseTask);
  EXPECT_EQ(file.certificates[0].mismatches.size(), 2u);  // the plan's digest, and no such candidate was sent
  EXPECT_EQ(Judge(file, 0).failure.step, 5);
}

TEST(VerifyLog, AFileWhoseNameIsNoTextIsStillNamedInJson) {
  ScratchDirectory scratch;
  const std::string path = scratch / "\xff.lcmlog";
  std::filesystem::rename(
      EditedCertificate(scratch, false, [](certified_plan_t& certified) { certified.expires_utime += 1; }), path);
  const std::string next = scratch.Write("next.lcmlog", "");  // files are named where there are several
  const Output output = Forereach("verify --json --config " + kCourseTask + " " + path + " " + next);
  EXPECT_EQ(output.code, 1);
  EXPECT_THAT(nlohmann::json::parse(output.text)["failures"][0]["certificate"], HasSubstr("\uFFFD.lcmlog event "));
}

TEST(VerifyLog, MissingCertifiedPlanIsNoticed) {
  ScratchDirectory scratch;
  const auto path = Edited(scratch, OfFirst<certified_plan_t>([](auto&) { return false; }));
  const auto whole = ReadCertificates(kCourseLog, kCourseTask), file = ReadCertificates(path, kCourseTask);
  EXPECT_EQ(file.certificates.size(), whole.certificates.size());
  EXPECT_THAT(file.certificates.back().missing, HasSubstr("no certified plan"));
}

TEST(VerifyLog, WithTheKeyWhatIsNotAuthenticIsPassedOver) {
  ScratchDirectory scratch;
  const auto [key, log] = SignedLog(scratch, kCourseLog);
  const auto is_whole = [](const RecordedCertificate& c) { return c.missing.empty() && c.mismatches.empty(); };
  EXPECT_FALSE(std::ranges::all_of(ReadCertificates(log, kCourseTask).certificates, is_whole)) << "all are believed";
  const auto whole = ReadCertificates(kCourseLog, kCourseTask), file = ReadCertificates(log, kCourseTask, {key});
  EXPECT_EQ(file.certificates.size(), whole.certificates.size());
  EXPECT_TRUE(std::ranges::all_of(file.certificates, is_whole));
  EXPECT_EQ(file.not_certificates, whole.not_certificates);
  EXPECT_EQ(DescribePassedOver(file.passed_over),
            "; not authentic and passed over: 5 (unsigned 2, forged 1, replayed 2)");
  EXPECT_EQ(ReadCertificates(log, kCourseTask, {key}).passed_over.not_authentic.replayed, kRepeated);
  EXPECT_THROW((void)ReadCertificates(log, kCourseTask, {scratch / "none"}), KeyError);
  const Output output = Forereach("verify --json " + log + " --config " + kCourseTask + " --key " + key);
  EXPECT_EQ(output.code, 0);
  EXPECT_EQ(nlohmann::json::parse(output.text)["passed_over"]["not_authentic"]["forged"], kForged);
}

TEST(VerifyLog, WhatIsNoCertifiedPlanIsPassedOver) {
  ScratchDirectory scratch;
  const auto path = Edited(scratch, [](LogEvent&) { return true; });
  {
    EventLogWriter writer(path);
    writer.Append(kStart, "PLAN_CERTIFIED", std::vector<std::uint8_t>{1, 2, 3});
    ASSERT_TRUE(writer.Flush());
  }
  const auto file = ReadCertificates(path, kCourseTask);
  EXPECT_EQ(file.certificates.size(), ReadCertificates(kCourseLog, kCourseTask).certificates.size());
  EXPECT_EQ(file.passed_over.undecodable, 1);
}

TEST(VerifyLog, DamageIsNoticed) {
  ScratchDirectory scratch;
  std::filesystem::copy(kCourseLog, scratch / "damaged.lcmlog");
  std::fstream log(scratch / "damaged.lcmlog", std::ios::in | std::ios::out | std::ios::binary);
  log.seekp(static_cast<std::streamoff>(Read(kCourseLog).find("PLAN_CERTIFIED")) + 1000);
  log << std::string(300, 'x');
  log.close();
  EXPECT_TRUE(std::ranges::any_of(ReadCertificates(scratch / "damaged.lcmlog", kCourseTask).certificates,
                                  [](const auto& c) { return !c.missing.empty() || !c.mismatches.empty(); }));
}

// ---- A plan that was certified in pieces of X0.

TEST(VerifyLog, APlanThatWasCertifiedInPiecesIsConfirmedInThese) {
  const ScratchDirectory scratch;
  const Config task = GapTask(scratch);
  const auto bytes = Encode(GapCandidate(task, 1, kStart));
  GateAnswer answer = Gate(task).Decide(bytes, kStart);
  ASSERT_TRUE(answer.certified);
  const auto recorded = [&](const std::string& message) {
    std::filesystem::remove(scratch / "log.lcmlog");
    EventLogWriter writer(scratch / "log.lcmlog");
    writer.Append(kStart, task.bus.candidate, bytes);
    SetText(answer.decision.message, message);
    writer.Append(kStart + 1, task.bus.decision, Encode(answer.decision));
    writer.Append(kStart + 2, task.bus.certified, Encode(*answer.certified));
    EXPECT_TRUE(writer.Flush());
    return ReadCertificates(scratch / "log.lcmlog", scratch / "gap.yaml");
  };
  const std::string message = GetText(answer.decision.message), pieces = message.substr(message.rfind(';'));
  const CertificateFile honest = recorded(message);
  ASSERT_EQ(honest.certificates.size(), 1u);
  EXPECT_TRUE(honest.certificates[0].mismatches.empty());
  EXPECT_TRUE(IsConfirmed(Judge(honest, 0)));
  ExpectMismatch(recorded(Replaced(message, pieces, "")), HasSubstr("message"));
  ExpectMismatch(recorded(Replaced(message, pieces, "; X0 in 1 pieces")), HasSubstr("message"));

  verifier::Certificate certificate = honest.certificates[0].certificate;
  const auto judge = [&](const std::function<void(std::vector<PieceCut>&)>& change) {
    verifier::Certificate changed = certificate;
    change(changed.cuts);
    return verifier::Verifier(task.problem, verifier::MethodOf(*task.problem)).Verify(changed);
  };
  EXPECT_TRUE(IsConfirmed(judge([](auto&) {})));
  EXPECT_EQ(judge([](auto& cuts) { cuts.clear(); }).status, Status::kRefuted) << "the whole may touch";
  for (const auto& change : std::vector<std::function<void(std::vector<PieceCut>&)>>{
           [](auto& cuts) { cuts.pop_back(); }, [](auto& cuts) { cuts.push_back({}); },
           [](auto& cuts) { cuts[0].state = 6; }, [](auto& cuts) { cuts[0].at = std::nan(""); },
           [](auto& cuts) { cuts.insert(cuts.begin(), PieceCut{}); }}) {
    const Verdict verdict = judge(change);
    EXPECT_EQ(verdict.status, Status::kRefuted);
    EXPECT_EQ(verdict.failure.what, "the pieces of the initial set cover it");
  }
  EXPECT_EQ(judge([](auto& cuts) { cuts = {{3, 1e9}, {}, {}}; }).status, Status::kRefuted) << "one has all of it";
}

// ---- Obstacles that come by the bus.

struct VerifyObstacles : testing::Test {
  VerifyObstacles() : config_(LoadConfig(kCourseTask)) {
    candidate_ = FirstCertified(kCourseLog);
    candidate_.utime = kStart + 2;
    candidate_.start_utime = kStart + 100'000;
  }

  [[nodiscard]] obstacles_t Message(double x, std::int64_t sequence, std::int64_t utime) const {
    return Sighted({Obstacle::Circle(Eigen::Vector2d(x, 0), 1)}, utime, sequence);
  }

  // The number of the first obstacle behind those of the task.
  [[nodiscard]] std::string OfTheBus() const { return std::to_string(config_.obstacles.size()); }

  // Obstacles, a candidate, and what the gate says of it. `edit` changes what is written, not what is decided on.
  std::string RecordWith(const std::function<void(decision_t&)>& edit) {
    edit_decision_ = edit;
    return Record();
  }
  std::string Record(const std::function<void(obstacles_t&, certified_plan_t&)>& edit = {}) {
    Gate gate(config_);
    obstacles_t obstacles = Message(80, 0, kStart);
    EXPECT_EQ(gate.UpdateObstacles(Encode(obstacles), kStart + 1), "");
    const auto bytes = Encode(candidate_);
    GateAnswer answer = gate.Decide(bytes, kStart + 3);
    EXPECT_TRUE(answer.certified) << GetText(answer.decision.message);
    certified_plan_t certified = answer.certified.value_or(certified_plan_t{});
    if (edit) edit(obstacles, certified);
    if (edit_decision_) edit_decision_(answer.decision);
    const std::string path = scratch_ / "log.lcmlog";
    std::filesystem::remove(path);  // a writer goes on with a log that is there
    EventLogWriter writer(path);
    writer.Append(kStart + 1, config_.bus.obstacles, Encode(obstacles));
    writer.Append(kStart + 3, config_.bus.candidate, bytes);
    writer.Append(kStart + 4, config_.bus.decision, Encode(answer.decision));
    writer.Append(kStart + 5, config_.bus.obstacles, Encode(Message(60, 1, kStart + 5)));
    writer.Append(kStart + 6, config_.bus.certified, Encode(certified));
    EXPECT_TRUE(writer.Flush());
    return path;
  }

  ScratchDirectory scratch_;
  Config config_;
  candidate_plan_t candidate_{};
  std::function<void(decision_t&)> edit_decision_;
};

TEST_F(VerifyObstacles, JudgesByTheObstaclesInForce) {
  const auto file = ReadCertificates(Record(), kCourseTask);
  EXPECT_FIELDS(Only(file.certificates), (mismatches.empty(), true), (certificate.obstacles.back().points()[0][0], 80));
  EXPECT_EQ(Judge(file, 0).status, Status::kConfirmed);
}

TEST_F(VerifyObstacles, NoticesAnObstacleMovedOntoThePath) {
  const auto file = ReadCertificates(Record([&](obstacles_t& obstacles, certified_plan_t& certified) {
                                       obstacles.obstacle[0].shape.point[0][0] = certified.slice_lower[20][0];
                                       obstacles.obstacle[0].shape.point[0][1] = certified.slice_lower[20][1];
                                     }),
                                     kCourseTask);
  ExpectMismatch(file, HasSubstr("obstacles in force"));
  EXPECT_THAT(Judge(file, 0).failure.what, HasSubstr("clear of obstacle " + OfTheBus()));
}

TEST_F(VerifyObstacles, RefutesAnObstacleMovedOntoThePathAndResealed) {
  const auto file = ReadCertificates(Record([&](obstacles_t& obstacles, certified_plan_t& certified) {
                                       obstacles.obstacle[0].shape.point[0][0] = certified.slice_lower[20][0];
                                       obstacles.obstacle[0].shape.point[0][1] = certified.slice_lower[20][1];
                                       std::vector<Obstacle> all = config_.obstacles;
                                       std::ranges::copy(FromMessage(obstacles, 2), std::back_inserter(all));
                                       SetDigest(certified.obstacles_digest, ObstaclesDigest(all));
                                       SetDigest(certified.certificate_digest, CertificateDigest(certified));
                                     }),
                                     kCourseTask);
  for (const Mismatch& mismatch : file.certificates[0].mismatches)
    EXPECT_THAT(mismatch.what, HasSubstr("its decision's"));
  EXPECT_EQ(Judge(file, 0).status, Status::kRefuted);
}

// The robot goes by them after a restart of the certifier.
TEST_F(VerifyObstacles, NoticesOtherTransitionsOfTheTaskThatAreResealed) {
  const auto file = ReadCertificates(Record([](obstacles_t&, certified_plan_t& certified) {
                                       certified.transitions_digest[7] ^= 1;
                                       SetDigest(certified.certificate_digest, CertificateDigest(certified));
                                     }),
                                     kCourseTask);
  ExpectMismatch(file, HasSubstr("digest of the transitions of the task"));
}

// The guard goes by them.
TEST_F(VerifyObstacles, NoticesOtherErrorsOfStepsOrStatesThatAreResealed) {
  const auto file = ReadCertificates(Record([](obstacles_t&, certified_plan_t& certified) {
                                       certified.step_error_us += 1;
                                       certified.state_error[1] += 0x1p-60;
                                       SetDigest(certified.certificate_digest, CertificateDigest(certified));
                                     }),
                                     kCourseTask);
  ASSERT_EQ(file.certificates[0].mismatches.size(), 2u);
  EXPECT_THAT(file.certificates[0].mismatches[0].what, HasSubstr("state_error[1]"));
  EXPECT_THAT(file.certificates[0].mismatches[1].what, HasSubstr("step_error_us"));
}

// The sentence and the numbers of the decision that goes with a certified plan.
TEST_F(VerifyObstacles, AlteredDecisionsAreRefused) {
  const auto mismatches = [&](const std::function<void(decision_t&)>& change) {
    const auto file = ReadCertificates(RecordWith(change), kCourseTask);
    return std::pair(file.certificates.at(0).mismatches.size(), Judge(file, 0).status);
  };
  EXPECT_EQ(mismatches([](decision_t&) {}), std::pair(std::size_t{0}, Status::kConfirmed));
  for (const std::function<void(decision_t&)>& change : std::initializer_list<std::function<void(decision_t&)>>{
           [](decision_t& d) { SetText(d.message, "certified: no obstacles"); },
           [](decision_t& d) { d.message[0] ^= 1; },
           [](decision_t& d) { d.message[60] ^= 1; },
           [](decision_t& d) { SetText(d.message, ""); },
           [](decision_t& d) { d.margin *= 1.001; },
           [](decision_t& d) { d.margin = -d.margin; },
           [](decision_t& d) { d.margin = std::nan(""); },
           [](decision_t& d) { d.threshold += 0.5; },
           [](decision_t& d) { d.obstacle = -1; },
           [](decision_t& d) { d.obstacle = 99; },
           [](decision_t& d) { d.step = 3; },
           [](decision_t& d) { d.cause = 4; },
           [](decision_t& d) { d.coordinate = 0; },
           [](decision_t& d) { d.first_observation = 0; },
           [](decision_t& d) { d.second_observation = 7; },
           [](decision_t& d) { d.config_digest[3] ^= 1; },
           [](decision_t& d) { d.model_digest[3] ^= 1; },
           [](decision_t& d) { d.declaration_digest[3] ^= 1; },
           [](decision_t& d) { d.observations_digest[3] ^= 1; },
           [](decision_t& d) { d.obstacles_digest[3] ^= 1; },
           [](decision_t& d) { ++d.plan_id; },
           [](decision_t& d) { d.source[0] ^= 1; },
           [](decision_t& d) { ++d.candidate_utime; }})
    EXPECT_GT(mismatches(change).first, 0u);
  // Consistent in itself, and more than there is.
  const auto [count, status] = mismatches([](decision_t& d) {
    d.margin += 1;
    std::string text(reinterpret_cast<const char*>(d.message));
    const std::size_t end = text.find(" m from"), begin = text.rfind(' ', end - 1) + 1;
    SetText(d.message, text.replace(begin, end - begin, RoundedDown(SubDown(d.margin, d.threshold))));
  });
  EXPECT_EQ(count, 0u);
  EXPECT_EQ(status, Status::kRefuted);
}

// A body that turns, bounds between the samples, and an obstacle of the bus that moves.
// What is left of a plan after an obstacle has appeared on its way.
class VerifyWithdrawal : public VerifyObstacles {
 protected:
  std::string Recorded(const std::function<void(withdrawal_t&)>& edit = {}) {
    const std::string path = Record();
    Gate gate(config_);
    PlanLedger plans(config_.gate, kStart);
    EXPECT_EQ(gate.UpdateObstacles(Encode(Message(80, 0, kStart)), kStart + 1), "");
    plans.Judge(gate, kStart + 1);
    const auto certified = gate.Decide(Encode(candidate_), kStart + 3).certified.value();
    plans.Add(certified, kStart + 6);
    obstacles_t wall = Message(certified.slice_lower[12][0], 2, kStart + 7);
    wall.obstacle[0].shape.point[0][1] = certified.slice_lower[12][1];
    wall.obstacle[0].shape.value = 0.05;  // a post: the plan's end is clear of it
    EXPECT_EQ(gate.UpdateObstacles(Encode(wall), kStart + 7), "");
    plans.Judge(gate, kStart + 7);
    withdrawal_ = plans.TakeDue(kStart + 8, kStart + 8).value().message;
    if (edit) edit(withdrawal_);
    EventLogWriter writer(path);
    writer.Append(kStart + 7, config_.bus.obstacles, Encode(wall));
    writer.Append(kStart + 8, config_.bus.withdrawn, Encode(withdrawal_));
    EXPECT_TRUE(writer.Flush());
    return path;
  }

  withdrawal_t withdrawal_{};
};

TEST_F(VerifyWithdrawal, WhatItLeavesIsClearOfTheNewObstacle) {
  const auto file = ReadCertificates(Recorded(), kCourseTask);
  ASSERT_EQ(file.certificates.size(), 2u);
  EXPECT_GT(withdrawal_.valid_steps, 2);
  EXPECT_LT(withdrawal_.valid_steps, 12);
  EXPECT_FIELDS(file.certificates[1], (mismatches.empty(), true), (missing, ""));
  EXPECT_EQ(Judge(file, 1).status, Status::kConfirmed) << Judge(file, 1).failure.what;
}

TEST_F(VerifyWithdrawal, OneControlTooManyIsRefuted) {
  const auto file = ReadCertificates(Recorded([](withdrawal_t& message) { ++message.valid_steps; }), kCourseTask);
  EXPECT_EQ(Judge(file, 1).status, Status::kRefuted);
  EXPECT_THAT(Judge(file, 1).failure.what, HasSubstr("clear of obstacle " + OfTheBus()));
}

// A robot that is said to be past the obstacle is judged from its step on.
TEST_F(VerifyWithdrawal, StepsThatArePastAreNotJudged) {
  const auto all = [&](withdrawal_t& message) {
    message.first_step = candidate_.num_steps - 1;
    message.valid_steps = candidate_.num_steps;
  };
  const auto file = ReadCertificates(Recorded(all), kCourseTask);
  EXPECT_EQ(Judge(file, 1).status, Status::kConfirmed) << Judge(file, 1).failure.what;
  const auto from_the_start = ReadCertificates(Recorded([&](withdrawal_t& message) {
                                                 all(message);
                                                 message.first_step = 0;
                                               }),
                                               kCourseTask);
  EXPECT_EQ(Judge(from_the_start, 1).status, Status::kRefuted);
}

TEST_F(VerifyWithdrawal, OfAnotherPlanOrUnderOtherGroundsIsNoticed) {
  const auto other = ReadCertificates(
      Recorded([](withdrawal_t& message) { SetDigest(message.certificate_digest, DigestOf("another")); }), kCourseTask);
  EXPECT_THAT(other.certificates[1].missing, HasSubstr("its certified plan is not in the log"));
  const auto grounds = ReadCertificates(
      Recorded([](withdrawal_t& message) { SetDigest(message.obstacles_digest, DigestOf("another")); }), kCourseTask);
  EXPECT_THAT(grounds.certificates[1].mismatches.at(0).what, HasSubstr("obstacles in force"));
  const auto longer = ReadCertificates(Recorded([](withdrawal_t& message) { message.valid_steps = 200; }), kCourseTask);
  EXPECT_THAT(longer.certificates[1].missing, HasSubstr("its plan has"));
  const auto none = ReadCertificates(Recorded([](withdrawal_t& message) { message.valid_steps = 0; }), kCourseTask);
  EXPECT_EQ(none.certificates.size(), 1u) << "nothing is claimed";
}

class VerifyMovingObstacles : public VerifyObstacles {
 protected:
  VerifyMovingObstacles() {
    std::string text = Read(kCourseTask);
    text = std::regex_replace(text, std::regex("  projection:[^\n]*"), R"(  body:
    pose: [x, y, theta]
    parts: [{hull: {points: [[-1, -1], [-1, 1], [3, -1], [3, 1]]}}, {disc: {at: [3, 0], radius: 0.5}}]
  between: {acceleration: [12, 12], turn_rate: 2, turn_acceleration: 4})");
    text = std::regex_replace(text, std::regex("  obstacles:\n(    - [^\n]*\n)*"), "  obstacles: []\n");
    std::filesystem::copy(FOREREACH_SOURCE_DIR "/tests/data/course_transitions.csv",
                          scratch_ / "course_transitions.csv");
    text = std::regex_replace(text, std::regex("step_error_ms: any"), "step_error_ms: 0");
    Load(std::regex_replace(text, std::regex("gate: \\{"), "gate: {max_clock_error_ms: 20, "));
    motion_.stamp_us = kStart;
    motion_.velocity = {-1, 0.5, 0};
    motion_.uncertainty = 0.125;
    motion_.growth = 0.25;
    motion_.growth_rate = 0.125;
  }

  void Load(const std::string& text) {
    task_ = scratch_.Write("task.yaml", text);
    config_ = LoadConfig(task_);
  }

  [[nodiscard]] static obstacles_t Message(const Obstacle& obstacle) { return Sighted({obstacle}, kStart, 0); }
  [[nodiscard]] Obstacle Mover(double x) const { return Obstacle::Circle(Eigen::Vector2d(x, 0), 1).Moving(motion_); }

  // A log of a decision among `decided`, in which `logged` is written and named instead.
  CertificateFile Decide(const Obstacle& decided, const Obstacle& logged,
                         const std::function<void(decision_t&)>& edit = {}) {
    Gate gate(config_);
    EXPECT_EQ(gate.UpdateObstacles(Encode(Message(decided)), kStart + 1), "");
    const auto bytes = Encode(candidate_);
    GateAnswer answer = gate.Decide(bytes, kStart + 3);
    EXPECT_TRUE(answer.certified) << GetText(answer.decision.message);
    certified_plan_t certified = answer.certified.value_or(certified_plan_t{});
    const Digest digest = ObstaclesDigest(FromMessage(Message(logged), 2));
    SetDigest(answer.decision.obstacles_digest, digest);
    SetDigest(certified.obstacles_digest, digest);
    SetDigest(certified.certificate_digest, CertificateDigest(certified));
    if (edit) edit(answer.decision);
    const std::string path = scratch_ / "log.lcmlog";
    std::filesystem::remove(path);
    EventLogWriter writer(path);
    writer.Append(kStart + 1, config_.bus.obstacles, Encode(Message(logged)));
    writer.Append(kStart + 3, config_.bus.candidate, bytes);
    writer.Append(kStart + 4, config_.bus.decision, Encode(answer.decision));
    writer.Append(kStart + 6, config_.bus.certified, Encode(certified));
    EXPECT_TRUE(writer.Flush());
    return ReadCertificates(path, task_);
  }

  std::string task_;
  ObstacleMotion motion_;
};

TEST_F(VerifyMovingObstacles, AreMetAtTheTimesOfThePlan) {
  const CertificateFile file = Decide(Mover(80), Mover(80));
  for (const Mismatch& mismatch : Only(file.certificates).mismatches)
    ADD_FAILURE() << mismatch.what << ": " << mismatch.expected << ", found " << mismatch.found;
  const Schedule& schedule = file.certificates[0].certificate.schedule;
  EXPECT_FIELDS(schedule, (start_us, candidate_.start_utime), (step_us, candidate_.step_us), (clock_error_us, 20'000));
  const Verdict verdict = Judge(file, 0);
  EXPECT_EQ(verdict.status, Status::kConfirmed) << verdict.failure.what << ": " << verdict.failure.found;
}

TEST_F(VerifyMovingObstacles, AnotherMotionIsRefuted) {
  const Obstacle decided = Mover(80);
  motion_.velocity[0] = -2;
  Verdict verdict = Judge(Decide(decided, Mover(80)), 0);
  EXPECT_EQ(verdict.status, Status::kRefuted);
  EXPECT_THAT(verdict.failure.what, HasSubstr("the motion to the next sample keeps clear of obstacle 0"));
  motion_.velocity[0] = -1;
  motion_.growth_rate = 0.25;
  verdict = Judge(Decide(decided, Mover(80)), 0);
  EXPECT_THAT(verdict.failure.what, HasSubstr("keeps clear of obstacle 0"));
}

TEST_F(VerifyMovingObstacles, TheDistanceToBeKeptIsThatOfAStep) {
  const auto first_mismatch = [&](double change) {
    const auto file = Decide(Mover(80), Mover(80), [&](decision_t& decision) {
      decision.threshold += change;
      decision.margin += change;
    });
    return file.certificates[0].mismatches.empty() ? "" : file.certificates[0].mismatches[0].what;
  };
  EXPECT_EQ(first_mismatch(0), "");
  EXPECT_THAT(first_mismatch(0.001), HasSubstr("its decision's threshold"));
  EXPECT_THAT(first_mismatch(-2), HasSubstr("its decision's threshold"));
}

// The gate rejects such a plan. The model says nothing of its steps.
TEST_F(VerifyMovingObstacles, AStepOfAnotherTimeThanTheModelsIsNotDerived) {
  Load(std::regex_replace(Read(task_), std::regex("max_clock_error_ms: 20, "),
                          ""));  // without a clock error, so nothing may move
  const Obstacle standing = Obstacle::Circle(Eigen::Vector2d(80, 0), 1);
  ASSERT_EQ(Decide(standing, standing).certificates.size(), 1u);
  const auto missing = [&](std::int64_t step_us) {
    const std::string path = scratch_ / ("step" + std::to_string(step_us) + ".lcmlog");
    CopyLog(scratch_ / "log.lcmlog", path, [&](LogEvent& event) {
      if (auto certified = Decoded<certified_plan_t>(event.data)) {
        certified->plan.step_us = step_us;
        event.data = Encode(*certified);
      }
      return true;
    });
    return ReadCertificates(path, task_).certificates.at(0).missing;
  };
  EXPECT_EQ(missing(100'000), "");
  EXPECT_THAT(missing(100'001), HasSubstr("step_us is 100001, must be 100000, model.dt"));
}

// A track that ended before the plan begins: the certificate names no obstacle.
TEST_F(VerifyMovingObstacles, WhatIsNowhereDuringThePlanIsNotNamed) {
  motion_.until_us = kStart + 10;
  candidate_.start_utime = kStart + 200'000;
  const CertificateFile file = Decide(Mover(0), Mover(0));
  EXPECT_TRUE(file.certificates.at(0).mismatches.empty());
  EXPECT_EQ(Judge(file, 0).status, Status::kConfirmed);
  motion_.until_us = ObstacleMotion::kAlways;
  EXPECT_EQ(Judge(Decide(Mover(900), Mover(900), [](decision_t& decision) { decision.obstacle = -1; }), 0).status,
            Status::kRefuted);
}

TEST_F(VerifyObstacles, NoticesStaleObstaclesThatWereNeverInForce) {
  const auto file = ReadCertificates(
      Record([](obstacles_t& obstacles, certified_plan_t&) { obstacles.utime -= 10'000'000; }), kCourseTask);
  EXPECT_GE(file.certificates[0].mismatches.size(), 1u);
  EXPECT_EQ(file.certificates[0].certificate.obstacles.size(), LoadConfig(kCourseTask).obstacles.size());
}

}  // namespace forereach::verify_log_test
