#include "research/affine_study.h"

#include <algorithm>
#include <iostream>
#include <memory>
#include <vector>

#include <fmt/format.h>

#include "forereach/declare/slope_bound.h"
#include "forereach/dynamics/models/residuals.h"
#include "forereach/numerics/directed.h"
#include "forereach/residual/affine_rows_enclosure.h"
#include "forereach/residual/lipschitz_envelope.h"
#include "research/equations_slopes.h"
#include "research/group_sums.h"
#include "research/markdown.h"
#include "research/methods/samples.h"
#include "research/regional.h"
#include "research/run_directory.h"
#include "research/variants.h"

namespace forereach::research {
namespace {

constexpr SlopeBoundOptions kSlopes{.gap = 1e-2, .max_boxes = 20'000};

// The slopes of a residual plus those of a plane.
class SlopesOnPlane final : public ResidualSlopes {
 public:
  SlopesOnPlane(const ResidualSlopes& slopes, double plane)
      : ResidualSlopes(slopes.num_states(), slopes.num_variables(), slopes.num_arguments() - slopes.num_variables()),
        slopes_(slopes),
        plane_(plane) {}
  [[nodiscard]] bool Occurs(int row, int argument) const override { return slopes_.Occurs(row, argument); }
  [[nodiscard]] Jet Enclose(int row, int column, std::span<const Interval> w,
                            std::span<const int> active) const override {
    Jet jet = slopes_.Enclose(row, column, w, active);
    jet.slope = jet.slope + Interval(plane_);
    return jet;
  }

 private:
  const ResidualSlopes& slopes_;
  double plane_;
};

struct DeclaredAffine {
  Eigen::MatrixXd lipschitz, rest;  // certified
};

// With slopes in [a, b], |slope| <= L: what L more and L less of them are at most is L + b and L - a, and half of b - a
// bounds the slopes of what the best plane leaves.
template <class Residual>
DeclaredAffine Declare(const System& system, const Residual& residual) {
  const EquationsSlopes<Residual> slopes;
  std::vector<Interval> parameters;
  for (const double p : residual.parameters()) parameters.emplace_back(p);
  DeclaredAffine declared{Eigen::MatrixXd::Zero(system.deployed.rows(), system.deployed.cols()), {}};
  declared.rest = declared.lipschitz;
  const auto largest = [&](const ResidualSlopes& of, int k, int l) {
    return BoundSlope(of, system.domain, parameters, k, l, kSlopes).upper;
  };
  for (int k = 0; k < slopes.num_states(); ++k)
    for (int l = 0; l < slopes.num_variables(); ++l) {
      if (!slopes.Occurs(k, l)) continue;
      const double most = declared.lipschitz(k, l) = largest(slopes, k, l);
      const double range = SubUp(
          AddUp(largest(SlopesOnPlane(slopes, most), k, l), largest(SlopesOnPlane(slopes, -most), k, l)), 2 * most);
      declared.rest(k, l) = std::min(most, range / 2);
    }
  return declared;
}

// Rows that L names, affine in the coordinates that it names.
Declaration AffineOf(const Declaration& declared, const Eigen::MatrixXd& rest) {
  Declaration declaration = declared;
  for (int k = 0; k < declared.lipschitz.rows(); ++k)
    if (!declared.lipschitz.row(k).isZero(0)) declaration.affine.rows.push_back(k);
  declaration.affine.columns = ActiveCoordinates(declared);
  declaration.affine.rest = rest;
  declaration.lipschitz.setZero();
  return declaration;
}

// Without slopes of its own: a row that no (M, b) explains has no value.
class AffineRowsOfData final : public ResidualEnclosure {
 public:
  AffineRowsOfData(const Setting& setting, const Declaration& declaration)
      : corners_(setting.domain.Corners()),
        observations_(Observe(setting.model, setting.data)),
        others_(WithoutAffineRows(declaration), WithoutAffineRows(declaration, observations_), corners_.first,
                corners_.second),
        rows_(declaration, observations_, corners_.first, corners_.second, others_) {}
  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override {
    rows_.Enclose(query, bounds);
    if (const auto& found = rows_.contradiction())
      bounds.lower[ToSize(found->coordinate)] = kInfinity, bounds.upper[ToSize(found->coordinate)] = -kInfinity;
  }

 private:
  std::pair<std::vector<double>, std::vector<double>> corners_;
  Observations observations_;
  LipschitzEnvelope others_;
  AffineRowsEnclosure rows_;
};

Method WithAffineRows(const Eigen::MatrixXd& rest) {
  return {"Affine rows", [rest](const Setting& setting) {
            return std::make_unique<AffineRowsOfData>(setting, AffineOf(setting.declaration, rest));
          }};
}

// How many observations, in their order, refute that rows are affine; "-": all of them do not.
std::string RefutedAfter(const System& system, const Declaration& declaration, int observations, double noise,
                         int seed) {
  const Observations seen = Observe(*system.model, MakeData(system, Layout::kCorridor, seed, observations, noise));
  const auto [lower, upper] = system.domain.Corners();
  const auto view = [](const Eigen::VectorXd& entries) {
    return std::span<const double>(entries.data(), ToSize(entries.size()));
  };
  const LipschitzEnvelope nothing(WithoutAffineRows(declaration), WithoutAffineRows(declaration, seen), lower, upper);
  AffineRowsEnclosure rows(declaration, {seen.z.topRows(1), seen.lower.topRows(1), seen.upper.topRows(1)}, lower, upper,
                           nothing);
  for (int i = 1; i < observations; ++i) {
    const Eigen::VectorXd z = seen.z.row(i), low = seen.lower.row(i), high = seen.upper.row(i);
    rows.Add(i, view(z), view(low), view(high));
    if (rows.contradiction()) return std::to_string(i + 1);
  }
  return "-";
}

struct Studied {
  const System* system;
  DeclaredAffine declared;
  double noise;  // s; without any, rollouts in doubles leave tubes that are as exact as their rounding
  std::vector<int> sizes;
};

std::vector<Studied> StudiedSystems() {
  const System& linear = LinearPointMass();
  return {{&BicycleSystem(), Declare(BicycleSystem(), HeadingSaturation{0.1, 2.5}), 0, {25, 100, 400}},
          {&PointMassInABox(), Declare(PointMassInABox(), VelocityKnee{0.15}), 0, {25, 100, 400}},
          {&linear, {linear.deployed, {}}, linear.noise_scale, {5, 10, 25, 100}}};
}

}  // namespace

void RunAffine(const AffineStudyOptions& options, std::ostream& out) {
  const Effort effort = options.quick ? Effort{20, 24} : Effort{80, 70};
  const int seeds = options.quick ? 1 : 2;
  std::vector<Cells> rows;
  for (Studied& studied : StudiedSystems()) {
    const System& system = *studied.system;
    const auto& [lipschitz, rest] = studied.declared;
    const Declaration declared{lipschitz, Eigen::VectorXd::Constant(system.num_states(), NoiseBound(studied.noise))};
    if (options.quick) studied.sizes.resize(1);
    for (const int observations : studied.sizes) {
      const auto add = [&](const std::string& name, const Method& method, const std::string& refuted) {
        const GroupSums sums = SumOfSeeds(system, method, lipschitz, observations, studied.noise, seeds, effort);
        Cells row{system.name, std::to_string(observations), name, refuted};
        for (const std::size_t g : {2, 1, 0}) row.push_back(sums.Recall(g));
        for (const std::size_t g : {2, 1, 0}) row.push_back(sums.HalfWidth(g));
        row.push_back(fmt::format("{} + {}", sums.false_certificates, sums.outside));
        row.push_back(fmt::format("{:.1f}", sums.build_us / 1e3));
        row.push_back(fmt::format("{:.1f}", sums.call_us));
        std::cerr << fmt::format("{}\n", fmt::join(row, " | "));
        rows.push_back(std::move(row));
      };
      const auto refuted = [&](const Eigen::MatrixXd& of_rest) {
        std::string all;
        for (int seed = 0; seed < seeds; ++seed)
          all += (seed > 0 ? ", " : "") +
                 RefutedAfter(system, AffineOf(declared, of_rest), observations, studied.noise, seed);
        return all;
      };
      add("L", Methods().front(), "-");
      add("affine", WithAffineRows({}), refuted({}));
      if (rest.size() > 0) add("affine, rest", WithAffineRows(rest), refuted(rest));
    }
  }
  const std::string report =
      "# Affine rows\n\n`" + options.command + "`. " +
      fmt::format(
          "{} seeds, {} plans a group, {} rollouts a plan; noiseless, but the linear point mass, with the paper's "
          "noise. ",
          seeds, effort.scenarios, effort.rollouts) +
      "L: certified slopes. Affine: the rows that L names, in the columns that it names; with a rest, of certified "
      "slopes. Refuted: after so many of the observations of each seed. Half-width: half the side of a square as large "
      "as the last slice, m, mean of the complete tubes. False: false certificates, and tubes that a rollout leaves. "
      "Build: of the enclosure. Call: median of the plans of C.\n\n" +
      Markdown({"system", "N", "declared", "refuted", "recall C", "B", "A", "half-width C", "B", "A", "false",
                "build, ms", "call, µs"},
               rows);
  std::filesystem::create_directories(options.directory);
  WriteFile(options.directory / "affine.md", report);
  out << report << std::flush;
}

}  // namespace forereach::research
