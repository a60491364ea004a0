// Equations of a text as C++: the header, its program, and decisions with it, bit for bit.
#include <bit>

#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/compiled_models.h"
#include "forereach/dynamics/equations_header.h"
#include "forereach/dynamics/models/kinematic_bicycle.h"
#include "forereach/dynamics/models/point_mass.h"
#include "forereach/dynamics/text_model.h"
#include "tests/forereach/exported_model.inc"
#include "tests/paths.h"
#include "tests/worlds.h"

namespace forereach::compiled_models_test {

// Every operation that a nominal model may have, names that are words of C++, and a definition that nothing uses.
ModelText EveryOperation() {
  ModelText text{.name = "every_operation",
                 .file = "robot.yaml",
                 .states = {{"x", "m"}, {"double", "m"}, {"_a__b", "rad"}},
                 .inputs = {{"next", "m/s"}, {"T", "1"}},
                 .parameters = {{"k", 1.5, 1.5}, {"dt", 0.1, 0.1}},
                 .definitions = {{"z", {"k*x - 2/(double + 10)"}}, {"half", {"0.5"}}, {"unused", {"x"}}}};
  text.equations = {{"x + dt*(sin(_a__b)*z + cos(x)^2 - tan(0.1*_a__b))/x^T + asin(0.1*sin(x)) - -acos(0.1*cos(x))"},
                    {"sqrt(4 + x^4) + exp(-x^2) - log(5 + double^2) + atan(z)*tanh(x) + hypot(x, 3 + double^2)"},
                    {"atan2(2 + x^2, next) + abs(x - 20) + min(x, 30)*max(T, z) + x^-3 + (x + 9)^half + pi*x^0 + x^1"}};
  text.integrator = ModelText::Integrator::kEuler;
  return text;
}

// The file in the repository is what the exporter writes, so the compiled test covers it.
TEST(EquationsHeader, IsTheOneThatIsCompiledHere) {
  const std::string header =
      EquationsHeader(EveryOperation(), "exported_operations", "Made by compiled_models_test.cpp.");
  const std::string path = FOREREACH_SOURCE_DIR "/tests/forereach/exported_model.inc";
  if (header != Read(path)) std::ofstream("exported_model.inc") << header;
  EXPECT_EQ(header, Read(path)) << "the new one is exported_model.inc in the working directory";
}

// A unit is any text, and what a task says does not become code.
TEST(EquationsHeader, HostileUnitsAndOriginsCannotEndAComment) {
  ModelText text = EveryOperation();
  text.states[0].unit = "m**//\n#error */";
  text.inputs[0].unit = "/*m/*/s";
  const std::string header = EquationsHeader(text, "robot", "robot.yaml */\rint x; /*/");
  EXPECT_EQ(header.find("*/"), header.find(". */\n#pragma once") + 2);
  EXPECT_EQ(header.find("/*", 2), header.find("/** The values of the parameters"));
  EXPECT_THAT(header, AllOf(Not(HasSubstr("\n#error")), Not(HasSubstr("\r"))));
}

// Whole numbers too large for an integer of C++, and zero with a sign.
TEST(EquationsHeader, ParametersAreTheDoublesThatTheyWere) {
  ModelText text = EveryOperation();
  text.parameters.push_back({"big", 123456789012345680000.0, 123456789012345680000.0});
  text.parameters.push_back({"zero", -0.0, -0.0});
  EXPECT_THAT(EquationsHeader(text, "robot", ""), HasSubstr("values{1.5, 0.1, 123456789012345683968.0, -0.0};"));
}

TEST(EquationsHeader, HasTheProgramOfTheText) {
  EXPECT_TRUE(HaveSameValues(EquationsModel<ExportedOperations>::kProgram, MakeTextModel(EveryOperation())->program()));
}

TEST(HaveSameValues, TellsProgramsApart) {
  const Program& bicycle = EquationsModel<KinematicBicycle>::kProgram;
  EXPECT_TRUE(HaveSameValues(bicycle, bicycle));
  EXPECT_FALSE(HaveSameValues(bicycle, EquationsModel<PointMass>::kProgram));
  const std::string once = EveryOperation().equations[0].text;
  for (const auto& [from, to] : {std::pair("dt*(", "(dt + 0)*("),
                                 {"sin(_a__b)", "sin(x)"},
                                 {"0.1*sin", "0.2*sin"},
                                 {"cos(x)^2", "cos(x)^3"},
                                 {"asin", "acos"},
                                 {"*z +", "*k +"},
                                 {"x + dt", "dt + x"}}) {
    ModelText text = EveryOperation();
    text.equations[0].text.replace(once.find(from), std::string(from).size(), to);
    EXPECT_FALSE(HaveSameValues(EquationsModel<ExportedOperations>::kProgram, MakeTextModel(text)->program())) << from;
  }
  ModelText swapped = EveryOperation();
  std::swap(swapped.equations[0], swapped.equations[1]);
  EXPECT_FALSE(HaveSameValues(EquationsModel<ExportedOperations>::kProgram, MakeTextModel(swapped)->program()));
}

TEST(StructNameTest, IsAValidNameThatIsNotTaken) {
  EXPECT_EQ(StructName("differential_drive"), "DifferentialDrive");
  EXPECT_EQ(StructName("robot"), "Robot");
  EXPECT_EQ(StructName("3_wheels"), "Model3Wheels");
  EXPECT_EQ(StructName("_"), "Model");
  // Words that C++ or a library has taken.
  EXPECT_EQ(StructName("NAN"), "ModelNAN");
  EXPECT_EQ(StructName("e_o_f"), "ModelEOF");
  EXPECT_EQ(StructName("eigen"), "ModelEigen");
  EXPECT_EQ(StructName("class"), "Class");
}

void ExpectRefused(const ModelText& text, const std::string& why) {
  EXPECT_THAT([&] { static_cast<void>(EquationsHeader(text, "robot", "")); },
              ThrowsMessage<ExportError>(HasSubstr(why)));
}

TEST(EquationsHeader, RefusesAModelThatGainsNothingByCompiling) {
  const auto with = [](const auto& change) {
    ModelText text = EveryOperation();
    change(text);
    return text;
  };
  ExpectRefused(with([](ModelText& text) { text.integrator = ModelText::Integrator::kRk4; }),
                "midpoint and rk4 are bounded stage by stage");
  ExpectRefused(with([](ModelText& text) { text.integrator = ModelText::Integrator::kMidpoint; }),
                "written out in `next`");
  ExpectRefused(with([](ModelText& text) { text.parameters[0].upper = 1.6; }), "model.parameters.k: is a range");
  ExpectRefused(with([](ModelText& text) {
                  text.definitions[1].value = {"1/2", 7, 5};
                }),
                "robot.yaml:7:6: an operation on numbers");
  for (const char* number : {"2^x", "hypot(x, 2)", "hypot(2, x)", "sin(2)", "-(2)*x", "2^0.5", "2^2"})
    ExpectRefused(with([&](ModelText& text) { text.equations[0].text = number; }), "an operation on numbers");
  ExpectRefused(with([](ModelText& text) {
                  text.integrator = ModelText::Integrator::kNone;
                  text.equations[1] = {"half", 8, 3};
                }),
                "robot.yaml:8:3: is a number");
  ModelText large = EveryOperation();
  for (int i = 0; i < 400; ++i) large.equations[0].text += " + sin(x*" + std::to_string(i) + ".5)*double";
  ExpectRefused(large, "more than the 2048");
}

// Two models of one text: the interpreted one, and the one that UseCompiled puts in its place.
TEST(UseCompiledTest, DecisionsHaveTheSameBits) {
  const auto text = MakeTextModel(EveryOperation());
  EXPECT_EQ(CompiledFor(text), text) << "nothing is compiled yet";
  UseCompiled<ExportedOperations>();
  ModelText other = EveryOperation();
  other.parameters[0] = {"k", 1.25, 1.25};
  other.parameters[1] = {"dt", 0.05, 0.05};
  for (const ModelText& each : {EveryOperation(), other}) {
    const auto interpreted = MakeTextModel(each), compiled = CompiledFor(interpreted);
    ASSERT_NE(compiled, interpreted);
    EXPECT_FIELDS(*compiled, (description(), interpreted->description()), (angles(), interpreted->angles()));
    std::vector<Tube> tubes(2);
    std::vector<Decision> decisions;
    for (const auto& model : {interpreted, compiled}) {
      auto problem = std::make_shared<Problem>(
          WorldOf(model, Box(Vec({0.5, -8, -3}), Vec({18, 60, 60})), Box(Vec({0.5, -5}), Vec({5, 5}))));
      problem->declaration.lipschitz = Eigen::MatrixXd::Constant(3, 5, 1e-3);
      problem->declaration.noise_bound = Eigen::Vector3d::Constant(1e-3);
      problem->transitions.z = Eigen::MatrixXd::Zero(1, 5);
      problem->transitions.z.row(0) << 2, 0, 0, 1, 1;
      Eigen::VectorXd next(3);
      const Eigen::VectorXd z = problem->transitions.z.row(0).transpose();
      model->Evaluate({z.data(), 5}, {next.data(), 3});
      problem->transitions.x_next = next.transpose();
      const Certifier certifier(problem);
      const std::vector<double> controls{1, 1, 2, 0.5, 1, -1};
      const Plan plan{controls.data(), 2, 3, 2};
      const auto initial_set = Zonotope::FromBox(Eigen::Vector3d(2, 0, 0), Eigen::Vector3d::Constant(1e-3));
      decisions.push_back(certifier.Certify(plan, initial_set, {}, tubes[decisions.size()]));
    }
    EXPECT_FIELDS(decisions[0], (outcome, decisions[1].outcome), (step, decisions[1].step));
    ASSERT_EQ(tubes[0].length(), tubes[1].length());
    ASSERT_GE(tubes[0].length(), 1) << static_cast<int>(decisions[0].cause);
    for (int t = 0; t <= tubes[0].length(); ++t)
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(std::bit_cast<std::uint64_t>(tubes[0].slice(t).center(k)),
                  std::bit_cast<std::uint64_t>(tubes[1].slice(t).center(k)));
        EXPECT_EQ(std::bit_cast<std::uint64_t>(tubes[0].half_width(t)[static_cast<std::size_t>(k)]),
                  std::bit_cast<std::uint64_t>(tubes[1].half_width(t)[static_cast<std::size_t>(k)]));
      }
  }
  ModelText changed = EveryOperation();
  changed.equations[1].text += " + 0.1*x";
  EXPECT_THROW(static_cast<void>(CompiledFor(MakeTextModel(changed))), std::invalid_argument);
}

}  // namespace forereach::compiled_models_test
