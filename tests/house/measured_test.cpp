// scripts/measured: a document says which of the folders that its figures measure have changed since.
#include "tests/test.h"

#include "tests/paths.h"
#include "tests/shell.h"

namespace forereach::measured_test {

struct Measured : testing::Test {
  Measured() {
    std::filesystem::create_directories(root_ / "scripts");
    std::filesystem::copy_file(FOREREACH_SOURCE_DIR "/scripts/measured", root_ / "scripts/measured");
    for (const char* folder : {"bench", "bus", "certifier", "forereach", "identify", "lcmtypes", "planner_bridge",
                               "research", "robot", "simulator", "task"})
      Write(std::string(folder) + "/deep/one.cpp", "int one;\n");
    Write("docs/performance.md", "# Speed\n\n1 us\n");
    Write("research/reproduction.md", "# Figures\n\n0.5\n");
    EXPECT_EQ(Run("--taken docs/performance.md").code, 0);
    EXPECT_EQ(Run("--taken research/reproduction.md").code, 0);
  }

  void Write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }
  [[nodiscard]] std::string Read(const std::string& file) const { return forereach::Read(root_ / file); }
  [[nodiscard]] Output Run(const std::string& arguments = "") const {
    return Shell("'" + (root_ / "scripts/measured").string() + "' " + arguments + " 2>&1");
  }

  const ScratchDirectory scratch_;
  const std::filesystem::path root_ = scratch_ / "house";
};

TEST_F(Measured, FiguresOfTheSourcesAsTheyAreSaySo) {
  EXPECT_EQ(Run().code, 0) << Run().text;
  EXPECT_THAT(Read("docs/performance.md"),
              HasSubstr("Nothing that these figures measure has changed since.\n\n1 us\n"));
}

TEST_F(Measured, ADocumentThatDoesNotSayThatItsCodeHasChangedIsRefused) {
  Write("bus/deep/one.cpp", "int two;\n");
  Output run = Run();
  EXPECT_THAT(run, Exits(1, "docs/performance.md", "`bus/` changed after", Not(HasSubstr("reproduction"))));
  EXPECT_EQ(Run("--say").code, 0);
  EXPECT_THAT(Read("docs/performance.md"), HasSubstr("**Older than the code:** `bus/` changed after"));
  EXPECT_EQ(Run().code, 0) << "it says so now";
  Write("bus/deep/one.cpp", "int three;\n");
  EXPECT_EQ(Run().code, 0) << "and may be older still";
  Write("task/new.h", "");
  EXPECT_THAT(Run().text, HasSubstr("`bus/`, `task/` changed after")) << "of both documents, a new folder is news";
  EXPECT_EQ(Run("--taken docs/performance.md").code, 0);
  EXPECT_THAT(Read("docs/performance.md"), Not(HasSubstr("Older")));
}

TEST_F(Measured, TextsAndPicturesAreNoSources) {
  Write("research/other.md", "words\n");
  Write("research/figures/one.svg", "<svg/>\n");
  EXPECT_EQ(Run().code, 0);
}

TEST_F(Measured, ADocumentWithoutDigestsIsOlderThanEverything) {
  Write("docs/performance.md", "# Speed\n\n1 us\n");
  EXPECT_EQ(Run().code, 1);
  EXPECT_EQ(Run("--say").code, 0);
  EXPECT_THAT(Read("docs/performance.md"), AllOf(HasSubstr("bench=unknown"), HasSubstr("`bench/`, `bus/`")));
}

}  // namespace forereach::measured_test
