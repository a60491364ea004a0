// The guard's domain and the certifier's: no honest certificate is refused, however close to the domain's ends it
// comes.
#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "robot/guard.h"
#include "task/config.h"
#include "tests/paths.h"
#include "tests/worlds.h"

namespace forereach::guard_domain_test {

constexpr std::int64_t kNow = 1'700'000'000'000'000;

std::vector<double> Entries(const Eigen::VectorXd& bounds) { return {bounds.begin(), bounds.end()}; }

class RandomCandidates final {
 public:
  RandomCandidates(const Config& config, unsigned seed) : config_(config), random_(seed) {}

  candidate_plan_t Next() {
    const Domain& domain = config_.problem->domain;
    candidate_plan_t candidate{.utime = kNow,
                               .plan_id = ++plan_id_,
                               .start_utime = kNow + 1'000'000,
                               .step_us = 40'000,
                               .num_states = static_cast<std::int16_t>(domain.state.dim()),
                               .num_inputs = static_cast<std::int16_t>(domain.input.dim())};
    candidate.num_steps = candidate.progress_steps = static_cast<std::int16_t>(1 + random_() % 4);
    for (int k = 0; k < candidate.num_states; ++k) {
      const double lower = domain.state.lower()[k], upper = domain.state.upper()[k];
      const double half_width = Coin(3) ? 0 : (upper - lower) * 1e-3 * Unit();
      double center = (lower + upper) / 2 + (Unit() - 0.5) * 0.5 * (upper - lower);
      if (Coin(6)) center = Coin(2) ? upper - half_width : lower + half_width;
      if (Coin(12)) center = std::nextafter(center, Coin(2) ? 1e300 : -1e300);
      candidate.initial_center[k] = center;
      candidate.initial_half_width[k] = half_width;
    }
    for (int t = 0; t < candidate.num_steps; ++t)
      for (int i = 0; i < candidate.num_inputs; ++i) {
        const double lower = domain.input.lower()[i], upper = domain.input.upper()[i];
        const double middle = (lower + upper) / 2 + (Unit() - 0.5) * 0.1 * (upper - lower);
        candidate.control[t][i] = !Coin(4) ? middle : Coin(2) ? upper : lower;
      }
    return candidate;
  }

 private:
  double Unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  bool Coin(unsigned sides) { return random_() % sides == 0; }

  const Config& config_;
  std::mt19937 random_;
  std::int64_t plan_id_ = 0;
};

TEST(GuardDomainProperty, EveryHonestCertificatePasses) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  for (const char* path :
       {FOREREACH_SOURCE_DIR "/tests/data/field.yaml", FOREREACH_SOURCE_DIR "/config/point_mass.yaml"}) {
    Config config = LoadConfig(path);
    config.obstacles.clear();
    Problem& problem = Own(config.problem);
    problem.rest.clear();  // these short plans end at speed
    const Domain& domain = config.problem->domain;
    GuardOptions options{domain.state.dim(), domain.input.dim(), 40'000, config.grounds.config, config.grounds.model};
    options.domain = GuardDomain{Entries(domain.state.lower()), Entries(domain.state.upper()),
                                 Entries(domain.input.lower()), Entries(domain.input.upper())};
    Gate gate(config);
    Guard guard(options);
    RandomCandidates candidates(config, seed);
    int certified = 0, at_an_end = 0;
    for (int i = 0; i < 12'000; ++i) {
      const GateAnswer answer = gate.Decide(Encode(candidates.Next()), kNow);
      if (!answer.certified) continue;
      ++certified;
      for (int k = 0; k < domain.state.dim(); ++k)
        at_an_end += answer.certified->slice_upper[0][k] == domain.state.upper()[k];
      const GuardVerdict verdict = guard.Accept(Encode(*answer.certified), kNow);
      ASSERT_TRUE(verdict.ok()) << path << ": " << verdict.message;
    }
    EXPECT_GT(certified, 300) << path;
    EXPECT_GT(at_an_end, 10) << path << ": the ends were reached";
  }
}

}  // namespace forereach::guard_domain_test
