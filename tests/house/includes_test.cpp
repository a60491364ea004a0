// scripts/check-includes: the sources keep to the arrows, and the script sees when they do not.
#include "tests/test.h"

#include "tests/paths.h"
#include "tests/shell.h"

namespace forereach::includes_test {

Output CheckIncludes(const std::string& root) {
  return Shell("'" FOREREACH_SOURCE_DIR "/scripts/check-includes' '" + root + "' 2>&1");
}

// A small house that keeps to the arrows, to which a test adds one thing.
struct IncludesTest : testing::Test {
  IncludesTest() {
    Write("forereach/numerics/interval.h", "#include <cmath>\n");
    Write("forereach/sets/box.h", "#include <Eigen/Core>\n#include \"forereach/numerics/interval.h\"\n");
    Write("certifier/gate/gate.h", "#include \"forereach/sets/box.h\"\n#include \"lcmtypes/codec.h\"\n");
    Write("certifier/process/node.h", "#include \"certifier/gate/gate.h\"\n#include <fmt/core.h>\n");
    Write("lcmtypes/codec.h", "#include <cstdint>\n");
    Write("bus/bus.cpp", "#include \"lcmtypes/codec.h\"\n#include <lcm/lcm-cpp.hpp>\n");
    Write("robot/guard.h", "#include \"forereach/certified_plan_t.hpp\"\n#include \"lcmtypes/codec.h\"\n");
    Write("robot/guard.cpp", "#include \"robot/guard.h\"\n");
    Write("planner_bridge/planner.cpp", "#include <ompl/util/RandomNumbers.h>\n#include \"forereach/sets/box.h\"\n");
    Write("records/database.cpp", "#include <sqlite3.h>\n");
    Write("verifier/real.h", "#include <mpfi.h>\n");
    Write("verifier/tube.cpp", "#include \"forereach/sets/box.h\"\n#include \"verifier/real.h\"\n");
    Write("tests/records/log_test.cpp", "#include <lcm/lcm-cpp.hpp>\n");
    Write("bench/gate_bench.cpp", "#include \"certifier/gate/gate.h\"\n#include <benchmark/benchmark.h>\n");
  }

  void Write(const std::string& file, const std::string& text) {
    std::filesystem::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }

  // Adds an include to a file, after which the script has to give `message` for that line.
  void Refuse(const std::string& file, const std::string& include, const std::string& message) {
    if (++lines_[file] == 1) Write(file, "");
    std::ofstream(root_ / file, std::ios::app) << "#include " << include << "\n";
    expected_.push_back(file + ":" + std::to_string(lines_[file]) + ": " + message);
  }
  void ExpectRefused() {
    const Output result = CheckIncludes(root_.string());
    EXPECT_EQ(result.code, 1);
    for (const std::string& message : expected_) EXPECT_THAT(result.text, HasSubstr(message));
  }

  const ScratchDirectory scratch_;
  const std::filesystem::path root_ = scratch_.path();
  std::map<std::string, int> lines_;
  std::vector<std::string> expected_;
};

TEST_F(IncludesTest, OurSourcesKeepTheIncludeRules) {
  EXPECT_THAT(CheckIncludes(FOREREACH_SOURCE_DIR), Exits(0, " 0 against the arrows"));
}

TEST_F(IncludesTest, ATreeThatKeepsTheRulesPasses) {
  EXPECT_THAT(CheckIncludes(root_.string()), Exits(0, "14 files, 22 includes, 0 against the arrows"));
}

TEST_F(IncludesTest, TypesOfOneNameAreRefusedUnlessNoOtherFileSeesThem) {
  const std::string of_all = "namespace forereach {\nstruct Window {\n};\n}  // namespace forereach\n";
  const std::string of_file = "namespace forereach {\nnamespace {\nstruct Window {\n};\n}  // namespace\n}\n";
  Write("records/window.h", of_all);
  Write("identify/window.cpp", of_file);
  EXPECT_EQ(CheckIncludes(root_.string()).code, 0);
  Write("identify/window.h", of_all);
  EXPECT_THAT(CheckIncludes(root_.string()),
              Exits(1, "records/window.h:1: defines forereach::Window, as identify/window.h does"));
}

TEST_F(IncludesTest, TheDocumentListsTheFoldersFromTheGroundUp) {
  const std::string page = Read(FOREREACH_SOURCE_DIR "/docs/architecture.md");
  const std::size_t bus = page.find("| `bus`"), robot = page.find("| `robot`"), next = page.find('\n', robot) + 1;
  const std::string bus_row = page.substr(bus, robot - bus), robot_row = page.substr(robot, next - robot);
  for (const std::string& rows : {bus_row + robot_row, bus_row, robot_row + bus_row}) {
    Write("docs/architecture.md", page.substr(0, bus) + rows + page.substr(next));
    const bool is_right = rows == bus_row + robot_row;
    EXPECT_THAT(CheckIncludes(root_.string()),
                Exits(is_right ? 0 : 1, is_right ? "0 against" : "docs/architecture.md:1: the table does not list"));
  }
}

TEST_F(IncludesTest, ATreeWithoutSourcesIsAnError) {
  std::filesystem::remove_all(root_);
  std::filesystem::create_directories(root_);
  EXPECT_EQ(CheckIncludes(root_.string()).code, 2);
}

TEST_F(IncludesTest, ALayerMayIncludeLowerLayersOnly) {
  Refuse("forereach/numerics/bad.h", "\"forereach/sets/box.h\"", "numerics may not include sets");
  Refuse("forereach/sets/bad.cpp", "<certifier/gate/gate.h>", "forereach may include Eigen");
  Refuse("forereach/certify/bad.cpp", "\"certifier/gate/gate.h\"", "forereach may include Eigen");
  Refuse("task/bad.cpp", "\"certifier/gate/gate.h\"", "task may not include certifier");
  Refuse("certifier/gate/bad.cpp", "\"certifier/process/node.h\"", "gate may not include process");
  Refuse("certifier/attic/bad.cpp", "\"forereach/sets/box.h\"", "certifier has no floor attic");
  ExpectRefused();
}

TEST_F(IncludesTest, TheLibraryMayIncludeEigenOnly) {
  for (const char* floor : {"numerics", "sets", "dynamics", "residual", "safety", "reach", "declare", "certify"}) {
    const std::string file = std::string("forereach/") + floor + "/bad.cpp";
    for (const char* include : {"\"lcmtypes/codec.h\"", "\"forereach/decision_t.hpp\"", "<fmt/core.h>", "<unistd.h>"})
      Refuse(file, include, "forereach may include Eigen");
  }
  ExpectRefused();
}

TEST_F(IncludesTest, AFolderMayIncludeItsListedFoldersOnly) {
  Refuse("lcmtypes/bad.h", "\"forereach/sets/box.h\"", "lcmtypes may not include forereach");
  Refuse("certifier/process/bad.cpp", "\"records/database.h\"", "certifier may not include records");
  for (const char* other : {"planner_bridge", "logger", "robot", "cli", "bench"})
    Refuse("certifier/gate/bad.cpp", std::string("\"") + other + "/x.h\"",
           std::string("certifier may not include ") + other);
  Refuse("robot/bad.cpp", "\"planner_bridge/x.h\"", "robot may not include planner_bridge");
  Refuse("records/bad.cpp", "\"logger/x.h\"", "records may not include logger");
  Refuse("bench/bad.cpp", "\"logger/x.h\"", "bench may not include logger");
  Refuse("research/bad.cpp", "\"robot/x.h\"", "research may not include robot");
  Refuse("research/bad.cpp", "\"cli/commands.h\"", "research may not include cli");
  Refuse("research/bad.cpp", "\"planner_bridge/proposal.h\"", "research may include the planner's policies only");
  Refuse("certifier/gate/bad.cpp", "\"research/x.h\"", "certifier may not include research");
  Refuse("logger/bad.cpp", "\"tests/records/logs.h\"", "logger may not include tests");
  ExpectRefused();
}

TEST_F(IncludesTest, ARobotIncludesMessagesLcmtypesAndBusOnly) {
  for (const char* include : {"<Eigen/Core>", "<fmt/core.h>"})
    Refuse("robot/guard.cpp", include, "robot may include messages, lcmtypes and bus only");
  for (const char* other : {"forereach", "task", "simulator"})
    Refuse("robot/supervisor.h", std::string("\"") + other + "/x.h\"", std::string("robot may not include ") + other);
  ExpectRefused();
}

TEST_F(IncludesTest, TheVerifierSharesNoArithmetic) {
  Refuse("verifier/bad.cpp", "\"forereach/numerics/interval.h\"", "the verifier may include the proof's data only");
  Refuse("verifier/bad.cpp", "\"certifier/gate/gate.h\"", "verifier may not include certifier");
  Refuse("verifier/bad.cpp", "\"lcmtypes/codec.h\"", "verifier may not include lcmtypes");
  Refuse("certifier/gate/bad.cpp", "\"verifier/real.h\"", "certifier may not include verifier");
  Refuse("logger/bad.cpp", "\"verifier/real.h\"", "logger may not include verifier");
  Refuse("verifier/tube.cpp", "<mpfi.h>", "MPFI belongs to verifier/real.h alone");
  ExpectRefused();
}

TEST_F(IncludesTest, OnlyItsOwnerMayIncludeTheHeadersOfALibrary) {
  for (const char* file :
       {"certifier/process/bad.cpp", "robot/bad.cpp", "logger/bad.cpp", "cli/bad.cpp", "bus/node.cpp"})
    Refuse(file, "<lcm/lcm-cpp.hpp>", "LCM belongs to bus/bus.cpp alone");
  Refuse("robot/bad.cpp", "<ompl/util/Console.h>", "OMPL belongs to planner_bridge/ alone");
  Refuse("cli/bad.cpp", "<sqlite3.h>", "SQLite belongs to records/ alone");
  Refuse("robot/bad.cpp", "<librsvg/rsvg.h>", "librsvg belongs to records/picture.cpp alone");
  Refuse("cli/bad.cpp", "<yaml-cpp/yaml.h>", "yaml-cpp belongs to task/document.cpp alone");
  Refuse("robot/bad.cpp", "<sodium.h>", "libsodium belongs to (bus/(authentic|keys)|lcmtypes/codec).cpp alone");
  ExpectRefused();
}

TEST_F(IncludesTest, PathsAreThoseFromTheRoot) {
  Refuse("robot/bad.cpp", "\"guard.h\"", "our headers are included by their path from the root");
  Refuse("robot/bad.cpp", "\"../certifier/sets/box.h\"", "our headers are included by their path from the root");
  Refuse("robot/bad.cpp", "\"forereach/sets/none.h\"", "forereach/sets/none.h does not exist");
  ExpectRefused();
}

}  // namespace forereach::includes_test
