/** A problem whose numbers are known by hand, and what the verifier says of certificates of it. */
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "certifier/dynamics/models/named_models.h"
#include "verifier/verifier.h"

namespace forereach::verifier {

inline constexpr double kTiny = std::numeric_limits<double>::denorm_min();

inline double Up(double x) { return std::nextafter(x, HUGE_VAL); }
inline double Down(double x) { return std::nextafter(x, -HUGE_VAL); }

// dt = 1/2, so that every number of a step is a double. The one observation is of the nominal model: its residual is
// known to a last bit of zero, the smallest double there is, in every coordinate.
inline std::shared_ptr<Problem> Halves() {
  auto problem = std::make_shared<Problem>();
  problem->model = MakePointMass(0.5);
  problem->domain.state = Box(Eigen::Vector4d::Constant(-8), Eigen::Vector4d::Constant(8));
  problem->domain.input = Box(Eigen::Vector2d(-2, -2), Eigen::Vector2d(2, 2));
  problem->declaration = {Eigen::MatrixXd::Zero(4, 6), Eigen::VectorXd::Zero(4)};
  problem->transitions = {Eigen::MatrixXd::Zero(1, 6), Eigen::MatrixXd::Zero(1, 4)};
  problem->projection = Eigen::MatrixXd::Identity(2, 4);
  return problem;
}

inline Verdict Judge(const std::shared_ptr<const Problem>& problem, const Certificate& certificate,
                     Method method = Method::kPaper) {
  return Verifier(problem, method).Verify(certificate);
}

inline void ExpectConfirmed(const Verdict& verdict) {
  EXPECT_EQ(verdict.status, Status::kConfirmed) << verdict.failure.what << ": " << verdict.failure.found;
}

inline void ExpectRefuted(const Verdict& verdict, int step, const std::string& what) {
  EXPECT_EQ(verdict.status, Status::kRefuted);
  EXPECT_EQ(verdict.failure.step, step);
  EXPECT_THAT(verdict.failure.what, testing::HasSubstr(what));
}

}  // namespace forereach::verifier
