// `forereach export`: each format read back by a reader that shares nothing with its writer.

#include "records/export.h"
#include "records/database.h"
#include "records/export_table.h"
#include "records/mcap.h"
#include "records/message_json.h"
#include "records/npz.h"
#include "records/output_file.h"
#include "tests/cli/program.h"
#include "tests/messages.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"
#include "tests/records/signed_log.h"
#include "tests/tries.h"

namespace forereach::export_test {

using nlohmann::json;

// RFC 4180.
std::vector<std::vector<std::string>> ParseCsv(const std::string& text) {
  std::vector<std::vector<std::string>> rows{{""}};
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string& cell = rows.back().back();
    if (quoted && text[i] == '"' && i + 1 < text.size() && text[i + 1] == '"')
      cell += text[i++];
    else if (text[i] == '"')
      quoted = !quoted;
    else if (!quoted && text[i] == ',')
      rows.back().emplace_back();
    else if (!quoted && text[i] == '\n')
      rows.push_back({""});
    else
      cell += text[i];
  }
  rows.pop_back();
  return rows;
}

std::vector<json> ParseLines(const std::string& text) {
  std::vector<json> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(json::parse(line));
  return lines;
}

std::set<std::string> FilesIn(const std::string& directory) {
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) files.insert(entry.path().filename());
  return files;
}

struct ExportTest : testing::Test {
  Output ExportTo(const std::string& format, const std::string& out, const std::string& input = kCourseLog,
                  const std::string& options = "") const {
    return Forereach("export '" + input + "' --format " + format + " -o '" + (scratch_ / out) + "' --config '" +
                     kCourseTask + "' " + options + " 2>&1");
  }
  json ReadBack(const std::string& reader, const std::string& file) const {
    const Output output =
        Shell("'" FOREREACH_SOURCE_DIR "/tests/export/" + reader + "' '" + (scratch_ / file) + "' 2>&1");
    EXPECT_EQ(output.code, 0) << output.text;
    return json::parse(output.text, nullptr, false);
  }
  // By npm's @mcap/core. @pre HasMcapCore().
  static constexpr const char* kMcapCore = FOREREACH_SOURCE_DIR "/build/mcap_core";
  static bool HasMcapCore() { return std::filesystem::exists(std::string(kMcapCore) + "/installed"); }
  json ReadByMcapCore(const std::string& file) const {
    const Output output = Shell("node '" + std::string(kMcapCore) + "/read.mjs' '" + (scratch_ / file) + "' 2>&1");
    EXPECT_EQ(output.code, 0) << output.text;
    return json::parse(output.text, nullptr, false);
  }

  const ScratchDirectory scratch_;
};

TEST_F(ExportTest, TablesHaveEveryDecisionWithItsCandidate) {
  EXPECT_THAT(ExportTo("csv", "tables"),
              Exits(0, StartsWith("export: " + std::to_string(kCourseDecisions) + " decisions, ")));
  const auto decisions = ParseCsv(Read(scratch_ / "tables/decisions.csv"));
  ASSERT_EQ(decisions.size(), kCourseDecisions + 1u);
  const auto column = [&](const std::string& name) {
    const auto found = std::ranges::find(decisions[0], name);
    EXPECT_NE(found, decisions[0].end()) << name;
    return static_cast<std::size_t>(found - decisions[0].begin());
  };
  int certified = 0, controls = 0;
  for (std::size_t i = 1; i < decisions.size(); ++i) {
    ASSERT_EQ(decisions[i].size(), decisions[0].size());
    certified += decisions[i][column("outcome")] == "certified";
    controls += std::stoi(decisions[i][column("num_steps")]);
  }
  EXPECT_EQ(certified, kCourseCertified);
  EXPECT_EQ(ParseCsv(Read(scratch_ / "tables/controls.csv")).size(), static_cast<std::size_t>(controls) + 1);
  for (const char* file : {"executions.csv", "withdrawals.csv", "gaps.csv"})
    EXPECT_GE(ParseCsv(Read(scratch_ / ("tables/" + std::string(file)))).size(), 1u) << file;
}

TEST_F(ExportTest, LinesSayWhatTheTablesSay) {
  ASSERT_EQ(ExportTo("csv", "tables").code, 0);
  ASSERT_EQ(ExportTo("jsonl", "run.jsonl").code, 0);
  const auto table = ParseCsv(Read(scratch_ / "tables/decisions.csv"));
  std::size_t row = 0, executions = 0;
  std::string first_control;
  for (const json& line : ParseLines(Read(scratch_ / "run.jsonl"))) {
    executions += line["record"] == "execution_event";
    if (line["record"] != "decision") continue;
    ++row;
    for (std::size_t i = 0; i < table[0].size(); ++i) {
      const json& value = line.at(table[0][i]);
      const std::string& cell = table[row][i];
      if (value.is_null()) EXPECT_EQ(cell, "") << table[0][i];
      if (value.is_string()) EXPECT_EQ(cell, value.get<std::string>());
      if (value.is_number()) EXPECT_EQ(std::stod(cell), value.get<double>()) << table[0][i];
      if (value.is_array()) EXPECT_EQ(std::ranges::count(cell, ' ') + 1, std::ssize(value)) << table[0][i];
    }
    EXPECT_EQ(line["controls"].size(), line["num_steps"]);
    EXPECT_EQ(line["controls"][0].size(), line["num_inputs"]);
  }
  EXPECT_EQ(row, std::size_t{kCourseDecisions});
  EXPECT_EQ(ParseCsv(Read(scratch_ / "tables/executions.csv")).size(), executions + 1);
}

// The page has a table for each file; the first cell of a row names its columns.
TEST_F(ExportTest, EveryColumnIsInTheDocument) {
  const std::string page = Read(FOREREACH_SOURCE_DIR "/docs/export.md");
  ASSERT_EQ(ExportTo("csv", "tables").code, 0);
  for (const char* file : {"decisions.csv", "controls.csv", "executions.csv", "withdrawals.csv", "gaps.csv"}) {
    const std::size_t begin = page.find("**" + std::string(file) + "**");
    ASSERT_NE(begin, std::string::npos) << file;
    const std::size_t end = std::min(page.find("\n**", begin + 1), page.find("\n## ", begin + 1));
    const std::string section = page.substr(begin, end - begin);
    const auto rows = ParseCsv(Read(scratch_ / ("tables/" + std::string(file))));
    for (const std::string& column : rows.front()) EXPECT_THAT(section, HasSubstr("`" + column + "`")) << file;
  }
  ASSERT_EQ(ExportTo("npz", "tubes.npz").code, 0);
  const json arrays = ReadBack("read_npz", "tubes.npz");
  for (const auto& [name, array] : arrays.items()) EXPECT_THAT(page, HasSubstr("`" + name + "`"));
}

TEST_F(ExportTest, TubesAreThoseOfTheCertifiedPlans) {
  EXPECT_THAT(ExportTo("npz", "tubes.npz"), Exits(0));
  const json arrays = ReadBack("read_npz", "tubes.npz");
  std::vector<certified_plan_t> plans;
  for (const LogEvent& event : ReadLog(kCourseLog).events)
    if (const auto certified = Decoded<certified_plan_t>(event.message())) plans.push_back(*certified);
  ASSERT_EQ(plans.size(), std::size_t{kCourseCertified});
  EXPECT_EQ(arrays["plan_id"]["shape"], json({kCourseCertified}));
  EXPECT_EQ(arrays["slice_begin"]["shape"], json({kCourseCertified + 1}));
  for (std::size_t i = 0; i < plans.size(); ++i) {
    const candidate_plan_t& plan = plans[i].plan;
    EXPECT_EQ(arrays["plan_id"]["values"][i], plan.plan_id);
    EXPECT_EQ(arrays["source"]["values"][i], GetText(plan.source));
    const std::size_t slice = arrays["slice_begin"]["values"][i], control = arrays["control_begin"]["values"][i];
    EXPECT_EQ(arrays["slice_begin"]["values"][i + 1], slice + static_cast<std::size_t>(plan.num_steps) + 1);
    for (std::size_t t = 0; t <= static_cast<std::size_t>(plan.num_steps); ++t)
      for (std::size_t k = 0; k < static_cast<std::size_t>(plan.num_states); ++k) {
        EXPECT_EQ(arrays["slice_lower"]["values"][slice + t][k].get<double>(), plans[i].slice_lower[t][k]);
        EXPECT_EQ(arrays["slice_upper"]["values"][slice + t][k].get<double>(), plans[i].slice_upper[t][k]);
      }
    for (std::size_t t = 0; t < static_cast<std::size_t>(plan.num_steps); ++t)
      for (std::size_t j = 0; j < static_cast<std::size_t>(plan.num_inputs); ++j)
        EXPECT_EQ(arrays["controls"]["values"][control + t][j].get<double>(), plan.control[t][j]);
  }
}

TEST_F(ExportTest, ArraysMayBeEmptyAndRowsMayDiffer) {
  NpzWriter arrays{OutputFile(scratch_ / "some.npz")};
  arrays.Declare("none", 'f');
  arrays.Declare("no_text", 'S');
  arrays.AddRow("rows", std::vector{1.0, 2.0, std::numeric_limits<double>::infinity()});
  arrays.AddRow("rows", std::vector{3.0});
  arrays.Add("text", "ab");
  arrays.Add("text", std::string(300, 'c'));
  arrays.Finish();
  const Output output =
      Shell("/usr/bin/python3 -c \"import numpy; a = numpy.load('" + (scratch_ / "some.npz") +
            "'); print(a['none'].shape, a['no_text'].shape, a['rows'].tolist(), [len(t) for t in a['text']])\" 2>&1");
  EXPECT_EQ(output.text, "(0, 0) (0,) [[1.0, 2.0, inf], [3.0, nan, nan]] [2, 255]\n");
}

TEST_F(ExportTest, AnMcapFileHasEveryMessage) {
  EXPECT_THAT(ExportTo("mcap", "run.mcap"), Exits(0));
  const json found = ReadBack("read_mcap", "run.mcap");
  std::map<std::string, std::int64_t> counts;
  const auto events = ReadLog(kCourseLog).events;
  std::int64_t known = 0;
  for (const LogEvent& event : events)
    if (Summarize(event.message())) {
      ++counts[event.channel];
      ++known;
    }
  EXPECT_GT(known, 300);
  EXPECT_EQ(found["messages"], known);
  EXPECT_EQ(found["channels"].size(), counts.size());
  for (const auto& [channel, count] : counts) EXPECT_EQ(found["channels"][channel]["count"], count) << channel;
  EXPECT_EQ(found["channels"]["PLAN_DECISION"]["type"], "forereach.decision_t");
  const auto first = std::ranges::find(events, "PLAN_DECISION", &LogEvent::channel);
  const json& message = found["first"]["PLAN_DECISION"];
  EXPECT_EQ(message["log"], first->utime * 1000);
  EXPECT_EQ(message["publish"], Decoded<decision_t>(first->message())->utime * 1000);
  EXPECT_EQ(message["json"]["message"], GetText(Decoded<decision_t>(first->message())->message));
}

// JavaScript's numbers are doubles.
json InDoubles(json value) {
  if (value.is_number()) return value.get<double>();
  for (json& part : value)
    if (value.is_structured()) part = InDoubles(part);
  return value;
}

// The reader of Foxglove.
TEST_F(ExportTest, AnMcapFileIsReadByItsOwnLibrary) {
  if (!HasMcapCore()) GTEST_SKIP() << "scripts/test installs npm's @mcap/core, and could not";
  ASSERT_EQ(ExportTo("mcap", "run.mcap").code, 0);
  const json found = ReadByMcapCore("run.mcap"), same = ReadBack("read_mcap", "run.mcap");
  EXPECT_THAT(found, Holds({{"library", "forereach"}, {"messages", same["messages"]}}));
  ASSERT_EQ(found["channels"].size(), same["channels"].size());
  for (const auto& [topic, channel] : found["channels"].items()) {
    EXPECT_EQ(channel["type"], same["channels"][topic]["type"]);
    EXPECT_EQ(channel["count"], same["channels"][topic]["count"]);
    EXPECT_THAT(channel["robot"], EndsWith("tests/data"));
    EXPECT_EQ(InDoubles(found["first"][topic]["json"]), InDoubles(same["first"][topic]["json"]));
    EXPECT_EQ(found["first"][topic]["log"], std::to_string(same["first"][topic]["log"].get<std::int64_t>()));
  }
  McapWriter many{OutputFile(scratch_ / "many.mcap")};
  const auto schema = many.AddSchema("t", R"({"type":"object","properties":{"text":{"type":"string"}}})");
  const auto a = many.AddChannel(schema, "A"), b = many.AddChannel(schema, "B");
  const std::string text = "{\"text\":\"" + std::string(100'000, 'x') + "\"}";
  for (int i = 0; i < 30; ++i) many.Write(i % 3 ? a : b, 1, 1000 - i, INT64_MAX, text);
  many.Finish();
  EXPECT_EQ(ReadByMcapCore("many.mcap")["channels"]["A"]["count"], 20);
  McapWriter none{OutputFile(scratch_ / "none.mcap")};
  none.Finish();
  EXPECT_EQ(ReadByMcapCore("none.mcap")["messages"], 0);
}

TEST_F(ExportTest, AnMcapFileMayHaveManyChunksOrNone) {
  {
    McapWriter none{OutputFile(scratch_ / "none.mcap")};
    none.Finish();
  }
  EXPECT_EQ(ReadBack("read_mcap", "none.mcap")["messages"], 0);
  McapWriter many{OutputFile(scratch_ / "many.mcap")};
  const auto schema = many.AddSchema("t", R"({"type":"object","properties":{"text":{"type":"string"}}})");
  const auto a = many.AddChannel(schema, "A"), b = many.AddChannel(schema, "B");
  const std::string object = "{\"text\":\"" + std::string(100'000, 'x') + "\"}";
  for (int i = 0; i < 30; ++i) many.Write(i % 3 ? a : b, 1, 1000 - i, INT64_MAX, object);  // the clock goes backwards
  many.Finish();
  const auto found = ReadBack("read_mcap", "many.mcap");
  EXPECT_EQ(found["messages"], 30);
  EXPECT_GE(found["chunks"].get<int>(), 3);
}

TEST_F(ExportTest, ADamagedMcapFileIsNoticedByItsReader) {
  ASSERT_EQ(ExportTo("mcap", "run.mcap").code, 0);
  const auto bytes = ReadBytes(scratch_ / "run.mcap");
  for (const std::size_t at : {bytes.size() / 3, bytes.size() / 2, bytes.size() - 60}) {
    auto damaged = bytes;
    damaged[at] ^= 1;
    WriteBytes(scratch_ / "damaged.mcap", damaged);
    EXPECT_NE(
        Shell("'" FOREREACH_SOURCE_DIR "/tests/export/read_mcap' '" + (scratch_ / "damaged.mcap") + "' 2>&1").code, 0)
        << at;
  }
}

TEST_F(ExportTest, TextsAreQuotedAndAreNoFormulas) {
  DecisionRow row;
  row.source = "=HYPERLINK(\"http://x\",\"y\")";
  row.message = "first, \"second\"";
  row.margin = std::numeric_limits<double>::infinity();
  row.threshold = -1.5;
  row.event.log_file = "@a\nb";
  const auto cells = ParseCsv(CsvHeader(CellsOf("-robot", row, nullptr)) + CsvLine(CellsOf("-robot", row, nullptr)));
  ASSERT_EQ(cells.size(), 2u);
  ASSERT_EQ(cells[0].size(), cells[1].size());
  nlohmann::json of;
  for (std::size_t i = 0; i < cells[0].size(); ++i) of[cells[0][i]] = cells[1][i];
  EXPECT_THAT(of, Holds({{"source", "'=HYPERLINK(\"http://x\",\"y\")"}, {"message", "first, \"second\""}}));
  EXPECT_EQ(of["margin"], "") << "infinite";
  EXPECT_EQ(of["threshold"], "-1.5") << "a number is no formula";
  EXPECT_EQ(of["elapsed_us"], "") << "not a number";
  EXPECT_EQ(of["step"], "") << "does not apply";
  EXPECT_THAT(of, Holds({{"log_file", "'@a\\x0ab"}, {"robot", "'-robot"}}));
  const json line = json::parse(JsonLine("decision", CellsOf("a", row, nullptr)));
  EXPECT_EQ(line["source"], row.source);
  EXPECT_TRUE(line["margin"].is_null());
  EXPECT_TRUE(line["num_steps"].is_null());
}

// Its candidates claim impossible sizes; one plan has no candidate; a withdrawal is repeated.
TEST_F(ExportTest, AHostileLogIsExported) {
  const std::string log = scratch_ / "hostile.lcmlog";
  {
    EventLogWriter writer(log);
    candidate_plan_t candidate = MakeCandidate(0, INT64_MAX, "../../etc/passwd");
    candidate.num_states = candidate.num_inputs = candidate.num_steps = 32767;
    writer.Append(1, "PLAN_CANDIDATE", Encode(candidate));
    writer.Append(2, "PLAN_DECISION", Encode(MakeDecision(candidate, 0, 99, 99)));
    writer.Append(3, "PLAN_DECISION", Encode(MakeDecision(MakeCandidate(1, -1), 1, decision_t::REJECTED, 12)));
    certified_plan_t certified{};
    certified.plan = candidate;
    writer.Append(4, "PLAN_CERTIFIED", Encode(certified));
    withdrawal_t withdrawal{.cause = withdrawal_t::OBSTACLE};
    for (int i = 0; i < 3; ++i) {
      withdrawal.sequence = withdrawal.utime = i;
      writer.Append(5 + i, "PLAN_WITHDRAWN", Encode(withdrawal));
    }
    writer.Append(INT64_MAX, "\x1b[2J\xff../../x", std::vector<std::uint8_t>(100, 0xAB));
    for (int i = 0; i < 300; ++i) writer.Append(9, "INVENTED" + std::to_string(i), Encode(withdrawal));
    ASSERT_TRUE(writer.Flush());
  }
  EXPECT_EQ(ExportTo("jsonl", "hostile.jsonl", log).code, 0);
  const auto lines = ParseLines(Read(scratch_ / "hostile.jsonl"));
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0]["plan_id"], INT64_MAX);
  EXPECT_EQ(lines[0]["outcome"], "unknown");
  EXPECT_EQ(lines[0]["num_states"], 32767);
  EXPECT_TRUE(lines[0]["initial_center"].is_null());
  EXPECT_FALSE(lines[0].contains("controls"));
  EXPECT_TRUE(lines[1]["num_states"].is_null());
  EXPECT_EQ(lines[2]["record"], "withdrawal");
  EXPECT_EQ(ExportTo("csv", "hostile", log).code, 0);
  EXPECT_THAT(ExportTo("npz", "hostile.npz", log).text,
              HasSubstr("0 tubes of certified plans; 1 with impossible counts"));
  EXPECT_EQ(ReadBack("read_npz", "hostile.npz")["slice_lower"]["shape"], json({0, 0}));
  const Output mcap = ExportTo("mcap", "hostile.mcap", log);
  EXPECT_EQ(mcap.code, 0) << mcap.text;
  EXPECT_LE(ReadBack("read_mcap", "hostile.mcap")["channels"].size(), 256u);
  EXPECT_THAT(mcap.text, HasSubstr("messages of other types left out"));
  EXPECT_EQ(FilesIn(scratch_.path()),
            (std::set<std::string>{"hostile", "hostile.lcmlog", "hostile.jsonl", "hostile.npz", "hostile.mcap"}));
}

TEST_F(ExportTest, DamageIsSaidAndTheRestIsExported) {
  auto bytes = ReadBytes(kCourseLog);
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(RecordFrom(bytes, bytes.size() / 2)), 100, std::uint8_t{0});
  WriteBytes(scratch_ / "damaged.lcmlog", bytes);
  EXPECT_THAT(ExportTo("jsonl", "run.jsonl", scratch_ / "damaged.lcmlog"), Exits(1, "damaged in 1 places"));
  EXPECT_GT(ParseLines(Read(scratch_ / "run.jsonl")).size(), 60u);
}

// Bytes of a recorded log are changed at random; what is left is exported in every format.
TEST_F(ExportTest, AnyLogIsExportedOrRefused) {
  const std::uint64_t seed = 20261124;
  std::mt19937_64 random(seed);
  SCOPED_TRACE(seed);
  const auto whole = ReadBytes(kCourseLog);
  for (int i = 0; i < Tries(8); ++i) {
    auto bytes = whole;
    for (int k = 0; k < 3000; ++k) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    bytes.resize(bytes.size() - random() % 1000);
    WriteBytes(scratch_ / "any.lcmlog", bytes);
    const RunLogs run{"r", {scratch_ / "any.lcmlog"}, "", {}};
    for (const ExportFormat format :
         {ExportFormat::kCsv, ExportFormat::kJsonLines, ExportFormat::kNpz, ExportFormat::kMcap}) {
      std::vector<std::string> files;
      for (const std::string& name : ExportFiles(format)) files.push_back(scratch_ / ("any." + name));
      const ExportResult result = ExportRun(run, {.format = format, .config = kCourseTask, .key = {}}, files);
      EXPECT_GT(result.damage.places + result.left_out + result.decisions, 0);
    }
    for (const json& line : ParseLines(Read(scratch_ / "any.jsonl"))) EXPECT_EQ(line["robot"], "r");
    static_cast<void>(ReadBack("read_mcap", "any.mcap"));
    static_cast<void>(ReadBack("read_npz", "any.npz"));
  }
}

TEST_F(ExportTest, ALogWithoutOurMessagesIsNoExport) {
  {
    EventLogWriter writer(scratch_ / "foreign.lcmlog");
    writer.Append(1, "CAMERA", std::vector<std::uint8_t>(100));
    ASSERT_TRUE(writer.Flush());
  }
  EXPECT_THAT(ExportTo("jsonl", "foreign.jsonl", scratch_ / "foreign.lcmlog"),
              Exits(1, "nothing in it is a message of ForeReach's"));
}

TEST_F(ExportTest, AFileThatExistsIsNotChanged) {
  scratch_.Write("precious", "mine");
  for (const char* format : {"jsonl", "npz", "mcap"}) {
    EXPECT_THAT(ExportTo(format, "precious"), Exits(2, "the file exists, and is not changed")) << format;
  }
  EXPECT_EQ(ExportTo("csv", "precious").code, 2);
  std::filesystem::create_directory(scratch_ / "tables");
  scratch_.Write("tables/gaps.csv", "mine");
  EXPECT_EQ(ExportTo("csv", "tables").code, 2);
  EXPECT_EQ(Read(scratch_ / "precious"), "mine");
  EXPECT_EQ(Read(scratch_ / "tables/gaps.csv"), "mine");
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "tables/decisions.csv"));
  std::filesystem::create_symlink("nowhere", scratch_ / "link");
  EXPECT_EQ(ExportTo("jsonl", "link").code, 2) << "a link is a file that exists";
  std::filesystem::create_directory(scratch_ / "empty");
  EXPECT_EQ(ExportTo("csv", "empty/").code, 0) << "an empty directory may be filled";
  EXPECT_EQ(FilesIn(scratch_.path()), (std::set<std::string>{"precious", "tables", "link", "empty"}));
}

TEST_F(ExportTest, RefusesWhatItCannotExportAndSaysWhy) {
  EXPECT_EQ(Forereach("export README.md --format csv -o '" + (scratch_ / "x") + "' 2>&1").code, 2);
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "x/decisions.csv"));
  EXPECT_EQ(Forereach("export '" + kCourseLog + "' --format xlsx -o '" + (scratch_ / "x.xlsx") + "' 2>&1").code, 2);
  EXPECT_THAT(Forereach("export '" + scratch_.path() + "' --format csv -o '" + (scratch_ / "y") + "' 2>&1").text,
              HasSubstr("neither a decision database nor event logs"));
}

TEST_F(ExportTest, AFullDiskIsAnErrorAndLeavesNothing) {
  EXPECT_THAT(Forereach("export '" + kCourseLog + "' --format jsonl -o /dev/full 2>&1"), Exits(2)) << "it exists";
  EXPECT_THAT(Shell("ulimit -f 8; trap '' XFSZ; '" FOREREACH_PROGRAM "' export '" + kCourseLog + "' --config '" +
                    kCourseTask + "' --format mcap -o '" + (scratch_ / "big.mcap") + "' 2>&1"),
              Exits(2, "cannot be written"));
  EXPECT_TRUE(FilesIn(scratch_.path()).empty()) << "neither the file nor what was begun";
}

TEST_F(ExportTest, OnlyAuthenticMessagesCount) {
  const auto [key, log] = SignedLog(scratch_, kCourseLog);
  EXPECT_THAT(ExportTo("jsonl", "run.jsonl", log, "--key '" + key + "'"),
              Exits(0, std::to_string(kCourseDecisions) + " decisions", "not authentic and passed over: 5"));
}

// Two files of one run and one file that is gone.
TEST_F(ExportTest, ADirectoryIsExportedByItsDatabase) {
  const std::string directory = scratch_ / "log";
  std::filesystem::create_directory(directory);
  std::filesystem::copy_file(kCourseLog, directory + "/events-1.lcmlog");
  {
    Database database(directory + "/decisions.sqlite");
    database.BeginRun("events-0.lcmlog", 1);
    Rows rows;
    rows.decisions.emplace_back();
    rows.decisions.back().event = {"events-0.lcmlog", 3, "ab"};
    rows.decisions.back().outcome = "certified";
    ASSERT_TRUE(database.Write(rows, "events-0.lcmlog", 4).has_value());
    database.MarkLogDeleted("events-0.lcmlog", 2);
    database.BeginRun("events-1.lcmlog", 3);
  }
  EXPECT_THAT(ExportTo("jsonl", "run.jsonl", directory), Exits(1, "events-0.lcmlog: the log was deleted for the quota",
                                                               std::to_string(kCourseDecisions + 1) + " decisions"))
      << "a log is missing";
  const auto lines = ParseLines(Read(scratch_ / "run.jsonl"));
  EXPECT_EQ(lines[0]["log_file"], "events-0.lcmlog");
  EXPECT_EQ(lines[0]["event_digest"], "ab");
  EXPECT_EQ(lines[1]["log_file"], "events-1.lcmlog");
}

// Two robots, of which one has a log that is damaged and one that is none.
struct ManyRunsTest : ExportTest {
  ManyRunsTest() {
    for (const char* robot : {"night/a", "night/b/log"}) {
      std::filesystem::create_directories(scratch_ / robot);
      std::filesystem::copy_file(kCourseLog, scratch_ / (std::string(robot) + "/one.lcmlog"));
    }
    scratch_.Write("night/b/log/two.lcmlog", "no log");
    std::filesystem::create_symlink("one.lcmlog", scratch_ / "night/a/latest.lcmlog");
    std::filesystem::create_directory_symlink("..", scratch_ / "night/a/up");
  }
};

TEST_F(ManyRunsTest, ChannelsOfAnMcapFileNameTheRobot) {
  if (!HasMcapCore()) GTEST_SKIP() << "scripts/test installs npm's @mcap/core, and could not";
  EXPECT_EQ(ExportTo("mcap", "mcaps", scratch_ / "night").code, 1);
  const json found = ReadByMcapCore("mcaps/0002-one.mcap");
  EXPECT_EQ(found["channels"][(scratch_ / "night/b/log") + "/PLAN_DECISION"]["robot"], scratch_ / "night/b/log");
}

TEST_F(ManyRunsTest, RowsHaveTheRobotAndRunsAFileEach) {
  EXPECT_THAT(ExportTo("jsonl", "night.jsonl", scratch_ / "night"),
              Exits(1, "two.lcmlog: is no LCM event log", std::to_string(2 * kCourseDecisions) + " decisions"))
      << "two.lcmlog cannot be read";
  std::map<std::string, int> decisions;
  for (const json& line : ParseLines(Read(scratch_ / "night.jsonl")))
    decisions[line["robot"]] += line["record"] == "decision";
  EXPECT_EQ(decisions, (std::map<std::string, int>{{scratch_ / "night/a", kCourseDecisions},
                                                   {scratch_ / "night/b/log", kCourseDecisions}}));

  EXPECT_EQ(ExportTo("csv", "tables", scratch_ / "night").code, 1);
  const auto table = ParseCsv(Read(scratch_ / "tables/decisions.csv"));
  ASSERT_EQ(table.size(), 2u * kCourseDecisions + 1) << "one line of names";
  EXPECT_EQ(table[0][0], "robot");
  EXPECT_EQ(table[1][0], scratch_ / "night/a");
  EXPECT_EQ(table[2 * kCourseDecisions][0], scratch_ / "night/b/log");

  EXPECT_EQ(ExportTo("mcap", "mcaps", scratch_ / "night").code, 1);
  EXPECT_EQ(FilesIn(scratch_ / "mcaps"), (std::set<std::string>{"0001-one.mcap", "0002-one.mcap"}));
  EXPECT_EQ(ExportTo("npz", "tubes", scratch_ / "night").code, 1);
  EXPECT_EQ(ReadBack("read_npz", "tubes/0001-one.npz")["robot"]["values"][19], scratch_ / "night/a");
  EXPECT_EQ(FilesIn(scratch_.path()), (std::set<std::string>{"night", "night.jsonl", "tables", "mcaps", "tubes"}));
}

TEST_F(ManyRunsTest, AKilledCommandLeavesNothingUnderTheNameOfItsOutput) {
  const std::string command = "'" FOREREACH_PROGRAM "' export '" + (scratch_ / "night") + "' --config '" + kCourseTask +
                              "' --format csv -o '" + (scratch_ / "tables") + "'";
  for (const char* after : {"0.01", "0.03", "0.06", "0.1", "0.2"}) {
    static_cast<void>(Shell(std::string("timeout -s KILL ") + after + " " + command + " 2>&1"));
    if (!std::filesystem::exists(scratch_ / "tables")) continue;
    EXPECT_EQ(FilesIn(scratch_ / "tables").size(), 5u) << "all or nothing";
    break;
  }
  if (!std::filesystem::exists(scratch_ / "tables")) static_cast<void>(Shell(command + " 2>&1"));
  EXPECT_EQ(ParseCsv(Read(scratch_ / "tables/decisions.csv")).size(), 2u * kCourseDecisions + 1);
}

}  // namespace forereach::export_test
