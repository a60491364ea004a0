#include "verifier/containment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "forereach/numerics/size.h"

namespace forereach::verifier {
namespace {

// The coordinate of a column's only entry that is not zero, -1 if it has several or none.
template <class Column, class IsZero>
int AxisOf(const Column& column, int dim, const IsZero& is_zero) {
  int axis = -1;
  for (int k = 0; k < dim; ++k) {
    if (is_zero(column[ToSize(k)])) continue;
    if (axis >= 0) return -1;
    axis = k;
  }
  return axis;
}

class ContainmentSearch {
 public:
  ContainmentSearch(const Slice& inner, const Eigen::VectorXd& center, const Eigen::MatrixXd& generators)
      : inner_(inner),
        center_(center),
        generators_(generators),
        rounded_(inner.RoundedColumns()),
        scaled_(generators),
        taken_(ToSize(generators.cols())),
        pairs_(rounded_.size()) {
    for (Eigen::Index i = 0; i < generators.cols(); ++i) {
      axis_.push_back(AxisOf(generators.col(i), inner.dim(), [](double g) { return g == 0; }));
      taken_[ToSize(i)] = axis_.back() >= 0;  // those make up for the rest
    }
    // What is far in one coordinate may be near in another that the set reaches further in.
    for (Eigen::Index k = 0; k < generators.rows(); ++k) {
      const double half_width = generators.row(k).cwiseAbs().sum();
      if (!(half_width > 0 && std::isfinite(1 / half_width))) continue;
      scaled_.row(k) /= half_width;
      for (Eigen::VectorXd& column : rounded_) column[k] /= half_width;
    }
  }

  [[nodiscard]] Containment Run() {
    if (PairByOrder() && !Uncovered()) return {};
    PairByNearness();
    if (const auto uncovered = Uncovered()) return Refuted().value_or(*uncovered);
    return {};
  }

 private:
  struct Pair {
    Eigen::Index generator;
    double gamma;
    double rest;  // of the column, relative to it
  };

  // Pairs them in the order that a certifier with the same rules writes. False if the numbers differ.
  bool PairByOrder() {
    Eigen::Index i = 0;
    for (std::size_t j = 0; j < rounded_.size(); ++j) {
      if (IsAlongAnAxis(j)) continue;
      while (i < generators_.cols() && axis_[ToSize(i)] >= 0) ++i;
      if (i == generators_.cols()) return false;
      const double gamma = rounded_[j].dot(scaled_.col(i)) < 0 ? -1 : 1;
      const double rest = (rounded_[j] - gamma * scaled_.col(i)).lpNorm<1>();
      pairs_[j] = Pair{i++, gamma, rest == 0 ? 0 : rest / rounded_[j].lpNorm<1>()};
    }
    return true;
  }

  // First those that are the same up to rounding, so that of nearly parallel ones each takes its own, at last any of
  // which a part helps. A column along an axis here may have got a tiny second entry there.
  void PairByNearness() {
    std::ranges::fill(pairs_, std::nullopt);
    const auto take = [&](bool whole, double worst, double worst_of_axis) {
      for (std::size_t j = 0; j < rounded_.size(); ++j)
        if (!pairs_[j]) TakeNearest(j, whole, IsAlongAnAxis(j) ? worst_of_axis : worst);
    };
    for (const double worst : {1e-14, 1e-13, 1e-11, 1e-9, 1e-6, 1e-3}) take(true, worst, worst);
    take(false, 1.0, 1e-3);
  }

  [[nodiscard]] std::optional<Containment> Uncovered() const {
    // A generator that is a little longer is not taken whole; one that differs by rounding alone is, for a coordinate
    // with nothing to make up for it has to agree exactly. Where to draw the line is tried.
    std::optional<Containment> first;
    for (const double line : {1e-13, 1e-15, 1e-11, 1.0, 0.0}) {
      const std::optional<Containment> uncovered = Uncovered(line);
      if (!uncovered) return {};
      if (!first) first = uncovered;
    }
    return first;
  }

  [[nodiscard]] bool IsAlongAnAxis(std::size_t j) const {
    return AxisOf(inner_.columns[j], inner_.dim(), [](const Real& entry) { return entry.IsZero(); }) >= 0;
  }

  // What is left may be `worst` times the column, in the sum of its entries. @param whole take all of a generator.
  void TakeNearest(std::size_t j, bool whole, double worst) {
    const Eigen::VectorXd& d = rounded_[j];
    double least = worst * d.lpNorm<1>();
    for (Eigen::Index i = 0; i < generators_.cols(); ++i) {
      if (taken_[ToSize(i)]) continue;
      const auto g = scaled_.col(i);
      const double along = d.dot(g);
      const double gamma = whole ? (along < 0 ? -1 : 1) : std::clamp(along / g.squaredNorm(), -1.0, 1.0);
      const double rest = (d - gamma * g).lpNorm<1>();
      if (!(rest < least)) continue;  // NaN, where a product under- or overflowed, is no choice
      least = rest;
      pairs_[j] = Pair{i, gamma, rest / d.lpNorm<1>()};
    }
    if (pairs_[j]) taken_[ToSize(pairs_[j]->generator)] = true;
  }

  // The gamma of a pair, |gamma| <= 1 for certain.
  [[nodiscard]] Real Gamma(std::size_t j, double line) const {
    const auto& [generator, gamma, rest] = *pairs_[j];
    if (std::abs(gamma) < 1 || rest <= line) return gamma;
    Eigen::Index k = 0;
    generators_.col(generator).cwiseAbs().maxCoeff(&k);
    const Real share = (inner_.columns[j][ToSize(k)] / Real(generators_(k, generator))).middle();
    return CertainlyAtMost(abs(share), 1.0) ? share : Real(gamma);
  }

  // The first coordinate that is not covered.
  [[nodiscard]] std::optional<Containment> Uncovered(double line) const {
    std::vector<Real> gamma;
    for (std::size_t j = 0; j < pairs_.size(); ++j) gamma.push_back(pairs_[j] ? Gamma(j, line) : Real());
    for (int k = 0; k < inner_.dim(); ++k)
      if (auto uncovered = Uncovered(k, gamma)) return uncovered;
    return std::nullopt;
  }

  [[nodiscard]] std::optional<Containment> Uncovered(int k, const std::vector<Real>& gamma) const {
    Real need = abs(inner_.center[ToSize(k)] - Real(center_[k])), room;
    for (std::size_t j = 0; j < pairs_.size(); ++j) {
      const Real& d = inner_.columns[j][ToSize(k)];
      if (!pairs_[j]) {
        if (!d.IsZero()) need += abs(d);
        continue;
      }
      const double g = generators_(k, pairs_[j]->generator);
      if (g != 0 || !d.IsZero()) need += abs(d - gamma[j] * Real(g));
    }
    for (Eigen::Index i = 0; i < generators_.cols(); ++i)
      if (axis_[ToSize(i)] == k) room += Real(std::abs(generators_(k, i)));
    if (CertainlyAtMost(need, room)) return std::nullopt;
    return Containment{Answer::kUnknown, k, need, room, SizeOf(k)};
  }

  [[nodiscard]] Real SizeOf(int k) const { return abs(inner_.center[ToSize(k)]) + inner_.HalfWidth(k); }

  // Along e_i / r_i +- e_k / r_k, with r the half-widths there: where two coordinates are tied together that are not
  // here.
  [[nodiscard]] std::optional<Containment> Refuted() const {
    const Eigen::VectorXd half_width = generators_.cwiseAbs().rowwise().sum();
    for (int i = 0; i < inner_.dim(); ++i)
      for (int k = i + 1; k < inner_.dim(); ++k)
        for (const double sign : {1.0, -1.0}) {
          const double a = 1 / half_width[i], b = sign / half_width[k];
          if (!std::isfinite(a) || !std::isfinite(b)) continue;
          const Real along_i(a), along_k(b);
          const Real away = along_i * (inner_.center[ToSize(i)] - Real(center_[i])) +
                            along_k * (inner_.center[ToSize(k)] - Real(center_[k]));
          Real reach = abs(away), bound;
          for (const auto& column : inner_.columns)
            reach += abs(along_i * column[ToSize(i)] + along_k * column[ToSize(k)]);
          for (const auto g : generators_.colwise()) bound += abs(along_i * Real(g[i]) + along_k * Real(g[k]));
          if (CertainlyBelow(bound, reach))
            return Containment{Answer::kNo, -1, reach, bound, abs(along_i) * SizeOf(i) + abs(along_k) * SizeOf(k)};
        }
    return std::nullopt;
  }

  const Slice& inner_;
  const Eigen::VectorXd& center_;
  const Eigen::MatrixXd& generators_;
  std::vector<Eigen::VectorXd> rounded_;    // inner's columns, in half-widths of the outer set
  Eigen::MatrixXd scaled_;                  // the generators in these
  std::vector<int> axis_;                   // of each generator
  std::vector<bool> taken_;                 // each generator
  std::vector<std::optional<Pair>> pairs_;  // of each column of inner
};

}  // namespace

Containment IsInside(const Slice& inner, const Eigen::VectorXd& center, const Eigen::MatrixXd& generators) {
  return ContainmentSearch(inner, center, generators).Run();
}

}  // namespace forereach::verifier
