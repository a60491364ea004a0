#include "verifier/tube.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/growing_disturbance.h"
#include "verifier/affine.h"
#include "verifier/functions.h"

namespace forereach::verifier {
namespace {

// Any strict order of recorded steps: equal ones become neighbours.
bool IsLess(const Transitions& data, int i, int j) {
  for (const Eigen::MatrixXd* part : {&data.z, &data.x_next})
    for (Eigen::Index l = 0; l < part->cols(); ++l)
      if (const double a = (*part)(i, l), b = (*part)(j, l); a != b) return a < b;
  if (data.Longer(i) != data.Longer(j)) return data.Longer(i) < data.Longer(j);
  return data.IsLearned(i) < data.IsLearned(j);
}

constexpr double kNone = std::numeric_limits<double>::infinity();
// Rows of L with more nonzero columns than this are bounded over the hull: that is part of the method.
constexpr std::size_t kMaxExactColumns = 12;
// Observations that contradict each other by less than this part of their operands may not do so in doubles.
constexpr double kSeenInDoubles = 0x1p-40;

Real Around(const Real& center, const Real& radius) { return Real::FromTo(center - radius, center + radius); }

double UlpOf(double x) { return std::nextafter(std::abs(x), kNone) - std::abs(x); }

// Up to this part of the domain's width, an axis of the residual is of the size of rounding errors, and counts as
// slack.
constexpr double kNegligible = 0x1p-41;

// By how much the record of an angle may be off: two units in the last place of 2 pi, or one of its own.
constexpr double kAngleUnit = 0x1p-49;
// More than the certifier rounds the rate that a transition shows.
constexpr double kRateRounding = 0x1p-40;

// What is nearest to zero of the numbers that differ from this by whole turns, if it is at most a quarter of a turn
// with the error: then no other is within three times that. Otherwise everything.
Real WithoutTurns(const Real& observed, const Real& error) {
  const Real turn = Real(2.0) * Real::Pi();
  const Real nearest = observed - Real(std::round((observed / turn).ToDouble())) * turn;
  return CertainlyAtMost(abs(nearest) + error, Real(0.25) * turn) ? nearest : Real::Everything();
}

// One more than the order of the integrator, and 2 for the next state itself.
int PowerOf(const NominalModel& model) {
  const std::optional<ModelText> text = TextOf(model);
  if (text && text->integrator == ModelText::Integrator::kMidpoint) return 3;
  return text && text->integrator == ModelText::Integrator::kRk4 ? 5 : 2;
}

bool IsZeroColumn(const std::vector<Real>& column) {
  return std::ranges::all_of(column, [](const Real& entry) { return entry.IsZero(); });
}

// Whether it lies along no axis.
bool IsMixed(const std::vector<Real>& column) {
  return std::ranges::count_if(column, [](const Real& entry) { return !entry.IsZero(); }) > 1;
}

std::vector<Real> Axis(int dim, int k, const Real& length) {
  std::vector<Real> column(ToSize(dim));
  column[ToSize(k)] = length;
  return column;
}

Slice WholeOf(const InitialSet& set) {
  Slice slice;
  if (set.lower.size() > 0) {
    const int n = static_cast<int>(set.lower.size());
    for (int k = 0; k < n; ++k) {
      const Real lower(set.lower[k]), upper(set.upper[k]), half(0.5);
      slice.center.push_back(half * (lower + upper));
      if (set.lower[k] != set.upper[k]) slice.columns.push_back(Axis(n, k, half * (upper - lower)));
    }
    return slice;
  }
  slice.center.assign(set.center.begin(), set.center.end());
  for (const auto column : set.generators.colwise()) slice.columns.emplace_back(column.begin(), column.end());
  std::erase_if(slice.columns, IsZeroColumn);
  return slice;
}

// What `set` says beside its `from` and `to`, then these.
Slice PieceOf(const InitialSet& set) {
  const Slice whole = WholeOf(set);
  if (set.from.size() == 0) return whole;
  Slice piece;
  for (int k = 0; k < whole.dim(); ++k) {
    const Real &c = whole.center[ToSize(k)], r = whole.HalfWidth(k), half(0.5);
    const Real lower = max(c - r, Real(set.from[k])), upper = max(lower, min(c + r, Real(set.to[k])));
    piece.center.push_back(half * (lower + upper));
    if (const Real width = half * (upper - lower); !width.IsZero())
      piece.columns.push_back(Axis(whole.dim(), k, width));
  }
  return piece;
}

// A certifier writes what it adds for rounding behind all else: tiny columns along the axes, one each at most, in
// order. What are taken for them makes no difference to the set.
Slice SliceOf(const RecordedSet& set) {
  constexpr double kTiny = 0x1p-20;  // of the half-width
  const Eigen::MatrixXd& generators = set.generators;
  const Eigen::VectorXd half_width = generators.cwiseAbs().rowwise().sum();
  Slice slice{{set.center.begin(), set.center.end()}, {}};
  Eigen::Index end = generators.cols(), axis = generators.rows();
  while (end > 0) {
    Eigen::Index k = 0;
    const double length = generators.col(end - 1).cwiseAbs().maxCoeff(&k);
    if ((generators.col(end - 1).array() != 0).count() != 1 || k >= axis || !(length <= kTiny * half_width[k])) break;
    axis = k;
    --end;
    ++slice.num_slack;
  }
  for (const auto column : generators.colwise()) slice.columns.emplace_back(column.begin(), column.end());
  return slice;
}

// What the reduction ranks a column by, |g|_1 - |g|_inf, and how far off a double's rounding may put that. A column
// along an axis has exactly zero, in doubles too.
struct Score {
  std::size_t column;
  Real value;
  double rounded, error;
};

Score ScoreOf(const std::vector<Real>& column, std::size_t index) {
  std::size_t largest = 0;
  for (std::size_t k = 1; k < column.size(); ++k)
    if (CertainlyBelow(abs(column[largest]).middle(), abs(column[k]).middle())) largest = k;
  Real sum;
  for (std::size_t k = 0; k < column.size(); ++k)
    if (k != largest && !column[k].IsZero()) sum += abs(column[k]);
  // Above what a double's sum of 16 entries may be off: where two scores are closer, the certifier may have chosen the
  // other column, and neither choice is wrong.
  const double rounded = sum.ToDouble(), error = 0x1p-44 * (sum + abs(column[largest])).ToDouble();
  return {index, rounded == 0 ? Real() : sum, rounded, rounded == 0 ? 0 : error};
}

// Cannot be held in doubles: the certifier's column may be zero, and dropped.
bool MayUnderflow(const std::vector<Real>& column) {
  return std::ranges::all_of(column, [](const Real& entry) { return entry.exponent() < -1073; });
}

// All columns by their score, the largest first; of equal scores the earlier first. Zeros are exact. Other scores are
// compared by the middles of enclosures that are far narrower than a double's last place.
std::vector<Score> Ranking(const Slice& slice) {
  std::vector<Score> scores;
  for (std::size_t j = 0; j < slice.columns.size(); ++j) scores.push_back(ScoreOf(slice.columns[j], j));
  std::ranges::stable_sort(
      scores, [](const Score& a, const Score& b) { return CertainlyBelow(b.value.middle(), a.value.middle()); });
  return scores;
}

// What boxing a column may cost, relative to center and half-width: all but one of its entries lose their connection.
double CostOfBoxing(const std::vector<Real>& column, const std::vector<double>& size) {
  double largest = 0, second = 0;
  for (std::size_t k = 0; k < column.size(); ++k) {
    if (column[k].IsZero()) continue;
    const double share = std::abs(column[k].ToDouble()) / size[k];
    second = std::max(second, std::min(share, largest));
    largest = std::max(largest, share);
  }
  return second;
}

// Whether the certifier, in doubles, may have ranked the last column kept and the first boxed the other way round, and
// what that may cost; zero if not. Its columns carry a double's rounding of their own size and of the slice's, and the
// remainders'.
double CostOfConfusing(const Slice& slice, const Score& last, const Score& first, double remainder_rounding) {
  if (last.value.IsZero() && first.value.IsZero()) return 0;
  std::vector<double> size;
  for (int k = 0; k < slice.dim(); ++k) size.push_back((abs(slice.center[ToSize(k)]) + slice.HalfWidth(k)).ToDouble());
  const double rounding = std::max(0x1p-48 * *std::ranges::max_element(size), remainder_rounding);
  if (std::abs(last.rounded - first.rounded) > last.error + first.error + rounding) return 0;
  return std::max(CostOfBoxing(slice.columns[last.column], size), CostOfBoxing(slice.columns[first.column], size));
}

// Keeps these columns, in this order, and boxes the others.
void BoxAllBut(Slice& slice, const std::vector<std::size_t>& kept) {
  Slice reduced{slice.center, {}};
  for (const std::size_t j : kept) reduced.columns.push_back(slice.columns[j]);
  for (int k = 0; k < slice.dim(); ++k) {
    Real sum;
    for (std::size_t j = 0; j < slice.columns.size(); ++j)
      if (std::ranges::count(kept, j) == 0) sum += abs(slice.columns[j][ToSize(k)]);
    if (!sum.IsZero()) reduced.columns.push_back(Axis(slice.dim(), k, sum));
  }
  slice = std::move(reduced);
}

// Girard's rule: keep the (order - 1) n columns of largest |g|_1 - |g|_inf, ties to the earlier, box the rest. Columns
// along axes, which a box holds as they are, do not count where steps may be off their times. Returns what it may have
// cost the certifier, in doubles, to go another way.
double Reduce(Slice& slice, int order, bool counts_axes, double remainder_rounding) {
  const auto n = ToSize(slice.dim()), kept = ToSize(order - 1) * n;
  const double tiny = std::ranges::any_of(slice.columns, MayUnderflow) ? 1 : 0;
  const bool has_room = counts_axes || ToSize(std::ranges::count_if(slice.columns, IsMixed)) <= kept;
  if (slice.columns.size() <= ToSize(order) * n && has_room) return tiny;
  const std::vector<Score> scores = Ranking(slice);
  const double close = kept > 0 ? CostOfConfusing(slice, scores[kept - 1], scores[kept], remainder_rounding) : 0;
  std::vector<std::size_t> largest;
  for (std::size_t i = 0; i < kept; ++i) largest.push_back(scores[i].column);
  std::ranges::sort(largest);
  BoxAllBut(slice, largest);
  return std::max(close, tiny);
}

// As Reduce, by the choice that a record shows: none, if it has more columns that are not along an axis, the offset's
// apart; else the (order - 1) n columns nearest to its first. What stays of the offset before is a column here alone.
// False if it has fewer. Any choice gives a set that contains the slice.
bool ReduceAs(Slice& slice, int order, const Eigen::MatrixXd& recorded, bool has_offset) {
  const auto n = ToSize(slice.dim()), kept = ToSize(order - 1) * n;
  const auto mixed = ((recorded.array() != 0).colwise().count() > 1).count() - (has_offset ? 1 : 0);
  const std::size_t most = ToSize(order) * n + (has_offset ? 1 : 0);
  if (slice.columns.size() <= most || mixed > static_cast<Eigen::Index>(kept)) return true;
  if (ToSize(recorded.cols()) < kept) return false;
  const std::vector<Eigen::VectorXd> rounded = slice.RoundedColumns();
  std::vector<std::size_t> chosen;
  for (Eigen::Index i = 0; ToSize(i) < kept; ++i) {
    const auto generator = recorded.col(i);
    std::size_t nearest = slice.columns.size();
    double least = kNone;
    for (std::size_t j = 0; j < slice.columns.size(); ++j) {
      if (std::ranges::count(chosen, j) > 0) continue;
      const double away = std::min((rounded[j] - generator).lpNorm<1>(), (rounded[j] + generator).lpNorm<1>());
      if (away < least) least = away, nearest = j;
    }
    if (nearest == slice.columns.size()) return false;
    chosen.push_back(nearest);
  }
  BoxAllBut(slice, chosen);
  return true;
}

// d_i d_l over the slice: at most r_i r_l in size, and within a quarter of the squares of the half-widths of
// d_i / r_i + d_l / r_l and of their difference, times r_i r_l.
Bounds MixedProduct(const Slice& slice, const std::vector<Real>& r, int i, int l, Method method) {
  const Real product = r[ToSize(i)] * r[ToSize(l)];
  if (method == Method::kPaper || product.IsZero()) return {-product, product};
  Real plus, minus;
  for (const auto& column : slice.columns) {
    const Real a = column[ToSize(i)] * r[ToSize(l)], b = column[ToSize(l)] * r[ToSize(i)];
    plus += abs(a + b);
    minus += abs(a - b);
  }
  const Real four = Real(4.0) * product;
  return {-min(product, sqr(minus) / four), min(product, sqr(plus) / four)};
}

// max over 0 <= s <= r of a s^2 / 2 + b s, b >= 0: docs/soundness.md, 3.4.
Real Peak(const Real& a, const Real& b, const Real& r) {
  const Real at_end = max(Real(), (Real(0.5) * a * r + b) * r);
  const bool rises_to_the_end = CertainlyAtMost(-a * r, b);
  return rises_to_the_end ? at_end : b * b / (Real(-2.0) * a);
}

Bounds Times(const Real& h, const Bounds& d) {
  const Real ends[] = {h.lower() * d.lower, h.lower() * d.upper, h.upper() * d.lower, h.upper() * d.upper};
  return {min(min(ends[0], ends[1]), min(ends[2], ends[3])), max(max(ends[0], ends[1]), max(ends[2], ends[3]))};
}

// A mixed second derivative of states, or a diagonal one; a mixed one takes a diagonal one of its variables along.
struct RemainderTerm {
  const SecondDerivative* entry;
  const SecondDerivative* diagonal = nullptr;
};

std::vector<RemainderTerm> TermsOf(const std::vector<SecondDerivative>& hessian) {
  std::vector<RemainderTerm> terms;
  for (const SecondDerivative& entry : hessian)
    if (entry.row != entry.column) terms.push_back({&entry});
  for (const SecondDerivative& entry : hessian) {
    if (entry.row != entry.column) continue;
    const auto partner = std::ranges::find_if(terms, [&](const RemainderTerm& term) {
      return term.entry->output == entry.output && term.entry->row != term.entry->column && term.diagonal == nullptr &&
             (term.entry->row == entry.row || term.entry->column == entry.row);
    });
    if (partner == terms.end())
      terms.push_back({&entry});
    else
      partner->diagonal = &entry;
  }
  return terms;
}

// Of a diagonal term: d^2 lies in [0, r^2].
Bounds DiagonalRange(const Real& h, const Real& r) {
  const Real half_square = Real(0.5) * r * r;
  return {half_square * min(Real(), h.lower()), half_square * max(Real(), h.upper())};
}

// Of a term of the centred method: the sum of its parts' ranges, or the range of their sum over the box, if that is
// less.
Bounds CentredRange(const RemainderTerm& term, const Slice& slice, const std::vector<Real>& r) {
  const SecondDerivative& entry = *term.entry;
  if (entry.row == entry.column) return DiagonalRange(entry.value, r[ToSize(entry.row)]);
  Bounds range = Times(entry.value, MixedProduct(slice, r, entry.row, entry.column, Method::kCentred));
  if (term.diagonal == nullptr) return range;
  const int shared = term.diagonal->row, other = shared == entry.row ? entry.column : entry.row;
  const Real& curve = term.diagonal->value;
  const Bounds square = DiagonalRange(curve, r[ToSize(shared)]);
  const Real slope = entry.value.magnitude() * r[ToSize(other)];
  // Both bound the same sum, so the tighter holds (soundness 3.4).
  return {max(range.lower + square.lower, -Peak(-curve.lower(), slope, r[ToSize(shared)])),
          min(range.upper + square.upper, Peak(curve.upper(), slope, r[ToSize(shared)]))};
}

// The remainder's bounds, with every second derivative over a box in `hessian` and half-widths r.
std::vector<Bounds> RemainderOver(const std::vector<SecondDerivative>& hessian, const Slice& slice,
                                  const std::vector<Real>& r, int n, Method method) {
  std::vector<Bounds> bounds(ToSize(n));
  if (method == Method::kPaper) {
    for (const SecondDerivative& entry : hessian) {
      const Real once = entry.row == entry.column ? Real(0.5) : Real(1.0);  // off the diagonal (i, j) and (j, i) count
      const Real most = once * r[ToSize(entry.row)] * r[ToSize(entry.column)] * entry.value.magnitude();
      bounds[ToSize(entry.output)].lower -= most;
      bounds[ToSize(entry.output)].upper += most;
    }
    return bounds;
  }
  for (const RemainderTerm& term : TermsOf(hessian)) {
    const Bounds range = CentredRange(term, slice, r);
    bounds[ToSize(term.entry->output)].lower += range.lower;
    bounds[ToSize(term.entry->output)].upper += range.upper;
  }
  return bounds;
}

bool AllFinite(const std::vector<SecondDerivative>& hessian) {
  return std::ranges::all_of(hessian, [](const SecondDerivative& entry) { return entry.value.IsFinite(); });
}

// The ends of what encloses either bound.
Bounds Outermost(const Bounds& bounds) { return {bounds.lower.lower(), bounds.upper.upper()}; }

// The record's generator that is nearest to d, unless d is nearer to nothing, in shares of the record's half-widths:
// the middle of a wide coordinate may be off by far more than a narrow one's.
int NearestGenerator(const RecordedSet& recorded, const std::vector<Real>& column) {
  Eigen::VectorXd rounded(recorded.center.size());
  for (Eigen::Index k = 0; k < rounded.size(); ++k) rounded[k] = column[ToSize(k)].ToDouble();
  const Eigen::VectorXd half_width = recorded.generators.cwiseAbs().rowwise().sum();
  const auto size = [&](const Eigen::VectorXd& away) {
    double sum = 0;
    for (Eigen::Index k = 0; k < away.size(); ++k)
      if (away[k] != 0) sum += std::abs(away[k]) / half_width[k];
    return sum;
  };
  int nearest = -1;
  double least = size(rounded);
  for (Eigen::Index j = 0; j < recorded.generators.cols(); ++j)
    if (const double away = size(recorded.generators.col(j) - rounded); away < least)
      least = away, nearest = static_cast<int>(j);
  return nearest;
}

// Around what was recorded as z: where the true one is.
std::vector<Real> BoxAround(const Declaration& declaration, const std::vector<Real>& z) {
  std::vector<Real> box;
  for (std::size_t l = 0; l < z.size(); ++l)
    box.push_back(Around(z[l], Real(declaration.VariableError(static_cast<Eigen::Index>(l)))));
  return box;
}

// Null: nothing grows.
std::shared_ptr<const Functions> GrowthOf(const Problem& problem) {
  const auto& growing = problem.declaration.growing;
  return growing ? std::make_shared<const Functions>(*problem.model, growing->bounds()) : nullptr;
}

// The least double that is not below any number of a range.
double UpperDouble(const Real& range) {
  double bound = range.upper().ToDouble();
  // ToDouble rounds to nearest, which may be inward.
  while (!CertainlyAtMost(range.upper(), Real(bound))) bound = std::nextafter(bound, kNone);
  return bound;
}

// Around ranges.
Ways::Box DoublesAround(std::span<const Real> ranges) {
  Ways::Box box;
  for (const Real& range : ranges) box.emplace_back(-UpperDouble(-range), UpperDouble(range));
  return box;
}

// Replaces a number by a point, and adds to `slack` how far it may be away.
void Round(Real& number, Real& slack) {
  const Real point = number.middle();
  slack += (number - point).magnitude();
  number = point;
}

}  // namespace

Real Slice::HalfWidth(int k) const {
  Real sum;
  for (const auto& column : columns)
    if (!column[ToSize(k)].IsZero()) sum += abs(column[ToSize(k)]);
  return sum;
}

std::vector<Eigen::VectorXd> Slice::RoundedColumns() const {
  std::vector<Eigen::VectorXd> rounded;
  for (const auto& column : columns) {
    Eigen::VectorXd& entries = rounded.emplace_back(dim());
    for (int k = 0; k < dim(); ++k) entries[k] = column[ToSize(k)].ToDouble();
  }
  return rounded;
}

// The bounds on r_k over one Z_t from data and declaration.
struct TubeMaker::Known {
  Bounds bounds;
  bool contradiction = false;       // one that doubles show too
  std::vector<double> slopes = {};  // of which the bounds are less
  bool is_tie = false;              // rounding may have chosen other slopes
};

// The affine rows of the residual, for one tube. The others are null.
struct TubeMaker::Affine {
  const AffineRows& declared;
  const std::vector<int>& columns = declared.columns;
  std::vector<std::unique_ptr<AffineRow>> rows = {};

  /** The slopes of state k's residual by n states. */
  [[nodiscard]] std::vector<double> Slopes(std::size_t k, std::size_t n) const {
    std::vector<double> slopes(n);
    for (std::size_t j = 0; j < columns.size(); ++j)
      if (ToSize(columns[j]) < n) slopes[ToSize(columns[j])] = rows[k]->slopes()[j];
    return slopes;
  }
  /** Bounds on the residual of k less its slope times x - c: at the center, and beyond by what the slope may be off. */
  [[nodiscard]] std::optional<Bounds> Enclose(const Query& query, std::size_t k) const;
};

// Z_t = X_t x {u_t}: the slice, and center, half-width and hull of every variable.
struct TubeMaker::Query {
  int t;
  const Slice& slice;
  std::vector<Real> center, half_width, hull;
  std::vector<Real> acted;  // the hull, with all inputs that may act
  const Affine& affine;

  Query(int step, const Slice& set, const Eigen::VectorXd& input, const std::vector<Real>& input_error,
        const Affine& affine_rows)
      : t(step), slice(set), center(set.center), affine(affine_rows) {
    for (int k = 0; k < set.dim(); ++k) half_width.push_back(set.HalfWidth(k));
    for (const double u : input) {
      center.emplace_back(u);
      half_width.emplace_back();
    }
    hull = acted = Box(Real(1.0));
    const std::size_t n = slice.center.size();
    for (std::size_t l = 0; l < input_error.size(); ++l) acted[n + l] = Around(center[n + l], input_error[l]);
  }

  /** The hull scaled about its center. */
  [[nodiscard]] std::vector<Real> Box(const Real& scale) const {
    std::vector<Real> box;
    for (std::size_t l = 0; l < center.size(); ++l) box.push_back(Around(center[l], scale * half_width[l]));
    return box;
  }
};

std::optional<Bounds> TubeMaker::Affine::Enclose(const Query& query, std::size_t k) const {
  std::vector<Real> at;
  Real around;
  for (std::size_t j = 0; j < columns.size(); ++j) {
    const auto l = ToSize(columns[j]);
    at.push_back(query.center[l]);
    around += rows[k]->reach()[j] * query.half_width[l];
  }
  at.emplace_back(1.0);
  std::vector<Real> place;
  for (std::size_t l = 0; l < query.center.size(); ++l)
    if (const double slope = declared.Rest(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)); slope > 0) {
      place.push_back(query.center[l]);
      around += Real(slope) * query.half_width[l];
    }
  rows[k]->LookFrom(place);
  const std::optional<Real> upper = rows[k]->Upper(at), lower = rows[k]->Lower(at);
  if (!upper || !lower) return std::nullopt;
  return Bounds{*lower - around, *upper + around};
}

// What the offsets of the boundaries of a step add: d, and what is added without correlation.
struct TubeMaker::Offset {
  std::vector<Real> column, spread;
  int recorded = -1;
};

TubeMaker::TubeMaker(const Problem& problem, const Equations& equations, Method method)
    : problem_(problem),
      equations_(equations),
      ways_(problem),
      method_(method),
      disturbance_(ToSize(problem.model->num_states())),
      growing_(GrowthOf(problem)),
      input_error_(ToSize(problem.model->num_inputs())),
      of_inputs_(disturbance_.size()),
      power_(PowerOf(*problem.model)),
      remainder_rounding_(RemainderRounding()) {
  std::ranges::copy(problem.declaration.input_error, input_error_.begin());
  rough_residuals_.resize(of_inputs_.size());
  std::ranges::copy(problem.declaration.disturbance, disturbance_.begin());
  for (std::size_t k = 0; k < of_inputs_.size(); ++k)
    for (std::size_t l = 0; l < input_error_.size(); ++l)
      if (!input_error_[l].IsZero())
        of_inputs_[k] += Real(problem.declaration.lipschitz(static_cast<Eigen::Index>(k),
                                                            static_cast<Eigen::Index>(of_inputs_.size() + l))) *
                         input_error_[l];
  Learn();
}

void TubeMaker::Learn() {
  const Transitions& data = problem_.transitions;
  for (int i = static_cast<int>(rough_residuals_[0].lower.size()); i < data.size(); ++i) {
    if (const auto failure = WhyTooFast(i)) too_much_.emplace_back(i, *failure);
    auto seen = std::make_shared<const Seen>(Look(i));
    if (const auto failure = WhyTooLarge(i, *seen)) too_much_.emplace_back(i, *failure);
    for (Eigen::Index k = 0; k < data.x_next.cols(); ++k) {
      RoughResiduals& rough = rough_residuals_[ToSize(k)];
      rough.lower.push_back(seen->residual[ToSize(k)].lower.ToDouble());
      rough.upper.push_back(seen->residual[ToSize(k)].upper.ToDouble());
      rough.scale.push_back(problem_.declaration.lipschitz.row(k).dot(data.z.row(i).cwiseAbs()));
    }
    if (i < kMostKeptBits / Precision::bits()) seen_.push_back(std::move(seen));
  }
}

TubeMaker::Seen TubeMaker::Look(int i) const {
  const Transitions& data = problem_.transitions;
  std::vector<Real> z;
  for (Eigen::Index l = 0; l < data.z.cols(); ++l) z.emplace_back(data.z(i, l));
  const std::vector<Real> nominal = equations_.Value(z);
  std::vector<Real> errors(ToSize(problem_.model->num_states()));
  // Only transitions of the file may be declared exact: a robot's own are measured (soundness 3.16).
  const bool is_exact = problem_.declaration.given_are_exact && !data.IsLearned(i);
  if (!is_exact) errors = RecordErrors(z);
  const std::vector<Real> around = is_exact ? z : BoxAround(problem_.declaration, z);
  const std::vector<Real> disturbance = DisturbanceOver(around), noise = NoiseOver(around);
  AddDuration(i, z, nominal, disturbance, noise, errors);
  Seen seen;
  for (Eigen::Index k = 0; k < data.x_next.cols(); ++k) {
    const double x_next = data.x_next(i, k);
    const bool is_angle = std::ranges::count(problem_.model->angles(), k) > 0;
    const double unit = is_angle ? std::max(UlpOf(x_next), kAngleUnit) : UlpOf(x_next);
    const Real& error = errors[ToSize(k)];
    const Real& w = disturbance[ToSize(k)];
    const Real allowed = Real(unit) + noise[ToSize(k)] + w + error;
    const Real difference = Real(x_next) - nominal[ToSize(k)];
    const Real observed = is_angle && difference.IsFinite() ? WithoutTurns(difference, error) : difference;
    const Bounds bounds{observed - allowed, observed + allowed};
    // A transition for which the model has no value says nothing.
    seen.residual.push_back(!observed.IsFinite() || !error.IsFinite() || !w.IsFinite() ? Bounds{-kNone, kNone}
                            : equations_.IsExact()                                     ? bounds
                                                                                       : Outermost(bounds));
    seen.size.push_back(abs(Real(x_next)) + error);
  }
  for (const auto& [output, variable, value] : equations_.First(z))
    seen.size[ToSize(output)] += value.IsFinite() ? abs(value * z[ToSize(variable)]) : Real(kNone);
  return seen;
}

// What an observation shows of the residual, against what the regions around it say.
std::optional<Failure> TubeMaker::WhyTooLarge(int i, const Seen& seen) const {
  Ways::Box at;
  for (const double value : problem_.transitions.z.row(i)) at.emplace_back(value, value);
  for (std::size_t k = 0; k < seen.residual.size(); ++k) {
    const double most = ways_.Largest(&Region::bound, static_cast<int>(k), kNone, at);
    const auto& [lower, upper] = seen.residual[k];
    if (most == kNone || !CertainlyBelow(Real(most) + Real(kSeenInDoubles) * seen.size[k], max(lower, -upper)))
      continue;
    return Failure{-1,
                   "no known transition has a residual of " + problem_.model->state_names()[k] +
                       " above what declaration.regions says",
                   max(lower, -upper).text(), "at most " + Real(most).text(), true};
  }
  return std::nullopt;
}

std::optional<Failure> TubeMaker::FindTooMuch(const KnownRows& known) const {
  for (const auto& [i, failure] : too_much_)
    if (known.Contains(i)) return failure;
  return std::nullopt;
}

std::optional<Failure> TubeMaker::WhyTooFast(int i) const {
  const Transitions& data = problem_.transitions;
  const Declaration& declaration = problem_.declaration;
  const NominalModel& model = *problem_.model;
  const double dt = StepOf(model);
  std::optional<Failure> failure;
  const auto test = [&](int k, double rate, bool is_angle) {
    const double x = data.z(i, k), x_next = data.x_next(i, k);
    Real change = abs(Real(x_next) - Real(x));
    if (is_angle) {
      const Real turn = Real(2.0) * Real::Pi();
      change = abs(change - Real(std::round((change / turn).ToDouble())) * turn);
      change = min(change, turn - change);
    }
    const bool is_exact = declaration.given_are_exact && !data.IsLearned(i);
    const Real recorded(is_exact ? 0 : declaration.VariableError(k));
    const Real error = recorded + recorded + Real(declaration.noise_bound[k]) +
                       Real(is_angle ? std::max(UlpOf(x_next), kAngleUnit) : UlpOf(x_next));
    const Real longest = Real(dt) + Real(data.Longer(i)), most = Real(rate) * longest;
    const Real rounding = Real(kRateRounding) * (most + Real(std::abs(x)) + Real(std::abs(x_next)) + error);
    if (!CertainlyBelow(most + rounding, change - error)) return;
    failure = Failure{-1, "no known transition changes " + model.state_names()[ToSize(k)] + " faster than is declared",
                      ((change - error) / longest).text(), "at most " + Real(rate).text(), true};
  };
  if (!(dt > 0)) return failure;
  const Eigen::VectorXd& rates = problem_.timing.rate_bound;
  for (int k = 0; k < rates.size(); ++k)
    if (rates[k] < kNone) test(k, rates[k], model.IsAngle(k));
  // Of steps that may have lasted longer than those of a plan this bound does not speak.
  const double longer = data.Longer(i), duration = longer > 0 ? std::nextafter(dt + longer, kNone) : dt;
  if (const int heading = problem_.body.heading;
      problem_.between && heading >= 0 && duration <= std::max(dt, problem_.between->period))
    test(heading, problem_.between->turn_rate, model.IsAngle(heading));
  return failure;
}

// With x+ - r(z) = f0(z) + w and z the true one, within e of the recorded one, as x+ is: e_k for x+, L e for r, and for
// f0 by the mean value theorem the largest slopes over z +- e times e. Not finite where z +- e leaves the domain, or f0
// has no bound there: nothing is known then.
std::vector<Real> TubeMaker::RecordErrors(const std::vector<Real>& z) const {
  const Declaration& declaration = problem_.declaration;
  std::vector<Real> e(z.size()), errors(ToSize(problem_.model->num_states()));
  std::ranges::copy(declaration.state_error, e.begin());
  std::ranges::copy(declaration.input_error, e.begin() + std::ssize(errors));
  if (std::ranges::all_of(e, [](const Real& error) { return error.IsZero(); })) return errors;
  const std::vector<Real> box = BoxAround(declaration, z);
  if (LeavesDomain(0, z, e)) return std::vector<Real>(errors.size(), Real::Everything());
  const std::vector<Real> values = equations_.Value(box);
  for (std::size_t k = 0; k < errors.size(); ++k) {
    errors[k] = values[k].IsFinite() ? e[k] : Real::Everything();
    for (std::size_t l = 0; l < z.size(); ++l)
      errors[k] += Real(declaration.lipschitz(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l))) * e[l];
  }
  for (const auto& [output, variable, slope] : equations_.First(box))
    if (const Real& error = e[ToSize(variable)]; !error.IsZero())
      errors[ToSize(output)] += slope.IsFinite() ? slope.magnitude() * error : Real::Everything();
  return errors;
}

// (1 + share)^q - 1 = share (1 + (1 + share) + ... + (1 + share)^(q - 1)).
Real TubeMaker::Growth(const Real& share) const {
  Real power(1.0), sum;
  for (int i = 0; i < power_; ++i) {
    sum += power;
    power = power * (Real(1.0) + share);
  }
  return share * sum;
}

// The largest disturbance of each state over a box, with the ends of what is not known exactly. Not finite where
// nothing bounds it.
std::vector<Real> TubeMaker::DisturbanceOver(std::span<const Real> box) const {
  std::vector<Real> sum = disturbance_;
  if (problem_.declaration.AnyRegionHas(&Region::disturbance))
    for (std::size_t k = 0; k < sum.size(); ++k) {
      const double everywhere = problem_.declaration.DisturbanceBound(static_cast<Eigen::Index>(k));
      sum[k] = Real(ways_.Largest(&Region::disturbance, static_cast<int>(k), everywhere, DoublesAround(box)));
    }
  if (!growing_) return sum;
  const std::vector<Real> grown = growing_->At(box);
  for (std::size_t k = 0; k < sum.size(); ++k)
    sum[k] += grown[k].IsFinite() ? grown[k].magnitude() : Real::Everything();
  return sum;
}

// The largest error of a recorded successor, likewise.
std::vector<Real> TubeMaker::NoiseOver(std::span<const Real> box) const {
  const Eigen::VectorXd& sigma = problem_.declaration.noise_bound;
  std::vector<Real> noise(sigma.begin(), sigma.end());
  if (problem_.declaration.AnyRegionHas(&Region::noise_bound))
    for (int k = 0; k < std::ssize(noise); ++k)
      noise[ToSize(k)] = Real(ways_.Largest(&Region::noise_bound, k, sigma[k], DoublesAround(box)));
  return noise;
}

// What inputs that are off by their errors add to f0: the largest slopes over all that may act, times the errors. Not
// finite where f0 has no bound there.
std::vector<Real> TubeMaker::InputSpread(const Query& query) const {
  const std::size_t n = query.slice.center.size();
  std::vector<Real> spread(n);
  if (std::ranges::all_of(input_error_, [](const Real& error) { return error.IsZero(); })) return spread;
  const std::vector<Real> values = equations_.Value(query.acted);
  for (std::size_t k = 0; k < n; ++k)
    if (!values[k].IsFinite()) spread[k] = Real::Everything();
  for (const auto& [output, variable, slope] : equations_.First(query.acted))
    if (const std::size_t l = ToSize(variable); l >= n && !input_error_[l - n].IsZero())
      spread[ToSize(output)] += slope.IsFinite() ? slope.magnitude() * input_error_[l - n] : Real::Everything();
  return spread;
}

// A step that lasted by up to delta longer or shorter: what that moved the state, and the growth of r + w, where |r| is
// at most what is seen of it, what hides it, and that growth itself. Of an angle it must not hide three quarters of a
// turn.
void TubeMaker::AddDuration(int i, const std::vector<Real>& z, const std::vector<Real>& nominal,
                            const std::vector<Real>& disturbance, const std::vector<Real>& noise,
                            std::vector<Real>& errors) const {
  if (problem_.transitions.Longer(i) == 0) return;
  const Declaration& declaration = problem_.declaration;
  const Real longer(problem_.transitions.Longer(i)), dt(StepOf(*problem_.model)), growth = Growth(longer / dt);
  const std::vector<Real> rate = equations_.Rate(BoxAround(declaration, z), Around(dt, longer));
  const StepTiming& timing = problem_.timing;
  for (std::size_t k = 0; k < errors.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    if (std::ranges::count(timing.set_at_steps, static_cast<int>(k)) > 0) continue;
    if (timing.rate_bound.size() > 0 && timing.rate_bound[row] < kNone) {
      errors[k] += longer * Real(timing.rate_bound[row]);
      continue;
    }
    const double x_next = problem_.transitions.x_next(i, row);
    const bool is_angle = std::ranges::count(problem_.model->angles(), static_cast<int>(k)) > 0;
    const Real difference = Real(x_next) - nominal[k];
    const Real seen = is_angle && difference.IsFinite() ? WithoutTurns(difference, errors[k]) : difference;
    const Real moved = longer * rate[k].magnitude(),
               unit(is_angle ? std::max(UlpOf(x_next), kAngleUnit) : UlpOf(x_next));
    const Real off = unit + noise[k] + disturbance[k];
    const Real hidden = errors[k] + off + moved + growth * disturbance[k];
    const Real most = (seen.magnitude() + hidden) / (Real(1.0) - growth);
    const Real turned = errors[k] + moved + growth * (Real(1.5) * Real::Pi() + off + disturbance[k]);
    const bool is_told = !is_angle || (difference.IsFinite() && WithoutTurns(difference, turned).IsFinite());
    const bool is_known =
        rate[k].IsFinite() && disturbance[k].IsFinite() && CertainlyBelow(growth, Real(1.0)) && is_told;
    errors[k] += is_known ? moved + growth * (most + disturbance[k]) : Real::Everything();
  }
}

// The certifier rounds each remainder by what its expansion may be off anywhere in the domain, some 2^-44 of the
// largest remainder there, and several meet in a column; where that is not negligible it takes intervals, as tight as
// the slice.
double TubeMaker::RemainderRounding() const {
  const auto [lower, upper] = problem_.domain.Corners();
  std::vector<Real> box, half_width;
  for (std::size_t l = 0; l < lower.size(); ++l) {
    box.push_back(Real::FromTo(Real(lower[l]), Real(upper[l])));
    half_width.push_back(Real(0.5) * (Real(upper[l]) - Real(lower[l])));
  }
  const std::vector<SecondDerivative> hessian = equations_.Second(box);
  if (!AllFinite(hessian)) return 0;
  double largest = 0;
  for (const Bounds& bounds : RemainderOver(hessian, {}, half_width, problem_.domain.state.dim(), Method::kPaper))
    largest = std::max(largest, bounds.upper.ToDouble());
  const double rounding = 0x1p-40 * largest;
  return rounding < 0x1p-20 ? rounding : 0;
}

Tube TubeMaker::Make(const InitialSet& initial_set, const Eigen::MatrixXd& controls, const TubeOptions& options) const {
  Tube tube;
  tube.slices.push_back(PieceOf(initial_set));
  Affine affine{problem_.declaration.affine};
  tube.failure = MakeAffine(options.known, affine);
  for (int t = 0, steps = static_cast<int>(controls.cols()); t < steps && !tube.failure; ++t) {
    Slice slice = tube.slices.back();
    if (options.follow) {
      slice = SliceOf((*options.follow)[ToSize(t)]);
      slice.offset = tube.recorded_offsets.back();
    }
    tube.failure = Advance(tube, Query(t, slice, controls.col(t), input_error_, affine), options);
  }
  return tube;
}

// Whether every lower end of an observed residual is at most every upper end and what the slopes allow between them:
// then the extensions agree with all of these. Doubles decide where they can.
bool TubeMaker::CanExtend(const std::vector<int>& rows) const {
  const Eigen::MatrixXd &z = problem_.transitions.z, &L = problem_.declaration.lipschitz;
  for (Eigen::Index k = 0; k < L.rows(); ++k) {
    const RoughResiduals& rough = rough_residuals_[ToSize(k)];
    for (const int i : rows)
      for (const int j : rows) {
        const std::size_t a = ToSize(i), b = ToSize(j);
        double reach = rough.upper[b] - 0x1p-36 * (rough.scale[a] + rough.scale[b]) -
                       0x1p-50 * (std::abs(rough.lower[a]) + std::abs(rough.upper[b]));
        for (Eigen::Index l = 0; l < L.cols(); ++l)
          if (L(k, l) > 0) reach += L(k, l) * std::abs(z(i, l) - z(j, l));
        if (rough.lower[a] <= reach) continue;
        Real exact = See(j)->residual[ToSize(k)].upper;
        for (Eigen::Index l = 0; l < L.cols(); ++l)
          if (L(k, l) > 0) exact += Real(L(k, l)) * abs(Real(z(i, l)) - Real(z(j, l)));
        if (!CertainlyAtMost(See(i)->residual[ToSize(k)].lower, exact)) return false;
      }
  }
  return true;
}

Real TubeMaker::Extension(const std::vector<int>& rows, int k, bool upper, const std::vector<Real>& z) const {
  const Eigen::MatrixXd& L = problem_.declaration.lipschitz;
  std::optional<Real> best;
  for (const int i : rows) {
    Real away;
    for (Eigen::Index l = 0; l < L.cols(); ++l)
      if (L(k, l) > 0) away += Real(L(k, l)) * abs(z[ToSize(l)] - Real(problem_.transitions.z(i, l)));
    const auto seen = See(i);
    const auto& [below, above] = seen->residual[ToSize(k)];
    const Real value = upper ? above + away : below - away;
    best = !best ? value : upper ? min(*best, value) : max(*best, value);
  }
  return best.value_or(Real::Everything());
}

std::optional<Tube> TubeMaker::Follow(const InitialSet& start, const Eigen::MatrixXd& controls,
                                      const std::vector<bool>& upper, const KnownRows& known) const {
  const Declaration& declaration = problem_.declaration;
  const int n = problem_.model->num_states();
  if (!declaration.affine.rows.empty() || !declaration.regions.empty() || declaration.HasErrorInZ() || growing_ ||
      !equations_.IsExact() || problem_.timing.error > 0 || !problem_.transitions.longer.isZero(0) ||
      std::ssize(upper) != n)
    return std::nullopt;
  std::vector<int> rows;
  for (int i = 0; i < problem_.transitions.size(); ++i)
    if (known.Contains(i)) rows.push_back(i);
  if (rows.empty() || !CanExtend(rows)) return std::nullopt;
  Tube motion;
  motion.slices.push_back(WholeOf(start));
  if (!motion.slices[0].columns.empty()) return std::nullopt;
  for (Eigen::Index t = 0; t < controls.cols(); ++t) {
    std::vector<Real> z = motion.slices.back().center;
    for (const double u : controls.col(t)) z.emplace_back(u);
    std::vector<Real> next = equations_.Value(z);
    for (int k = 0; k < n; ++k) {
      const Real by = Extension(rows, k, upper[ToSize(k)], z), &w = disturbance_[ToSize(k)];
      next[ToSize(k)] += upper[ToSize(k)] ? by + w : by - w;
      if (!next[ToSize(k)].IsFinite()) return motion;
    }
    motion.slices.push_back({std::move(next), {}});
  }
  return motion;
}

Failure TubeMaker::NoAffineResidual(int step, int k, bool is_visible) const {
  return {step, "some affine residual of " + problem_.model->state_names()[ToSize(k)] + " agrees with all data", "none",
          "", is_visible};
}

std::optional<Failure> TubeMaker::MakeAffine(const KnownRows& known, Affine& affine) const {
  const Transitions& data = problem_.transitions;
  affine.rows.resize(ToSize(problem_.model->num_states()));
  if (problem_.declaration.affine.rows.empty()) return std::nullopt;
  std::vector<int> kept;
  for (int i = 0; i < data.size(); ++i)
    if (known.Contains(i)) kept.push_back(i);
  const Eigen::MatrixXd z = data.z(kept, affine.columns);
  const auto [first, last] = problem_.domain.Corners();
  for (const int k : problem_.declaration.affine.rows) {
    const std::string& name = problem_.model->state_names()[ToSize(k)];
    std::vector<Real> lower, upper, sizes;
    for (const int i : kept) {
      const auto seen = See(i);
      lower.push_back(seen->residual[ToSize(k)].lower);
      upper.push_back(seen->residual[ToSize(k)].upper);
      sizes.push_back(seen->size[ToSize(k)]);
    }
    AffineRest rest;
    std::vector<int> variables;
    for (int l = 0; l < problem_.model->num_variables(); ++l)
      if (const double slope = problem_.declaration.affine.Rest(k, l); slope > 0) {
        variables.push_back(l);
        rest.slopes.emplace_back(slope);
        // As the certifier has it, in doubles: its slopes depend on it.
        rest.middle.emplace_back(first[ToSize(l)] / 2 + last[ToSize(l)] / 2);
      }
    rest.z = data.z(kept, variables);
    auto row = std::make_unique<AffineRow>(z, lower, upper, sizes, std::move(rest));
    if (row->IsEmpty()) return NoAffineResidual(0, k, row->IsVisiblyEmpty());
    if (!row->IsBounded()) return Failure{0, "data bound the affine residual of " + name, "no bound", "", false};
    if (row->IsAmbiguous())
      return Failure{0, "the slopes of the affine residual of " + name + " are known to the last bit", "a tie", "",
                     false};
    for (std::size_t j = 0; j < affine.columns.size(); ++j)
      if (const double most = problem_.declaration.lipschitz(k, affine.columns[j]);
          most > 0 && CertainlyBelow(Real(most), abs(Real(row->slopes()[j])) - row->reach()[j]))
        return Failure{0, "the slopes of the affine residual of " + name + " are at most what is declared",
                       Real(row->slopes()[j]).text(), "at most " + Real(most).text()};
    affine.rows[ToSize(k)] = std::move(row);
  }
  return std::nullopt;
}

std::optional<Failure> TubeMaker::Advance(Tube& tube, const Query& query, const TubeOptions& options) const {
  const int n = query.slice.dim();
  std::vector<Real> reach = query.half_width;
  for (std::size_t l = 0; l < input_error_.size(); ++l) reach[ToSize(n) + l] += input_error_[l];
  if (const auto failure = LeavesDomain(query.t, query.center, reach)) return failure;
  const auto no_bound = [&](const std::string& what) {
    return Failure{query.t, what + " has no finite enclosure", "", ""};
  };

  Step step;
  step.remainder = Remainder(query, options.split_remainder);
  if (step.remainder.empty()) return no_bound("the nominal model's second derivative");
  for (int k = 0; k < n; ++k) {
    if (query.affine.rows[ToSize(k)]) {
      const std::optional<Bounds> affine = query.affine.Enclose(query, ToSize(k));
      const AffineRow& row = *query.affine.rows[ToSize(k)];
      if (row.IsEmpty()) return NoAffineResidual(query.t, k, row.IsVisiblyEmpty());
      if (!affine) return no_bound("the affine residual");
      step.envelope.push_back(*affine);
      step.slopes.push_back(query.affine.Slopes(ToSize(k), ToSize(n)));
      continue;
    }
    const auto& [bounds, contradiction, slopes, is_tie] = Envelope(query, k, options.known);
    if (is_tie)
      return Failure{query.t, "the slopes of a residual with regions are known to the last bit", "a tie", "", false};
    if (contradiction)
      return Failure{query.t, "some residual is consistent with data and declaration", bounds.lower.text(),
                     "at most " + bounds.upper.text()};
    step.envelope.push_back(equations_.IsExact() ? bounds : Outermost(bounds));
    step.slopes.push_back(slopes);
  }

  const RecordedSet* const recorded = options.follow ? &(*options.follow)[tube.slices.size()] : nullptr;
  const std::vector<Real> input_spread = InputSpread(query);
  std::vector<Real> unexpected = DisturbanceOver(query.acted);
  for (std::size_t k = 0; k < unexpected.size(); ++k) unexpected[k] += of_inputs_[k];
  Offset offset = OffsetOf(query, step, input_spread, unexpected, recorded);
  std::vector<Real> slack(ToSize(n));
  Slice next = Image(query, step, !recorded && options.reduce, offset, slack);
  const Real half(0.5);
  const Box& domain = problem_.domain.state;
  for (int k = 0; k < n; ++k) {  // diag(q), of its own or part of what offsets add
    const auto& [lower, upper] = step.remainder[ToSize(k)];
    next.center[ToSize(k)] += half * (lower + upper);
    const Real q = half * (upper - lower);
    if (problem_.timing.error > 0)
      offset.spread[ToSize(k)] += q;
    else if (!q.IsZero())
      next.columns.push_back(Axis(n, k, q));
  }
  for (int k = 0; k < n; ++k) {  // diag(h + w)
    const auto& [lower, upper] = step.envelope[ToSize(k)];
    // lower > upper where observations contradict each other by so little that doubles do not show it. No residual is
    // admissible then. The certificate has to hold all the same, for those that err by so much more than is allowed.
    next.center[ToSize(k)] += half * (lower + upper);
    const Real h =
        half * abs(upper - lower) + unexpected[ToSize(k)] + input_spread[ToSize(k)] + offset.spread[ToSize(k)];
    if (CertainlyAtMost(h, Real(kNegligible) * (Real(domain.upper()[k]) - Real(domain.lower()[k]))))
      slack[ToSize(k)] += h;
    else if (!h.IsZero())
      next.columns.push_back(Axis(n, k, h));
    if (!(next.center[ToSize(k)] + next.HalfWidth(k) + slack[ToSize(k)]).IsFinite()) return no_bound("the successor");
  }
  const bool followed = recorded && ReduceAs(next, problem_.zonotope_order, recorded->generators, offset.recorded >= 0);
  if (options.reduce && !followed)
    tube.ambiguity = std::max(tube.ambiguity,
                              Reduce(next, problem_.zonotope_order, problem_.timing.error == 0, remainder_rounding_));
  if (!IsZeroColumn(offset.column)) {
    next.offset = static_cast<int>(next.columns.size());
    next.columns.push_back(offset.column);
    for (int k = 0; k < n; ++k)
      if (!next.HalfWidth(k).IsFinite()) return no_bound("the successor");
  }
  tube.recorded_offsets.push_back(offset.recorded);
  for (int k = 0; k < n; ++k)
    if (!slack[ToSize(k)].IsZero()) {
      next.columns.push_back(Axis(n, k, slack[ToSize(k)]));
      ++next.num_slack;
    }
  tube.steps.push_back(std::move(step));
  tube.slices.push_back(std::move(next));
  return std::nullopt;
}

// d x+ / d dt over the slice. Where x+ - x is in proportion to the duration it is (x+ - x) / dt, with x+ - x in
// f0(c) - c + (J - I) G b + remainder and what the inputs' errors add; elsewhere it is over the hull.
std::vector<Real> TubeMaker::Rates(const Query& query, const std::vector<Bounds>& remainder,
                                   const std::vector<Real>& input_spread) const {
  const Real dt(StepOf(*problem_.model)), most = Real(2.0) * Real(problem_.timing.error);
  std::vector<Real> rate = equations_.Rate(query.acted, Around(dt, most)), moved = equations_.Value(query.center);
  const std::vector<FirstDerivative> jacobian = equations_.First(query.center);
  std::vector<Real> spread(rate.size());
  for (const std::vector<Real>& column : query.slice.columns) {
    std::vector<Real> change(rate.size());
    for (std::size_t k = 0; k < change.size(); ++k) change[k] = -column[k];
    for (const auto& [output, variable, value] : jacobian)
      if (ToSize(variable) < change.size()) change[ToSize(output)] += value * column[ToSize(variable)];
    for (std::size_t k = 0; k < change.size(); ++k) spread[k] += abs(change[k]);
  }
  for (std::size_t k = 0; k < rate.size(); ++k)
    if (equations_.IsProportional(static_cast<int>(k)))
      rate[k] = Around(moved[k] - query.center[k] + Real::FromTo(remainder[k].lower, remainder[k].upper),
                       spread[k] + input_spread[k]) /
                dt;
  return rate;
}

// Any d is sound, since what it differs from E g counts as spread: the record's is the one by which its slices hold.
TubeMaker::Offset TubeMaker::OffsetOf(const Query& query, const Step& step, const std::vector<Real>& input_spread,
                                      const std::vector<Real>& unexpected, const RecordedSet* recorded) const {
  const std::vector<Bounds>& envelope = step.envelope;
  const std::size_t n = envelope.size();
  Offset offset{std::vector<Real>(n), std::vector<Real>(n)};
  const StepTiming& timing = problem_.timing;
  if (timing.error == 0) return offset;
  const Real error(timing.error), dt(StepOf(*problem_.model)), ends(query.t == 0 ? 1.0 : 2.0);
  const std::vector<Real> rate = Rates(query, step.remainder, input_spread);
  const Real growth = Growth(ends * error / dt);
  const auto is_set = [&](std::size_t k) { return std::ranges::count(timing.set_at_steps, static_cast<int>(k)) > 0; };
  const auto declared = [&](std::size_t k) {
    return timing.rate_bound.size() > 0 ? timing.rate_bound[static_cast<Eigen::Index>(k)] : kNone;
  };
  std::vector<Real> moved(n);
  for (std::size_t k = 0; k < n; ++k)
    if (!is_set(k) && declared(k) == kNone) moved[k] = error * rate[k], offset.column[k] = moved[k].middle();
  if (recorded) offset.recorded = NearestGenerator(*recorded, offset.column);
  for (std::size_t k = 0; k < n; ++k) {
    if (offset.recorded >= 0) offset.column[k] = recorded->generators(static_cast<Eigen::Index>(k), offset.recorded);
    if (is_set(k)) {
      offset.spread[k] = ends * abs(offset.column[k]);
    } else if (declared(k) < kNone) {
      offset.spread[k] = ends * (error * Real(declared(k)) + abs(offset.column[k]));
    } else {
      Real unknown = max(abs(envelope[k].lower), abs(envelope[k].upper)) + unexpected[k];
      for (std::size_t l = 0; l < step.slopes[k].size(); ++l)
        unknown += abs(Real(step.slopes[k][l])) * query.half_width[l];
      offset.spread[k] = ends * (moved[k] - offset.column[k]).magnitude() + growth * unknown;
    }
  }
  return offset;
}

// <f0(c), (J + A) G>, A the step's slopes. With parameters that are intervals, the middles; `slack` then is set
// to what they may be off, coordinate by coordinate, the slice's own slack included. What stays of the offset before is
// a column, or `boxed` into the spread.
Slice TubeMaker::Image(const Query& query, const Step& step, bool boxed, Offset& offset,
                       std::vector<Real>& slack) const {
  const std::size_t n = slack.size(), num_columns = query.slice.columns.size() - query.slice.num_slack;
  Slice next;
  next.center = equations_.Value(query.center);
  const std::vector<FirstDerivative> jacobian = equations_.First(query.center);
  const auto stay = [&](std::vector<Real> column) {  // of the offset before
    for (std::size_t k = 0; k < n && boxed; ++k) offset.spread[k] += column[k].magnitude();
    if (!boxed && !IsZeroColumn(column)) next.columns.push_back(std::move(column));
  };
  for (std::size_t j = 0; j < query.slice.columns.size(); ++j) {
    const std::vector<Real>& column = query.slice.columns[j];
    std::vector<Real> image(n);
    for (const auto& [output, variable, value] : jacobian)
      if (ToSize(variable) < n && !column[ToSize(variable)].IsZero())
        image[ToSize(output)] += value * column[ToSize(variable)];
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t l = 0; l < step.slopes[k].size(); ++l)
        if (const double slope = step.slopes[k][l]; slope != 0) image[k] += Real(slope) * column[l];
    const bool is_offset = static_cast<int>(j) == query.slice.offset;
    if (is_offset)
      for (std::size_t k = 0; k < n; ++k) image[k] -= offset.column[k];
    if (j >= num_columns)
      for (std::size_t k = 0; k < n; ++k) slack[k] += image[k].magnitude();
    else if (is_offset)
      stay(std::move(image));
    else if (!IsZeroColumn(image))
      next.columns.push_back(std::move(image));
  }
  if (query.t > 0 && query.slice.offset < 0) stay(offset.column);
  if (equations_.IsExact()) return next;
  for (std::size_t k = 0; k < n; ++k) {
    Round(next.center[k], slack[k]);
    for (std::vector<Real>& column : next.columns) Round(column[k], slack[k]);
  }
  return next;
}

std::optional<Failure> TubeMaker::LeavesDomain(int t, const std::vector<Real>& centers,
                                               const std::vector<Real>& half_width) const {
  const Domain& domain = problem_.domain;
  const auto refuse = [&](const std::string& what, const Real& found, const Real& bound, Answer answer,
                          const char* relation = "at most ") {
    const Real scale = max(abs(found), abs(bound));
    return Failure{t,
                   "the tube stays in the domain: " + what,
                   found.text(),
                   relation + bound.text(),
                   answer == Answer::kNo,
                   scale.IsZero() ? 1 : (abs(found - bound) / scale).ToDouble()};
  };
  const int n = domain.state.dim();
  const std::vector<std::string> names = problem_.model->variable_names();
  for (int l = 0; l < static_cast<int>(centers.size()); ++l) {
    const Real lower(l < n ? domain.state.lower()[l] : domain.input.lower()[l - n]);
    const Real upper(l < n ? domain.state.upper()[l] : domain.input.upper()[l - n]);
    const Real &center = centers[ToSize(l)], &r = half_width[ToSize(l)];
    const std::string& name = names[ToSize(l)];
    if (const Answer a = IsAtMost(lower, center - r); a != Answer::kYes)
      return refuse(name, center - r, lower, a, "at least ");
    if (const Answer a = IsAtMost(center + r, upper); a != Answer::kYes) return refuse(name, center + r, upper, a);
  }
  for (std::size_t i = 0; i < domain.inequalities.size(); ++i) {
    const auto& [coefficients, bound] = domain.inequalities[i];
    Real largest;
    for (Eigen::Index l = 0; l < coefficients.size(); ++l) {
      const Real c(coefficients[l]);
      largest += c * centers[ToSize(l)] + abs(c) * half_width[ToSize(l)];
    }
    if (const Answer a = IsAtMost(largest, bound); a != Answer::kYes)
      return refuse("inequality " + std::to_string(i), largest, bound, a);
  }
  for (std::size_t i = 0; i < domain.balls.size(); ++i) {
    const auto& [coordinates, center, radius] = domain.balls[i];
    Real square;
    for (Eigen::Index c = 0; c < center.size(); ++c) {
      const auto l = ToSize(coordinates[ToSize(c)]);
      square += sqr(abs(centers[l] - Real(center[c])) + half_width[l]);
    }
    if (const Answer a = IsAtMost(square, sqr(Real(radius))); a != Answer::kYes)
      return refuse("ball " + std::to_string(i), sqrt(square), radius, a);
  }
  return std::nullopt;
}

// With f0(z) = f0(c) + J (z - c) + int_0^1 (1 - s) (z - c)^T H(c + s (z - c)) (z - c) ds: over s <= 1/2 the argument
// stays in half the box, and that part of the integral of 1 - s weighs 3/4.
std::vector<Bounds> TubeMaker::Remainder(const Query& query, bool split) const {
  const int n = query.slice.dim();
  // A variable that is a point has d = 0. f0 is a function of the others alone then: what has no bound along a point,
  // as at a kink, is no part of its remainder.
  const auto second = [&](const std::vector<Real>& box) {
    std::vector<SecondDerivative> hessian = equations_.Second(box);
    for (SecondDerivative& entry : hessian)
      if (query.half_width[ToSize(entry.row)].IsZero() || query.half_width[ToSize(entry.column)].IsZero())
        entry.value = Real();
    return hessian;
  };
  const std::vector<SecondDerivative> whole = second(query.hull);
  if (!AllFinite(whole)) return {};
  std::vector<Bounds> bounds = RemainderOver(whole, query.slice, query.half_width, n, method_);
  if (!split) return bounds;
  const auto inner = RemainderOver(second(query.Box(Real(0.5))), query.slice, query.half_width, n, method_);
  for (std::size_t k = 0; k < bounds.size(); ++k) {
    bounds[k].lower = Real(0.25) * bounds[k].lower + Real(0.75) * inner[k].lower;
    bounds[k].upper = Real(0.25) * bounds[k].upper + Real(0.75) * inner[k].upper;
  }
  return bounds;
}

// One row k of L over one Z_t. D_i = max_s |sum_l s_l L_l (c_l - z_il)| + sum_j |sum_l s_l L_l G_lj| over the signs s
// of the nonzero columns l, or over the hull: sum_l L_l (|c_l - z_il| + r_l).
struct TubeMaker::Row {
  const Query& query;
  std::vector<int> columns;
  std::vector<double> slopes;
  bool exact;
  std::size_t patterns;
  // Doubles choose; scale bounds all that goes into one of them but the observation.
  std::vector<double> center, spread;
  double scale = 0;
  mutable std::vector<std::optional<Real>> exact_spread;

  Row(const Declaration& declaration, const Query& set, int k) : query(set) {
    for (int l = 0; l < static_cast<int>(set.center.size()); ++l)
      if (declaration.lipschitz(k, l) > 0) {
        columns.push_back(l);
        slopes.push_back(declaration.lipschitz(k, l));
        center.push_back(set.center[ToSize(l)].ToDouble());
        scale += slopes.back() * (std::abs(center.back()) + set.half_width[ToSize(l)].ToDouble());
      }
    exact = columns.size() <= kMaxExactColumns;
    patterns = exact && !columns.empty() ? std::size_t{1} << (columns.size() - 1) : 1;  // s and -s give the same
    exact_spread.resize(patterns);
    std::vector<std::vector<double>> generators;
    for (const auto& column : set.slice.columns) {
      std::vector<double>& entries = generators.emplace_back();
      for (const int l : columns) entries.push_back(l < set.slice.dim() ? column[ToSize(l)].ToDouble() : 0);
    }
    for (std::size_t s = 0; s < patterns; ++s) {
      double sum = 0;
      for (const auto& entries : generators) {
        double along = 0;
        for (std::size_t l = 0; l < columns.size(); ++l) along += Sign(s, l) * slopes[l] * entries[l];
        sum += std::abs(along);
      }
      spread.push_back(sum);
    }
    if (!exact) spread[0] = Spread(0).ToDouble();
  }

  static double Sign(std::size_t pattern, std::size_t column) { return pattern >> column & 1 ? -1 : 1; }

  [[nodiscard]] const Real& Spread(std::size_t s) const {
    if (exact_spread[s]) return *exact_spread[s];
    Real sum;
    if (!exact)
      for (std::size_t l = 0; l < columns.size(); ++l) sum += Real(slopes[l]) * query.half_width[ToSize(columns[l])];
    if (exact)
      for (const auto& column : query.slice.columns) {
        Real along;
        for (std::size_t l = 0; l < columns.size(); ++l)
          if (columns[l] < query.slice.dim() && !column[ToSize(columns[l])].IsZero())
            along += Real(Sign(s, l) * slopes[l]) * column[ToSize(columns[l])];
        sum += abs(along);
      }
    exact_spread[s] = sum;
    return *exact_spread[s];
  }

  [[nodiscard]] double Roughly(const Eigen::MatrixXd& z, int i, std::size_t s) const {
    double sum = 0;
    for (std::size_t l = 0; l < columns.size(); ++l) {
      const double away = slopes[l] * (center[l] - z(i, columns[l]));
      sum += exact ? Sign(s, l) * away : std::abs(away);
    }
    return std::abs(sum) + spread[s];
  }

  [[nodiscard]] double ScaleAt(const Eigen::MatrixXd& z, int i) const {
    double sum = scale;
    for (std::size_t l = 0; l < columns.size(); ++l) sum += slopes[l] * std::abs(z(i, columns[l]));
    return sum;
  }

  // D_i of all observations.
  [[nodiscard]] Eigen::ArrayXd Roughly(const Eigen::MatrixXd& z) const {
    Eigen::ArrayXd largest = Eigen::ArrayXd::Zero(z.rows()), sum(z.rows());
    for (std::size_t s = 0; s < patterns; ++s) {
      sum.setZero();
      for (std::size_t l = 0; l < columns.size(); ++l) {
        const auto away = slopes[l] * (center[l] - z.col(columns[l]).array());
        if (exact)
          sum += Sign(s, l) * away;
        else
          sum += away.abs();
      }
      largest = largest.max(sum.abs() + spread[s]);
    }
    return largest;
  }

  // Plain sums of some hundred doubles are good to 2^-40 of their scale while nothing under- or overflows: a pattern
  // that falls short of the largest by more than that is not the maximum.
  [[nodiscard]] Real Distance(const Eigen::MatrixXd& z, int i) const {
    std::vector<double> rough;
    for (std::size_t s = 0; s < patterns; ++s) rough.push_back(Roughly(z, i, s));
    const double total = ScaleAt(z, i), largest = *std::ranges::max_element(rough);
    const bool trusted = total > 1e-250 && total < 1e250;
    Real distance;
    for (std::size_t s = 0; s < patterns; ++s) {
      if (trusted && rough[s] < largest - 0x1p-38 * total) continue;
      Real sum;
      for (std::size_t l = 0; l < columns.size(); ++l) {
        const Real away = Real(slopes[l]) * (query.center[ToSize(columns[l])] - Real(z(i, columns[l])));
        sum += exact ? Real(Sign(s, l)) * away : abs(away);
      }
      distance = max(distance, abs(sum) + Spread(s));
    }
    return distance;
  }
};

// Every observation gives a bound; doubles choose those that may give the tightest. They are good to 2^-36 of what goes
// into a distance, and to 2^-50 of a residual.
TubeMaker::Known TubeMaker::Envelope(const Query& query, int k, const KnownRows& known) const {
  const Row row(problem_.declaration, query, k);
  const Eigen::MatrixXd& z = problem_.transitions.z;
  const RoughResiduals& rough = rough_residuals_[ToSize(k)];
  const auto array = [&](const std::vector<double>& of) {
    return Eigen::Map<const Eigen::ArrayXd>(of.data(), z.rows());
  };
  const Eigen::ArrayXd distance = row.Roughly(z), lower = array(rough.lower) - distance,
                       upper = array(rough.upper) + distance,
                       slack = 0x1p-36 * (row.scale + array(rough.scale)) +
                               0x1p-50 * (array(rough.lower).abs() + array(rough.upper).abs());
  double highest = -kNone, lowest = kNone;
  bool trusted = true;
  const auto for_each = [&](const auto& visit) {
    for (int i = 0; i < problem_.transitions.size(); ++i)
      if (known.Contains(i)) visit(i);
  };
  for_each([&](int i) {
    trusted &= slack[i] > 1e-250;
    highest = std::max(highest, lower[i] - slack[i]);
    lowest = std::min(lowest, upper[i] + slack[i]);
  });
  std::vector<int> tight;
  for_each([&](int i) {
    if (!trusted || !(lower[i] + slack[i] < highest && upper[i] - slack[i] > lowest)) tight.push_back(i);
  });
  // A robot that stands records one step again and again.
  const auto less = [&](int i, int j) { return IsLess(problem_.transitions, i, j); };
  std::ranges::sort(tight, less);
  tight.erase(std::unique(tight.begin(), tight.end(), [&](int i, int j) { return !less(i, j); }), tight.end());
  const auto intersect = [&](bool in_doubt) {
    std::optional<Bounds> tightest;
    for (const int i : tight) {
      Real away = row.Distance(z, i);
      const auto seen = See(i);
      if (in_doubt) away += Real(kSeenInDoubles) * (seen->size[ToSize(k)] + Real(row.ScaleAt(z, i)));
      const auto& [below, above] = seen->residual[ToSize(k)];
      tightest = tightest ? Bounds{max(tightest->lower, below - away), min(tightest->upper, above + away)}
                          : Bounds{below - away, above + away};
    }
    AddRegions(query, k, known, in_doubt, *tightest);
    return *tightest;
  };
  const auto contradicts = [](const Bounds& bounds) { return CertainlyBelow(bounds.upper, bounds.lower); };
  const Bounds bounds = intersect(false);
  // Again with doubts in their favour as large as rounding to doubles could give rise to.
  Known result{bounds, contradicts(bounds) && contradicts(intersect(true))};
  if (!result.contradiction) Tilt(query, k, known, result);
  return result;
}

// Bounds the size of what goes into an observation and its ways.
Real TubeMaker::ScaleAt(int k, const Seen& seen) const {
  const Problem& problem = problem_;
  const auto [lower, upper] = problem.domain.Corners();
  Real size = seen.size[ToSize(k)];
  for (std::size_t l = 0; l < lower.size(); ++l)
    size += Real(problem.declaration.lipschitz(k, static_cast<Eigen::Index>(l))) *
            Real(std::max(std::abs(lower[l]), std::abs(upper[l])));
  return size;
}

// What some transitions say at the nodes of a grid (ways.h), and the largest of their sizes.
struct TubeMaker::Lattice {
  Nodes nodes;
  std::vector<bool> added = {};
  std::ptrdiff_t count = 0;
  Real size = {};
};

// Made of the largest one there is of a part of these transitions: those of a log become ever more.
std::shared_ptr<const TubeMaker::Lattice> TubeMaker::LatticeOf(int k, const KnownRows& known) const {
  constexpr std::size_t kKept = 4;
  const Transitions& data = problem_.transitions;
  std::vector<bool> wanted;
  for (int i = 0; i < data.size(); ++i) wanted.push_back(known.Contains(i));
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<const Lattice>>& lattices = lattices_[k];
  std::shared_ptr<const Lattice> best;
  for (const auto& lattice : lattices) {
    bool is_part = !best || lattice->count > best->count;
    for (std::size_t i = 0; i < lattice->added.size() && is_part; ++i) is_part = !lattice->added[i] || wanted[i];
    if (is_part) best = lattice;
  }
  if (best && best->count == std::ranges::count(wanted, true)) return best;
  const auto lattice = std::make_shared<Lattice>(best ? *best : Lattice{Nodes(ways_, k)});
  lattice->added.resize(wanted.size());
  for (int i = 0; i < data.size(); ++i) {
    if (!wanted[ToSize(i)] || lattice->added[ToSize(i)]) continue;
    const auto seen = See(i);
    const auto& [lower, upper] = seen->residual[ToSize(k)];
    if (lower.IsFinite() && upper.IsFinite()) {
      lattice->size = max(lattice->size, ScaleAt(k, *seen));
      lattice->nodes.Add(data.z.row(i), lower, upper);
    }
    lattice->added[ToSize(i)] = true;
    ++lattice->count;
  }
  lattice->nodes.Spread();
  lattices.push_back(lattice);
  if (lattices.size() > kKept) lattices.erase(lattices.begin());
  return lattice;
}

// Bounds relative to slopes at nodes where they are much narrower: the certifier's choice, which claims nothing.
void TubeMaker::Tilt(const Query& query, int k, const KnownRows& rows, Known& known) const {
  const std::vector<int> variables = ways_.Axes(k);
  if (!ways_.Narrow(k) || variables.empty()) return;
  const auto lattice = LatticeOf(k, rows);
  const auto slopes = lattice->nodes.SlopesOver(query.center, query.half_width);
  known.is_tie = !slopes;
  if (!slopes || *slopes == Nodes::Slopes{}) return;
  const auto [lower, upper] = lattice->nodes.Over(query.hull, *slopes, query.center);
  Real width = upper - lower;
  for (std::size_t a = 0; a < variables.size(); ++a)
    width += Real(0.53) * Real(2.0) * abs(Real((*slopes)[a])) * query.half_width[ToSize(variables[a])];
  const double least = 0.999 * (known.bounds.upper - known.bounds.lower).ToDouble(), much = width.ToDouble();
  known.is_tie = std::abs(much - least) <= 0x1p-30 * std::abs(least);
  if (!(much < least)) return;
  known.bounds = {lower, upper};
  known.slopes.resize(query.slice.center.size());
  for (std::size_t a = 0; a < variables.size(); ++a)
    if (ToSize(variables[a]) < known.slopes.size()) known.slopes[ToSize(variables[a])] = (*slopes)[a];
}

// `bounds` narrowed by what regions say of the residual, and by ways through them. Doubles choose those that may narrow
// them.
void TubeMaker::AddRegions(const Query& query, int k, const KnownRows& known, bool in_doubt, Bounds& bounds) const {
  if (problem_.declaration.AnyRegionHas(&Region::bound)) {
    const double most = ways_.Largest(&Region::bound, k, kNone, DoublesAround(query.hull));
    if (most < kNone) bounds = {max(bounds.lower, Real(-most)), min(bounds.upper, Real(most))};
  }
  if (!ways_.Narrow(k)) return;
  const std::size_t axes = ways_.Axes(k).size();
  if (axes > 0) {
    const auto lattice = LatticeOf(k, known);
    const auto [lower, upper] = lattice->nodes.Over(query.hull, {}, query.center);
    const Real doubt = in_doubt ? Real(kSeenInDoubles) * lattice->size : Real();
    bounds = {max(bounds.lower, lower - doubt), min(bounds.upper, upper + doubt)};
    if (axes < 3) return;  // In three variables single observations count, too (3.20).
  }
  const Row row(problem_.declaration, query, k);
  const Transitions& data = problem_.transitions;
  Ways::Box hull = DoublesAround(query.hull);
  ways_.Cut(hull);
  const RoughResiduals& rough = rough_residuals_[ToSize(k)];
  const double floor = bounds.lower.ToDouble(), ceiling = bounds.upper.ToDouble();
  for (int i = 0; i < data.size(); ++i) {
    if (!known.Contains(i)) continue;
    // Doubles, good to 2^-50, tell of most that they do not narrow, however near they were.
    const double below = rough.lower[ToSize(i)], above = rough.upper[ToSize(i)],
                 slack = 0x1p-50 * (std::abs(below) + std::abs(above) + std::abs(floor) + std::abs(ceiling));
    if (below + slack < floor && above - slack > ceiling) continue;
    const Eigen::VectorXd z = data.z.row(i);
    const auto seen = See(i);
    const auto& [lower, upper] = seen->residual[ToSize(k)];
    const auto narrows = [&, &low = lower, &high = upper](const Real& away) {
      return !CertainlyAtMost(low - away, bounds.lower) || !CertainlyAtMost(bounds.upper, high + away);
    };
    if (!narrows(Real())) continue;
    if (const double scale = row.ScaleAt(data.z, i); scale > 1e-250 && scale < 1e250)
      if (!narrows(max(Real(), Real(ways_.Cheapest<double>(k, z, hull)) - Real(0x1p-36 * scale)))) continue;
    Real away = ways_.Cheapest<Real>(k, z, hull);
    if (in_doubt) away += Real(kSeenInDoubles) * (seen->size[ToSize(k)] + Real(row.ScaleAt(data.z, i)));
    bounds = {max(bounds.lower, lower - away), min(bounds.upper, upper + away)};
  }
}

}  // namespace forereach::verifier
