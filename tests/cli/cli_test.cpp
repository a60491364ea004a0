// The `forereach` program as a person or a script calls it.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/program.h"
#include "tests/scratch.h"

namespace {

using forereach::Forereach, forereach::Output, forereach::Read;
using testing::HasSubstr;
using Json = nlohmann::json;

Json CertifyJson(const std::string& config, const std::string& plan) {
  return Json::parse(Forereach("certify --json --config config/" + config + ".yaml --plan config/plans/" + plan + ".csv").text);
}

std::set<std::string> KeysOf(const Json& object) {
  std::set<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.insert(key);
  return keys;
}

struct Case {
  const char *config, *plan, *outcome, *cause;
  int code;
};

class Shipped : public testing::TestWithParam<Case> {};

TEST_P(Shipped, GivesItsOutcome) {
  const Case& c = GetParam();
  const Output output =
      Forereach(std::string("certify --config config/") + c.config + ".yaml --plan config/plans/" + c.plan + ".csv");
  EXPECT_EQ(output.code, c.code) << output.text;
  const Json decision = CertifyJson(c.config, c.plan);
  EXPECT_EQ(decision["outcome"], c.outcome);
  EXPECT_EQ(decision["cause"], c.cause == nullptr ? Json(nullptr) : Json(c.cause));
}

INSTANTIATE_TEST_SUITE_P(
    Tasks, Shipped,
    testing::Values(Case{"bicycle", "bicycle_certified", "certified", nullptr, 0},
                    Case{"bicycle", "bicycle_domain", "abstain_domain", "domain_exit", 1},
                    Case{"bicycle", "bicycle_safety", "abstain_safety", "obstacle", 1},
                    Case{"bicycle_falsified", "bicycle_certified", "abstain_falsified", "pairwise", 1},
                    Case{"point_mass", "point_mass_certified", "certified", nullptr, 0},
                    Case{"point_mass", "point_mass_domain", "abstain_domain", "domain_exit", 1},
                    Case{"point_mass", "point_mass_safety", "abstain_safety", "obstacle", 1},
                    Case{"point_mass_falsified", "point_mass_certified", "abstain_falsified", "pairwise", 1}));

TEST(CertifyJsonTest, HasExactlyTheKeysOfTheContract) {
  const Json decision = CertifyJson("bicycle", "bicycle_certified");
  EXPECT_EQ(KeysOf(decision),
            (std::set<std::string>{"outcome", "step", "cause", "message", "capped", "inputs", "tube", "digests", "elapsed_us"}));
  EXPECT_EQ(KeysOf(decision["digests"]),
            (std::set<std::string>{"plan", "tube", "config", "model", "declaration", "observations", "obstacles"}));
  const Json& tube = decision["tube"];
  ASSERT_EQ(tube.size(), 13u);
  const std::set<std::string> slice_keys{"center", "half_width", "generators", "clearance", "radius"};
  std::set<std::string> step_keys = slice_keys;
  step_keys.insert({"envelope", "remainder"});
  for (std::size_t t = 0; t < 12; ++t) EXPECT_EQ(KeysOf(tube[t]), step_keys) << t;
  EXPECT_EQ(KeysOf(tube[12]), slice_keys);
  EXPECT_EQ(tube[0]["center"].size(), 6u);
  EXPECT_EQ(tube[0]["generators"].size(), 6u);
  for (const Json& slice : tube) EXPECT_GT(slice["clearance"][0].get<double>(), 0);
}

TEST(CertifyJsonTest, TubeEndsWhereDEndedIt) {
  const Json decision = CertifyJson("bicycle", "bicycle_domain");
  EXPECT_EQ(decision["tube"].size(), decision["step"].get<std::size_t>() + 1);
  EXPECT_FALSE(decision["tube"].back().contains("envelope"));
}

TEST(CertifyJsonTest, FalsifiedHasNoTubeAndNoStep) {
  const Json decision = CertifyJson("bicycle_falsified", "bicycle_certified");
  EXPECT_TRUE(decision["tube"].empty());
  EXPECT_TRUE(decision["step"].is_null());
}

TEST(CertifyJsonTest, SafetyNamesAStepWhoseClearanceIsNotProven) {
  const Json decision = CertifyJson("bicycle", "bicycle_safety");
  const auto step = decision["step"].get<std::size_t>();
  EXPECT_LE(decision["tube"][step]["clearance"][0].get<double>(), 0);
  for (std::size_t t = 0; t < step; ++t) EXPECT_GT(decision["tube"][t]["clearance"][0].get<double>(), 0) << t;
}

TEST(BadInput, ExitsWithTwoAndOneLine) {
  for (const char* arguments :
       {"certify --config none.yaml --plan config/plans/bicycle_certified.csv",
        "certify --config config/bicycle.yaml --plan none.csv",
        "certify --config config/bicycle.yaml --plan config/plans/point_mass_certified.csv",
        "plan --config config/bicycle.yaml --out /tmp/not_written.csv",
        "replay tests/data/course.lcmlog --config tests/data/course.yaml --key none",
        "verify tests/data/course.lcmlog --config tests/data/course.yaml --key none",
        "replay none.lcmlog --config config/bicycle.yaml", "report none.lcmlog --config config/bicycle.yaml"}) {
    const Output output = Forereach(std::string(arguments) + " 2>&1 >/dev/null");
    EXPECT_EQ(output.code, 2) << arguments;
    EXPECT_EQ(std::count(output.text.begin(), output.text.end(), '\n'), 1) << output.text;
  }
}

TEST(BadInput, UsageExitsWithTwo) {
  for (const char* arguments : {"", "certify", "nonsense", "certify --config"})
    EXPECT_EQ(Forereach(std::string(arguments) + " >/dev/null 2>&1").code, 2) << arguments;
}

TEST(Help, ExitsWithZeroAndShowsAnExample) {
  for (const char* command : {"", "certify ", "plan ", "replay ", "report ", "run "}) {
    const Output output = Forereach(std::string(command) + "--help");
    EXPECT_EQ(output.code, 0) << command;
    EXPECT_THAT(output.text, HasSubstr("forereach ")) << command;
  }
}

TEST(Plan, WritesACsvThatCertifyReads) {
  const forereach::ScratchDirectory scratch;
  const std::string file = scratch / "plan.csv";
  const Output planned = Forereach("plan --config config/demo.yaml --out " + file);
  ASSERT_EQ(planned.code, 0) << planned.text;
  const Output certified = Forereach("certify --json --config config/demo.yaml --plan " + file);
  EXPECT_LE(certified.code, 1);
  EXPECT_NE(Json::parse(certified.text)["outcome"], "abstain_falsified");
}

TEST(Doctor, PrintsOneJsonDocument) {
  const Output output = Forereach("doctor --json");
  const Json document = Json::parse(output.text);
  EXPECT_EQ(output.code, document["good"] ? 0 : 1);
  ASSERT_EQ(document["checks"].size(), 5u);
  const Json& keys = document["checks"][4];
  EXPECT_EQ(keys["found"], "UNSIGNED: anyone on this network can move this robot");
  EXPECT_TRUE(keys["warning"]) << "the bus works all the same";
  for (const Json& check : document["checks"])
    EXPECT_TRUE(check["good"] || !check["advice"].get<std::string>().empty());
}

// ---- README: its commands are run and its code is the code of tests/install.

// The contents of all fenced blocks of a language.
std::vector<std::string> Blocks(const std::string& markdown, const std::string& language) {
  std::vector<std::string> blocks;
  const std::string fence = "```" + language + "\n";
  for (std::size_t at = markdown.find(fence); at != std::string::npos; at = markdown.find(fence, at + 1)) {
    const std::size_t begin = at + fence.size();
    blocks.push_back(markdown.substr(begin, markdown.find("```", begin) - begin));
  }
  return blocks;
}

std::string WithoutTimes(const std::string& text) {
  return std::regex_replace(text, std::regex("took [0-9.e+]+ us"), "took ... us");
}

TEST(Readme, CommandsPrintWhatItSays) {
  int commands = 0;
  for (const std::string& block : Blocks(Read(FOREREACH_SOURCE_DIR "/README.md"), "console")) {
    std::istringstream lines(block);
    std::string line, expected, command;
    const auto check = [&] {
      if (command.rfind("forereach certify", 0) == 0) {
        ++commands;
        EXPECT_EQ(WithoutTimes(Forereach(command.substr(10)).text), WithoutTimes(expected)) << command;
      }
    };
    while (std::getline(lines, line)) {
      if (line.rfind("$ ", 0) == 0) {
        check();
        command = line.substr(2);
        expected.clear();
      } else {
        expected += line + "\n";
      }
    }
    check();
  }
  EXPECT_GE(commands, 3);
}

TEST(Readme, CodeIsTheInstalledExample) {
  const std::vector<std::string> blocks = Blocks(Read(FOREREACH_SOURCE_DIR "/README.md"), "cpp");
  ASSERT_EQ(blocks.size(), 1u);
  EXPECT_EQ(blocks[0], Read(FOREREACH_SOURCE_DIR "/tests/install/main.cpp"));
}

}  // namespace
