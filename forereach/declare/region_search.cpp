#include "forereach/declare/region_search.h"

#include <algorithm>
#include <map>

#include "forereach/numerics/size.h"

namespace forereach {
namespace {

using Cuts = std::vector<std::vector<double>>;  // along each axis, the ends of the domain included

class RegionSearch {
 public:
  RegionSearch(const ResidualSlopes& slopes, const Domain& domain, std::span<const Interval> parameters,
               const Eigen::MatrixXd& lipschitz, const std::vector<int>& variables, const RegionSearchOptions& options)
      : slopes_(slopes),
        domain_(domain),
        parameters_(parameters),
        lipschitz_(lipschitz),
        variables_(variables),
        options_(options) {
    const std::vector<Interval> ranges = domain.Ranges();
    for (const int l : variables) cuts_.push_back({ranges[ToSize(l)].lower, ranges[ToSize(l)].upper});
  }

  std::vector<Region> Run() {
    cuts_ = BestEven(cuts_, 0);
    const double enough = options_.least_gain * Mean(cuts_);
    // Each round moves the cuts that save least to where they save most.
    for (double mean = kInfinity; mean - Mean(cuts_) > enough;) {
      mean = Mean(cuts_);
      RemoveWhatSavesNothing();
      while (AddOne(enough)) continue;
    }
    return Regions();
  }

 private:
  static std::size_t Count(const Cuts& cuts) {
    std::size_t count = 1;
    for (const std::vector<double>& along : cuts) count *= along.size() - 1;
    return count;
  }

  // Strips of the same width along the axes from `axis` on, a power of two of them along each.
  Cuts BestEven(const Cuts& begin, std::size_t axis) {
    if (axis == begin.size()) return begin;
    Cuts best = BestEven(begin, axis + 1), cuts = begin;
    for (std::size_t strips = 2; Count(begin) * strips <= options_.most_cells; strips *= 2) {
      const double lower = begin[axis].front(), upper = begin[axis].back();
      cuts[axis] = begin[axis];
      for (std::size_t i = 1; i < strips; ++i) {
        const double share = static_cast<double>(i) / static_cast<double>(strips);
        cuts[axis].insert(cuts[axis].end() - 1, lower * (1 - share) + upper * share);
      }
      if (const Cuts trial = BestEven(cuts, axis + 1); Mean(trial) < Mean(best)) best = trial;
    }
    return best;
  }

  void RemoveWhatSavesNothing() {
    for (std::size_t a = 0; a < cuts_.size(); ++a)
      for (std::size_t i = 1; i + 1 < cuts_[a].size();) {
        Cuts cuts = cuts_;
        cuts[a].erase(cuts[a].begin() + static_cast<std::ptrdiff_t>(i));
        if (Mean(cuts) <= Mean(cuts_) * (1 + 1e-9))
          cuts_ = cuts;
        else
          ++i;
      }
  }

  // The cut in the middle of a strip that saves most for each cell that it adds, if it saves enough.
  bool AddOne(double enough) {
    const double mean = Mean(cuts_);
    Cuts best;
    double best_gain = 0;
    for (std::size_t a = 0; a < cuts_.size(); ++a)
      for (std::size_t i = 0; i + 1 < cuts_[a].size(); ++i) {
        Cuts cuts = cuts_;
        const double middle = cuts[a][i] / 2 + cuts[a][i + 1] / 2;
        if (!(cuts[a][i] < middle && middle < cuts[a][i + 1])) continue;
        cuts[a].insert(cuts[a].begin() + static_cast<std::ptrdiff_t>(i) + 1, middle);
        if (Count(cuts) > options_.most_cells) continue;
        const double saved = mean - Mean(cuts), gain = saved / static_cast<double>(Count(cuts) - Count(cuts_));
        if (saved > enough && gain > best_gain) best = cuts, best_gain = gain;
      }
    if (!best.empty()) cuts_ = best;
    return !best.empty();
  }

  static std::vector<Interval> CellAt(const Cuts& cuts, std::size_t index) {
    std::vector<Interval> cell;
    for (const std::vector<double>& along : cuts) {
      const std::size_t i = index % (along.size() - 1);
      cell.emplace_back(along[i], along[i + 1]);
      index /= along.size() - 1;
    }
    return cell;
  }

  [[nodiscard]] std::vector<Region::Side> SidesOf(const std::vector<Interval>& cell) const {
    std::vector<Region::Side> sides;
    for (std::size_t a = 0; a < cell.size(); ++a) sides.push_back({variables_[a], cell[a]});
    return sides;
  }

  // Bounds on all slopes over one cell, at most those of the whole domain.
  const Eigen::MatrixXd& SlopesOf(const std::vector<Interval>& cell) {
    std::vector<double> key;
    for (const Interval& range : cell) key.insert(key.end(), {range.lower, range.upper});
    const auto [at, is_new] = known_.try_emplace(key, lipschitz_);
    if (!is_new) return at->second;
    const std::optional<Domain> part = PartIn(domain_, {SidesOf(cell), {}});
    for (int k = 0; k < slopes_.num_states(); ++k)
      for (int l = 0; l < slopes_.num_variables(); ++l)
        if (double& slope = at->second(k, l); slope > 0)
          slope = std::min(slope, BoundSlope(slopes_, *part, parameters_, k, l, options_.slopes).upper);
    return at->second;
  }

  double Mean(const Cuts& cuts) {
    double sum = 0;
    for (std::size_t i = 0; i < Count(cuts); ++i) {
      const std::vector<Interval> cell = CellAt(cuts, i);
      const Eigen::MatrixXd& slopes = SlopesOf(cell);
      double volume = 1, relative = 0;
      for (std::size_t a = 0; a < cell.size(); ++a)
        volume *= (cell[a].upper - cell[a].lower) / (cuts[a].back() - cuts[a].front());
      for (Eigen::Index e = 0; e < slopes.size(); ++e)
        if (const double whole = lipschitz_.data()[e]; whole > 0) relative += slopes.data()[e] / whole;
      sum += volume * relative;
    }
    return sum;
  }

  std::vector<Region> Regions() {
    std::vector<Region> regions;
    for (std::size_t i = 0; i < Count(cuts_); ++i) {
      const std::vector<Interval> cell = CellAt(cuts_, i);
      Region region{SidesOf(cell), SlopesOf(cell)};
      if (i % (cuts_[0].size() - 1) > 0 && !regions.empty() && regions.back().lipschitz == region.lipschitz)
        regions.back().box[0].range.upper = cell[0].upper;
      else
        regions.push_back(std::move(region));
    }
    std::erase_if(regions, [&](const Region& region) { return region.lipschitz == lipschitz_; });
    return regions;
  }

  const ResidualSlopes& slopes_;
  const Domain& domain_;
  const std::span<const Interval> parameters_;
  const Eigen::MatrixXd& lipschitz_;
  const std::vector<int>& variables_;
  const RegionSearchOptions& options_;
  Cuts cuts_;
  std::map<std::vector<double>, Eigen::MatrixXd> known_;  // by the ends of the cell
};

}  // namespace

std::vector<Region> FindRegions(const ResidualSlopes& slopes, const Domain& domain,
                                std::span<const Interval> parameters, const Eigen::MatrixXd& lipschitz,
                                const std::vector<int>& variables, const RegionSearchOptions& options) {
  return variables.empty() ? std::vector<Region>()
                           : RegionSearch(slopes, domain, parameters, lipschitz, variables, options).Run();
}

std::optional<Domain> PartIn(const Domain& domain, const Region& region) {
  auto [lower, upper] = domain.Corners();
  for (const auto& [variable, range] : region.box) {
    const auto l = ToSize(variable);
    lower[l] = std::max(lower[l], range.lower);
    upper[l] = std::min(upper[l], range.upper);
    if (!(lower[l] <= upper[l])) return std::nullopt;
  }
  const int n = domain.state.dim(), m = domain.input.dim();
  Domain part = domain;
  part.state = Box(Eigen::VectorXd::Map(lower.data(), n), Eigen::VectorXd::Map(upper.data(), n));
  part.input = Box(Eigen::VectorXd::Map(lower.data() + n, m), Eigen::VectorXd::Map(upper.data() + n, m));
  return part;
}

}  // namespace forereach
