// scripts/mutants --check: the list of mutations fits the tree, and the script sees where one does not.
#include "tests/test.h"

#include "tests/paths.h"
#include "tests/shell.h"

namespace forereach::mutants_test {

Output Check(const std::string& root) {
  return Shell("'" FOREREACH_SOURCE_DIR "/scripts/mutants' --check --root '" + root + "' 2>&1");
}

// A small tree with one mutant, which fits.
class MutantsTest : public testing::Test {
 protected:
  MutantsTest() {
    Write("sum.cpp", "int Sum(int a, int b) { return a + b; }\n");
    Write("tests/CMakeLists.txt", "forereach_test(sum_test SOURCES sum_test.cpp)\n");
    Write("tests/sum_test.cpp", "TEST(Sum, Adds) {}\n");
    WriteMutant();
  }

  void Write(const std::string& file, const std::string& text) {
    std::filesystem::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }
  void WriteMutant(const std::string& text = "a + b", const std::string& test = "sum_test Sum.*",
                   const std::string& file = "sum.cpp") {
    Write("tests/mutants/all.toml",
          "[['" + file + "']]\ntests = ['" + test + "']\n'subtracts' = ['" + text + "', 'a - b']\n");
  }
  void ExpectFault(const std::string& what) const {
    const auto [exit_code, output] = Check(root_.string());
    EXPECT_EQ(exit_code, 1);
    EXPECT_THAT(output, HasSubstr("subtracts: " + what));
  }

 private:
  const ScratchDirectory scratch_;
  const std::filesystem::path root_ = scratch_.path();
};

TEST(Mutants, TheListFitsTheTree) {
  const auto [exit_code, output] = Check(FOREREACH_SOURCE_DIR);
  EXPECT_EQ(exit_code, 0) << output;
}

TEST_F(MutantsTest, ATextThatIsGoneIsNamed) {
  WriteMutant("a * b");
  ExpectFault("its text occurs 0 times in sum.cpp");
}

TEST_F(MutantsTest, ATextThatOccursTwiceIsNamed) {
  Write("sum.cpp", "int x = a + b, y = a + b;\n");
  ExpectFault("its text occurs 2 times in sum.cpp");
}

TEST_F(MutantsTest, AFileThatIsGoneIsNamed) {
  WriteMutant("a + b", "sum_test Sum.*", "total.cpp");
  ExpectFault("there is no file total.cpp");
}

TEST_F(MutantsTest, ATestThatIsGoneIsNamed) {
  WriteMutant("a + b", "sum_test Total.*");
  ExpectFault("no test matches 'Total.*'");
}

TEST_F(MutantsTest, AProgramThatIsGoneIsNamed) {
  WriteMutant("a + b", "total_test Sum.*");
  ExpectFault("no test program is named total_test");
}

TEST_F(MutantsTest, AMutantThatChangesNothingIsNamed) {
  WriteMutant("a - b");
  Write("sum.cpp", "int Sum(int a, int b) { return a - b; }\n");
  ExpectFault("changes nothing");
}

}  // namespace forereach::mutants_test
