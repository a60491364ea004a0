// CONTRIBUTING.md, "Extensions": its lists of files are those that the sources give.
#include <regex>

#include "tests/test.h"

#include "tests/paths.h"

namespace forereach::extensions_test {

namespace fs = std::filesystem;
const fs::path kRoot = FOREREACH_SOURCE_DIR;

// A source without comments and includes: what is left of its text names what its code names.
std::string CodeOf(const std::string& text) {
  std::string code;
  for (std::size_t at = 0; at < text.size();) {
    const std::string_view rest = std::string_view(text).substr(at);
    if (rest.starts_with("/*")) {
      at = std::min(text.find("*/", at), text.size() - 2) + 2;
    } else if (rest.starts_with("//") || rest.starts_with("#include")) {
      at = std::min(text.find('\n', at), text.size());
    } else {
      const std::size_t end = std::min(text.find_first_of("/#", at + 1), text.size());
      code.append(text, at, end - at);
      at = end;
    }
  }
  return code;
}

// The product's, by file.
std::map<std::string, std::string> Sources() {
  std::map<std::string, std::string> sources;
  for (const char* folder :
       {"advise", "bus", "certifier", "cli", "command_line", "forereach", "identify", "lcmtypes", "live", "logger",
        "page", "planner_bridge", "records", "robot", "simulator", "task", "verifier"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".h" || extension == ".cpp" || extension == ".lcm")
        sources[fs::relative(entry.path(), kRoot).string()] = CodeOf(Read(entry.path()));
    }
  }
  return sources;
}

// The first column of the table under "### title".
std::set<std::string> Listed(const std::string& title) {
  std::istringstream page(Read(kRoot / "CONTRIBUTING.md"));
  std::set<std::string> files;
  bool here = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("#")) here = line == "### " + title;
    if (!here || !line.starts_with("| `")) continue;
    const std::string cell = line.substr(0, line.find('|', 1));
    static const std::regex kQuoted("`([^`]+)`");
    for (std::sregex_iterator match(cell.begin(), cell.end(), kQuoted), end; match != end; ++match)
      files.insert((*match)[1]);
  }
  return files;
}

// `kinds`: for each that exists, what names it in code. A file that names all of them has to be extended by one more,
// so the page lists it. A file that the page lists names at least one.
void ExpectListed(const std::string& title, const std::vector<std::string>& kinds) {
  const std::set<std::string> listed = Listed(title);
  ASSERT_GE(listed.size(), 3u) << "CONTRIBUTING.md has no list under " << title;
  const std::vector<std::regex> patterns(kinds.begin(), kinds.end());
  std::size_t with_all = 0;
  const auto sources = Sources();
  for (const auto& [file, text] : sources) {
    const auto names = [&text = text](const std::regex& kind) { return std::regex_search(text, kind); };
    const bool all = std::ranges::all_of(patterns, names);
    with_all += all;
    if (all)
      EXPECT_TRUE(listed.contains(file)) << title << ": " << file << " names every one, and the page does not list it";
    if (listed.contains(file))
      EXPECT_TRUE(std::ranges::any_of(patterns, names)) << title << ": the page lists " << file << ", which names none";
  }
  EXPECT_GE(with_all, 3u);
  for (const std::string& file : listed) EXPECT_TRUE(sources.contains(file)) << title << ": no source " << file;
}

TEST(Extensions, DocumentListsTheFilesOfANominalModel) {
  ExpectListed("A nominal model", {R"(\w*PointMass\b|"point_mass")", R"(\w*KinematicBicycle\b|"kinematic_bicycle")"});
}

TEST(Extensions, NothingElseKnowsAModelByName) {
  const std::regex names(R"(PointMass|point_mass|KinematicBicycle|kinematic_bicycle)");
  int found = 0;
  for (const auto& [file, text] : Sources()) {
    if (!std::regex_search(text, names)) continue;
    ++found;
    EXPECT_TRUE(file.starts_with("forereach/dynamics/models/")) << file;
  }
  EXPECT_GE(found, 4);
}

TEST(Extensions, DocumentListsTheFilesOfAnObstacleKind) {
  ExpectListed("An obstacle kind", {R"(\bkCircle\b|\bObstacle::Circle\b|\bCIRCLE\b|\]\.circle\b)",
                                    R"(\bkBox\b|\bAxisBox\b|\bBOX\b|\]\.box\b)",
                                    R"(\bkPolygon\b|\bObstacle::Polygon\b|\bPOLYGON\b|\]\.polygon\b)",
                                    R"(\bkHalfSpace\b|\bHalfSpace\b|\bHALF_SPACE\b|\]\.half_plane\b)"});
}

}  // namespace forereach::extensions_test
