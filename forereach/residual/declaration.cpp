#include "forereach/residual/declaration.h"

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <string>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/residual/growing_disturbance.h"
#include "forereach/residual/region_grid.h"

namespace forereach {
namespace {

void RequireBound(const std::string& name, double value) {
  if (!(value >= 0 && value < kInfinity))
    throw std::invalid_argument(name + ": " + ToText(value) + " must be finite and not negative");
}

// A bound that may be left out.
void RequireBounds(const std::string& name, const Eigen::VectorXd& bounds, int size) {
  if (bounds.size() != 0 && bounds.size() != size)
    throw std::invalid_argument("declaration: " + name + " has " + std::to_string(bounds.size()) +
                                " entries, must have " + std::to_string(size) + " or none");
  for (Eigen::Index k = 0; k < bounds.size(); ++k) RequireBound(name + " " + std::to_string(k), bounds[k]);
}

void RequireAffine(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument("affine: " + what);
}

bool AreIndices(const std::vector<int>& all, int size) {
  return std::ranges::is_sorted(all, std::ranges::less_equal{}) &&
         (all.empty() || (all.front() >= 0 && all.back() < size));
}

void ValidateAffine(const Declaration& declaration) {
  const auto& [rows, columns, rest] = declaration.affine;
  RequireAffine(AreIndices(rows, static_cast<int>(declaration.lipschitz.rows())),
                "rows are states, each once, in their order");
  RequireAffine(AreIndices(columns, static_cast<int>(declaration.lipschitz.cols())),
                "columns are states and inputs, each once, in their order");
  RequireAffine(rows.empty() == columns.empty(), "rows and columns, or neither");
  RequireAffine(
      columns.size() <= AffineRows::kMaxColumns,
      std::to_string(columns.size()) + " columns, must be at most " + std::to_string(AffineRows::kMaxColumns));
  RequireAffine(
      rest.size() == 0 || (rest.rows() == declaration.lipschitz.rows() && rest.cols() == declaration.lipschitz.cols()),
      "rest has not the size of L");
  for (Eigen::Index k = 0; k < rest.rows(); ++k)
    for (Eigen::Index l = 0; l < rest.cols(); ++l) {
      RequireBound("affine: rest " + std::to_string(k) + ", " + std::to_string(l), rest(k, l));
      RequireAffine(rest(k, l) == 0 || declaration.affine.Contains(k),
                    "rest of row " + std::to_string(k) + ", which is not affine");
    }
  for (const int k : rows)
    for (Eigen::Index l = 0; l < declaration.lipschitz.cols(); ++l) {
      const std::string entry = "row " + std::to_string(k) + ", variable " + std::to_string(l) + ": ";
      const bool depends = declaration.affine.DependsOn(k, l);
      // It would bound a slope that is zero by declaration, and errors would count by it (soundness 3.19).
      RequireAffine(depends || declaration.lipschitz(k, l) == 0, entry + "bounded by lipschitz, and no column");
      RequireAffine(!depends || declaration.lipschitz(k, l) > 0 || declaration.VariableError(l) == 0,
                    entry + "recorded with an error, which counts by lipschitz: declare a bound on the slope there");
    }
}

void RequireRegion(bool holds, std::size_t i, const std::string& what) {
  if (!holds) throw std::invalid_argument("region " + std::to_string(i) + ": " + what);
}

void ValidateRegions(const Declaration& declaration) {
  const std::vector<Region>& regions = declaration.regions;
  const Eigen::MatrixXd& L = declaration.lipschitz;
  if (regions.size() > Region::kMaxRegions)
    throw std::invalid_argument("regions: " + std::to_string(regions.size()) + ", must be at most " +
                                std::to_string(Region::kMaxRegions));
  for (std::size_t i = 0; i < regions.size(); ++i) {
    std::vector<int> variables;
    for (const auto& [variable, range] : regions[i].box) {
      variables.push_back(variable);
      RequireRegion(range.lower < range.upper && range.IsFinite(), i,
                    ToText(range.lower) + " to " + ToText(range.upper) + " is no range");
    }
    RequireRegion(!variables.empty() && AreIndices(variables, static_cast<int>(L.cols())), i,
                  "its box is of states and inputs, at least one, each once, in their order");
    const Eigen::MatrixXd& slopes = regions[i].lipschitz;
    RequireRegion(slopes.rows() == L.rows() && slopes.cols() == L.cols(), i, "its lipschitz has not the size of L");
    RequireRegion((slopes.array() >= 0 && slopes.array() < kInfinity).all(), i,
                  "an entry of its lipschitz is negative or not finite");
    for (const auto& [bounds, name] :
         {std::pair(&regions[i].disturbance, "disturbance"), std::pair(&regions[i].noise_bound, "noise_bound"),
          std::pair(&regions[i].bound, "bound")})
      RequireRegion(bounds->size() == 0 || (bounds->size() == L.rows() && (bounds->array() >= 0).all()), i,
                    std::string("its ") + name + " has not an entry for each state, or one that is negative or NaN");
    // An affine row holds in the whole domain; nothing uses a bound of a part of it.
    for (const int k : declaration.affine.rows)
      RequireRegion(regions[i].bound.size() == 0 || regions[i].bound[k] == kInfinity, i,
                    "bounds row " + std::to_string(k) + ", which is affine");
  }
  const RegionGrid grid(declaration);
  if (grid.num_cells() > Region::kMaxCells || grid.variables().size() > Region::kMaxVariables)
    throw std::invalid_argument("regions: " + grid.SizeText() + ", must be at most " +
                                std::to_string(Region::kMaxVariables) + " variables and " +
                                std::to_string(Region::kMaxCells) + " cells");
}

}  // namespace

bool Region::Contains(std::span<const double> z) const {
  return std::ranges::all_of(box, [&](const Side& side) { return side.range.Contains(z[ToSize(side.variable)]); });
}

double Declaration::VariableError(Eigen::Index l) const {
  const Eigen::Index n = noise_bound.size();
  const Eigen::VectorXd& errors = l < n ? state_error : input_error;
  return errors.size() == 0 ? 0 : errors[l < n ? l : l - n];
}

std::vector<Interval> Declaration::BoxAround(std::span<const double> z) const {
  std::vector<Interval> box(z.begin(), z.end());
  for (std::size_t l = 0; l < box.size(); ++l)
    if (const double e = VariableError(static_cast<Eigen::Index>(l)); e != 0) box[l] += Interval(-e, e);
  return box;
}

bool Declaration::Grows(Eigen::Index k) const {
  return growing && growing->bounds()[ToSize(k)].text != GrowingDisturbance::kNone;
}

std::string Declaration::DisturbanceText(Eigen::Index k) const {
  const double constant = DisturbanceBound(k);
  if (!Grows(k)) return ToText(constant);
  const std::string& text = growing->bounds()[ToSize(k)].text;
  return constant == 0 ? text : ToText(constant) + " + abs(" + text + ")";
}

double Declaration::LeastOf(Eigen::VectorXd Region::*bound, Eigen::Index k, double everywhere) const {
  for (const Region& region : regions)
    if ((region.*bound).size() != 0) everywhere = std::min(everywhere, (region.*bound)[k]);
  return everywhere;
}

bool Declaration::AnyRegionHas(Eigen::VectorXd Region::*bound) const {
  return std::ranges::any_of(regions, [&](const Region& region) { return (region.*bound).size() != 0; });
}

double Declaration::ObservationError(Eigen::Index k) const {
  // The least anywhere counts for every observation. What one may be off by more, where it lies, widens its own
  // enclosure (observations.cpp), so that one number is enough here.
  return AddUp(LeastOf(&Region::noise_bound, k, noise_bound[k]), LeastOf(&Region::disturbance, k, DisturbanceBound(k)));
}

void Declaration::Validate(int num_states, int num_variables) const {
  if (lipschitz.rows() != num_states || lipschitz.cols() != num_variables || noise_bound.size() != num_states)
    throw std::invalid_argument("declaration: lipschitz is " + std::to_string(lipschitz.rows()) + "-by-" +
                                std::to_string(lipschitz.cols()) + " with " + std::to_string(noise_bound.size()) +
                                " noise bounds, must be " + std::to_string(num_states) + "-by-" +
                                std::to_string(num_variables) + " with " + std::to_string(num_states));
  for (Eigen::Index k = 0; k < lipschitz.rows(); ++k) {
    RequireBound("noise_bound " + std::to_string(k), noise_bound[k]);
    for (Eigen::Index l = 0; l < lipschitz.cols(); ++l)
      RequireBound("lipschitz " + std::to_string(k) + ", " + std::to_string(l), lipschitz(k, l));
  }
  ValidateDisturbance(num_states);
  RequireBounds("state_error", state_error, num_states);
  RequireBounds("input_error", input_error, num_variables - num_states);
  ValidateAffine(*this);
  ValidateRegions(*this);
}

void Declaration::ValidateDisturbance(int num_states) const { RequireBounds("disturbance", disturbance, num_states); }

}  // namespace forereach
