#include "research/regional.h"

#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <vector>

#include <fmt/format.h>

#include "forereach/declare/region_search.h"
#include "forereach/dynamics/models/residuals.h"
#include "forereach/residual/lipschitz_envelope.h"
#include "forereach/residual/regional_enclosure.h"
#include "research/equations_slopes.h"
#include "research/group_sums.h"
#include "research/markdown.h"
#include "research/run_directory.h"

namespace forereach::research {
namespace {

constexpr SlopeBoundOptions kSlopes{.gap = 1e-2, .max_boxes = 20'000};

// L and regions for all parameters of the road within a share of the paper's.
struct DeclaredByRegion {
  Eigen::MatrixXd lipschitz;
  std::vector<Region> regions;
  double seconds = 0;
};

template <class Residual>
DeclaredByRegion Declare(const System& system, const Residual& residual, std::size_t first_of_road, double share,
                         const std::vector<int>& variables, std::size_t most_cells) {
  const auto begin = std::chrono::steady_clock::now();
  const EquationsSlopes<Residual> slopes;
  const RegionSearchOptions search{.most_cells = most_cells, .slopes = kSlopes};
  std::vector<Interval> parameters;
  for (const double p : residual.parameters()) {
    const double away = parameters.size() < first_of_road ? 0 : share * p;
    parameters.push_back({p - away, p + away});
  }
  DeclaredByRegion declared{Eigen::MatrixXd::Zero(system.deployed.rows(), system.deployed.cols())};
  for (int k = 0; k < slopes.num_states(); ++k)
    for (int l = 0; l < slopes.num_variables(); ++l)
      if (slopes.Occurs(k, l))
        declared.lipschitz(k, l) = BoundSlope(slopes, system.domain, parameters, k, l, kSlopes).upper;
  declared.regions = FindRegions(slopes, system.domain, parameters, declared.lipschitz, variables, search);
  declared.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return declared;
}

class RegionalByCells final : public ResidualEnclosure {
 public:
  RegionalByCells(const Setting& setting, Declaration declaration)
      : corners_(setting.domain.Corners()),
        observations_(Observe(setting.model, setting.data)),
        by_l_(declaration, observations_, corners_.first, corners_.second),
        regional_(declaration, observations_, corners_.first, corners_.second, by_l_) {}
  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override {
    regional_.Enclose(query, bounds);
  }

 private:
  std::pair<std::vector<double>, std::vector<double>> corners_;
  Observations observations_;
  LipschitzEnvelope by_l_;
  RegionalEnclosure regional_;
};

Method WithRegions(const DeclaredByRegion& declared) {
  return {"Regional", [&declared](const Setting& setting) {
            Declaration declaration = setting.declaration;
            declaration.regions = declared.regions;
            return std::make_unique<RegionalByCells>(setting, std::move(declaration));
          }};
}

}  // namespace

const System& PointMassInABox() {
  static const System system = [] {
    System in_a_box = PointMassSystem();
    in_a_box.domain.balls.clear();
    return in_a_box;
  }();
  return system;
}

void RunRegional(const RegionalStudyOptions& options, std::ostream& out) {
  const Effort effort = options.quick ? Effort{20, 24} : Effort{80, 70};
  const int seeds = options.quick ? 1 : 2;
  const std::vector<int> percents = options.quick ? std::vector{0} : std::vector{0, 5, 10, 20},
                         sizes = options.quick ? std::vector{25, 400} : std::vector{25, 50, 100, 400};
  std::vector<Cells> rows;
  std::string cells;
  for (const System* system : {&BicycleSystem(), &PointMassInABox()})
    for (const int percent : percents) {
      const bool is_bicycle = system->name == "bicycle";
      // The slopes of the point mass have seven parameters: some minutes a box.
      if (!is_bicycle && (options.quick || percent > 0)) continue;
      const double share = percent / 100.0;
      const DeclaredByRegion declared = is_bicycle ? Declare(*system, HeadingSaturation{0.1, 2.5}, 2, share, {3, 5}, 64)
                                                   : Declare(*system, VelocityKnee{0.15}, 1, share, {2, 3}, 16);
      cells += fmt::format("{}{}, {} %: {} regions in {:.1f} s", cells.empty() ? "" : "; ", system->name, percent,
                           declared.regions.size(), declared.seconds);
      for (const int observations : sizes) {
        const GroupSums flat =
                            SumOfSeeds(*system, Methods().front(), declared.lipschitz, observations, 0, seeds, effort),
                        regional = SumOfSeeds(*system, WithRegions(declared), declared.lipschitz, observations, 0,
                                              seeds, effort);
        Cells row{system->name, std::to_string(percent), std::to_string(observations)};
        for (const std::size_t g : {2, 1, 0}) row.push_back(flat.Recall(g) + " → " + regional.Recall(g));
        for (const std::size_t g : {2, 1, 0}) row.push_back(flat.HalfWidth(g) + " → " + regional.HalfWidth(g));
        row.push_back(fmt::format("{} + {}", flat.false_certificates + regional.false_certificates,
                                  flat.outside + regional.outside));
        row.push_back(fmt::format("{:.1f}", regional.build_us / 1e3));
        row.push_back(fmt::format("{:.1f} → {:.1f}", flat.call_us, regional.call_us));
        std::cerr << fmt::format("{}\n", fmt::join(row, " | "));
        rows.push_back(std::move(row));
      }
    }
  const std::string report =
      "# A bound for each region\n\n`" + options.command + "`. " +
      fmt::format("{} seeds, {} plans a group, {} rollouts a plan, noiseless. ", seeds, effort.scenarios,
                  effort.rollouts) +
      "One certified L → regions with certified slopes. Parameters of the road within so many per cent. "
      "Half-width: half the side of a square as large as the last slice, m, mean of the complete tubes. False: false "
      "certificates, and tubes that a rollout leaves, of both. Build: of the regions' enclosure. Call: median of the "
      "plans of C, of 12 steps. " +
      cells + ".\n\n" +
      Markdown({"system", "±%", "N", "recall C", "B", "A", "half-width C", "B", "A", "false", "build, ms", "call, µs"},
               rows);
  std::filesystem::create_directories(options.directory);
  WriteFile(options.directory / "regional.md", report);
  out << report << std::flush;
}

}  // namespace forereach::research
