// Which task a log was recorded with, and inputs that are no log or none of this task: a sentence and exit 2.
#include <regex>

#include "forereach/decision_t.hpp"
#include "records/database.h"
#include "records/event_log.h"
#include "records/kept_tasks.h"
#include "records/log_directory.h"
#include "task/config.h"
#include "tests/cli/program.h"

namespace forereach::wrong_input_test {

namespace fs = std::filesystem;

const std::string kSource = FOREREACH_SOURCE_DIR;
const std::string kCourse = kSource + "/tests/data/course.yaml", kCourseLog = kSource + "/tests/data/course.lcmlog";

/** Two tasks of different digests, whose data lies outside the directory of the task files, and a run of each. */
struct KeptTaskTest : testing::Test {
  // Once for all tests. Not in SetUpTestSuite(): where that fails, the tests count as skipped, and CTest passes.
  void SetUp() override {
    if (!logs_) Record();
    ASSERT_TRUE(logs_ && logs_->size() == 2) << "the runs were not recorded";
  }
  static void Record() {
    delete scratch_;
    scratch_ = new ScratchDirectory;
    fs::create_directories(*scratch_ / "tasks_of_mine");
    fs::create_directories(*scratch_ / "data");
    fs::copy(kSource + "/config/data/demo_transitions.csv", *scratch_ / "data/demo.csv");
    std::string text = Read(kSource + "/tests/data/field.yaml");
    const auto replace = [&text](const std::string& old, const std::string& by) {
      ASSERT_NE(text.find(old), std::string::npos) << old;
      text.replace(text.find(old), old.size(), by);
    };
    replace("transitions: ../../config/data/demo_transitions.csv", "transitions: ../data/demo.csv");
    replace("time_limit_s: 45", "time_limit_s: 2");
    replace("gate: {obstacles: task}", "gate: {obstacles: task, learn: none}");
    for (const char* name : {"one", "two"}) {
      scratch_->Write(std::string("tasks_of_mine/") + name + ".yaml", text + "# " + name + "\n");
      ASSERT_THAT(Forereach("run --config " + TaskOf(name) + " --directory " + (*scratch_ / "log") + " 2>&1"),
                  Exits(1, "the robot did not reach planner.goal"))
          << "in 2 s";
    }
    logs_ = new std::vector<std::string>;
    for (const std::string& log : LogDirectory(*scratch_ / "log").Logs()) logs_->push_back(*scratch_ / "log/" + log);
  }
  static void TearDownTestSuite() {
    delete std::exchange(logs_, nullptr);
    delete std::exchange(scratch_, nullptr);
  }
  static std::string TaskOf(const std::string& name) { return *scratch_ / "tasks_of_mine/" + name + ".yaml"; }

  /** A copy of the directory, at a place where nothing else is. */
  std::string Copied() {
    const std::string copy = elsewhere_ / "copy";
    fs::copy(*scratch_ / "log", copy, fs::copy_options::recursive);
    return copy;
  }
  [[nodiscard]] static std::string In(const std::string& directory, const std::string& log) {
    return directory + "/" + fs::path(log).filename().string();
  }

  static void ExpectRefused(const std::string& command, const std::vector<std::string>& sentences) {
    const Output output = Forereach(command + " 2>&1");
    EXPECT_EQ(output.code, 2) << command << "\n" << output.text;
    for (const std::string& sentence : sentences) EXPECT_THAT(output.text, HasSubstr(sentence)) << command;
    EXPECT_EQ(std::ranges::count(output.text, '\n'), 1) << command << "\n" << output.text;
  }

  /** Of several inputs those that are none are named, and the others are read. */
  static void ExpectNamed(const std::string& command, const std::vector<std::string>& sentences) {
    const Output output = Forereach(command + " 2>&1");
    EXPECT_EQ(output.code, 1) << command << "\n" << output.text;
    for (const std::string& sentence : sentences) EXPECT_THAT(output.text, HasSubstr(sentence)) << command;
  }

  static ScratchDirectory* scratch_;
  static std::vector<std::string>* logs_;
  const ScratchDirectory elsewhere_;
};
ScratchDirectory* KeptTaskTest::scratch_ = nullptr;
std::vector<std::string>* KeptTaskTest::logs_ = nullptr;

TEST_F(KeptTaskTest, ACopiedDirectoryNeedsNoTaskFile) {
  const std::string copy = Copied();
  fs::rename(*scratch_ / "data", *scratch_ / "data_away");
  fs::rename(*scratch_ / "tasks_of_mine", *scratch_ / "tasks_away");
  for (const std::string& log : *logs_) {
    for (const char* command : {"replay ", "verify ", "report --picture picture.svg "}) {
      std::string line = command + In(copy, log);
      if (const auto at = line.find("picture.svg"); at != std::string::npos)
        line.replace(at, 11, elsewhere_ / "picture.svg");
      const Output output = Forereach(line + " 2>&1");
      EXPECT_EQ(output.code, 0) << line << "\n" << output.text;
      EXPECT_THAT(output.text, Not(HasSubstr("tubes left out")));
    }
  }
  fs::rename(*scratch_ / "tasks_away", *scratch_ / "tasks_of_mine");
  fs::rename(*scratch_ / "data_away", *scratch_ / "data");
}

TEST_F(KeptTaskTest, ADirectoryWithSeveralTasksVerifiesWhole) {
  const std::string copy = Copied();
  for (const std::string& what : {copy, copy + "/decisions.sqlite"}) {
    EXPECT_THAT(Forereach("verify " + what + " 2>&1"), Exits(0, " 0 refuted", " 0 cannot be verified"));
  }
  EXPECT_EQ(Forereach("verify " + copy + " --config " + TaskOf("one")).code, 0)
      << "the given one for its own, the kept for others";
}

TEST_F(KeptTaskTest, AnotherTaskIsRefusedAndItsOwnIsNamed) {
  const std::string digest = ToHex(LoadConfig(TaskOf("one")).grounds.config), log = logs_->front();
  for (const char* command : {"replay ", "report ", "verify "}) {
    ExpectRefused(command + log + " --config " + TaskOf("two"),
                  {TaskOf("two"), digest, *scratch_ / "log/tasks/" + digest});
    ExpectRefused(command + log + " --config " + kSource + "/config/point_mass.yaml", {digest});
    ExpectRefused(command + kCourseLog + " --config " + TaskOf("two"), {"not kept next to the log"});
    ExpectRefused(command + kCourseLog, {"--config"});
  }
  EXPECT_THAT(Forereach("replay " + log + " --other-task --config " + TaskOf("two")), Exits(1, "another config"));
  EXPECT_EQ(Forereach("replay " + log + " --other-task 2>&1").code, 2);
}

TEST_F(KeptTaskTest, UnrelatedRunsAreRefused) {
  const std::string both = logs_->at(0) + " " + logs_->at(1);
  ExpectRefused("report " + both, {logs_->at(1), "does not follow", logs_->at(0)});
  for (const char* command : {"replay ", "report ", "verify "})
    ExpectRefused(command + logs_->at(0) + " " + logs_->at(0), {"is named twice"});
  for (const char* command : {"replay ", "verify "})
    EXPECT_THAT(Forereach(command + both + " 2>&1").text, HasSubstr("; 2 runs"));
}

TEST_F(KeptTaskTest, ADamagedTaskIsNotUsed) {
  const Config task = LoadConfig(TaskOf("one"));
  const std::string kept = "tasks/" + ToHex(task.grounds.config);
  std::string copy = Copied();
  std::ofstream(copy + "/" + kept + "/task.yaml", std::ios::app) << "# more\n";
  ExpectRefused("replay " + In(copy, logs_->front()), {"is damaged", kept});
  fs::remove_all(copy);
  copy = Copied();
  const std::string transitions = copy + "/" + kept + "/transitions-" + ToHex(task.grounds.observations) + ".csv";
  std::string text = Read(transitions);
  text.erase(text.rfind('\n', text.size() - 2) + 1);
  std::ofstream(transitions) << text;
  ExpectRefused("verify " + In(copy, logs_->front()), {"is damaged", transitions});
  fs::remove(transitions);
  ExpectRefused("report " + In(copy, logs_->front()), {"not kept next to it"});
}

TEST_F(KeptTaskTest, OfSeveralVersionsOfTheTransitionsTheLogNamesTheRightOne) {
  const std::string copy = Copied();
  TaskCopy other = CopyTask(LoadConfig(TaskOf("one")));
  other.transitions.erase(other.transitions.rfind('\n', other.transitions.size() - 2) + 1);
  const std::string csv = elsewhere_.Write("other.csv", other.transitions);
  other.observations_digest = ObservationsDigest(*other.model, LoadTransitions(csv, *other.model));
  KeptTasks(copy).Keep(other);
  EXPECT_EQ(Forereach("replay " + In(copy, logs_->front())).code, 0);
}

TEST_F(KeptTaskTest, ATaskWithAKeyAsksForIt) {
  const ScratchDirectory own;
  const std::string keys = own / "keys", data = kSource + "/tests/data/";
  ASSERT_EQ(Forereach("keygen --robot alpha " + keys).code, 0);
  const std::string field = std::regex_replace(Read(data + "field.yaml"), std::regex(R"(\.\./\.\./)"), data + "../../");
  const std::string task = own.Write("task.yaml", field + "bus: {key: keys}\n");
  ASSERT_THAT(Forereach("run --config " + task + " --directory " + (own / "log") + " 2>&1"), Exits(0));
  const std::string log = own / "log/" + LogDirectory(own / "log").Logs().front();
  ExpectRefused("replay " + log, {"keys are not kept", "--key FILE", "--no-key"});
  EXPECT_EQ(Forereach("replay " + log + " --key " + keys).code, 0);
  EXPECT_EQ(Forereach("replay " + log + " --key " + keys + "/verify.pub").code, 0);
  EXPECT_EQ(Forereach("replay " + log + " --config " + task).code, 0);
  std::set<std::string> secrets;
  for (const auto& file : fs::directory_iterator(keys)) secrets.insert(Read(file.path()));
  EXPECT_EQ(secrets.size(), 7u) << "a file for each of six roles, and the public keys";
  for (const auto& file : fs::recursive_directory_iterator(own / "log"))
    EXPECT_FALSE(file.is_regular_file() && secrets.contains(Read(file.path()))) << file.path();
}

// Every command against every kind of input that is none for it.
TEST_F(KeptTaskTest, EachCommandRefusesInputThatIsNotItsOwn) {
  const ScratchDirectory own;
  const std::string empty = own.Write("empty.lcmlog", ""), text = own.Write("text.lcmlog", "hello\nworld\n");
  const std::string json = own.Write("decision.lcmlog", "{\"outcome\": \"certified\"}");
  const std::string noise = own.Write("noise.lcmlog", std::string(5000, '\x07'));
  const std::string cut = own.Write("cut.lcmlog", "\xED\xA1\xDA\x01");
  fs::create_directory(own / "none");
  const std::string foreign = own / "foreign.sqlite", alien = own / "alien.lcmlog", none = own / "none.lcmlog";
  {
    { const Database ours(foreign); }
    std::fstream header(foreign, std::ios::in | std::ios::out | std::ios::binary);
    header.seekp(68) << "else";  // the application's number
    EventLogWriter writer(alien);
    writer.Append(1, "SOMETHING_ELSE", std::vector<std::uint8_t>{1, 2, 3});
    ASSERT_TRUE(writer.Flush());
  }
  const std::string database = *scratch_ / "log/decisions.sqlite", directory = *scratch_ / "log";
  const std::vector<std::pair<std::string, std::string>> no_logs{{empty, "is empty"},
                                                                 {text, "no LCM event log"},
                                                                 {json, ""},
                                                                 {noise, "no LCM event log"},
                                                                 {cut, "neither a candidate nor a decision"},
                                                                 {alien, "neither a candidate nor a decision"},
                                                                 {none, "No such file"},
                                                                 {TaskOf("one"), "no LCM event log"},
                                                                 {"/dev/null", "not a regular file"}};
  for (const std::string& config : {std::string(), " --config " + TaskOf("one")}) {
    for (const char* command : {"replay ", "report "}) {
      for (const auto& [input, sentence] : no_logs) ExpectRefused(command + input + config, {sentence, input});
      ExpectRefused(command + logs_->front() + " " + text + config, {"no LCM event log"});
    }
    ExpectRefused("report " + own.path() + config, {"of another run"});
    for (const char* command : {"replay ", "verify "})
      ExpectNamed(command + own.path() + config, {json + ": is a JSON document", noise + ": is no LCM event log",
                                                  text + ": is no LCM event log", "3 logs or runs could not be re"});
    for (const std::string& runs : {database, directory}) ExpectRefused("report " + runs + config, {"of another run"});
    ExpectRefused("report " + foreign + config, {"not a decision database"});
    ExpectRefused("report " + logs_->front() + " " + database + config, {"is named twice"});
    ExpectRefused("replay " + foreign + config, {"not a decision database"});
    ExpectRefused("replay " + logs_->front() + " " + database + config, {"is named twice"});
    ExpectRefused("replay " + logs_->front() + " " + directory + config, {"is named twice"});
    for (const auto& [input, sentence] : no_logs) ExpectRefused("verify " + input + config, {input});
    ExpectRefused("verify " + foreign + config, {"not a decision database"});
    ExpectRefused("verify " + (own / "none") + config, {"neither a decision database"});
    ExpectRefused("verify " + logs_->front() + " " + database + config, {"is named twice"});
    ExpectRefused("verify " + logs_->front() + " " + text + config, {"no LCM event log"});
  }
  for (const std::string& input : {empty, text, json, noise, alien, logs_->front(), database, foreign, TaskOf("one")})
    ExpectRefused("check-log " + input, {input, "name the logger's directory"});
  ExpectRefused("check-log " + none, {"no such directory"});
  ExpectRefused("check-log " + own.path(), {"no decision database"});
  for (const std::string& wrong : {text, json, database, logs_->front(), directory, none})
    for (const char* command : {"replay ", "report ", "verify "})
      ExpectRefused(command + logs_->front() + " --config " + wrong, {wrong});
}

// Whoever sends one invented decision does not keep the others from being judged.
TEST_F(KeptTaskTest, ADecisionOfATaskThatNobodyKnowsSpoilsItselfOnly) {
  const std::string copy = Copied(), log = In(copy, logs_->front());
  {
    EventLogWriter writer(log);
    decision_t decision{.sequence = 1 << 20, .outcome = decision_t::CERTIFIED};
    decision.config_digest[0] = 1;
    writer.Append(1, "PLAN_DECISION", Encode(decision));
    ASSERT_TRUE(writer.Flush());
  }
  const Output replayed = Forereach("replay " + log), verified = Forereach("verify " + log);
  EXPECT_THAT(replayed, Exits(1, " 1 differ"));
  EXPECT_EQ(verified.code, 1);
  EXPECT_THAT(verified.text, AllOf(HasSubstr(" 0 refuted"), HasSubstr(" 1 cannot be verified")));
}

// A database from elsewhere names a log outside its directory.
TEST_F(KeptTaskTest, ADatabaseDoesNotLeadOutOfItsDirectory) {
  const std::string copy = Copied();
  fs::copy(logs_->front(), elsewhere_ / "outside.lcmlog");
  Database(copy + "/decisions.sqlite").BeginRun("../outside.lcmlog", 0);
  ExpectNamed("verify " + copy, {"not in its directory", "../outside.lcmlog", "; 1 logs or runs could not be read"});
  ExpectRefused("verify " + copy + "/decisions.sqlite", {"not in its directory", "../outside.lcmlog"});
  ExpectRefused("check-log " + copy, {"not in its directory"});
}

}  // namespace forereach::wrong_input_test
