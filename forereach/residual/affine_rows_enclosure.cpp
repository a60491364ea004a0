#include "forereach/residual/affine_rows_enclosure.h"

#include <algorithm>
#include <array>

#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"

namespace forereach {
namespace {

std::span<const double> View(const Eigen::VectorXd& entries) { return {entries.data(), ToSize(entries.size())}; }

}  // namespace

AffineRowsEnclosure::AffineRowsEnclosure(const Declaration& declaration, const Observations& observations,
                                         std::span<const double> domain_lower, std::span<const double> domain_upper,
                                         const ResidualEnclosure& others)
    : declaration_(declaration), others_(others) {
  for (const int k : declaration_.affine.rows) {
    Eigen::VectorXd rest;
    if (declaration_.affine.rest.size() > 0) rest = declaration_.affine.rest.row(k);
    AffineSet& set = sets_.emplace_back(declaration_.affine.columns, domain_lower, domain_upper, View(rest));
    for (std::size_t j = 0; j < declaration_.affine.columns.size(); ++j)
      set.Declare(j, declaration_.lipschitz(k, declaration_.affine.columns[j]));
  }
  for (int i = 0; i < observations.size(); ++i) {
    const Eigen::VectorXd z = observations.z.row(i), lower = observations.lower.row(i),
                          upper = observations.upper.row(i);
    for (std::size_t s = 0; s < sets_.size(); ++s) {
      const Interval value = Observed(s, View(lower), View(upper));
      sets_[s].Add(i, View(z), value.lower, value.upper);
    }
  }
  for (std::size_t s = 0; s < sets_.size(); ++s) {
    sets_[s].Derive();
    TakeContradiction(s);
  }
}

Interval AffineRowsEnclosure::Observed(std::size_t i, std::span<const double> lower,
                                       std::span<const double> upper) const {
  const int k = declaration_.affine.rows[i];
  const double error = declaration_.ObservationError(k);
  return {SubDown(lower[ToSize(k)], error), AddUp(upper[ToSize(k)], error)};
}

void AffineRowsEnclosure::TakeContradiction(std::size_t i) {
  if (contradiction_ || !sets_[i].contradiction()) return;
  contradiction_ = sets_[i].contradiction();
  contradiction_->coordinate = declaration_.affine.rows[i];
}

void AffineRowsEnclosure::Add(int id, std::span<const double> z, std::span<const double> lower,
                              std::span<const double> upper) {
  for (std::size_t i = 0; i < sets_.size(); ++i) {
    const Interval value = Observed(i, lower, upper);
    sets_[i].Learn(id, z, value.lower, value.upper);
    TakeContradiction(i);
  }
}

const AffineSet& AffineRowsEnclosure::set(int k) const {
  const std::vector<int>& rows = declaration_.affine.rows;
  return sets_[ToSize(static_cast<int>(std::ranges::lower_bound(rows, k) - rows.begin()))];
}

void AffineRowsEnclosure::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  others_.Enclose(query, bounds);
  const auto n = ToSize(query.slice.dim());
  const std::vector<int>&rows = declaration_.affine.rows, &columns = declaration_.affine.columns;
  for (std::size_t k = 0; k < n && !bounds.has_slope; ++k) std::fill_n(bounds.slope[k].begin(), n, 0.0);
  bounds.has_slope = true;
  std::array<double, kMaxVariables> z;
  for (std::size_t l = 0; l < n; ++l) z[l] = query.slice.center(static_cast<int>(l));
  std::ranges::copy(query.input, z.begin() + std::ptrdiff_t(n));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto k = ToSize(rows[i]);
    const Interval middle = sets_[i].Enclose({z.data(), n + query.input.size()});
    double around = 0;
    for (std::size_t l = 0; l < n; ++l)
      around = AddUp(around, MulUp(declaration_.affine.Rest(rows[i], static_cast<int>(l)), query.half_width[l]));
    for (std::size_t j = 0; j < columns.size() && sets_[i].IsBounded(); ++j) {
      if (ToSize(columns[j]) >= n) continue;
      bounds.slope[k][ToSize(columns[j])] = sets_[i].slope(j);
      around = AddUp(around, MulUp(sets_[i].reach(j), query.half_width[ToSize(columns[j])]));
    }
    bounds.lower[k] = SubDown(middle.lower, around);
    bounds.upper[k] = AddUp(middle.upper, around);
  }
}

Declaration WithoutAffineRows(Declaration declaration) {
  for (const int k : declaration.affine.rows) declaration.lipschitz.row(k).setZero();
  declaration.affine = {};
  return declaration;
}

Observations WithoutAffineRows(const Declaration& declaration, Observations observations) {
  for (const int k : declaration.affine.rows) observations.lower.col(k).setZero(), observations.upper.col(k).setZero();
  return observations;
}

std::optional<AffineContradiction> FindAffineContradiction(const Declaration& declaration,
                                                           const Observations& observations,
                                                           std::span<const double> domain_lower,
                                                           std::span<const double> domain_upper) {
  if (declaration.affine.rows.empty() || observations.size() == 0) return std::nullopt;
  class Nothing final : public ResidualEnclosure {
    void Enclose(const QuerySet&, ResidualBounds&) const noexcept override {}
  } nothing;
  return AffineRowsEnclosure(declaration, observations, domain_lower, domain_upper, nothing).contradiction();
}

Violation AsViolation(const AffineContradiction& contradiction) {
  const std::vector<int>& rows = contradiction.rows;
  const int latest = std::ranges::max(rows);
  return {rows[0] == latest ? rows[1] : rows[0], latest, contradiction.coordinate, contradiction.gap,
          contradiction.most};
}

}  // namespace forereach
