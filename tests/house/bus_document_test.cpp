// docs/bus.md documents every message, field, constant and channel, with the tables that its types give.
#include <regex>

#include "tests/test.h"

#include "tests/paths.h"
#include "tests/shell.h"

namespace forereach::bus_document_test {

using forereach::Output;
using forereach::Read;
using forereach::ScratchDirectory;
using forereach::Shell;

const std::string kFacts = FOREREACH_BINARY_DIR "/lcmtypes/forereach_message_facts ";

struct Type {
  std::vector<std::string> fields, constants;
};

// By name, from lcmtypes/*.lcm.
std::map<std::string, Type> Types() {
  std::map<std::string, Type> types;
  for (const auto& file : std::filesystem::directory_iterator(FOREREACH_SOURCE_DIR "/lcmtypes")) {
    if (file.path().extension() != ".lcm") continue;
    Type& type = types[file.path().stem()];
    std::string text = std::regex_replace(Read(file.path()), std::regex("//[^\n]*"), "");
    text = text.substr(text.find('{') + 1);
    static const std::regex statement("([^;]*);"), constant("(\\w+)\\s*=\\s*-?\\d+"), field("^\\s*\\w+\\s+(\\w+)");
    for (std::sregex_iterator s(text.begin(), text.end(), statement), end; s != end; ++s) {
      const std::string words = (*s)[1];
      std::smatch match;
      if (words.find("const") != std::string::npos) {
        for (std::sregex_iterator c(words.begin(), words.end(), constant); c != end; ++c)
          type.constants.push_back((*c)[1]);
      } else if (std::regex_search(words, match, field)) {
        type.fields.push_back(match[1]);
      }
    }
  }
  return types;
}

// The part of docs/bus.md that is about a type: from its heading to the next heading of the same kind.
std::string SectionOn(const std::string& type) {
  static const std::string document = Read(FOREREACH_SOURCE_DIR "/docs/bus.md");
  const std::size_t begin = document.find("\n### `" + type + "`");
  if (begin == std::string::npos) return "";
  return document.substr(begin, document.find("\n## ", begin) - begin)
      .substr(0, document.find("\n### ", begin + 1) - begin);
}

TEST(BusDocumentTest, ReadsTheMessagesItIsHeldAgainst) {
  const auto types = Types();
  EXPECT_EQ(types.size(), 17u);
  EXPECT_THAT(
      types.at("candidate_plan_t").fields,
      ElementsAre("utime", "sequence", "plan_id", "source", "start_utime", "step_us", "num_states", "num_inputs",
                  "num_steps", "progress_steps", "repair", "initial_center", "initial_half_width", "control"));
  EXPECT_EQ(types.at("decision_t").constants.size(), 36u);
}

TEST(BusDocumentTest, ItsTablesAreThoseOfTheTypes) {
  const ScratchDirectory scratch;
  const std::string page = Read(FOREREACH_SOURCE_DIR "/docs/bus.md"), copy = scratch.Write("bus.md", page);
  EXPECT_EQ(Shell(kFacts + "document " + copy + " " FOREREACH_SOURCE_DIR "/lcmtypes/*.lcm 2>&1").code, 0);
  EXPECT_EQ(Read(copy), page) << "scripts/bus-tables writes them";
  EXPECT_FALSE(std::regex_search(page, std::regex("\n\\| `[a-z][^|\n]*\\| *\\|\n"))) << "a field without a meaning";
}

// What is not understood is in no table and in no JSON, so it is an error.
TEST(BusDocumentTest, RefusesALineOfATypeThatItDoesNotUnderstand) {
  const ScratchDirectory scratch;
  const auto refused = [&](const std::string& line) {
    const std::string file =
        scratch.Write("a_t.lcm", "struct a_t {\n    int64_t utime;  // [us] when\n" + line + "\n}\n");
    const Output output = Shell(kFacts + "fields " + (scratch / "out") + " " + file + " 2>&1");
    EXPECT_EQ(output.code == 0, std::filesystem::exists(scratch / "out"));
    return output.code == 0 ? "" : output.text;
  };
  EXPECT_THAT(refused("    double x[3]  // no end"), HasSubstr("a_t.lcm:3: neither a field"));
  EXPECT_THAT(refused("    const int16_t A = 1;  // of no group"), HasSubstr("a_t.lcm:3"));
  EXPECT_THAT(refused("    double x[3][2];  // {num_x} of one count"), HasSubstr("x: 1 counts"));
  EXPECT_EQ(refused("    double x[3];  // {num_x} as it should be"), "");
}

TEST(BusDocumentTest, EveryFieldHasItsRow) {
  for (const auto& [name, type] : Types()) {
    const std::string section = SectionOn(name);
    ASSERT_NE(section, "") << name << " has no section";
    for (const std::string& field : type.fields) {
      const std::regex row("\n\\|[^|\n]*`" + field + "(\\[[^`]*)?`[^|\n]*\\|");
      EXPECT_TRUE(std::regex_search(section, row)) << name << "." << field;
    }
  }
}

TEST(BusDocumentTest, EveryConstantIsExplained) {
  for (const auto& [name, type] : Types()) {
    const std::string section = SectionOn(name);
    for (const std::string& constant : type.constants)
      EXPECT_TRUE(std::regex_search(section, std::regex("`" + constant + "`"))) << name << "::" << constant;
  }
}

TEST(BusDocumentTest, EveryChannelIsListed) {
  const std::string document = Read(FOREREACH_SOURCE_DIR "/docs/bus.md");
  for (const char* channel :
       {"PLAN_CANDIDATE", "PLAN_DECISION", "PLAN_CERTIFIED", "ROBOT_STATE", "OBSTACLES", "TRANSITION", "PLAN_WITHDRAWN",
        "PLAN_ADVICE", "CERTIFIER_STATUS", "EXECUTION_EVENT", "FAULT", "COMMAND", "LOGGER_STATUS"})
    EXPECT_TRUE(std::regex_search(document, std::regex("\n\\| `" + std::string(channel) + "` \\|"))) << channel;
}

}  // namespace forereach::bus_document_test
