// Certify calls without end: random problems of both models and random queries, from typical to absurd, with the
// promises of every outcome checked. `forereach_soak --count N --seed S`; exit 1 at the first broken promise, with what
// repeats it.

#include <array>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>

#include "command_line/command_line.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/safety/separation.h"
#include "tests/oracle/problems.h"

namespace forereach {
namespace {

constexpr int kCallsPerProblem = 400;

void Promise(bool kept, const char* what) {
  if (!kept) throw std::logic_error(what);
}

// Problems at the edges of what a certifier accepts.
void Exaggerate(Random& random, Problem& problem) {
  const Eigen::Index n = problem.declaration.lipschitz.rows(), variables = problem.declaration.lipschitz.cols();
  const double huge = std::ldexp(1, random.Integer(0, 1000));
  const Eigen::VectorXd reach = Eigen::VectorXd::Constant(n, huge),
                        input = Eigen::VectorXd::Constant(variables - n, huge);
  switch (random.Below(5)) {
    case 0:  // a declaration that the data contradict
      problem.transitions.x_next(0, random.Below(static_cast<int>(n))) += 100;
      break;
    case 1: problem.declaration.lipschitz *= std::ldexp(1, random.Integer(-1000, 900)); break;
    case 2: problem.declaration.lipschitz.setConstant(std::ldexp(1, random.Integer(-1000, 1000))); break;
    case 3: problem.declaration.noise_bound.setConstant(std::ldexp(1, random.Integer(-1074, 1023))); break;
    default: break;
  }
  if (random.Coin())
    problem.domain = {Box(-reach.cwiseMax(StateReach(n == 6)), reach.cwiseMax(StateReach(n == 6))),
                      Box(-input.cwiseMax(20), input.cwiseMax(20)),
                      {},
                      {}};
}

// Controls, sets and obstacles of any doubles that a certifier accepts.
void Exaggerate(Random& random, Query& query) {
  const auto any = [&] { return random.Double(); };
  const int n = query.initial_set.dim();
  if (random.Coin()) query.controls = Eigen::MatrixXd::NullaryExpr(query.controls.rows(), query.controls.cols(), any);
  if (random.Coin()) {
    Eigen::MatrixXd generators = query.initial_set.GeneratorMatrix();
    if (random.Coin() && generators.cols() > 0) generators.col(0) = Eigen::VectorXd::NullaryExpr(n, any);
    Eigen::VectorXd center = query.initial_set.CenterVector();
    center[random.Below(n)] = random.Double();
    query.initial_set = Zonotope(center, generators * std::ldexp(1, random.Integer(-1000, 0)));
  }
  if (random.Coin())
    query.obstacles.push_back(Obstacle::Circle(Eigen::VectorXd::NullaryExpr(2, any), std::abs(random.Double())));
}

void CheckCertificate(const Certifier& certifier, const Query& query, const Decision& decision, const Tube& tube) {
  Promise(tube.length() == query.plan().num_steps, "a certificate covers the whole plan");
  Promise(decision.step == -1 && decision.cause == Cause::kNone, "a certificate has no cause");
  Promise(decision.margin > decision.threshold, "a certificate has its margin");
  Zonotope projected;
  for (int t = 0; t <= tube.length(); ++t) {
    Hull hull;
    certifier.projection().EncloseHull(tube.slice(t), tube.half_width(t), hull);
    certifier.projection().Enclose(tube.slice(t), tube.half_width(t), projected);
    for (const Obstacle& obstacle : query.obstacles) {
      const bool proven = Separate(projected, obstacle).IsProven() || SeparateHulls(hull, obstacle).IsProven();
      Promise(proven, "a certificate separates every slice from every obstacle");
    }
  }
}

void CheckAbstention(const Query& query, const Decision& decision, const Tube& tube) {
  const bool falsified = decision.outcome == Outcome::kFalsified;
  Promise(decision.cause != Cause::kNone, "an abstention has a cause");
  Promise(falsified || (0 <= decision.step && decision.step <= query.plan().num_steps), "an abstention has its step");
  if (decision.outcome == Outcome::kSafety) {
    Promise(0 <= decision.obstacle && decision.obstacle < static_cast<int>(query.obstacles.size()),
            "S names its obstacle");
    Promise(!(decision.margin > decision.threshold), "S has no margin");
  }
  if (decision.outcome == Outcome::kDomain) {
    Promise(tube.length() == decision.step && decision.step < query.plan().num_steps, "D ends the run");
    Promise(decision.cause == Cause::kNoFiniteEnclosure || decision.exit.kind != DomainExit::Kind::kNone,
            "D names its bound");
    Promise(decision.coordinate >= 0, "D names its coordinate");
  }
}

Outcome Call(const Certifier& certifier, const Query& query, Tube& tube) {
  certifier.Require(query.plan(), query.initial_set, query.obstacles);
  const Decision decision = certifier.Certify(query.plan(), query.initial_set, query.obstacles, tube);
  if (decision.outcome == Outcome::kCertified)
    CheckCertificate(certifier, query, decision, tube);
  else
    CheckAbstention(query, decision, tube);
  Promise(decision.outcome != Outcome::kNone, "every plan gets an answer");
  Promise(!Explain(decision, certifier.problem()).empty(), "every answer has words");
  return decision.outcome;
}

class Soak {
 public:
  explicit Soak(std::uint64_t seed) : random_(seed) {}

  void Run(long count) {
    while (called_ < count) {
      const bool bicycle = random_.Coin(), absurd = random_.Coin(0.3);
      const auto problem = AnyProblem(random_, bicycle, random_.Integer(1, 25));
      if (random_.Coin(0.3)) Disturb(random_, *problem);
      if (absurd) Exaggerate(random_, *problem);
      std::unique_ptr<Certifier> certifier;
      try {
        certifier = std::make_unique<Certifier>(problem);
      } catch (const std::invalid_argument&) {
        Promise(absurd, "an ordinary problem is accepted");
        ++refused_;
        continue;
      }
      Promise(absurd || !certifier->violation(), "data that satisfy the declaration do not falsify it");
      for (int i = 0; i < kCallsPerProblem && called_ < count; ++i, ++called_) {
        Query query = AnyQuery(random_, *problem);
        if (random_.Coin(absurd ? 0.5 : 0.05)) Exaggerate(random_, query);
        ++outcomes_[static_cast<std::size_t>(Call(*certifier, query, tube_))];
      }
    }
  }

  [[nodiscard]] std::string Summary() const {
    std::ostringstream text;
    text << called_ << " calls: " << outcomes_[1] << " certified, " << outcomes_[2] << " F, " << outcomes_[3] << " D, "
         << outcomes_[4] << " S; " << refused_ << " problems refused";
    return text.str();
  }
  [[nodiscard]] bool EveryOutcomeOccurred() const {
    return outcomes_[1] > 0 && outcomes_[2] > 0 && outcomes_[3] > 0 && outcomes_[4] > 0;
  }

 private:
  Random random_;
  Tube tube_;
  std::array<long, 5> outcomes_{};
  long called_ = 0, refused_ = 0;
};

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) {
  using namespace forereach;
  long count = 100000;
  std::uint64_t seed = 1;
  const Command program{
      .name = "forereach_soak",
      .purpose = "Certifies random plans of random problems and checks what every outcome promises.",
      .options = {{.name = "--count", .variable = &count, .help = "Certify calls", .range = NumberRange{1, 1e9}},
                  {.name = "--seed", .variable = &seed, .help = "Of the random numbers"}}};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  forereach::Soak soak(seed);
  try {
    soak.Run(count);
  } catch (const std::exception& error) {
    std::cerr << "broken promise: " << error.what() << "; after " << soak.Summary() << "; --seed " << seed << '\n';
    return 1;
  }
  std::cout << soak.Summary() << '\n';
  return count < 20000 || soak.EveryOutcomeOccurred() ? 0 : 1;
}
