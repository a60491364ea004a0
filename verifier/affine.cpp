#include "verifier/affine.h"

#include <algorithm>
#include <cmath>

#include "forereach/numerics/size.h"

namespace forereach::verifier {
namespace {

constexpr int kMostPivots = 2000;
// What doubles cannot tell apart, of the numbers that they add up.
constexpr double kDoubt = 0x1p-40;
// Rounding of slopes; what is nearer to a tie may have been rounded the other way in doubles.
constexpr int kSlopeBits = 16;
constexpr double kTie = 0x1p-20;
// A column of the locations is taken to lie in the span of the others from this share of it on.
constexpr double kFlatShare = 1e-9;

// x with A x = b by elimination with row interchanges. Not finite where a pivot may be zero.
std::vector<Real> SolveLinear(std::vector<std::vector<Real>> a, std::vector<Real> b) {
  const std::size_t n = b.size();
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t best = c;
    double most = -1;
    for (std::size_t i = c; i < n; ++i)
      if (const double size = std::abs(a[i][c].ToDouble()); size > most) most = size, best = i;
    std::swap(a[c], a[best]);
    std::swap(b[c], b[best]);
    for (std::size_t i = c + 1; i < n; ++i) {
      if (a[i][c].IsZero()) continue;
      const Real factor = a[i][c] / a[c][c];
      for (std::size_t j = c + 1; j < n; ++j) a[i][j] -= factor * a[c][j];
      b[i] -= factor * b[c];
    }
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t j = i + 1; j < n; ++j) b[i] -= a[i][j] * b[j];
    b[i] = b[i] / a[i][i];
  }
  return b;
}

bool AllFinite(const std::vector<Real>& numbers) {
  return std::ranges::all_of(numbers, [](const Real& number) { return number.IsFinite(); });
}

}  // namespace

AffineRow::AffineRow(const Eigen::MatrixXd& z, const std::vector<Real>& lower, const std::vector<Real>& upper,
                     const std::vector<Real>& sizes, AffineRest rest)
    : rows_(z.rows(), z.cols() + 1), rest_(std::move(rest)) {
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < z.rows(); ++i) {
    const auto at = ToSize(static_cast<int>(i));
    if (!lower[at].IsFinite() || !upper[at].IsFinite()) continue;
    rows_.row(kept) << z.row(i), 1;
    if (!rest_.slopes.empty()) rest_.z.row(kept) = rest_.z.row(i).eval();
    ++kept;
    given_lower_.push_back(lower[at].lower());
    given_upper_.push_back(upper[at].upper());
    sizes_.push_back(sizes[at]);
  }
  rows_.conservativeResize(kept, Eigen::NoChange);
  LookFrom(rest_.middle);
  if (FindBasis()) DeriveSlopes();
}

void AffineRow::LookFrom(const std::vector<Real>& place) {
  if (rest_.slopes.empty() && !lower_.empty()) return;
  lower_.clear(), upper_.clear(), rough_lower_.clear(), rough_upper_.clear();
  for (std::size_t i = 0; i < given_lower_.size(); ++i) {
    Real apart;
    for (std::size_t l = 0; l < rest_.slopes.size(); ++l)
      apart +=
          rest_.slopes[l] * abs(Real(rest_.z(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(l))) - place[l]);
    lower_.push_back((given_lower_[i] - apart).lower());
    upper_.push_back((given_upper_[i] + apart).upper());
    rough_lower_.push_back(lower_.back().ToDouble());
    rough_upper_.push_back(upper_.back().ToDouble());
  }
}

// Elimination of whole columns: of the rows that are left, the one with the largest entry in any column is next.
bool AffineRow::FindBasis() {
  Eigen::MatrixXd left = rows_;
  for (Eigen::Index l = 0; l + 1 < left.cols() && left.rows() > 0; ++l) {
    left.col(l).array() -= (left.col(l).maxCoeff() + left.col(l).minCoeff()) / 2;
    if (const double size = left.col(l).cwiseAbs().maxCoeff(); size > 0) left.col(l) /= size;
  }
  std::vector<bool> done(ToSize(static_cast<int>(left.cols())));
  for (Eigen::Index step = 0; step < left.cols(); ++step) {
    Eigen::Index row = -1, column = -1;
    double most = kFlatShare;
    for (Eigen::Index l = 0; l < left.cols(); ++l)
      for (Eigen::Index i = 0; i < left.rows() && !done[ToSize(static_cast<int>(l))]; ++i)
        if (std::abs(left(i, l)) > most) most = std::abs(left(i, l)), row = i, column = l;
    if (row < 0) return false;
    basis_.push_back(row);
    done[ToSize(static_cast<int>(column))] = true;
    const Eigen::VectorXd pivot = left.col(column) / left(row, column);
    for (Eigen::Index l = 0; l < left.cols(); ++l)
      if (!done[ToSize(static_cast<int>(l))]) left.col(l) -= pivot * left(row, l);
  }
  return true;
}

Real AffineRow::ValueAt(Eigen::Index i, const std::vector<Real>& theta) const {
  Real sum;
  for (Eigen::Index l = 0; l < rows_.cols(); ++l) sum += Real(rows_(i, l)) * theta[ToSize(static_cast<int>(l))];
  return sum;
}

std::vector<Real> AffineRow::Weights(const Basis& basis, const std::vector<Real>& direction) const {
  std::vector<std::vector<Real>> transposed;
  for (Eigen::Index l = 0; l < rows_.cols(); ++l) {
    std::vector<Real>& row = transposed.emplace_back();
    for (const Eigen::Index i : basis) row.emplace_back(rows_(i, l));
  }
  return SolveLinear(std::move(transposed), direction);
}

std::vector<Real> AffineRow::Vertex(const Basis& basis, const std::vector<Real>& weights) const {
  std::vector<std::vector<Real>> matrix;
  std::vector<Real> values;
  for (std::size_t j = 0; j < basis.size(); ++j) {
    const auto i = ToSize(static_cast<int>(basis[j]));
    std::vector<Real>& row = matrix.emplace_back();
    for (Eigen::Index l = 0; l < rows_.cols(); ++l) row.emplace_back(rows_(basis[j], l));
    values.push_back(CertainlyBelow(weights[j], 0.0) ? lower_[i] : upper_[i]);
  }
  return SolveLinear(std::move(matrix), std::move(values));
}

// By doubles the one that is violated most; where these do not tell, the first that certainly is.
AffineRow::Violated AffineRow::MostViolated(const Basis& basis, const std::vector<Real>& theta) const {
  Eigen::VectorXd rough(rows_.cols());
  for (Eigen::Index l = 0; l < rough.size(); ++l) rough[l] = theta[ToSize(static_cast<int>(l))].ToDouble();
  const Eigen::VectorXd values = rows_ * rough, sizes = rows_.cwiseAbs() * rough.cwiseAbs();
  Violated most;
  double by = 0;
  std::vector<Eigen::Index> close;
  for (Eigen::Index i = 0; i < rows_.rows(); ++i) {
    if (std::ranges::count(basis, i) > 0) continue;
    const auto at = ToSize(static_cast<int>(i));
    const double above = values[i] - rough_upper_[at], below = rough_lower_[at] - values[i];
    const double doubt = kDoubt * (sizes[i] + std::abs(rough_lower_[at]) + std::abs(rough_upper_[at]));
    const double larger = std::max(above, below);
    if (!(larger < -doubt)) close.push_back(i);
    if (larger > doubt && larger > by) by = larger, most = {i, above > below};
  }
  if (most.row >= 0) return most;
  for (const Eigen::Index i : close) {
    const auto at = ToSize(static_cast<int>(i));
    const Real value = ValueAt(i, theta);
    if (CertainlyBelow(upper_[at], value)) return {i, true};
    if (CertainlyBelow(value, lower_[at])) return {i, false};
  }
  return {};
}

// What the basis predicts of an observation excludes what it shows.
void AffineRow::Judge(const Basis& basis, const std::vector<Real>& alpha, const Violated& violated) const {
  const auto at = ToSize(static_cast<int>(violated.row));
  Real least, most, size = sizes_[at] + abs(lower_[at]) + abs(upper_[at]);
  for (std::size_t j = 0; j < basis.size(); ++j) {
    const auto i = ToSize(static_cast<int>(basis[j]));
    const Real a = alpha[j] * lower_[i], b = alpha[j] * upper_[i];
    least += min(a, b);
    most += max(a, b);
    size += abs(alpha[j]) * (sizes_[i] + abs(lower_[i]) + abs(upper_[i]));
  }
  const Real gap = violated.above ? least - upper_[at] : lower_[at] - most;
  if (!CertainlyBelow(0.0, gap)) return;
  const bool is_visible = CertainlyBelow(Real(kDoubt) * size, gap);
  emptiness_ = is_visible || emptiness_ == Emptiness::kVisible ? Emptiness::kVisible : Emptiness::kHidden;
}

// The direction, off by so little that it does not matter, and so that no weight is zero on the way.
std::vector<Real> AffineRow::Perturbed(std::vector<Real> direction) const {
  const std::vector<Real> weights = Weights(basis_, direction);
  Real largest;
  for (const Real& weight : weights) largest = max(largest, abs(weight).middle());
  for (std::size_t j = 0; j < basis_.size(); ++j) {
    const Real size = Real(0x1p-120 * static_cast<double>(j + 1)) * largest;
    const Real off = CertainlyBelow(weights[j], 0.0) ? -size : size;
    for (Eigen::Index l = 0; l < rows_.cols(); ++l)
      direction[ToSize(static_cast<int>(l))] += off * Real(rows_(basis_[j], l));
  }
  for (Real& entry : direction) entry = entry.middle();
  return direction;
}

std::optional<Real> AffineRow::Upper(const std::vector<Real>& direction) const {
  if (ToSize(static_cast<int>(rows_.cols())) != basis_.size() || IsEmpty()) return std::nullopt;
  std::optional<Real> best;
  const std::vector<Real> perturbed = Perturbed(direction);
  for (int pivots = 0; pivots < kMostPivots; ++pivots) {
    const std::vector<Real> exact = Weights(basis_, direction), weights = Weights(basis_, perturbed);
    if (!AllFinite(exact) || !AllFinite(weights)) break;
    Real bound;
    for (std::size_t j = 0; j < basis_.size(); ++j) {
      const auto i = ToSize(static_cast<int>(basis_[j]));
      bound += max(exact[j] * lower_[i], exact[j] * upper_[i]);
    }
    best = best ? min(*best, bound.upper()) : bound.upper();
    const std::vector<Real> theta = Vertex(basis_, weights);
    if (!AllFinite(theta)) break;
    const Violated violated = MostViolated(basis_, theta);
    if (violated.row < 0) break;
    std::vector<Real> row;
    for (Eigen::Index l = 0; l < rows_.cols(); ++l) row.emplace_back(rows_(violated.row, l));
    const std::vector<Real> alpha = Weights(basis_, row);
    // The one whose weight becomes zero first, as that of the violated one grows.
    std::optional<std::size_t> leaving;
    Real least;
    for (std::size_t j = 0; j < basis_.size(); ++j) {
      const Real towards = CertainlyBelow(weights[j], 0.0) == violated.above ? -alpha[j] : alpha[j];
      if (!CertainlyBelow(0.0, towards)) continue;
      const Real ratio = abs(weights[j]) / towards;
      if (!leaving || CertainlyBelow(ratio, least)) leaving = j, least = ratio;
    }
    if (!leaving) {
      Judge(basis_, alpha, violated);
      if (IsEmpty()) return std::nullopt;
      break;
    }
    basis_[*leaving] = violated.row;
  }
  return best;
}

std::optional<Real> AffineRow::Lower(std::vector<Real> direction) const {
  for (Real& entry : direction) entry = -entry;
  const std::optional<Real> upper = Upper(direction);
  if (!upper) return std::nullopt;
  return -*upper;
}

void AffineRow::DeriveSlopes() {
  const auto q = basis_.size();
  for (std::size_t l = 0; l + 1 < q; ++l) {
    std::vector<Real> axis(q);
    axis[l] = Real(1.0);
    const std::optional<Real> upper = Upper(axis), lower = Lower(axis);
    if (!upper || !lower) {
      slopes_.clear();
      return;
    }
    SetSlope(*lower, *upper);
  }
}

void AffineRow::SetSlope(const Real& lower, const Real& upper) {
  const Real middle = Real(0.5) * (lower + upper), size = max(abs(lower), abs(upper));
  const auto rounded = [&](long exponent) {  // to 2^(exponent - kSlopeBits)
    const double units = middle.ToDouble(kSlopeBits - exponent), whole = std::nearbyint(units);
    is_ambiguous_ |= std::abs(std::abs(units - std::floor(units)) - 0.5) < kTie;
    return std::ldexp(whole, static_cast<int>(exponent) - kSlopeBits);
  };
  double slope = 0;
  if (!size.IsZero()) {
    const long exponent = size.exponent() - 1;  // 2^exponent <= size < 2 * 2^exponent
    slope = rounded(exponent);
    const double share = size.ToDouble(-exponent);
    if (share > 2 - kTie) is_ambiguous_ |= rounded(exponent + 1) != slope;
    if (share < 1 + kTie) is_ambiguous_ |= rounded(exponent - 1) != slope;
  }
  slopes_.push_back(slope);
  reach_.push_back(max(abs(upper - Real(slope)), abs(lower - Real(slope))));
}

}  // namespace forereach::verifier
