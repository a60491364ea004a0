// CMakePresets.json: a build directory keeps what an earlier configure set, so whoever configures it says all of it.
#include <regex>

#include "tests/test.h"

#include "tests/paths.h"

namespace forereach::presets_test {

namespace fs = std::filesystem;
using Json = nlohmann::json;

Json ConfigurePresets() {
  std::ifstream file(fs::path(FOREREACH_SOURCE_DIR) / "CMakePresets.json");
  return Json::parse(file).at("configurePresets");
}

Json WithItsParents(const Json& presets, const std::string& name) {
  for (const Json& preset : presets) {
    if (preset.at("name") != name) continue;
    Json whole = preset.contains("inherits") ? WithItsParents(presets, preset.at("inherits")) : Json::object();
    whole.merge_patch(preset);
    return whole;
  }
  throw std::invalid_argument("no preset " + name);
}

std::set<std::string> VariablesOf(const std::string& preset) {
  std::set<std::string> variables;
  const Json whole = WithItsParents(ConfigurePresets(), preset);
  for (const auto& [variable, value] : whole.at("cacheVariables").items()) variables.insert(variable);
  return variables;
}

TEST(Presets, SetTheSameVariablesWhereTheyShareADirectory) {
  const Json presets = ConfigurePresets();
  std::map<std::string, std::set<std::string>> users;
  for (const Json& preset : presets) {
    const std::string name = preset.at("name");
    if (preset.value("hidden", false)) continue;
    const std::string directory = WithItsParents(presets, name).at("binaryDir");
    users[std::regex_replace(directory, std::regex(R"(\$\{presetName\})"), name)].insert(name);
  }
  EXPECT_GT(users.at("${sourceDir}/build/release").size(), 1u);
  for (const auto& [directory, names] : users)
    for (const std::string& name : names) EXPECT_EQ(VariablesOf(name), VariablesOf(*names.begin())) << name;
}

// `build PRESET -DFOREREACH_...` of scripts/common.sh leaves the variable behind.
TEST(Presets, OfReleaseSetsEveryVariableThatAScriptSets) {
  const std::set<std::string> set = VariablesOf("release");
  const std::regex built(R"(^(build |programs_only=).*)"), variable(R"(-D(FOREREACH_\w+)=)");
  int found = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(FOREREACH_SOURCE_DIR) / "scripts")) {
    std::ifstream script(entry.path());
    for (std::string line; std::getline(script, line);) {
      if (!std::regex_match(line, built)) continue;
      for (std::sregex_iterator at(line.begin(), line.end(), variable), end; at != end; ++at, ++found)
        EXPECT_THAT(set, Contains((*at)[1].str())) << entry.path() << ": " << line;
    }
  }
  EXPECT_GT(found, 0);
}

}  // namespace forereach::presets_test
