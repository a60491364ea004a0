#include "fleet/report.h"

#include "tests/cli/program.h"
#include "tests/fleet/postgres.h"
#include "tests/records/course.h"

namespace forereach::report_test {

constexpr std::int64_t kDay = 86'400'000'000, kFirst = 1'767'225'600'000'000;  // 2026-01-01

class FleetReportTest : public PostgresTest {
 protected:
  // Decisions of a robot on one day, of which so many are certified and falsified.
  void Add(const std::string& robot, const std::string& log, int day, int count, int certified, int falsified,
           const std::string& declaration) {
    Rows rows;
    for (int i = 0; i < count; ++i) {
      DecisionRow& row = rows.decisions.emplace_back();
      row.event = {log, i, robot + log + std::to_string(i), kFirst + day * kDay + i};
      row.outcome = i < certified ? "certified" : i < certified + falsified ? "abstain_falsified" : "abstain_safety";
      row.cause = i < certified ? "none" : i < certified + falsified ? "pair" : "obstacle";
      row.grounds[2] = declaration + std::string(52, '0');
    }
    EventRow& event = rows.events.emplace_back();
    event.event = {log, count, robot + log + "w", kFirst + day * kDay + count};
    event.kind = "withdrawn";
    Store store(server_->Address());
    static_cast<void>(store.Write(robot, rows));
  }
  void AddFleet() {
    Add("r1", "a.lcmlog", 0, 10, 9, 0, "aaaaaaaaaaaa");
    Add("r1", "b.lcmlog", 1, 10, 5, 2, "bbbbbbbbbbbb");
    Add("r2", "a.lcmlog", 1, 20, 20, 0, "aaaaaaaaaaaa");
    Add("<b>r3</b>", "x\"&.lcmlog", 1, 4, 1, 0, "bbbbbbbbbbbb");
  }
  std::map<std::string, std::vector<std::vector<std::string>>> Tables() {
    Store store(server_->Address());
    std::map<std::string, std::vector<std::vector<std::string>>> tables;
    for (FleetTable& table : ReadFleet(store)) tables[table.title] = std::move(table.rows);
    return tables;
  }
};

using Row = std::vector<std::string>;

TEST_F(FleetReportTest, CountsEachRobotCauseDeclarationAndDay) {
  AddFleet();
  const auto tables = Tables();
  EXPECT_THAT(tables.at("Robots"), ElementsAre(Row{"<b>r3</b>", "4", "25.0", "0", "0", "1", "1", "25.0", "x\"&.lcmlog"},
                                               Row{"r1", "20", "70.0", "0", "2", "2", "2", "90.0 50.0", "b.lcmlog"},
                                               Row{"r2", "20", "100.0", "0", "0", "1", "1", "100.0", "a.lcmlog"}));
  EXPECT_THAT(tables.at("Causes"),
              ElementsAre(Row{"certified", "none", "35", "79.5", "3", "r2", "a.lcmlog", "0"},
                          Row{"abstain_safety", "obstacle", "7", "15.9", "2", "<b>r3</b>", "x\"&.lcmlog", "1"},
                          Row{"abstain_falsified", "pair", "2", "4.5", "1", "r1", "b.lcmlog", "5"}));
  EXPECT_THAT(tables.at("Contradictions"), ElementsAre(Row{"bbbbbbbbbbbb", "2", "r1", "b.lcmlog", "5"}));
  EXPECT_EQ(tables.at("Withdrawals").size(), 4u);
  EXPECT_THAT(tables.at("Declarations"),
              ElementsAre(Row{"bbbbbbbbbbbb", "2", "2", "14", "42.9", "2", "2026-01-02 00:00", "<b>r3</b>"},
                          Row{"aaaaaaaaaaaa", "1", "2", "30", "96.7", "0", "2026-01-02 00:00", "r1"}));
  EXPECT_THAT(tables.at("Days"),
              ElementsAre(Row{"2026-01-02", "3", "34", "76.5", "2"}, Row{"2026-01-01", "1", "10", "90.0", "0"}));
  EXPECT_THAT(tables.at("Runs").front(), (Row{"r1", "b.lcmlog", "10", "50.0", "0", "2"}));
}

// The query of docs/fleet.md.
TEST_F(FleetReportTest, OneQueryFindsTheRefutedDeclarationsAndTheirRobots) {
  AddFleet();
  Add("r4", "a.lcmlog", 3, 4, 0, 4, "aaaaaaaaaaaa");
  const std::string text = Read(FOREREACH_SOURCE_DIR "/docs/fleet.md");
  const std::size_t at = text.find("```sql\n");
  ASSERT_NE(at, std::string::npos);
  EXPECT_EQ(server_->Sql(text.substr(at + 7, text.find("```\n", at + 7) - at - 7)).text,
            "aaaaaaaaaaaa|r4|r1 r2 r4\nbbbbbbbbbbbb|r1|<b>r3</b> r1\n");
}

TEST_F(FleetReportTest, OfAnEmptyStoreHasNoRows) {
  for (const auto& [title, rows] : Tables()) EXPECT_TRUE(rows.empty()) << title;
}

TEST_F(FleetReportTest, IsATextADocumentOrAPage) {
  AddFleet();
  const ScratchDirectory scratch;
  const std::string database = "report --database '" + server_->Address() + "'";
  EXPECT_THAT(Forereach(database + " 2>&1"), Exits(0, "Robots\n  robot ", "r1        20        70.0"));
  const Output json = Forereach(database + " --json");
  EXPECT_EQ(nlohmann::json::parse(json.text).at("Robots").at("rows").at(1).at(2), "70.0");
  const std::string page = scratch / "fleet.html";
  EXPECT_THAT(Forereach(database + " --out " + page + " --runs ../pages 2>&1"), Exits(0, "3 robots"));
  EXPECT_THAT(Read(page), AllOf(HasSubstr("<td><a href=\"../pages/r1/b.lcmlog.html\">b.lcmlog</a></td>"),
                                HasSubstr("&lt;b&gt;r3&lt;/b&gt;"), Not(HasSubstr("<b>r3")),
                                HasSubstr("pages/%3Cb%3Er3%3C%2Fb%3E/x%22%26.lcmlog.html")));
  EXPECT_THAT(Read(page), AllOf(HasSubstr("<a href=\"#Robots-1\">2</a>"), HasSubstr("points=\"0,2 4,8 \""),
                                HasSubstr("<td><a href=\"../pages/r2/a.lcmlog.html\">100.0</a></td>"),
                                HasSubstr("No gate was in shadow mode"),
                                HasSubstr("<code>forereach report LOG --out ../pages/ROBOT")));
  EXPECT_THAT(Forereach(database + " --out " + page + " 2>&1"), Exits(2, page));
}

TEST_F(FleetReportTest, NamesTheRobotsInShadowMode) {
  AddFleet();
  Rows rows;
  for (const std::string cause : {"domain", "obstacle", "fault"}) {
    DecisionRow& row = rows.decisions.emplace_back();
    row.event = {"s.lcmlog", std::ssize(rows.decisions), cause + std::to_string(rows.decisions.size()), kFirst};
    row.outcome = "rejected";
    row.cause = cause;
    row.shadow = 1;
  }
  Store store(server_->Address());
  for (const std::string robot : {"r2", "r5<i>"}) static_cast<void>(store.Write(robot, rows));
  const std::vector<FleetTable> tables = ReadFleet(store);
  EXPECT_THAT(tables.front().rows.front(), (Row{"r5<i>", "3", "0.0", "3", "0", "0", "1", "0.0", "s.lcmlog"}));
  EXPECT_THAT(tables.back().rows, Contains(Row{"r2", "s.lcmlog", "3", "0.0", "3", "0"}));
  const std::string html = FleetHtml(tables, "pages");
  EXPECT_THAT(html, AllOf(HasSubstr("<b>In shadow mode: r2 r5&lt;i&gt;.</b>"),
                          HasSubstr("<td><a href=\"pages/r5%3Ci%3E/s.lcmlog.html\">3</a></td>")));
}

// From every number to the page of a run, which is there.
TEST_F(FleetReportTest, ItsNumbersLeadToThePagesOfRuns) {
  const ScratchDirectory scratch;
  for (const std::string robot : {"r1", "r2"}) {
    std::filesystem::create_directories(scratch / ("pages/" + robot));
    for (const std::string log : {"a.lcmlog", "b.lcmlog"}) {
      std::filesystem::copy_file(kCourseLog, scratch / log, std::filesystem::copy_options::overwrite_existing);
      const std::string of = " '" + scratch / log + "' --config " + kCourseTask;
      EXPECT_EQ(Forereach("ingest" + of + " --robot " + robot + " --database '" + server_->Address() + "' 2>&1").code,
                0);
      EXPECT_EQ(Forereach("report" + of + " --advice-seconds 0 --out " + (scratch / ("pages/" + robot + "/" + log)) +
                          ".html 2>&1")
                    .code,
                0);
    }
  }
  const std::string page = scratch / "fleet.html";
  EXPECT_THAT(Forereach("report --database '" + server_->Address() + "' --out " + page + " --runs pages 2>&1"),
              Exits(0, "2 robots"));
  const std::string html = Read(page), address = "<a href=\"";
  std::set<std::string> pages;
  int lists = 0;
  for (std::size_t at = 0; (at = html.find(address, at)) != std::string::npos;) {
    at += address.size();
    const std::string to = html.substr(at, html.find('"', at) - at);
    if (to.starts_with("#")) {
      ++lists;
      EXPECT_THAT(html, HasSubstr("id=\"" + to.substr(1) + "\">"));
    } else {
      pages.insert(to);
      EXPECT_THAT(Read(scratch / to), HasSubstr("<html")) << to;
    }
  }
  EXPECT_EQ(pages.size(), 4u);
  EXPECT_GE(lists, 2 * 5) << "of robots, causes, declarations and days";
  const std::size_t robots = html.find("<h2>Robots"), row = html.find("<td>r1</td>", robots);
  EXPECT_EQ(html.find("<td><a", row), row + 11) << "each number leads somewhere";
}

}  // namespace forereach::report_test
