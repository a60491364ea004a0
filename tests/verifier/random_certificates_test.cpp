// Certificates of random problems, of residuals with affine rows and with regions: what the certifier claims, the
// verifier derives by its own ways.
#include "tests/test.h"

#include "forereach/certify/tube.h"
#include "tests/oracle/affine_problems.h"
#include "tests/oracle/region_problems.h"
#include "tests/oracle/traced_random.h"
#include "tests/verifier/is_confirmed.h"
#include "tests/verifier/record.h"

namespace forereach::verifier::random_certificates_test {

// The certificate of the query's plan, if it is certified: an honest one.
std::optional<Certificate> ConfirmedCertificate(const std::shared_ptr<const Problem>& problem, const Verifier& judge,
                                                const Query& query, forereach::Tube& tube) {
  const Certifier certifier(problem);
  EXPECT_FALSE(certifier.violation());
  const Decision decision = certifier.Certify(query.plan(), query.initial_set, query.obstacles, tube);
  if (decision.outcome != Outcome::kCertified) return std::nullopt;
  const Certificate certificate = CertificateOf(certifier, query.plan(), query.initial_set, query.obstacles, tube);
  EXPECT_TRUE(IsConfirmed(judge.Verify(certificate)));
  return certificate;
}

TEST(AffineCertificates, AreConfirmedUnlessTheyAreTooNarrowOrTheDataAreOthers) {
  TracedRandom random(95), records(96), rests(97);
  int certified = 0, recorded = 0, changed = 0, steep = 0, with_rest = 0;
  for (int trial = 0; trial < 80; ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    const bool bicycle = random.Coin();
    const auto exact = AnyProblem(random, bicycle, random.Integer(6, 40));
    if (random.Coin()) Disturb(random, *exact);
    static_cast<void>(MakeAffine(random, *exact, rests.Coin() ? &rests : nullptr));
    if (random.Coin(0.3)) Shift(random, *exact);
    const auto problem = records.Coin(0.4) ? RecordedAffine(records, *exact) : exact;
    const Verifier judge(problem, MethodOf(*problem));
    forereach::Tube tube;
    const Query query = AnyQuery(random, *problem);
    const std::optional<Certificate> certificate = ConfirmedCertificate(problem, judge, query, tube);
    if (!certificate) continue;
    ++certified;
    recorded += problem->declaration.HasErrorInZ();
    with_rest += problem->declaration.affine.rest.size() > 0;
    Certificate narrower = *certificate;
    const int row = problem->declaration.affine.rows[0];
    RecordedSlice& last = narrower.slices.back();
    last.upper[row] -= 0.25 * (last.upper[row] - last.lower[row]);
    EXPECT_NE(judge.Verify(narrower).status, Status::kConfirmed);
    // Slopes of almost nothing, which data that are not tell from what is declared.
    const auto flat = std::make_shared<Problem>(*problem);
    for (int l = 0; l < problem->model->num_variables(); ++l)
      if (problem->declaration.affine.DependsOn(row, l)) flat->declaration.lipschitz(row, l) = 1e-6;
    const Verdict of_flat = Verifier(flat, MethodOf(*flat)).Verify(*certificate);
    steep += of_flat.failure.what.find("are at most what is declared") != std::string::npos;
    EXPECT_FALSE(Certifier(flat).violation() && of_flat.status == Status::kConfirmed);
    // Data by which the row's residual is another one, or none.
    const auto other = std::make_shared<Problem>(*problem);
    other->transitions.x_next.col(row).array() += 0.1;
    EXPECT_NE(Verifier(other, MethodOf(*other)).Verify(*certificate).status, Status::kConfirmed);
    other->transitions.x_next = problem->transitions.x_next;
    other->transitions.x_next(0, row) += 0.3;
    const Verdict of_other = Verifier(other, MethodOf(*other)).Verify(*certificate);
    // Errors or a rest may explain one step.
    EXPECT_TRUE(problem->declaration.HasErrorInZ() || problem->declaration.affine.rest.size() > 0 ||
                of_other.status != Status::kConfirmed);
    changed += of_other.failure.what.find("agrees with all data") != std::string::npos;
  }
  EXPECT_GT(certified, 15);
  EXPECT_GT(changed, 5);
  EXPECT_GT(recorded, 5);
  EXPECT_GT(steep, 5);
  EXPECT_GT(with_rest, 5);
}

TEST(RegionalCertificates, AreConfirmedUnlessTheyAreTooNarrowOrTheRegionsAreNotDeclared) {
  int certified = 0, need_regions = 0, falsified = 0;
  for (TracedRandom random(2121); random.Again(40);) {
    SCOPED_TRACE("trial " + std::to_string(random.trial()));
    const bool bicycle = random.Coin();
    const int transitions = random.Integer(2, 8);
    auto problem = AnyRegionalProblem(random, bicycle, transitions, random.Coin());
    if (random.Coin(0.3)) problem = Recorded(random, *problem);
    if (random.Coin(0.3)) Shift(random, *problem);
    const Verifier judge(problem, MethodOf(*problem));
    forereach::Tube tube;
    const Query query = AnyQuery(random, *problem);
    const std::optional<Certificate> certificate = ConfirmedCertificate(problem, judge, query, tube);
    if (!certificate) continue;
    ++certified;
    Certificate narrower = *certificate;
    RecordedSlice& last = narrower.slices.back();
    Eigen::Index widest = 0;
    (last.upper - last.lower).maxCoeff(&widest);
    last.upper[widest] -= 0.6 * (last.upper - last.lower)[widest];
    EXPECT_NE(judge.Verify(narrower).status, Status::kConfirmed);
    // By L alone the tube is wider.
    const auto plain = std::make_shared<Problem>(*problem);
    plain->declaration.regions = {};
    const Certifier wide(plain);
    forereach::Tube wider;
    static_cast<void>(wide.Certify(query.plan(), query.initial_set, {}, wider));
    const bool is_narrower =
        wider.length() < tube.length() || wider.half_width(tube.length())[0] > 1.01 * tube.half_width(tube.length())[0];
    if (!is_narrower) continue;
    ++need_regions;
    EXPECT_NE(Verifier(plain, MethodOf(*plain)).Verify(*certificate).status, Status::kConfirmed);
    // Data that contradict the regions and not L.
    const auto false_data = std::make_shared<Problem>(*problem);
    false_data->declaration.regions = {Region{{{0, {-1e3, 1e3}}}, 0 * problem->declaration.lipschitz}};
    const Verdict of_false = Verifier(false_data, MethodOf(*false_data)).Verify(*certificate);
    falsified += of_false.failure.what.find("consistent with data") != std::string::npos;
  }
  EXPECT_GT(certified, 15);
  EXPECT_GT(need_regions, 5);
  EXPECT_GT(falsified, 2);
}

}  // namespace forereach::verifier::random_certificates_test
