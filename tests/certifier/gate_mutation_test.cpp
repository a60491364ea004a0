// Random mutations of valid candidates, and the same bytes twice.
#include <bit>

#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "forereach/certify/tube.h"
#include "lcmtypes/seal.h"
#include "tests/certifier/small_task.h"

namespace forereach::gate_mutation_test {

class Mutator {
 public:
  explicit Mutator(unsigned seed) : random_(seed) {}

  std::size_t Below(std::size_t bound) { return random_() % bound; }

  /** Flips that many bits of the first `within` bytes. */
  void Flip(std::vector<std::uint8_t>& bytes, std::size_t count, std::size_t within) {
    for (; count > 0; --count) bytes[Below(within)] ^= static_cast<std::uint8_t>(1u << Below(8));
  }

  /** A candidate that was valid before something happened to it; sometimes nothing did. */
  std::vector<std::uint8_t> Next(std::int64_t plan_id) {
    constexpr double kAccelerations[] = {kAccelerationThatCertifies, kAccelerationIntoTheCircle,
                                         kAccelerationOutsideDomain};
    candidate_plan_t candidate = Candidate(plan_id, kAccelerations[Below(8) < 6 ? 0 : Below(3)]);
    if (Below(3) == 0) MutateFields(candidate);
    std::vector<std::uint8_t> bytes = Encode(candidate);
    switch (Below(8)) {
      case 0: bytes.resize(Below(bytes.size() + 1)); break;
      case 1: bytes.resize(bytes.size() + 1 + Below(64)); break;
      case 2:
      case 3: Flip(bytes, 1 + Below(8), 350); break;  // in the head, up to the controls
      case 4: Flip(bytes, 1 + Below(8), bytes.size()); break;
      default: break;
    }
    return bytes;
  }

 private:
  double Number() {
    using Limits = std::numeric_limits<double>;
    constexpr double kSpecial[] = {0.0,
                                   -0.0,
                                   1.0,
                                   -1.0,
                                   2.999,
                                   3.5,
                                   5.0,
                                   1e10,
                                   1e150,
                                   1e-150,
                                   Limits::denorm_min(),
                                   Limits::min(),
                                   Limits::max(),
                                   -Limits::max(),
                                   Limits::infinity(),
                                   -Limits::infinity(),
                                   Limits::quiet_NaN()};
    if (Below(4) == 0) return std::bit_cast<double>(static_cast<std::uint64_t>(random_()) << 32 | random_());
    return kSpecial[Below(std::size(kSpecial))];
  }

  void MutateFields(candidate_plan_t& candidate) {
    for (std::size_t count = 1 + Below(3); count > 0; --count) {
      switch (Below(8)) {
        case 0: candidate.initial_center[Below(5)] = Number(); break;
        case 1: candidate.initial_half_width[Below(5)] = Number(); break;
        case 2: candidate.control[Below(12)][Below(3)] = Number(); break;
        case 3: candidate.num_steps = static_cast<std::int16_t>(Below(140)); break;
        case 4: candidate.progress_steps = static_cast<std::int16_t>(Below(20)) - 3; break;
        case 5: candidate.utime += static_cast<std::int64_t>(Below(2'000'000)) - 1'000'000; break;
        case 6: candidate.start_utime += static_cast<std::int64_t>(Below(4'000'000)) - 2'000'000; break;
        default: candidate.num_states = static_cast<std::int16_t>(Below(8)); break;
      }
    }
  }

  std::mt19937 random_;
};

Mutator Seeded() {
  const unsigned seed = std::random_device{}();
  std::cout << "seed " << seed << std::endl;
  testing::Test::RecordProperty("seed", std::to_string(seed));
  return Mutator(seed);
}

// The certifier asked directly, without the gate.
bool CertifiesDirectly(const Certifier& certifier, Bytes bytes, const std::vector<Obstacle>& obstacles, Tube& tube) {
  const auto candidate = Decoded<candidate_plan_t>(bytes);
  if (!candidate || candidate->num_states != 4 || candidate->num_inputs != 2) return false;
  const Eigen::Map<const Eigen::VectorXd> center(candidate->initial_center, 4),
      half_width(candidate->initial_half_width, 4);
  try {
    const Zonotope initial_set = Zonotope::FromBox(center, half_width);
    const Plan plan{candidate->control[0], 2, candidate->num_steps, 8};
    certifier.Require(plan, initial_set, obstacles);
    return certifier.Certify(plan, initial_set, obstacles, tube).outcome == Outcome::kCertified;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

// A flipped bit can make a plan_id or sequence so large that everything after it is a repetition, so gates are fresh
// every few messages.
constexpr int kBatch = 20;

TEST(GateMutationTest, EveryAnswerIsADecisionAndOnlyWhatIsCertifiableIsCertified) {
  const Config config = SmallTask();
  const Certifier certifier(config.problem);
  Tube tube;
  Mutator mutator = Seeded();
  std::array<int, decision_t::ABSTAIN_DEADLINE + 1> outcomes{};
  for (int batch = 0; batch < 400; ++batch) {
    Gate gate(config);
    for (int i = 0; i < kBatch; ++i) {
      SCOPED_TRACE("batch " + std::to_string(batch) + ", message " + std::to_string(i));
      const std::vector<std::uint8_t> bytes = mutator.Next(i);
      const GateAnswer answer = gate.Decide(bytes, kNow);
      const decision_t& decision = answer.decision;
      ASSERT_EQ(decision.sequence, i);
      ASSERT_TRUE(decision_t::CERTIFIED <= decision.outcome && decision.outcome <= decision_t::ABSTAIN_DEADLINE);
      ASSERT_NE(decision.cause, decision_t::CAUSE_INTERNAL_ERROR) << GetText(decision.message);
      ASSERT_EQ(GetDigest(decision.plan_digest), PlanDigest(Bytes(bytes)));
      const bool certified = decision.outcome == decision_t::CERTIFIED;
      ASSERT_EQ(decision.cause == decision_t::CAUSE_NONE, certified);
      ASSERT_EQ(answer.certified.has_value(), certified);
      if (decision.outcome != decision_t::REJECTED && decision.outcome != decision_t::ABSTAIN_DEADLINE)
        ASSERT_EQ(CertifiesDirectly(certifier, bytes, config.obstacles, tube), certified);
      if (certified) ASSERT_EQ(Encode(answer.certified->plan), bytes);
      ++outcomes[static_cast<std::size_t>(decision.outcome)];
    }
    ASSERT_EQ(gate.Status(kNow).candidates, kBatch);
  }
  for (const int outcome :
       {decision_t::CERTIFIED, decision_t::ABSTAIN_DOMAIN, decision_t::ABSTAIN_SAFETY, decision_t::REJECTED})
    EXPECT_GT(outcomes[static_cast<std::size_t>(outcome)], 100) << outcome;
}

TEST(GateMutationTest, ObstacleUpdatesApplyWholeOrNotAtAll) {
  const std::vector<Obstacle> obstacles = {
      Obstacle::Circle(Eigen::Vector2d(0.1, -2), 0.3),
      Obstacle::Polygon({Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0), Eigen::Vector2d(0.5, 2)})};
  const std::size_t head = EncodedSize<obstacles_t>() - 62 * (EncodedSize<obstacle_t>() - 8);  // up to the second
  Mutator mutator = Seeded();
  int applied = 0, refused = 0;
  for (int batch = 0; batch < 250; ++batch) {
    Gate gate(SmallTaskOnTheBus());
    for (int i = 0; i < kBatch; ++i) {
      SCOPED_TRACE("batch " + std::to_string(batch) + ", message " + std::to_string(i));
      obstacles_t message = Sighted(obstacles, kNow, i);
      std::vector<std::uint8_t> bytes = Encode(message);
      mutator.Flip(bytes, mutator.Below(4), head);
      const Digest before = GetDigest(gate.Status(kNow).obstacles_digest);
      const bool good = gate.UpdateObstacles(bytes, kNow).empty();
      const Digest after = GetDigest(gate.Status(kNow).obstacles_digest);
      ASSERT_EQ(after, ObstaclesDigest(gate.obstacles()));
      if (!good) ASSERT_EQ(after, before);
      ++(good ? applied : refused);
      const decision_t decision = gate.Decide(Encode(Candidate(i)), kNow).decision;
      ASSERT_NE(decision.cause, decision_t::CAUSE_INTERNAL_ERROR) << GetText(decision.message);
      ASSERT_EQ(GetDigest(decision.obstacles_digest), after);
    }
  }
  EXPECT_GT(applied, 100);
  EXPECT_GT(refused, 100);
}

TEST(GateReplayTest, TheSameBytesAndClockGiveTheSameAnswers) {
  Mutator mutator = Seeded();
  obstacles_t begin = ToMessage({}, kNow), moved = ToMessage({Obstacle::Circle(Eigen::Vector2d(1, 0), 0.1)}, kNow);
  moved.sequence = 1;
  int certified = 0;
  for (int batch = 0; batch < 100; ++batch) {
    Gate first(SmallTaskOnTheBus()), second(SmallTaskOnTheBus());
    for (Gate* gate : {&first, &second}) ASSERT_EQ(gate->UpdateObstacles(Encode(begin), kNow), "");
    for (int i = 0; i < kBatch; ++i) {
      SCOPED_TRACE("batch " + std::to_string(batch) + ", message " + std::to_string(i));
      const std::vector<std::uint8_t> bytes = mutator.Next(i);
      const std::int64_t now_us = kNow + static_cast<std::int64_t>(mutator.Below(500'000));
      const GateAnswer a = first.Decide(bytes, now_us), b = second.Decide(bytes, now_us);
      ASSERT_EQ(Encode(a.decision), Encode(b.decision));
      ASSERT_EQ(a.certified.has_value(), b.certified.has_value());
      if (a.certified) {
        ASSERT_EQ(Encode(*a.certified), Encode(*b.certified));
        ++certified;
      }
      if (i == kBatch / 2) {
        for (Gate* gate : {&first, &second}) ASSERT_EQ(gate->UpdateObstacles(Encode(moved), kNow), "");
      }
    }
    ASSERT_EQ(Encode(first.Status(kNow)), Encode(second.Status(kNow)));
  }
  EXPECT_GT(certified, 100);
}

}  // namespace forereach::gate_mutation_test
