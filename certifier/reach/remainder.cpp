#include "certifier/reach/remainder.h"

#include <algorithm>
#include <cmath>

namespace forereach {
namespace {

// Above all relative rounding of the few operations below, whose results are compared with the sum of their terms' sizes.
constexpr double kRelative = 0x1p-44, kTiny = 0x1p-1060;

double Margin(double error) { return kCountsRounding ? error : 0; }

double Size(const PlainInterval& x) { return std::max(std::abs(x.lower), std::abs(x.upper)); }

// [lower, upper] of a term, and the sum of the sizes it was made of.
struct TermRange {
  double lower, upper, size;
};

TermRange Diagonal(const PlainInterval& h, double r) {
  const double half_square = r * r / 2;
  return {half_square * std::min(0.0, h.lower), half_square * std::max(0.0, h.upper), half_square * Size(h)};
}

// max over 0 <= s <= r of 1/2 a s^2 + b s, b >= 0.
double Peak(double a, double b, double r) {
  return -a * r > b ? b * (b / (-2 * a)) : std::max(0.0, (a * r / 2 + b) * r);
}

// d_i d_l in [-negative, positive].
struct ProductRange {
  double negative, positive;
};

FOREREACH_INLINE ProductRange MixedProduct(const Zonotope& slice, std::size_t i, std::size_t l, double r_i, double r_l) {
  const double product = r_i * r_l;
  if (!(product > 0x1p-400)) return {product, product};  // the squares below could underflow
  const double* g_i = slice.padded_row(static_cast<int>(i)).data();
  const double* g_l = slice.padded_row(static_cast<int>(l)).data();
  Lanes sum = AllLanes(0), difference = AllLanes(0);
  for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) {
    const Lanes a = LoadLanes(g_i + j) * AllLanes(r_l), b = LoadLanes(g_l + j) * AllLanes(r_i);
    sum += Abs(a + b);
    difference += Abs(a - b);
  }
  const double slack = slice.slack(static_cast<int>(i)) * r_l + slice.slack(static_cast<int>(l)) * r_i;
  const double plus = Sum(sum) + slack, minus = Sum(difference) + slack;
  return {std::min(product, minus * minus / (4 * product)), std::min(product, plus * plus / (4 * product))};
}

using MixedProductFunction = ProductRange(const Zonotope&, std::size_t, std::size_t, double, double);

FOREREACH_AVX2 ProductRange MixedProductAvx2(const Zonotope& slice, std::size_t i, std::size_t l, double r_i, double r_l) {
  return MixedProduct(slice, i, l, r_i, r_l);
}
FOREREACH_FLATTEN ProductRange MixedProductBaseline(const Zonotope& slice, std::size_t i, std::size_t l, double r_i, double r_l) {
  return MixedProduct(slice, i, l, r_i, r_l);
}

TermRange Mixed(const PlainInterval& h, const ProductRange& d, double product) {
  return {std::min(std::min(h.lower * d.positive, h.upper * d.positive), std::min(-h.lower * d.negative, -h.upper * d.negative)),
          std::max(std::max(h.lower * d.positive, h.upper * d.positive), std::max(-h.lower * d.negative, -h.upper * d.negative)),
          Size(h) * product};
}

}  // namespace

RemainderBound::RemainderBound(const Program& program, Method method)
    : states_(static_cast<std::size_t>(program.states)), method_(method) {
  std::vector<Term> diagonals;
  for (std::size_t e = 0; e < static_cast<std::size_t>(program.num_second); ++e) {
    const Program::Second& entry = program.hessian[e];
    if (entry.row >= program.states || entry.column >= program.states) continue;  // an input is a point: d = 0
    const Term term{static_cast<std::size_t>(entry.output), static_cast<std::size_t>(entry.row),
                    static_cast<std::size_t>(entry.column), e, false, 0, 0};
    (entry.row == entry.column ? diagonals : terms_).push_back(term);
    entries_.push_back({term.output, term.first, term.second, e, entry.row == entry.column ? 0.5 : 1});
  }
  for (const Term& diagonal : diagonals) {
    const auto shares = [&](const Term& term) {
      return term.output == diagonal.output && term.first != term.second && !term.has_diagonal &&
             (term.first == diagonal.first || term.second == diagonal.first);
    };
    const auto partner = std::ranges::find_if(terms_, shares);
    if (partner == terms_.end()) {
      terms_.push_back(diagonal);
      continue;
    }
    if (partner->first != diagonal.first) std::swap(partner->first, partner->second);
    partner->has_diagonal = true;
    partner->diagonal = diagonal.entry;
  }
  for (Term& term : terms_) {
    const Pair pair{std::min(term.first, term.second), std::max(term.first, term.second)};
    if (pair.first == pair.second) continue;
    const auto known = std::ranges::find(pairs_, pair);
    term.pair = static_cast<std::size_t>(known - pairs_.begin());
    if (known == pairs_.end()) pairs_.push_back(pair);
  }
}

void RemainderBound::Enclose(const Zonotope& slice, const double* half_width, const PlainInterval* hessian, const double* error,
                             Remainder& out) const noexcept {
  if (method_ == Method::kPaper)
    EncloseSizes(half_width, hessian, error, out);
  else
    EncloseCentred(slice, half_width, hessian, error, out);
}

void RemainderBound::EncloseSizes(const double* half_width, const PlainInterval* hessian, const double* error,
                                  Remainder& out) const noexcept {
  std::fill_n(out.center.begin(), states_, 0.0);
  std::fill_n(out.half_width.begin(), states_, 0.0);
  for (const Entry& entry : entries_) {
    const PlainInterval& h = hessian[entry.index];
    const double r = half_width[entry.first], other = half_width[entry.second];
    if (r == 0 || other == 0) continue;  // exactly zero
    out.half_width[entry.output] += entry.weight * Size(h) * (r * other + kTiny) * (1 + kRelative) + Margin(error[entry.index]);
  }
}

void RemainderBound::EncloseCentred(const Zonotope& slice, const double* half_width, const PlainInterval* hessian,
                                    const double* error, Remainder& out) const noexcept {
  struct Sum {
    double lower, upper, size, margin;
  };
  std::array<Sum, kMaxStates> sums;
  std::fill_n(sums.begin(), states_, Sum{0, 0, 0, 0});
  std::array<ProductRange, Program::kMaxSecond> products;
  MixedProductFunction* mixed_product =
      active_instruction_set == InstructionSet::kAvx2 ? MixedProductAvx2 : MixedProductBaseline;
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const auto [i, l] = pairs_[p];
    products[p] = mixed_product(slice, i, l, half_width[i], half_width[l]);
  }
  for (const Term& term : terms_) {
    const double r = half_width[term.first], other = half_width[term.second];
    Sum& sum = sums[term.output];
    TermRange range{0, 0, 0};
    if (r == 0) continue;  // exactly zero, and so is the mixed term where `other` is
    if (other != 0) {
      const PlainInterval& h = hessian[term.entry];
      range = term.first == term.second ? Diagonal(h, r) : Mixed(h, products[term.pair], r * other);
      sum.margin += Margin(error[term.entry]) + kTiny * Size(h);
    }
    if (term.has_diagonal) {
      const PlainInterval& a = hessian[term.diagonal];
      const TermRange diagonal = Diagonal(a, r);
      const double slope = other == 0 ? 0 : Size(hessian[term.entry]) * other;
      range = {std::max(range.lower + diagonal.lower, -Peak(-a.lower, slope, r)),
               std::min(range.upper + diagonal.upper, Peak(a.upper, slope, r)), range.size + diagonal.size};
      sum.margin += Margin(error[term.diagonal]) + kTiny * Size(a);
    }
    sum.lower += range.lower;
    sum.upper += range.upper;
    sum.size += range.size;
  }
  for (std::size_t k = 0; k < states_; ++k) {
    const auto& [lower, upper, size, margin] = sums[k];
    const double rounding = RoundingError(kRelative, size) + margin * (1 + kRelative);
    out.center[k] = (lower + upper) / 2;
    out.half_width[k] = (upper - lower) / 2 + rounding;
  }
}

}  // namespace forereach
