// The tasks in config/ have the described outcomes, and the README there agrees with the code.

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/text_model.h"
#include "simulator/target.h"
#include "task/schema.h"
#include "tests/paths.h"
#include "tests/task/task_files.h"
#include "tests/worlds.h"

namespace forereach::shipped_test {

const std::string kDirectory = FOREREACH_SOURCE_DIR "/config/";

TEST(Shipped, ReadmeListsTheKeysOfTheSchema) {
  const std::string readme = Read(kDirectory + "README.md");
  const std::size_t keys = readme.find("## Keys\n");
  ASSERT_NE(keys, std::string::npos);
  EXPECT_EQ(readme.substr(keys), SchemaMarkdown()) << "everything from '## Keys' on is what `forereach keys` prints";
}

TEST(Shipped, EveryTaskLoads) {
  int tasks = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kDirectory)) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW((void)LoadConfig(entry.path().string())) << entry.path();
    ++tasks;
  }
  EXPECT_GE(tasks, 4);
}

TEST(Shipped, DeclarationsAreThePapers) {
  const Declaration bicycle = LoadConfig(kDirectory + "bicycle.yaml").problem->declaration;
  EXPECT_FIELDS(bicycle, (lipschitz(2, 3), 0.017926410), (lipschitz(2, 5), 0.609638820));
  EXPECT_EQ((bicycle.lipschitz.array() != 0).count(), 2);
  const Declaration point_mass = LoadConfig(kDirectory + "point_mass.yaml").problem->declaration;
  EXPECT_FIELDS(point_mass, (lipschitz(0, 2), 0.006914008), (lipschitz(1, 2), 0.005689541),
                (lipschitz(2, 2), 0.092186775), (lipschitz(3, 2), 0.075860540));
  EXPECT_EQ((point_mass.lipschitz.array() != 0).count(), 8);
}

// The commands that the task files quote.
TEST(Shipped, TransitionsAreThoseOfTheirCommands) {
  const auto made = [](const Config& config, int count, const std::vector<SampleRange>& ranges) {
    return ObservationsDigest(*config.problem->model,
                              MakeTransitions(*MakeTarget(config), *config.problem, 1, count, ranges));
  };
  const Config bicycle = LoadConfig(kDirectory + "bicycle.yaml");
  EXPECT_EQ(bicycle.grounds.observations, made(bicycle, 400, {{"v", 7.25, 15.75}, {"delta", 0, 0.45}}));
  const Config point_mass = LoadConfig(kDirectory + "point_mass.yaml");
  EXPECT_EQ(point_mass.grounds.observations, made(point_mass, 100, {{"vx", -0.5, 3.5}, {"vy", -0.8, 0.8}}));
}

Decision Decide(const Config& config, const Eigen::MatrixXd& controls) {
  const Certifier certifier(config.problem);
  const auto inputs = static_cast<int>(controls.rows());
  const Plan plan{controls.data(), inputs, static_cast<int>(controls.cols()), inputs};
  const Zonotope initial_set = Zonotope::Enclose(config.initial_set);
  certifier.Require(plan, initial_set, config.obstacles);
  Tube tube;
  return certifier.Certify(plan, initial_set, config.obstacles, tube);
}

Outcome Certify(const std::string& task, const std::string& plan_name) {
  const Config config = LoadConfig(kDirectory + task + ".yaml");
  return Decide(config, LoadPlan(kDirectory + "plans/" + plan_name + ".csv", *config.problem->model)).outcome;
}

TEST(Shipped, EachPlanGetsTheAnswerItIsNamedAfter) {
  for (const std::string task : {"bicycle", "point_mass"}) {
    EXPECT_EQ(Certify(task, task + "_certified"), Outcome::kCertified) << task;
    EXPECT_EQ(Certify(task, task + "_domain"), Outcome::kDomain) << task;
    EXPECT_EQ(Certify(task, task + "_safety"), Outcome::kSafety) << task;
    EXPECT_EQ(Certify(task + "_falsified", task + "_certified"), Outcome::kFalsified) << task;
  }
}

// Whether two tubes are the same to the last bit.
void ExpectSameTube(const Tube& a, const Tube& b, const std::string& what) {
  ASSERT_EQ(a.length(), b.length()) << what;
  for (int t = 0; t <= a.length(); ++t) {
    EXPECT_THAT(a.half_width(t), ElementsAreArray(b.half_width(t))) << what << ", step " << t;
    EXPECT_THAT(a.slice(t).center(), ElementsAreArray(b.slice(t).center())) << what << ", step " << t;
    ASSERT_EQ(a.slice(t).num_generators(), b.slice(t).num_generators()) << what << ", step " << t;
    for (int k = 0; k < a.slice(t).dim(); ++k)
      EXPECT_THAT(a.slice(t).row(k), ElementsAreArray(b.slice(t).row(k))) << what << ", step " << t;
  }
}

void ExpectSameDecision(const Config& compiled, const Config& text, const Eigen::MatrixXd& controls,
                        const std::string& what) {
  const auto decide = [&](const Config& config, Tube& tube) {
    const auto inputs = static_cast<int>(controls.rows());
    const Plan plan{controls.data(), inputs, static_cast<int>(controls.cols()), inputs};
    return Certifier(config.problem).Certify(plan, Zonotope::Enclose(config.initial_set), config.obstacles, tube);
  };
  Tube tube, text_tube;
  const Decision a = decide(compiled, tube), b = decide(text, text_tube);
  EXPECT_EQ(a.outcome, b.outcome) << what;
  EXPECT_EQ(a.cause, b.cause) << what;
  EXPECT_EQ(a.step, b.step) << what;
  EXPECT_EQ(a.coordinate, b.coordinate) << what;
  EXPECT_EQ(a.obstacle, b.obstacle) << what;
  EXPECT_EQ(a.closest_step, b.closest_step) << what;
  EXPECT_EQ(a.margin, b.margin) << what;
  EXPECT_EQ(a.threshold, b.threshold) << what;
  ExpectSameTube(tube, text_tube, what);
}

TEST(Shipped, AModelAsTextGivesTheDecisionsOfTheCompiledOne) {
  for (const std::string task : {"bicycle", "point_mass"}) {
    const Config compiled = LoadConfig(kDirectory + task + ".yaml");
    Config text = LoadConfig(kDirectory + task + "_text.yaml");
    EXPECT_NE(text.grounds.model, compiled.grounds.model);
    EXPECT_EQ(text.grounds.declaration, compiled.grounds.declaration);
    EXPECT_EQ(text.grounds.observations, compiled.grounds.observations);
    for (const Method method : {Method::kCentred, Method::kPaper})
      for (const char* end : {"_certified", "_domain", "_safety"}) {
        Config one = compiled, other = text;
        for (Config* config : {&one, &other}) {
          Own(config->problem).method = method;
        }
        const std::string plan = task + end;
        ExpectSameDecision(one, other, LoadPlan(kDirectory + "plans/" + plan + ".csv", *text.problem->model), plan);
      }
  }
}

// Tasks with a body, and with bounds between the samples.
TEST(Shipped, AModelAsTextDecidesAsTheCompiledOneInOtherTasks) {
  for (const auto& [task, plan] :
       {std::pair{"truck", "truck_turn"}, {"post", "straight"}, {"post_samples", "straight"}}) {
    const Config compiled = LoadConfig(kDirectory + task + ".yaml");
    const NominalModel& model = *compiled.problem->model;
    ModelText text = *LoadConfig(kDirectory + "bicycle_text.yaml").problem->model->text();
    for (std::size_t p = 0; p < text.parameters.size(); ++p) {
      ASSERT_EQ(text.parameters[p].name, model.parameter_names()[p]);
      text.parameters[p].lower = text.parameters[p].upper = model.parameters()[p];
    }
    Config other = compiled;
    Problem problem = *compiled.problem;
    problem.model = MakeTextModel(text);
    other.problem = std::make_shared<const Problem>(std::move(problem));
    ExpectSameDecision(compiled, other, LoadPlan(kDirectory + "plans/" + plan + ".csv", model), task);
  }
}

TEST(Shipped, ACarIsCertifiedIfItKeepsItsLane) {
  const Config config = LoadConfig(kDirectory + "lane.yaml");
  const auto decide = [&](const std::string& plan) {
    return Decide(config, LoadPlan(kDirectory + "plans/" + plan + ".csv", *config.problem->model));
  };
  const Decision straight = decide("straight"), turn = decide("lane_turn");
  EXPECT_EQ(Explain(straight, *config.problem),
            "certified: no obstacle is there; within its limits at the sample instants; steps on time");
  EXPECT_EQ(turn.cause, Cause::kLimit);
  EXPECT_THAT(Explain(turn, *config.problem), HasSubstr("left front corner may reach"));
}

// Its forearm comes near the post at the end, and would meet one that stands a tenth of a metre nearer.
TEST(Shipped, AnArmReachesPastAPost) {
  Config config = LoadConfig(kDirectory + "arm.yaml");
  const Eigen::MatrixXd plan = LoadPlan(kDirectory + "plans/arm_reach.csv", *config.problem->model);
  const Decision reaches = Decide(config, plan);
  EXPECT_EQ(reaches.outcome, Outcome::kCertified) << Explain(reaches, *config.problem);
  EXPECT_FIELDS(reaches, (obstacle, 0), (part, 1));
  config.obstacles = {Obstacle::Circle(Eigen::Vector2d(1.02, 1.13), 0.08)};
  EXPECT_FIELDS(Decide(config, plan), (cause, Cause::kObstacle), (part, 1));
}

// What a robot on the bus drives has to end standing; coasting does not, standing still does.
TEST(Shipped, ARobotsPlanHasToEndStanding) {
  for (const std::string task : {"demo", "policy"}) {
    const Config config = LoadConfig(kDirectory + task + ".yaml");
    EXPECT_EQ(Decide(config, Eigen::MatrixXd::Zero(2, 6)).outcome, Outcome::kCertified) << task;
    Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(2, 6);
    controls(0, 0) = 10, controls(0, 4) = -10;  // jerk: 1 m/s^2 for a while, and then it coasts
    const Decision decision = Decide(config, controls);
    EXPECT_EQ(decision.outcome, Outcome::kDomain) << task;
    EXPECT_EQ(decision.cause, Cause::kNoStop) << task;
    EXPECT_EQ(decision.step, 6) << task;
    EXPECT_EQ(config.problem->model->state_names()[static_cast<std::size_t>(decision.coordinate)], "v") << task;
  }
}

// The first block of this kind in the README.
std::string Block(const std::string& kind) {
  const std::string readme = Read(kDirectory + "README.md"), fence = "```" + kind + "\n";
  const std::size_t begin = readme.find(fence) + fence.size();
  return readme.substr(begin, readme.find("```", begin) - begin);
}

TEST(Shipped, TheReadmesExampleGetsTheAnswerItQuotes) {
  const TaskFiles files;
  const Config config = files.Load(Block("yaml"), Block("csv"));
  const Decision decision = Decide(config, Eigen::MatrixXd::Zero(2, 6));
  EXPECT_FIELDS(decision, (outcome, Outcome::kCertified), (closest_step, 5));
  EXPECT_THAT(Read(kDirectory + "README.md"), HasSubstr(Explain(decision, *config.problem)));
}

TEST(Shipped, TheReadmesErrorsAreThoseItQuotes) {
  const TaskFiles files;
  const std::string task = Block("yaml"), steps = Block("csv"), readme = Read(kDirectory + "README.md");
  for (const std::string& error : {files.Error(Replaced(task, "vx: {vx: 0.02", "vx: {vx: -0.02"), steps),
                                   files.Error(Replaced(task, "{lower: [-1, -1]", "{lower: [-1]"), steps),
                                   files.Error(task, Replaced(steps, "1,2,2.0,", "1,2,3.5,"))})
    EXPECT_THAT(readme, AnyOf(HasSubstr("\n" + error + "\n"), HasSubstr("\ntask.yaml:" + error + "\n")));
}

}  // namespace forereach::shipped_test
