// `--shard I/N` of commands over logs, and `forereach merge`: of all shards it makes what one command prints or writes.

#include "lcmtypes/seal.h"
#include "records/kept_tasks.h"
#include "records/replay.h"
#include "records/result.h"
#include "records/shard.h"
#include "tests/cli/program.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"
#include "tests/records/signed_log.h"

namespace forereach::shards_test {

namespace fs = std::filesystem;

TEST(Shard, EachCaseIsJudgedByExactlyOne) {
  for (const int count : {1, 2, 3, 7, 40}) {
    std::vector<int> judged(20, 0);
    for (int index = 0; index < count; ++index) {
      CaseResults<std::vector<int>> results;
      for (int& times : judged) times += results.Next({index, count});
      EXPECT_EQ(results.cases, 20);
    }
    EXPECT_THAT(judged, Each(1)) << count;
  }
}

TEST(ResultJson, KeepsEachNumberOfPassedOverMessages) {
  PassedOver passed_over;
  passed_over.undecodable = 7;
  RefusalCounts& refused = passed_over.not_authentic;
  refused = {.unsigned_ones = 1, .forged = 2, .replayed = 3, .foreign = 4, .old = 5, .ahead = 6};
  EXPECT_EQ(DescribePassedOver(nlohmann::json(passed_over).get<PassedOver>()), DescribePassedOver(passed_over));
}

// The recorded course, and a copy in which much is changed: outcomes of decisions, slices of certified plans, some of
// them sealed anew, missing candidates and decisions, and damage.
struct ShardsTest : testing::Test {
  ShardsTest() {
    fs::create_directories(scratch_ / "night/a");
    fs::create_directories(scratch_ / "night/b");
    fs::copy(kCourseLog, scratch_ / "night/a/one.lcmlog");
    changed_ = scratch_ / "night/b/one.lcmlog";
    int decisions = 0, candidates = 0, plans = 0;
    CopyLog(kCourseLog, changed_, [&](LogEvent& event) {
      if (auto decision = Decoded<decision_t>(event.data)) {
        if (++decisions % 9 == 0) return false;
        if (decisions % 5 == 0) ++decision->step;
        event.data = Encode(*decision);
      } else if (Decoded<candidate_plan_t>(event.data)) {
        return ++candidates % 11 != 0;
      } else if (auto certified = Decoded<certified_plan_t>(event.data)) {
        if (++plans % 3 != 0) certified->slice_upper[1][0] -= 1e-9;
        if (plans % 3 == 1) SetDigest(certified->certificate_digest, CertificateDigest(*certified));
        event.data = Encode(*certified);
      }
      return true;
    });
    auto bytes = ReadBytes(changed_);
    bytes[RecordFrom(bytes, bytes.size() / 2)] ^= 1;
    WriteBytes(changed_, bytes);
    noisy_task_ = Noisy("noisy.yaml", "0.002, 0.002, 0.0005, 0.002, 0, 0");
  }
  // The course's task with this bound on the noise.
  std::string Noisy(const std::string& name, const std::string& bound) {
    const std::string task =
        Replaced(Read(kCourseTask), "transitions: ", "transitions: " FOREREACH_SOURCE_DIR "/tests/data/");
    return scratch_.Write(name, Replaced(task, "noise_bound: [0, 0, 0, 0, 0, 0]", "noise_bound: [" + bound + "]"));
  }

  /** The course up to its decision of this number. */
  [[nodiscard]] std::string FirstDecisions(int number) const {
    const std::string log = scratch_ / "short.lcmlog";
    int decisions = 0;
    CopyLog(kCourseLog, log, [&](LogEvent& event) {
      decisions += Decoded<decision_t>(event.data).has_value();
      return decisions <= number;
    });
    return log;
  }
  [[nodiscard]] std::string PathOf(int number) const { return scratch_ / ("part" + std::to_string(number) + ".json"); }
  /** The files of all shards, as arguments, the last one first. */
  std::string WriteShards(const std::string& command, int count) {
    std::string files;
    for (int number = 1; number <= count; ++number) {
      EXPECT_THAT(WriteOne(command, number, count),
                  Exits(0, "shard " + std::to_string(number) + "/" + std::to_string(count)));
      files = PathOf(number) + " " + files;
    }
    return files;
  }
  [[nodiscard]] Output WriteOne(const std::string& command, int number, int count) const {
    return Forereach(command + " --shard " + std::to_string(number) + "/" + std::to_string(count) + " --out " +
                     PathOf(number) + " 2>&1");
  }
  static Output Merge(const std::string& files) { return Forereach("merge " + files + " 2>&1"); }
  /** Of each number of shards merge prints what the command prints. @return what that is. */
  Output ExpectMergedAsWhole(const std::string& command, std::initializer_list<int> counts = {1, 3}) {
    const Output whole = Forereach(command), json = Forereach(command + " --json");
    for (const int count : counts) {
      const std::string files = WriteShards(command, count);
      for (const auto& [how, expected] : {std::pair<std::string, Output>{"", whole}, {" --json", json}}) {
        const Output merged = Forereach("merge " + files + how);
        EXPECT_EQ(merged.text, expected.text) << command << ", " << count << how;
        EXPECT_EQ(merged.code, expected.code) << command << ", " << count << how;
      }
    }
    return whole;
  }

  /** Of each number of shards merge writes what the command writes, and prints the same. */
  void ExpectSameExport(const std::string& what, const std::string& format, std::initializer_list<int> counts) {
    const std::string whole = scratch_ / "whole", merged = scratch_ / "merged", command = what + " --format " + format;
    const Output expected = Forereach("export " + command + " -o " + whole + " 2>&1");
    for (const int count : counts) {
      const Output output = Merge(WriteShards("export " + command, count) + "-o " + merged);
      EXPECT_EQ(Replaced(output.text, merged, whole), expected.text) << command << ", " << count;
      EXPECT_EQ(output.code, expected.code) << command << ", " << count;
      const Output difference = Shell("diff -r " + whole + " " + merged);
      EXPECT_EQ(difference.code, 0) << command << ", " << count << ": " << difference.text;
      fs::remove_all(merged);
    }
    fs::remove_all(whole);
  }

  const ScratchDirectory scratch_;
  const std::string config_ = " --config " + kCourseTask;
  std::string changed_, noisy_task_;
};

TEST_F(ShardsTest, OfTheRecordedCourseMakeTheWhole) {
  EXPECT_THAT(ExpectMergedAsWhole("replay " + kCourseLog + config_), Exits(0, " 0 differ"));
  EXPECT_THAT(ExpectMergedAsWhole("verify " + kCourseLog + config_, {3}), Exits(0, " 0 refuted"));
  EXPECT_THAT(ExpectMergedAsWhole("replay " + kCourseLog + config_ + " --compare", {2}), Exits(0, "none of the"));
  EXPECT_THAT(
      ExpectMergedAsWhole(
          "replay " + kCourseLog + " --compare --config " + Noisy("noisier.yaml", "0.5, 0.5, 0.5, 0.5, 0.5, 0.5"), {3}),
      Exits(1, "and " + std::to_string(kCourseCertified) + " of the", "    and 2 more\n"));
}

TEST_F(ShardsTest, OfAChangedLogMakeTheWhole) {
  EXPECT_THAT(ExpectMergedAsWhole("replay " + changed_ + config_ + " --plan-digest 5"),
              Exits(1, "recorded ", "no decision recorded", "its candidate is not in the log", "the seal does not hold",
                    "damaged in"));
  EXPECT_THAT(ExpectMergedAsWhole("verify " + changed_ + config_, {2}), Exits(1, "refuted: "));
  EXPECT_THAT(ExpectMergedAsWhole("replay " + changed_ + " --compare --config " + noisy_task_, {3}),
              Exits(1, "certificates that would have been lost", "are alone in the log"));
  EXPECT_THAT(ExpectMergedAsWhole("replay " + changed_ + " --other-task --config " + noisy_task_, {3}),
              Exits(1, "another "));
}

TEST_F(ShardsTest, OfManyRunsMakeTheWhole) {
  const std::string night = scratch_ / "night";
  scratch_.Write("night/b/two.lcmlog", "not a log");
  EXPECT_THAT(ExpectMergedAsWhole("replay " + night + config_, {3}), Exits(1, night + "/b: ", "2 runs"));
  EXPECT_THAT(ExpectMergedAsWhole("verify " + night + config_, {3}), Exits(1, night + "/b: refuted: "));
  EXPECT_THAT(ExpectMergedAsWhole("replay " + night + " --compare --config " + noisy_task_, {3}),
              Exits(1, night + "/a: ", night + "/b: "));
}

TEST_F(ShardsTest, OfAdviceMakeTheWhole) {
  const std::string advise = "advise " + FirstDecisions(20) + config_;
  EXPECT_THAT(ExpectMergedAsWhole(advise, {2}),
              Exits(0, "it would be certified", "where one more observation would turn most"));
  EXPECT_THAT(ExpectMergedAsWhole(advise + " --all --inner", {3}), Exits(0, "the inner bound", "not enough alone"));
}

TEST_F(ShardsTest, OfAnExportMakeTheSameFiles) {
  for (const std::string format : {"csv", "jsonl", "npz", "mcap"}) ExpectSameExport(changed_ + config_, format, {3});
  for (const std::string format : {"csv", "npz"}) ExpectSameExport((scratch_ / "night") + config_, format, {2});
}

// More shards than cases.
TEST_F(ShardsTest, WithoutCasesBelongToTheWhole) {
  const std::string log = FirstDecisions(2);
  for (const std::string command : {"replay ", "verify ", "advise "}) ExpectMergedAsWhole(command + log + config_, {3});
  ExpectMergedAsWhole("replay --compare " + log + config_, {3});
  for (const std::string format : {"csv", "npz"}) ExpectSameExport(log + config_, format, {3});
}

TEST_F(ShardsTest, OfAnExportThatAreDamagedAreRefused) {
  const std::string command = "export " + kCourseLog + config_ + " --format jsonl", file = PathOf(1);
  WriteShards(command, 1);
  const std::string whole = Read(file), out = scratch_ / "out", merge = file + " --out " + out;
  EXPECT_THAT(Merge(file), Exits(2, "--out: is needed"));
  EXPECT_THAT(Merge(merge + " --json"), Exits(2, "--out"));
  std::string changed = whole;
  changed[whole.size() / 2] ^= 1;
  for (const std::string& damaged : {changed, whole.substr(0, whole.size() - 2), whole + "x"}) {
    scratch_.Write("part1.json", damaged);
    EXPECT_THAT(Merge(merge), Exits(2, file + ": is damaged"));
  }
  // Whole, and nonsense.
  const std::size_t end = whole.find('\n') + 1;
  auto document = nlohmann::json::parse(whole.substr(0, end));
  const auto sealed = [&](const std::string& pieces) {
    document.erase("digest");
    document["pieces"] =
        ToHex(ChainedDigest({}, Bytes(reinterpret_cast<const std::uint8_t*>(pieces.data()), pieces.size())));
    document["digest"] = ToHex(DigestOf(document.dump()));
    scratch_.Write("part1.json", document.dump() + "\n" + pieces);
    return Merge(merge);
  };
  EXPECT_THAT(sealed("\xff\xff}\n"), Exits(2, file + ": has no "));
  EXPECT_THAT(sealed("\x83\x00\x00\x01}\n"), Exits(2, file + ": has no "));
  for (const char nested : {'\x81', '\x7f', '\x5f', '\xa1', '\xc1'})  // deeper than a stack
    for (const std::string head : {"", "\x84"}) {
      EXPECT_THAT(sealed(head + std::string(1'000'000, nested)), Exits(2, file + ": has no ")) << head << nested;
    }
  const auto with = [&](const char* key, const nlohmann::json& value) {
    const nlohmann::json before = document;
    document.merge_patch({{key, value}});
    if (document.at("runs").empty()) document["results"] = nlohmann::json::array();
    const Output output = sealed(whole.substr(end));
    document = before;
    return output;
  };
  EXPECT_THAT(with("options", {{"format", "xml"}}), Exits(2, "no format of an export is called xml"));
  for (const std::string format : {"jsonl", "npz"}) {
    document["options"]["format"] = format;
    EXPECT_THAT(with("runs", nlohmann::json::array()), Exits(2, file + ": has not the result of one run"));
    EXPECT_THAT(with("results", {nullptr}), Exits(2, file + ": has not the result of one run"));
  }
  document["options"]["format"] = "jsonl";
  const std::int64_t cases = std::exchange(document["results"][0]["cases"], INT64_MAX);
  EXPECT_EQ(sealed(whole.substr(end)).code, 0) << "in no more time than its pieces take";
  fs::remove(out);
  const auto piece = [](const nlohmann::json& entries) {
    const std::vector<std::uint8_t> bytes = nlohmann::json::to_cbor(entries);
    return std::string(bytes.begin(), bytes.end());
  };
  const std::string far = piece({0, INT64_MAX - 2, "x", "\n"});
  EXPECT_THAT(sealed(far + piece({0, 5, "x", "\n"}) + "}\n"), Exits(2, file + ": has no ")) << "not in order";
  document["results"][0]["cases"] = cases;
  EXPECT_FALSE(fs::exists(out));
  EXPECT_EQ(sealed(whole.substr(end)).code, 0);
  EXPECT_THAT(Merge(merge), Exits(2, out));
  WriteShards("replay " + kCourseLog + config_, 1);
  EXPECT_THAT(Merge(merge), Exits(2, "--out: is for the shards of an export"));
}

TEST_F(ShardsTest, OfAdviceNeedTheirLogs) {
  const std::string log = scratch_ / "night/a/one.lcmlog", files = WriteShards("advise " + log + config_, 2);
  fs::copy(changed_, log, fs::copy_options::overwrite_existing);
  EXPECT_THAT(Merge(files), Exits(2, "is of other logs than those that are there now"));
}

TEST_F(ShardsTest, CountOnceWhatIsPassedOver) {
  const auto [key, log] = SignedLog(scratch_, kCourseLog);
  for (const std::string command : {"replay ", "verify "})
    EXPECT_THAT(ExpectMergedAsWhole(command + log + config_ + " --key " + key, {3}),
                Exits(0, "passed over: 5 (unsigned 2, forged 1, replayed 2)"));
}

TEST_F(ShardsTest, AreDisjointAndComplete) {
  WriteShards("replay " + changed_ + config_, 3);
  std::set<std::int64_t> told;
  std::int64_t agreed = 0;
  for (int number = 1; number <= 3; ++number) {
    const auto results = nlohmann::json::parse(Read(PathOf(number)))["results"][0];
    agreed += results["counts"]["agreed"].get<std::int64_t>();
    EXPECT_GT(results["counts"]["agreed"], 0) << "one log is divided";
    for (const auto& each : results["told"]) {
      EXPECT_TRUE(told.insert(each[0].get<std::int64_t>()).second) << each[0];
      EXPECT_EQ(each[0].get<std::int64_t>() % 3, number - 1);
    }
  }
  const auto whole = nlohmann::json::parse(Forereach("replay --json " + changed_ + config_).text);
  EXPECT_EQ(agreed, whole["agreed"]);
  EXPECT_LE(told.size(), whole["differences"].size());
}

TEST_F(ShardsTest, WrittenAgainAreTheSameFileAndReplaceNoOther) {
  const std::string command = "verify " + changed_ + config_;
  ASSERT_EQ(WriteOne(command, 2, 3).code, 0);
  const std::string before = Read(PathOf(2));
  EXPECT_EQ(WriteOne(command + " --jobs 1", 2, 3).code, 0);
  EXPECT_EQ(Read(PathOf(2)), before);
  scratch_.Write("part1.json", "{\"n\":1}");
  EXPECT_THAT(WriteOne(command, 1, 3), Exits(2, "part1.json: is not the file of a shard, and is not replaced"));
  EXPECT_EQ(Read(PathOf(1)), "{\"n\":1}");
}

TEST_F(ShardsTest, ThatDoNotBelongTogetherAreRefused) {
  const std::string replay = "replay " + kCourseLog + config_;
  const auto keep = [this](const std::string& command, int number, int count, const std::string& name) {
    EXPECT_EQ(WriteOne(command, number, count).code, 0) << command;
    fs::rename(PathOf(number), scratch_ / name);
    return scratch_ / name;
  };
  const std::string one = keep(replay, 1, 2, "one.json"), two = keep(replay, 2, 2, "two.json");
  EXPECT_EQ(Merge(two + " " + one).code, 0);
  EXPECT_THAT(Merge(one), Exits(2, one + ": shard 2 of 2 is missing"));
  EXPECT_THAT(Merge(two), Exits(2, two + ": shard 1 of 2 is missing"));
  fs::copy(one, scratch_ / "again.json");
  EXPECT_THAT(Merge(one + " " + two + " " + (scratch_ / "again.json")),
              Exits(2, (scratch_ / "again.json") + ": is shard 1 of 2, and so is " + one));
  const std::pair<std::string, std::string> others[] = {
      {keep(replay, 2, 3, "thirds.json"), "is shard 2 of 3, and " + one + " is one of 2"},
      {keep("verify " + kCourseLog + config_, 2, 2, "verify.json"), "is of another command than " + one},
      {keep(replay + " --compare", 2, 2, "compare.json"), "is of another command than " + one},
      {keep(replay + " --plan-digest 5", 2, 2, "digest.json"), "was made with another task, key or option than " + one},
      {keep(replay + " --no-key", 2, 2, "no-key.json"), "was made with another task, key or option than " + one},
      {keep("replay " + changed_ + config_, 2, 2, "changed.json"), "is of other runs than " + one},
      {keep("replay " + (scratch_ / "night/a") + config_, 2, 2, "a.json"), "is of other runs than " + one}};
  for (const auto& [file, why] : others) EXPECT_THAT(Merge(one + " " + file), Exits(2, file + ": " + why));
}

TEST_F(ShardsTest, OfCopiesOnSeveralMachinesBelongTogether) {
  const std::string directory = scratch_ / "robot";
  fs::create_directory(directory);
  fs::copy(kCourseLog, directory + "/events-1.lcmlog");
  KeptTasks(directory).Keep(CopyTask(LoadConfig(kCourseTask)));
  EXPECT_EQ(WriteOne("replay " + directory, 1, 2).code, 0);
  for (const auto& entry : fs::recursive_directory_iterator(directory)) fs::last_write_time(entry, {});
  EXPECT_EQ(WriteOne("replay " + directory, 2, 2).code, 0);
  EXPECT_THAT(Merge(PathOf(1) + " " + PathOf(2)), Exits(0, "0 differ"));
}

TEST_F(ShardsTest, DamagedFilesAreRefused) {
  WriteShards("replay " + kCourseLog + config_, 1);
  const std::string whole = Read(PathOf(1));
  const auto merged = [this](const std::string& text) { return Merge(scratch_.Write("damaged.json", text)); };
  EXPECT_EQ(merged(whole).code, 0);
  const std::string file = scratch_ / "damaged.json";
  EXPECT_THAT(merged(whole.substr(0, whole.size() / 2)), Exits(2, file + ": not the file of a shard: it is no JSON"));
  EXPECT_THAT(merged("{}"), Exits(2, file + ": not the file of a shard: it "));
  EXPECT_THAT(merged("[]"), Exits(2, file + ": not the file of a shard: it "));
  std::string altered = whole;
  const std::size_t at = altered.find("\"agreed\":") + 9;
  ASSERT_LT(at, altered.size());
  altered[at] = altered[at] == '1' ? '2' : '1';
  EXPECT_THAT(merged(altered), Exits(2, file + ": is damaged"));
  // Whole, and nonsense.
  const auto sealed = [&](auto edit) {
    auto document = nlohmann::json::parse(whole);
    document.erase("digest");
    edit(document);
    document["digest"] = ToHex(DigestOf(document.dump()));
    return merged(document.dump());
  };
  EXPECT_EQ(sealed([](auto&) {}).code, 0);
  EXPECT_THAT(sealed([](auto& document) { document["program"] = "0.0.1"; }),
              Exits(2, file + ": another version of this program wrote it"));
  EXPECT_THAT(sealed([](auto& document) { document["shard"] = 2; }), Exits(2, file + ": no shard is such"));
  EXPECT_THAT(sealed([](auto& document) { document["results"].clear(); }), Exits(2, file + ": no shard is such"));
  EXPECT_THAT(sealed([](auto& document) { document["results"][0] = 7; }),
              Exits(2, file + ": has no results of this command"));
  EXPECT_THAT(sealed([](auto& document) { document["command"] = "report"; }), Exits(2, file + ": no shard is such"));
}

TEST_F(ShardsTest, ThatFoundAnotherRunUnderTheSameNameAreRefused) {
  const std::string files = WriteShards("replay " + kCourseLog + config_, 2);
  auto document = nlohmann::json::parse(Read(PathOf(2)));
  document.erase("digest");
  document["results"][0]["cases"] = 3;
  document["digest"] = ToHex(DigestOf(document.dump()));
  scratch_.Write("part2.json", document.dump());
  EXPECT_THAT(Merge(files),
              Exits(2, PathOf(2) + ": found other cases or messages in " + kCourseLog + " than " + PathOf(1)));
}

TEST_F(ShardsTest, OptionsThatMakeNoShardAreRefused) {
  const std::string replay = "replay " + kCourseLog + config_;
  for (const char* shard : {"0/3", "4/3", "1", "1/", "/3", "1/3x", "-1/3", "1/0", "1/100001", "1/99999999999", "x/y"})
    EXPECT_THAT(Forereach(replay + " --shard " + shard + " --out " + PathOf(1) + " 2>&1"),
                Exits(2, std::string("--shard: ") + shard + " is not I/N"));
  EXPECT_THAT(Forereach(replay + " --shard 1/3 2>&1"), Exits(2, "--out"));
  EXPECT_THAT(Forereach(replay + " --out " + PathOf(1) + " 2>&1"), Exits(2, "--shard"));
  EXPECT_THAT(Forereach(replay + " --json --shard 1/3 --out " + PathOf(1) + " 2>&1"), Exits(2, "--json"));
  EXPECT_THAT(Forereach("advise " + kCourseLog + config_ + " --shard 1/3 2>&1"), Exits(2, "--out"));
  EXPECT_THAT(
      Forereach("advise " + kCourseLog + config_ + " --advice-seconds 9 --shard 1/3 --out " + PathOf(1) + " 2>&1"),
      Exits(2, "--shard"));
  EXPECT_FALSE(fs::exists(PathOf(1)));
  const std::string decision = scratch_ / "decision.json";
  ASSERT_EQ(
      Forereach("certify --json --config config/bicycle.yaml --plan config/plans/bicycle_certified.csv > " + decision)
          .code,
      0);
  for (const std::string command : {"verify ", "advise "})
    EXPECT_THAT(Forereach(command + decision + " --shard 1/3 --out " + PathOf(1) + " 2>&1"),
                Exits(2, "--shard divides logs, and this is a single decision"));
}

TEST_F(ShardsTest, ANameThatIsNoTextIsRefused) {
  const std::string log = scratch_ / "\xff.lcmlog";
  fs::copy(kCourseLog, log);
  EXPECT_THAT(WriteOne("replay " + log + config_, 1, 2), Exits(2, "is not UTF-8, which this file cannot hold"));
  EXPECT_FALSE(fs::exists(PathOf(1)));
}

}  // namespace forereach::shards_test
