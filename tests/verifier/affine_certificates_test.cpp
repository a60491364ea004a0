// Certificates of residuals with affine rows: what the certifier claims, the verifier derives by its own programs.
#include "tests/test.h"

#include "tests/oracle/affine_problems.h"
#include "tests/oracle/traced_random.h"
#include "tests/verifier/is_confirmed.h"
#include "tests/verifier/record.h"

namespace forereach::verifier::affine_certificates_test {

TEST(AffineCertificates, AreConfirmedUnlessTheyAreTooNarrowOrTheDataAreOthers) {
  TracedRandom random(95), records(96);
  int certified = 0, recorded = 0, changed = 0, steep = 0;
  for (int trial = 0; trial < 80; ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    const bool bicycle = random.Coin();
    const auto exact = AnyProblem(random, bicycle, random.Integer(6, 40));
    if (random.Coin()) Disturb(random, *exact);
    static_cast<void>(MakeAffine(random, *exact));
    if (random.Coin(0.3)) Shift(random, *exact);
    const auto problem = records.Coin(0.4) ? RecordedAffine(records, *exact) : exact;
    const Certifier certifier(problem);
    ASSERT_FALSE(certifier.violation());
    const Verifier judge(problem, MethodOf(*problem));
    forereach::Tube tube;
    const Query query = AnyQuery(random, *problem);
    const Decision decision = certifier.Certify(query.plan(), query.initial_set, query.obstacles, tube);
    if (decision.outcome != Outcome::kCertified) continue;
    ++certified;
    recorded += problem->declaration.HasErrorInZ();
    const Certificate certificate = CertificateOf(certifier, query.plan(), query.initial_set, query.obstacles, tube);
    EXPECT_TRUE(IsConfirmed(judge.Verify(certificate)));
    Certificate narrower = certificate;
    const int row = problem->declaration.affine.rows[0];
    RecordedSlice& last = narrower.slices.back();
    last.upper[row] -= 0.25 * (last.upper[row] - last.lower[row]);
    EXPECT_NE(judge.Verify(narrower).status, Status::kConfirmed);
    // Slopes of almost nothing, which data that are not tell from what is declared.
    const auto flat = std::make_shared<Problem>(*problem);
    for (const int l : problem->declaration.affine.columns) flat->declaration.lipschitz(row, l) = 1e-6;
    const Verdict of_flat = Verifier(flat, MethodOf(*flat)).Verify(certificate);
    steep += of_flat.failure.what.find("are at most what is declared") != std::string::npos;
    EXPECT_FALSE(Certifier(flat).violation() && of_flat.status == Status::kConfirmed);
    // Data by which the row's residual is another one, or none.
    const auto other = std::make_shared<Problem>(*problem);
    other->transitions.x_next.col(row).array() += 0.1;
    EXPECT_NE(Verifier(other, MethodOf(*other)).Verify(certificate).status, Status::kConfirmed);
    other->transitions.x_next = problem->transitions.x_next;
    other->transitions.x_next(0, row) += 0.3;
    const Verdict of_other = Verifier(other, MethodOf(*other)).Verify(certificate);
    EXPECT_TRUE(problem->declaration.HasErrorInZ() || of_other.status != Status::kConfirmed);
    changed += of_other.failure.what.find("agrees with all data") != std::string::npos;
  }
  EXPECT_GT(certified, 15);
  EXPECT_GT(changed, 5);
  EXPECT_GT(recorded, 5);
  EXPECT_GT(steep, 5);
}

}  // namespace forereach::verifier::affine_certificates_test
