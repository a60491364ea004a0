// The log of a drive with errors of steps, sensors and inputs, which learns of it: replayed and verified.
#include "forereach/transition_t.hpp"
#include "lcmtypes/seal.h"
#include "logger/logger_node.h"
#include "records/replay.h"
#include "simulator/lockstep.h"
#include "tests/paths.h"
#include "tests/records/certificates.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"
#include "tests/scratch.h"
#include "tests/verifier/is_confirmed.h"
#include "verifier/verifier.h"

namespace forereach::errors_log_test {

using verifier::Status;

// The course with errors of steps, states and inputs, driven by a robot that has them.
std::string Task(const ScratchDirectory& scratch, const std::string& step_error_ms = "5") {
  std::filesystem::copy_file(FOREREACH_SOURCE_DIR "/tests/data/course_transitions.csv",
                             scratch / "course_transitions.csv", std::filesystem::copy_options::overwrite_existing);
  std::string text = Read(kCourseTask);
  text = Replaced(text, "state_error: {}", R"(state_error: {x: 0.02, y: 0.02, theta: 0.003, v: 0.02}
  input_error: {jerk: 0.01, steer_rate: 0.001}
  transitions_are: exact)");
  text = Replaced(text, "step_error_ms: any", "step_error_ms: " + step_error_ms + R"(
  step_jitter: random
  input_error: random
  sensor_error: adversarial)");
  text = Replaced(text, "time_limit_s: 4", "time_limit_s: 2");
  return scratch.Write("task" + step_error_ms + ".yaml", text);
}

struct ErrorsLog : testing::Test {
  static void SetUpTestSuite() {
    scratch_ = new ScratchDirectory;
    task_ = Task(*scratch_);
    Config config = LoadConfig(task_);
    config.logger.directory = *scratch_ / "log";
    Lockstep lockstep(config, config, 1'800'000'000'000'000);
    std::ostringstream said;
    LoggerNode logger(lockstep.config(), lockstep.bus(), said);
    lockstep.Run(&logger);
    log_ = logger.recorder().log_path();
    logger.Stop();
  }
  static void TearDownTestSuite() { delete scratch_; }

  static std::string Edited(const std::function<bool(LogEvent&)>& edit) {
    const std::string path = *scratch_ / "edited.lcmlog";
    std::filesystem::remove(path);
    CopyLog(log_, path, edit);
    return path;
  }
  static std::string Resealed(const std::function<void(certified_plan_t&)>& edit) {
    return Edited(OfFirst<certified_plan_t>([&](certified_plan_t& certified) {
      edit(certified);
      SetDigest(certified.certificate_digest, CertificateDigest(certified));
    }));
  }
  static verifier::Verdict FirstVerdict(const CertificateFile& file) {
    return verifier::Verifier(file.config.problem, verifier::MethodOf(*file.config.problem))
        .Verify(file.certificates.at(0).certificate);
  }

  static inline ScratchDirectory* scratch_ = nullptr;
  static inline std::string task_, log_;
};

TEST_F(ErrorsLog, AgreesOnEveryDecision) {
  const ReplayResult result = Replay({log_}, {LoadConfig(task_)});
  EXPECT_THAT(result.differences, IsEmpty());
  EXPECT_FIELDS(result, (agreed, result.candidates), (corruptions, 0));
  EXPECT_GE(result.candidates, 10);
}

TEST_F(ErrorsLog, IsConfirmedInEachCertificateWithWhatWasLearned) {
  const CertificateFile file = ReadCertificates(log_, task_);
  const Transitions& known = file.config.problem->transitions;
  EXPECT_GT(known.num_learned, 5);
  EXPECT_GT(known.longer.tail(known.num_learned).maxCoeff(), 1e-3) << "some were not on time";
  EXPECT_GE(file.certificates.size(), 5u);
  for (const RecordedCertificate& recorded : file.certificates) {
    EXPECT_THAT(recorded.mismatches, IsEmpty()) << recorded.name;
    EXPECT_EQ(recorded.missing, "") << recorded.name;
  }
  const verifier::Verifier judge(file.config.problem, verifier::MethodOf(*file.config.problem));
  for (const RecordedCertificate& recorded : file.certificates)
    EXPECT_TRUE(IsConfirmed(judge.Verify(recorded.certificate))) << recorded.name;
}

TEST_F(ErrorsLog, WithASliceThatIsSmallerIsRefuted) {
  EXPECT_TRUE(IsConfirmed(FirstVerdict(ReadCertificates(Resealed([](auto&) {}), task_))));
  const auto file =
      ReadCertificates(Resealed([](certified_plan_t& certified) { certified.slice_upper[9][3] -= 1e-9; }), task_);
  EXPECT_FIELDS(FirstVerdict(file), (status, Status::kRefuted), (failure.step, 9));
}

// Under errors that are larger by a hair, its tube is too narrow.
TEST_F(ErrorsLog, UnderLargerErrorsOfStepsIsRefuted) {
  CertificateFile file = ReadCertificates(log_, task_);
  const Config wider = LoadConfig(Task(*scratch_, "5.01"));
  auto problem = std::make_shared<Problem>(*file.config.problem);
  problem->timing = wider.problem->timing;
  file.config.problem = problem;
  EXPECT_EQ(FirstVerdict(file).status, Status::kRefuted);
}

TEST_F(ErrorsLog, WithATransitionOfAnotherDurationIsNoticed) {
  const std::string path = Edited(OfFirst<transition_t>([](transition_t& transition) { ++transition.duration_us; }));
  EXPECT_THAT(Replay({path}, {LoadConfig(task_)}).differences, Not(IsEmpty()));
  const CertificateFile file = ReadCertificates(path, task_);
  EXPECT_TRUE(std::ranges::any_of(file.certificates, [](const auto& each) { return !each.mismatches.empty(); }));
}

TEST_F(ErrorsLog, WithOtherErrorsUnderTheSealIsNoticed) {
  const auto expect_noticed = [](const auto& edit, const std::string& what) {
    const CertificateFile file = ReadCertificates(Resealed(edit), task_);
    ASSERT_EQ(file.certificates.at(0).mismatches.size(), 1u);
    EXPECT_THAT(file.certificates[0].mismatches[0].what, HasSubstr(what));
  };
  expect_noticed([](certified_plan_t& plan) { ++plan.step_error_us; }, "step_error_us");
  expect_noticed([](certified_plan_t& plan) { plan.state_error[3] = std::nextafter(plan.state_error[3], 0); },
                 "state_error[3]");
}

}  // namespace forereach::errors_log_test
