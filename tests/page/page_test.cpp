
#include "forereach/numerics/parallel.h"
#include "page/detail.h"
#include "page/document.h"
#include "page/gather.h"
#include "page/write.h"
#include "records/database.h"
#include "tests/cli/program.h"
#include "tests/records/logs.h"
#include "tests/records/long_course.h"
#include "tests/tries.h"

namespace forereach::page_test {

const std::string kLog = FOREREACH_SOURCE_DIR "/tests/data/course.lcmlog";
const std::string kTask = FOREREACH_SOURCE_DIR "/tests/data/course.yaml";

// As `forereach report --out` gathers a page, run by run.
PageRun GatherPage(const std::vector<std::string>& inputs, const std::string& config, const LogKey& key,
                   const PageBounds& bounds) {
  const unsigned threads = AllCores();
  NamedRuns named = RunsNamedBy(inputs, threads);
  const PageTasks tasks{config, key, RunTasks(config, key, named.is_many)};
  PageRun page = EmptyPage(inputs);
  std::deque<PagePass> passes;
  std::vector<PagePass*> all;
  for (const RunLogs& run : named.runs) try {
      ReadPass(run, tasks, bounds, 2, passes.emplace_back(bounds));
      all.push_back(&passes.back());
      if (named.is_many) KeepLast(all, bounds);
    } catch (const BadInput& error) {
      passes.pop_back();
      if (!named.is_many) throw;
      named.missing.emplace_back(error.what());
    }
  for (PagePass& pass : passes) AddRows(page, std::move(pass.rows));
  AddMissing(page, named);
  std::size_t bytes = bounds.bytes;
  const auto chosen = ChooseDetails(page, bounds);
  for (std::size_t k = 0; k < chosen.size(); ++k)
    AddDetails(page, GatherDetails(passes[k], page, chosen[k], bytes, threads), bytes);
  return page;
}

TEST(ColumnsTest, Base64IsThatOfTheStandard) {
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64("\xff\xfe\xfd"), "//79");
}

TEST(ColumnsTest, ColumnNamesItsType) {
  EXPECT_EQ(Column(std::vector<std::uint8_t>{1})["type"], "u8");
  EXPECT_EQ(Column(std::vector<double>{1})["type"], "f64");
  EXPECT_EQ(Column(std::vector<float>{})["type"], "f32");
}

// How far a point lies outside of a convex polygon whose corners are in counter-clockwise order.
double Outside(const Svg::Points& polygon, const Eigen::Vector2d& point) {
  double most = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d from = polygon[i], edge = polygon[(i + 1) % polygon.size()] - from, to = point - from;
    most = std::max(most, (edge.y() * to.x() - edge.x() * to.y()) / edge.norm());
  }
  return most;
}

TEST(SvgTest, OutlineIsWithinItsTolerance) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> size(0.01, 50), place(-1000, 1000);
  for (int i = 0; i < Tries(200); ++i) {
    const double a = size(random), b = size(random), x = place(random), y = place(random);
    Svg::Points ellipse;
    for (int k = 0; k < 60; ++k)
      ellipse.emplace_back(x + a * std::cos(2 * M_PI * k / 60), y + b * std::sin(2 * M_PI * k / 60));
    const double tolerance = 0.01 * std::max(a, b);
    const Svg::Points few = Simplified(ellipse, tolerance);
    EXPECT_LT(few.size(), 60u);
    for (const Eigen::Vector2d& corner : ellipse) EXPECT_LE(Outside(few, corner), tolerance + 1e-9);
  }
}

TEST(SvgTest, AThinOutlineKeepsItsFarEnd) {
  const Eigen::Vector2d far_end(10, 0.02);
  EXPECT_THAT(Simplified({{0, 0}, far_end, {6, 0.03}, {1, 0.02}}, 0.1), Contains(far_end));
}

TEST(SvgTest, ShapesAreOnAGridOverTheFrame) {
  Svg svg(Eigen::AlignedBox2d(Eigen::Vector2d(0, 0), Eigen::Vector2d(16384, 16384)));
  svg.Polygon({{8192, 8192}, {8193.2, 8192}, {8192, 8195}}, "class=\"a\"");
  svg.Circle({8192, 8182}, 3);
  svg.Text({8192, 8192}, "<a & b>");
  EXPECT_EQ(svg.Done(),
            "<g class=\"scene\" data-scale=\"1\" transform=\"translate(8192 -8192) scale(1)\">"
            "<path d=\"M0 0l1 0 -1 -3z\" class=\"a\"/><circle cx=\"0\" cy=\"10\" r=\"3\" ></circle>"
            "<text x=\"0\" y=\"0\" >&lt;a &amp; b></text></g>");
}

TEST(SvgTest, LeavesOutWhatIsNotFinite) {
  const auto is_drawn = [](const Svg::Points& corners) {
    Svg svg({0, 0}, 1, 1);
    svg.Polygon(corners);
    return !svg.Done().empty();
  };
  EXPECT_TRUE(is_drawn({{0, 0}, {1, 0}, {0, 1}}));
  EXPECT_FALSE(is_drawn({{0, 0}, {1, 0}, {0, std::nan("")}}));
  EXPECT_FALSE(is_drawn({{0, 0}, {1, 0}, {0, kInfinity}}));
  EXPECT_FALSE(is_drawn({{0, 0}, {1e300, 0}, {0, 1e300}}));
  PageDetail detail;
  EXPECT_FALSE(DrawTube({}, {}, {}, -1, detail));
  EXPECT_FALSE(DrawTube({{{{0, 0}, {1e300, 0}, {0, 1}}}}, {}, {}, -1, detail));
  EXPECT_EQ(detail.svg, "");
}

// An obstacle that drives away grows; one is there for a part of the time.
TEST(DrawTest, ObstaclesMoveByTheDrawingsClock) {
  PageDetail detail;
  detail.step_us = 1'000'000;
  ObstacleMotion motion{.velocity = {8, 0, 0}, .growth = 0.5};
  const Obstacle circle = Obstacle::Circle(Eigen::Vector2d(0, 0), 1),
                 box = Obstacle::AxisBox(Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 2));
  const Svg::Points square{{0, 0}, {100, 0}, {100, 100}, {0, 100}};
  ObstacleMotion brief = motion;
  brief.from_us = 1'000'000;
  ASSERT_TRUE(
      DrawTube({{square}, {square}, {square}}, {}, {circle.Moving(motion), box.Moving(brief), circle}, 1, detail));
  EXPECT_THAT(
      detail.svg,
      AllOf(
          HasSubstr("type=\"translate\" calcMode=\"discrete\" dur=\"3s\" fill=\"freeze\" values=\"0 0;1057 0;2114 0\""),
          HasSubstr("attributeName=\"r\" calcMode=\"discrete\" dur=\"3s\" fill=\"freeze\" values=\"132;198;264\""),
          HasSubstr("values=\"hidden;inherit;inherit\""), HasSubstr("class=\"obstacle binding\""),
          HasSubstr(">2</text>")));
}

// Its pieces are one shape without names, and each is found by its number.
TEST(DrawTest, OutsideOfAnAreaIsOneGroup) {
  PageDetail detail;
  const Obstacle box = Obstacle::AxisBox(Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 2)),
                 outside = box.Named("outside:lawn");
  ASSERT_TRUE(DrawTube({{{{0, 0}, {9, 0}, {9, 9}}}}, {}, {box, outside, outside, box}, 2, detail));
  EXPECT_THAT(detail.svg, HasSubstr("<g class=\"outside\"><g class=\"obstacle\">"));
  EXPECT_THAT(detail.svg, testing::ContainsRegex("<g class=\"obstacle binding\"><path [^>]*/></g></g><g class=\"obst"));
  EXPECT_THAT(detail.svg, AllOf(Not(HasSubstr("lawn")), HasSubstr(">3</text>")));
}

TEST(GatherTest, EachDecisionOfTheCourseHasItsTube) {
  const PageRun run = GatherPage({kCourseLog}, kCourseTask, {}, {});
  ASSERT_GT(run.decisions.size(), 20u);
  std::size_t judged = 0;
  for (const PageDecision& row : run.decisions)
    judged += row.outcome == "certified" || row.outcome.starts_with("abstain_");
  EXPECT_EQ(run.details.size(), judged);
  std::size_t executed = 0;
  for (const PageDetail& detail : run.details) {
    SCOPED_TRACE(run.decisions[detail.decision].message);
    EXPECT_EQ(detail.missing, "");
    EXPECT_THAT(detail.svg, HasSubstr("<path"));
    ASSERT_GE(detail.binding, 0);
    EXPECT_EQ(detail.hull_lower.size(), 6u);
    if (const int step = run.decisions[detail.decision].step; step >= 0) EXPECT_EQ(detail.binding, step);
    executed += detail.executed.size();
  }
  EXPECT_GT(executed, 50u);
  EXPECT_EQ(run.tasks.size(), 1u);
  EXPECT_THAT(run.parts.at(0).replays.at("course.lcmlog"), HasSubstr("--config"));
}

TEST(GatherTest, DrawsNoMoreThanItsBounds) {
  const PageRun few = GatherPage({kCourseLog}, kCourseTask, {}, {.certified = 3, .abstained = 2, .bytes = 1'000'000});
  EXPECT_EQ(few.details.size(), 5u);
  const PageRun none = GatherPage({kCourseLog}, kCourseTask, {}, {.certified = 3, .abstained = 2, .bytes = 10});
  for (const PageDetail& detail : none.details) {
    EXPECT_THAT(detail.missing, HasSubstr("reached their bound"));
    EXPECT_EQ(detail.svg, "");
  }
}

// Two runs of the course, each in three rounds.
TEST(GatherTest, HoldsTheLastRowsByTime) {
  const ScratchDirectory scratch;
  for (const char* name : {"a", "b"}) {
    std::filesystem::create_directory(scratch / name);
    WriteLongCourse(scratch / name + "/events.lcmlog", *name == 'a' ? 3 : 2);
  }
  const PageRun page = GatherPage({scratch / "a", scratch / "b"}, kCourseTask, {},
                                  {.decisions = 100, .events = 20, .certified = 4, .abstained = 5});
  const std::int64_t all = 5 * kCourseDecisions;
  EXPECT_EQ(page.decisions.left_out + std::ssize(page.decisions), all);
  EXPECT_GE(page.decisions.size(), 100u);
  EXPECT_LE(page.decisions.size(), 103u) << "and what was decided at the same time as the first of them";
  EXPECT_EQ(page.parts[0].decisions + page.parts[1].decisions, page.decisions.size());
  EXPECT_GT(page.parts[0].decisions, page.parts[1].decisions) << "it lasts longer";
  EXPECT_EQ(page.details.size(), 9u);
  for (const PageDetail& detail : page.details) EXPECT_EQ(detail.missing, "");
  EXPECT_THAT(PageHtml(page), HasSubstr("Of " + std::to_string(all) + " decisions the last "));
}

// A car of the demo stands for three steps.
PageDetail DetailOfStandingCar(const Config& task, const std::vector<Obstacle>& obstacles = {}) {
  candidate_plan_t candidate{.step_us = 100'000,
                             .num_states = static_cast<std::int16_t>(task.problem->model->num_states()),
                             .num_inputs = static_cast<std::int16_t>(task.problem->model->num_inputs()),
                             .num_steps = 3};
  std::fill_n(candidate.initial_half_width, candidate.num_states, 0.01);
  EXPECT_EQ(WhyNotJudged(candidate, task), "");
  const Certifier certifier(task.problem);
  const Schedule schedule = ScheduleOf(candidate, task.gate);
  Tube tube;
  const Decision decision = certifier.Certify(PlanOf(candidate, schedule), InitialSetOf(candidate), obstacles, tube);
  PageDetail detail;
  Describe(certifier, {candidate, schedule, static_cast<int>(decision.outcome), decision.step}, decision, tube,
           obstacles, detail);
  return detail;
}

TEST(GatherTest, OfSeveralRunsTheLastSetsOfObstaclesThatHaveRoomAreKept) {
  const auto set = [](int size) {
    return std::make_shared<const std::vector<Obstacle>>(static_cast<std::size_t>(size),
                                                         Obstacle::Circle(Eigen::Vector2d(0, 0), 1));
  };
  const auto shared = set(4);
  const std::vector<DatedSet> sets{{30, set(2)}, {10, shared}, {40, set(3)}, {20, shared}, {50, set(0)}};
  constexpr auto kAll = std::numeric_limits<std::int64_t>::min();
  // What the oldest one kept has does not count.
  for (const auto& [most, begin] : {std::pair<std::size_t, std::int64_t>{5, kAll}, {4, 21}, {3, 21}, {2, 31}, {0, 31}})
    EXPECT_EQ(BeginOfKept(sets, most), begin) << most;
  EXPECT_EQ(BeginOfKept({}, 0), kAll);
}

TEST(DetailTest, ABodyIsDrawnAtEachStep) {
  const PageDetail detail = DetailOfStandingCar(LoadConfig(FOREREACH_SOURCE_DIR "/config/demo.yaml"));
  ASSERT_EQ(detail.missing, "");
  EXPECT_TRUE(detail.has_body);
  EXPECT_EQ(detail.units, 3u);
  const std::string bodies = detail.svg.substr(detail.svg.find("class=\"bodies\""));
  const double scale = std::stod(detail.svg.substr(detail.svg.find("data-scale=\"") + 12));
  for (const char* unit : {"s0", "s1", "s2"}) EXPECT_THAT(bodies, HasSubstr("class=\"" + std::string(unit)));
  EXPECT_EQ(std::ranges::count(bodies, 'z'), 3) << "a rectangle each";
  std::istringstream first(bodies.substr(bodies.find("d=\"M") + 4));
  double left, top, x, y;
  char l;
  first >> left >> top >> l;
  double right = left;
  for (double at = left; first >> x >> y;) at += x, left = std::min(left, at), right = std::max(right, at);
  EXPECT_NEAR(scale * left + detail.frame.center().x(), -0.9, 0.01);
  EXPECT_NEAR(scale * right + detail.frame.center().x(), 3.4, 0.01);
}

TEST(DetailTest, NamesTheNearestObservationOfEachState) {
  const Config task = LoadConfig(FOREREACH_SOURCE_DIR "/config/demo.yaml");
  const PageDetail detail = DetailOfStandingCar(task, {Obstacle::Circle(Eigen::Vector2d(1, 0), 1)});
  ASSERT_EQ(detail.binding, 0);
  const Transitions& known = task.problem->transitions;
  // The first step begins at the origin, and its input is zero.
  for (int k = 0; k < 6; ++k) {
    const Eigen::VectorXd weights = task.problem->declaration.lipschitz.row(k);
    if (weights.isZero(0)) {
      EXPECT_EQ(detail.nearest[k], -1) << k;
      continue;
    }
    double least = std::numeric_limits<double>::infinity();
    int nearest = -1;
    for (int i = 0; i < known.size(); ++i) {
      double distance = 0;
      for (int j = 0; j < weights.size(); ++j) distance += weights[j] * std::abs(known.z(i, j));
      if (distance < least) least = distance, nearest = i;
    }
    EXPECT_EQ(detail.nearest[k], nearest) << k;
    EXPECT_NEAR(detail.nearest_distance[k], least, 1e-12) << k;
  }
}

/** A logger's directory with the course's log and its rows. */
struct DirectoryTest : testing::Test {
  DirectoryTest() {
    std::filesystem::copy(kCourseLog, log_);
    Database database(directory_ / "decisions.sqlite");
    database.BeginRun("events-20260101-120000-000000.lcmlog", 1);
    Interpreter interpreter({}, "events-20260101-120000-000000.lcmlog");
    Rows rows;
    std::int64_t events = 0;
    ForEachEvent({log_}, [&](const LogEvent& event, const std::string&) {
      interpreter.Observe(event, rows);
      ++events;
    });
    EXPECT_TRUE(database.Write(rows, "events-20260101-120000-000000.lcmlog", events));
  }

  const ScratchDirectory directory_;
  const std::string log_ = directory_ / "events-20260101-120000-000000.lcmlog";
};

TEST_F(DirectoryTest, HasTheRowsOfTheDatabaseAndTheTubesOfTheLog) {
  const PageRun of_log = GatherPage({kCourseLog}, kCourseTask, {}, {});
  const PageRun run = GatherPage({directory_.path()}, kCourseTask, {}, {});
  EXPECT_FIELDS(run, (decisions.size(), of_log.decisions.size()), (events.size(), of_log.events.size()),
                (details.size(), of_log.details.size()));
  for (const PageDetail& detail : run.details) EXPECT_EQ(detail.missing, "");
  EXPECT_THAT(run.notes, IsEmpty());
}

TEST_F(DirectoryTest, WithoutTheLogItHasTheRowsAlone) {
  std::filesystem::remove(log_);
  const PageRun run = GatherPage({directory_ / "decisions.sqlite"}, "", {}, {});
  EXPECT_FIELDS(run, (decisions.size(), std::size_t{kCourseDecisions}), (details.empty(), true));
  EXPECT_THAT(run.notes, ElementsAre(HasSubstr("the log is not in the database's directory")));
}

TEST_F(DirectoryTest, WithoutTheTaskItSaysWhyThereAreNoTubes) {
  const PageRun run = GatherPage({directory_.path()}, "", {}, {});
  EXPECT_FIELDS(run, (decisions.size(), std::size_t{kCourseDecisions}), (details.empty(), true));
  EXPECT_THAT(run.notes, ElementsAre(HasSubstr("is not kept next to it")));
}

TEST_F(DirectoryTest, WithoutADatabaseItReadsTheLogs) {
  std::filesystem::remove(directory_ / "decisions.sqlite");
  EXPECT_EQ(
      GatherPage({directory_.path()}, kCourseTask, {}, {.certified = 0, .abstained = 0, .bytes = 0}).decisions.size(),
      std::size_t{kCourseDecisions});
  std::filesystem::remove(log_);
  EXPECT_THROW(static_cast<void>(GatherPage({directory_.path()}, kCourseTask, {}, {})), BadInput);
}

// Two robots with the same plans at the same times, and a file that is no log.
struct ManyRunsTest : testing::Test {
  ManyRunsTest() {
    for (const char* robot : {"a", "b"}) {
      std::filesystem::create_directories(directory_ / ("night/" + std::string(robot)));
      std::filesystem::copy(kCourseLog, directory_ / ("night/" + std::string(robot) + "/one.lcmlog"));
    }
    directory_.Write("night/b/two.lcmlog", "no log");
  }
  Output Report(const std::string& page, const std::string& options) const {
    return Forereach("report '" + (directory_ / "night") + "' --config '" + kCourseTask + "' --out '" +
                     (directory_ / page) + "' " + options + " 2>&1");
  }

  const ScratchDirectory directory_;
};

TEST_F(ManyRunsTest, EachRunHasItsRobotItsRowsAndItsTubes) {
  const PageRun run = GatherPage({directory_ / "night"}, kCourseTask, {}, {});
  const PageRun one = GatherPage({kCourseLog}, kCourseTask, {}, {});
  ASSERT_EQ(run.parts.size(), 2u);
  EXPECT_FIELDS(run, (parts[0].robot, directory_ / "night/a"), (parts[1].robot, directory_ / "night/b"));
  EXPECT_THAT(run.parts[1].replays.at("one.lcmlog"), HasSubstr(directory_ / "night/b/one.lcmlog"));
  EXPECT_EQ(run.parts[1].decisions, std::size_t{kCourseDecisions});
  EXPECT_EQ(run.decisions.size(), std::size_t{2 * kCourseDecisions});
  EXPECT_THAT(run.notes, ElementsAre(HasSubstr("two.lcmlog: is no LCM event log")));
  ASSERT_EQ(run.details.size(), 2 * one.details.size());
  for (std::size_t i = 0; i < one.details.size(); ++i) {
    const PageDetail &a = one.details[i], &b = run.details[one.details.size() + i];
    EXPECT_EQ(a.svg, b.svg);
    EXPECT_EQ(run.decisions[b.decision].plan_digest, one.decisions[a.decision].plan_digest);
    EXPECT_GE(b.decision, std::size_t{kCourseDecisions});
    EXPECT_EQ(b.missing, "");
  }
  const PageRun few = GatherPage({directory_ / "night"}, kCourseTask, {}, {.certified = 3, .abstained = 2});
  EXPECT_EQ(few.details.size(), 5u) << "of the page, not of each run";
}

TEST_F(ManyRunsTest, APageMadeOnOneCoreIsTheSame) {
  for (const char* log : {"night/a/one.lcmlog", "night/b/one.lcmlog"})  // the first quarter, as the search takes long
    std::filesystem::resize_file(directory_ / log, std::filesystem::file_size(kCourseLog) / 4);
  EXPECT_THAT(Report("first.html", "--advice-seconds 1000"),
              Exits(0, "50 decisions", ", 2 runs", "two.lcmlog: is no LCM event log"));
  EXPECT_EQ(Report("fresh.html", "--advice-seconds 1000 --jobs 1").code, 0);
  EXPECT_EQ(Read(directory_ / "first.html"), Read(directory_ / "fresh.html"));
}

TEST(ReportCommandTest, WritesAPageWholeOrNotAtAll) {
  const ScratchDirectory directory;
  const std::string page = directory / "a page.html",
                    report = "report --advice-seconds 0 '" + kCourseLog + "' --config '" + kCourseTask + "' --out '";
  EXPECT_THAT(Forereach(report + page + "' 2>&1"), Exits(0, std::to_string(kCourseDecisions) + " decisions"));
  EXPECT_THAT(Read(page), StartsWith("<!DOCTYPE html>"));
  directory.Write("a page.html", "mine");
  EXPECT_THAT(Forereach(report + page + "' 2>&1"), Exits(2, "the file exists"));
  EXPECT_EQ(Read(page), "mine");
  EXPECT_EQ(Forereach(report + page + "' --force 2>&1").code, 0);
  EXPECT_THAT(Read(page), EndsWith("</html>\n"));
  EXPECT_EQ(Forereach(report + directory.path() + "/none/page.html' 2>&1").code, 2);
}

TEST(WriteTest, TextsOfARunCannotOpenATag) {
  PageRun run = GatherPage({kCourseLog}, kCourseTask, {}, {.certified = 0, .abstained = 0, .bytes = 0});
  const std::string plain = PageHtml(run);
  const auto tags = [](const std::string& html) { return std::ranges::count(html, '<'); };
  for (PageDecision& row : run.decisions) row.source = row.cause = "</script><!--<b>";
  run.name = run.shadow = run.notes.emplace_back("<script>");
  run.faults.push_back({1, 1, "<i>", "<i>"});
  const std::string html = PageHtml(run);
  EXPECT_EQ(tags(html), tags(plain));
  EXPECT_THAT(html, Not(HasSubstr("</script><!--")));
}

// The course once more, as if its gate had been a shadow, and the robot had driven the same plans without it.
TEST(GatherTest, APageOfAShadowSaysSoAndWhatHappened) {
  const ScratchDirectory directory;
  const std::string log = directory / "shadow.lcmlog";
  CopyLog(kLog, log, [](LogEvent& event) {
    if (auto decision = Decoded<decision_t>(event.data); decision && decision->outcome == decision_t::CERTIFIED) {
      decision->outcome = decision_t::REJECTED;
      decision->cause = decision_t::CAUSE_SHADOW;
      event.data = Encode(*decision);
    }
    return event.channel != "PLAN_CERTIFIED";
  });
  const std::string shadow = GatherPage({log}, kTask, {}, {.certified = 0, .abstained = 0, .bytes = 0}).shadow;
  EXPECT_THAT(shadow, testing::StartsWith("Shadow mode: the gate certified nothing, and the robot did not obey it. It "
                                          "would have certified " +
                                          std::to_string(kCourseCertified) + " plans"));
  EXPECT_THAT(shadow, testing::ContainsRegex("the robot drove [1-9][0-9]*, left a slice of 0 and had 0 contacts"));
  EXPECT_EQ(GatherPage({kLog}, kTask, {}, {.certified = 0, .abstained = 0, .bytes = 0}).shadow, "");
  const Output printed = Forereach("report '" + log + "' --config '" + kTask + "'");
  EXPECT_THAT(printed.text, testing::StartsWith("SHADOW"));
  EXPECT_THAT(printed.text, testing::ContainsRegex("driven [1-9][0-9]*: 0 left a slice \\(0 of [1-9][0-9]* states\\)"));
}

TEST(WriteTest, ObstaclesHaveTheirNames) {
  PageRun run;
  DecisionRow row;
  for (const auto& [obstacle, message] : {std::pair(3, "at step 2 the robot may touch oak_2 (by 1 m)"),
                                          {-1, "closest at step 2, 1 m from oak_3"},
                                          {7, "closest at step 2, 1 m from obstacle 7; steps on time"},
                                          {1, "the robot may leave lawn (by 1 m)"}}) {
    row.obstacle = obstacle;
    row.message = message;
    run.decisions.emplace_back(row);
  }
  run.parts = {{"", {}, run.decisions.size()}};
  EXPECT_THAT(PageHtml(run), HasSubstr(R"("names":["oak_2","","7","outside:lawn"])"));
}

TEST(WriteTest, ALogNamedLikeAKeyIsWritten) {
  PageRun run;
  run.parts = {{"", {{"type", "one"}, {"data", "two"}}}};
  EXPECT_THAT(PageHtml(run), HasSubstr(R"("replays":{"data":"two","type":"one"})"));
}

TEST(WriteTest, PolicyForbidsRequests) {
  EXPECT_THAT(PageHtml({}), AllOf(HasSubstr("default-src 'none'"), HasSubstr("script-src 'sha256-"),
                                  Not(HasSubstr("unsafe-inline")), Not(HasSubstr(" src=\"http"))));
}

// A browser keeps other characters in texts twice as large, and takes twice as long over what is next to them.
TEST(WriteTest, APageIsOfAsciiWhereItsTextsAre) {
  const std::string html =
      PageHtml(GatherPage({kCourseLog}, kCourseTask, {}, {.certified = 0, .abstained = 0, .bytes = 0}));
  EXPECT_TRUE(std::ranges::all_of(html, [](char c) { return static_cast<unsigned char>(c) < 0x80; }));
}

}  // namespace forereach::page_test
