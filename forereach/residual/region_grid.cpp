#include "forereach/residual/region_grid.h"

#include <algorithm>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

using Slopes = std::vector<double>;

void SortUnique(auto& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

}  // namespace

RegionGrid::RegionGrid(const Declaration& declaration, std::span<const double> domain_lower,
                       std::span<const double> domain_upper) {
  const std::vector<Region>& regions = declaration.regions;
  for (const Region& region : regions)
    for (const Region::Side& side : region.box) variables_.push_back(side.variable);
  SortUnique(variables_);
  std::vector<std::vector<double>> cuts(variables_.size());
  const auto axis_of = [&](int variable) {
    return ToSize(std::ranges::lower_bound(variables_, variable) - variables_.begin());
  };
  const auto ends_of = [&](std::size_t a) {
    const auto l = ToSize(variables_[a]);
    return domain_lower.empty() ? Interval::Entire() : Interval(domain_lower[l], domain_upper[l]);
  };
  for (const Region& region : regions)
    for (const auto& [variable, range] : region.box) {
      const std::size_t a = axis_of(variable);
      for (const double cut : {range.lower, range.upper})
        // Sides beyond the domain divide nothing: there no slope is asked for.
        if (ends_of(a).lower < cut && cut < ends_of(a).upper) cuts[a].push_back(cut);
    }
  std::string product;
  for (std::vector<double>& along : cuts) {
    SortUnique(along);
    num_cells_ *= along.size() + 1;
    product += (product.empty() ? "" : " x ") + std::to_string(along.size() + 1);
    if (num_cells_ > 100 * Region::kMaxCells) num_cells_ = 100 * Region::kMaxCells;  // of many variables
  }
  size_text_ =
      std::to_string(variables_.size()) + " variables and " + product + " = " + std::to_string(num_cells_) + " cells";
  num_axes_ = variables_.size();
  if (num_axes_ > kMaxAxes || num_cells_ > Region::kMaxCells) return;  // Validate refuses it

  std::vector<std::vector<std::size_t>> strips(num_cells_);  // of each cell, along each axis
  for (std::size_t a = 0, stride = 1; a < num_axes_; stride *= cuts_[a].size() + 1, ++a) {
    cuts_[a] = std::move(cuts[a]);
    stride_[a] = stride;
    for (std::size_t cell = 0; cell < num_cells_; ++cell) strips[cell].push_back(cell / stride % (cuts_[a].size() + 1));
  }
  const auto lies_in = [&](std::size_t cell, const Region& region) {
    return std::ranges::all_of(region.box, [&](const Region::Side& side) {
      const std::size_t a = axis_of(side.variable), strip = strips[cell][a];
      const double lower = strip == 0 ? ends_of(a).lower : cuts_[a][strip - 1],
                   upper = strip == cuts_[a].size() ? ends_of(a).upper : cuts_[a][strip];
      // All of the cell: a region's slopes hold between two points of its box only (soundness 3.20).
      return side.range.lower <= lower && upper <= side.range.upper;
    });
  };
  std::vector<std::vector<const Region*>> around(num_cells_);
  for (std::size_t cell = 0; cell < num_cells_; ++cell)
    for (const Region& region : regions)
      if (lies_in(cell, region)) around[cell].push_back(&region);
  for (Eigen::Index k = 0; k < declaration.lipschitz.rows(); ++k) {
    const double sigma = declaration.noise_bound.size() == 0 ? 0 : declaration.noise_bound[k];
    std::size_t which = 0;
    for (const auto& [of, everywhere] :
         {std::pair(&Region::disturbance, declaration.DisturbanceBound(k)), std::pair(&Region::noise_bound, sigma),
          std::pair(&Region::bound, kInfinity)}) {
      auto& [by_state, in_cells] = bounds_[which++];
      by_state.push_back(everywhere);
      if (!declaration.AnyRegionHas(of)) continue;
      for (const std::vector<const Region*>& cell : around) {
        double bound = everywhere;
        for (const Region* region : cell)
          if ((region->*of).size() != 0) bound = std::min(bound, (region->*of)[k]);
        in_cells.push_back(bound);
      }
    }
  }
  std::vector<Eigen::MatrixXd> least(num_cells_, declaration.lipschitz);
  for (std::size_t cell = 0; cell < num_cells_; ++cell)
    for (const Region* region : around[cell]) least[cell] = least[cell].cwiseMin(region->lipschitz);
  for (Eigen::Index k = 0; k < declaration.lipschitz.rows(); ++k) {
    const auto is_less = [&](const Eigen::MatrixXd& of) { return of.row(k) != declaration.lipschitz.row(k); };
    if (!std::ranges::any_of(least, is_less)) continue;
    rows_.push_back(static_cast<int>(k));
    Row& row = slopes_.emplace_back();
    for (Eigen::Index l = 0; l < declaration.lipschitz.cols(); ++l) {
      Column column{static_cast<int>(l)};
      for (const Eigen::MatrixXd& of : least) column.slopes.push_back(of(k, l));
      const std::size_t a = axis_of(column.variable);
      if (a < num_axes_ && variables_[a] == column.variable)
        row.axes[a] = std::move(column);
      else if (std::ranges::max(column.slopes) > 0)
        row.others.push_back(std::move(column));
    }
  }
}

std::string RegionGrid::SizeText() const { return size_text_; }

void RegionGrid::Find(Box& box) const noexcept {
  for (std::size_t a = 0; a < num_axes_; ++a) {
    const auto l = ToSize(variables_[a]);
    const Slopes& cuts = cuts_[a];
    const auto first = std::upper_bound(cuts.begin(), cuts.end(), box.lower[l]) - cuts.begin(),
               last = std::lower_bound(cuts.begin(), cuts.end(), box.upper[l]) - cuts.begin();
    box.place.last[a] = static_cast<std::uint16_t>(last);
    box.place.first[a] = static_cast<std::uint16_t>(std::min(first, last));
    box.place.on_cut[a] = first > last;
  }
}

double RegionGrid::LargestBound(RegionBound which, std::size_t k, const Box& box) const noexcept {
  const auto& [everywhere, in_cells] = bounds_[static_cast<std::size_t>(which)];
  if (in_cells.empty()) return everywhere.empty() ? kInfinity : everywhere[k];  // of more cells than are allowed
  std::array<std::size_t, kMaxAxes> first{}, last{};
  for (std::size_t a = 0; a < num_axes_; ++a) {
    const auto l = ToSize(variables_[a]);
    const Slopes& cuts = cuts_[a];
    // A side counts for both cells, the other way round than in Find: a bound on what is at z may be of either, and the
    // larger is the safe one. NaN gets all cells.
    first[a] = ToSize(std::lower_bound(cuts.begin(), cuts.end(), box.lower[l]) - cuts.begin());
    last[a] = ToSize(std::upper_bound(cuts.begin(), cuts.end(), box.upper[l]) - cuts.begin());
  }
  double largest = 0;
  for (std::size_t i = first[0]; i <= last[0]; ++i)
    for (std::size_t j = first[1]; j <= last[1]; ++j)
      for (std::size_t m = first[2]; m <= last[2]; ++m)
        largest = std::max(largest, in_cells[k * num_cells_ + i * stride_[0] + j * stride_[1] + m * stride_[2]]);
  return largest;
}

// On a cut both strips hold: the lesser slope counts.
double RegionGrid::LargestSlope(const std::vector<double>& slopes, const Place& place) const noexcept {
  const auto &first = place.first, &last = place.last;
  const std::array<bool, kMaxAxes>& on_cut = place.on_cut;
  const auto least = [&](std::size_t cell) {
    double slope = slopes[cell];
    for (std::size_t next = 1; next < std::size_t{1} << kMaxAxes; ++next) {
      std::size_t neighbour = cell;
      bool is_near = true;
      for (std::size_t a = 0; a < kMaxAxes; ++a)
        if (next >> a & 1) neighbour += stride_[a], is_near &= on_cut[a];
      if (is_near) slope = std::min(slope, slopes[neighbour]);
    }
    return slope;
  };
  const bool is_cut = on_cut[0] || on_cut[1] || on_cut[2];
  double largest = 0;
  for (std::size_t i = first[0]; i <= last[0]; ++i)
    for (std::size_t j = first[1]; j <= last[1]; ++j)
      for (std::size_t k = first[2]; k <= last[2]; ++k) {
        const std::size_t cell = i * stride_[0] + j * stride_[1] + k * stride_[2];
        largest = std::max(largest, is_cut ? least(cell) : slopes[cell]);
      }
  return largest;
}

// From `from` in `strip` up to `to`, or, where to < from, down; the other axes at `at`.
double RegionGrid::Ascent(const Row& row, std::size_t a, Place at, std::size_t strip, double from,
                          double to) const noexcept {
  const std::vector<double>& cuts = cuts_[a];
  const bool up = from < to;
  at.on_cut[a] = false;
  double cost = 0;
  for (bool is_last = false; !is_last; strip = up ? strip + 1 : strip - 1) {
    is_last = up ? strip == cuts.size() || to <= cuts[strip] : strip == 0 || cuts[strip - 1] <= to;
    const double end = is_last ? to : cuts[up ? strip : strip - 1];
    at.first[a] = at.last[a] = static_cast<std::uint16_t>(strip);
    // A longer way is sound, a shorter one is not: upward throughout.
    cost = AddUp(cost, MulUp(LargestSlope(row.axes[a].slopes, at), up ? SubUp(end, from) : SubUp(from, end)));
    from = end;
  }
  return cost;
}

double RegionGrid::AlongAxis(const Row& row, std::size_t a, const Place& across, const Box& from,
                             const Box& to) const noexcept {
  const auto l = ToSize(variables_[a]);
  const double begin = from.lower[l];
  double cost = 0;  // the nearer of two ends on one side costs no more
  if (begin < to.upper[l]) cost = Ascent(row, a, across, from.place.first[a], begin, to.upper[l]);
  if (to.lower[l] < begin) cost = std::max(cost, Ascent(row, a, across, from.place.first[a], begin, to.lower[l]));
  return cost;
}

double RegionGrid::OfOthers(const Row& row, const Place& at, const Box& from, const Box& to) const noexcept {
  double cost = 0;
  for (const Column& column : row.others) {
    const auto l = ToSize(column.variable);
    const double away = std::max(SubUp(to.upper[l], from.lower[l]), SubUp(from.lower[l], to.lower[l]));
    cost = AddUp(cost, MulUp(LargestSlope(column.slopes, at), away));
  }
  return cost;
}

// The least cost of every set of moves that come first.
double RegionGrid::CostUpper(std::size_t index, const Box& from, const Box& to, double enough) const noexcept {
  const Row& row = slopes_[index];
  const std::size_t moves = num_axes_ + (row.others.empty() ? 0 : 1), all = std::size_t{1} << moves;
  std::array<double, std::size_t{2} << kMaxAxes> least;
  least.fill(kInfinity);
  least[0] = 0;
  for (std::size_t moved = 0; moved + 1 < all; ++moved) {
    // A cost that is not below `enough` narrows nothing, so what it leads to need not be known.
    if (!(least[moved] < enough)) continue;
    Place at = from.place;
    for (std::size_t a = 0; a < num_axes_; ++a)
      if (moved >> a & 1)
        at.first[a] = to.place.first[a], at.last[a] = to.place.last[a], at.on_cut[a] = to.place.on_cut[a];
    for (std::size_t move = 0; move < moves; ++move) {
      if (moved >> move & 1) continue;
      const double cost = move < num_axes_ ? AlongAxis(row, move, at, from, to) : OfOthers(row, at, from, to);
      double& next = least[moved | std::size_t{1} << move];
      next = std::min(next, AddUp(least[moved], cost));
    }
  }
  return least[all - 1];
}

}  // namespace forereach
