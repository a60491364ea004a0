// docs/queries.md: its columns are those of the database, and its queries answer.
#include <regex>

#include "records/database.h"
#include "task/config.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"
#include "tests/records/sql.h"

namespace forereach::queries_test {

std::string Document() { return Read(FOREREACH_SOURCE_DIR "/docs/queries.md"); }

struct QueriesTest : testing::Test {
  QueriesTest() {
    Database database(path_);
    database.BeginRun("course.lcmlog", 1);
    EXPECT_TRUE(database.Write(RowsOf(kCourseLog, "course.lcmlog", LoadConfig(kCourseTask).bus), "course.lcmlog",
                               std::ssize(ReadLog(kCourseLog).events)));
  }

  auto Ask(const std::string& sql) const { return Sql(path_, sql); }

  const ScratchDirectory scratch_;
  const std::string path_ = scratch_ / "decisions.sqlite";
};

TEST_F(QueriesTest, EveryColumnIsExplained) {
  std::map<std::string, std::set<std::string>> explained;
  std::istringstream lines(Document());
  std::string table;
  const std::regex heading(R"(\*\*(\w+)\*\*: a row.*)"), row(R"(\| (`.*`) \| .* \|)"), name("`(\\w+)`");
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (line.starts_with("## ") && line != "## Columns") break;
    if (std::regex_match(line, match, heading)) table = match[1];
    if (!std::regex_match(line, match, row)) continue;
    const std::string cell = match[1].str().substr(0, match[1].str().find(" | "));
    for (std::sregex_iterator each(cell.begin(), cell.end(), name), end; each != end; ++each)
      explained[table].insert((*each)[1]);
  }
  std::set<std::string> tables;
  for (const auto& entry : Ask("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite%'")) {
    std::set<std::string> columns;
    for (const auto& column : Ask("PRAGMA table_info(" + entry[0] + ")")) columns.insert(column[1]);
    EXPECT_EQ(explained[entry[0]], columns) << entry[0];
    tables.insert(entry[0]);
  }
  EXPECT_EQ(tables.size(), 5u);
  EXPECT_EQ(explained.size(), 5u);
}

TEST_F(QueriesTest, EveryQueryAnswers) {
  const std::string text = Document();
  int queries = 0, with_rows = 0;
  for (std::size_t at = text.find("```sql\n"); at != std::string::npos; at = text.find("```sql\n", at + 1)) {
    const std::string sql = text.substr(at + 7, text.find("```\n", at + 7) - at - 7);
    with_rows += !Ask(sql).empty();
    ++queries;
  }
  EXPECT_GE(queries, 14);
  EXPECT_GE(with_rows, queries - 3) << "the course has gaps of no kind, and no rejections";
}

TEST_F(QueriesTest, TheFirstQueryCountsTheDecisionsOfTheLog) {
  const std::string text = Document();
  const std::size_t at = text.find("```sql\n") + 7;
  int decisions = 0, certified = 0;
  for (const auto& row : Ask(text.substr(at, text.find("```\n", at) - at))) {
    decisions += std::stoi(row[2]);
    if (row[0] == "certified") certified = std::stoi(row[2]);
  }
  EXPECT_EQ(decisions, kCourseDecisions);
  EXPECT_EQ(certified, kCourseCertified);
}

}  // namespace forereach::queries_test
