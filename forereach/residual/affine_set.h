/** The parameters of an affine row of the residual that agree with all observations, Eq. (affine-consistency-set):

    A = {theta = (M_k, b_k) : lower_i <= phi_i . theta <= upper_i for all i},   phi_i = (z_i in the columns, 1).

A search may be clever and wrong; what it returns is bounded by a rule that is simple and right. Any q = columns + 1
observations B and any weights w give, for every theta in A and every direction d,
    d . theta = sum_j w_j phi_j . theta + rest . theta,   rest = d - sum_j w_j phi_j,
which is at most sum_j w_j (upper_j, or lower_j if w_j < 0) + sum_l |rest_l| limit_l. The search is a dual simplex in
plain arithmetic: it walks from one B to a better one until no other observation is violated at its vertex. The rule is
evaluated outward, and `limit` bounds |theta| beforehand: with R about the inverse of the matrix Phi of some B,
|theta| <= |R| |y| + |I - R Phi| |theta| for y = Phi theta, so any v with |R| |y| + |I - R Phi| v <= v, v > 0, is a
bound.

Of a row that is affine up to a rest, r_k(z) = M_k z + b_k + g(z) with |g(z) - g(z')| <= d(z, z') = sum_l G_l |z_l -
z'_l|, the same holds as seen from any c: for theta = (M_k, b_k + g(c)) and r_k(c) = (c, 1) . theta,
    lower_i - d(z_i, c) <= phi_i . theta <= upper_i + d(z_i, c).
A query looks from its own place. docs/soundness.md, 3.19. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forereach/numerics/interval.h"
#include "forereach/numerics/limits.h"
#include "forereach/residual/declaration.h"

namespace forereach {

/** A proof that A is empty: what q observations predict of another one is at least `gap` away from what it shows. */
struct AffineContradiction {
  int coordinate;         ///< k
  std::vector<int> rows;  ///< Of the observations, by their ids: first the one that is predicted, then the q others,
                          ///< the most decisive first, and the one from whose place they are seen, if it is
                          ///< another one. Or q that give a slope of more than is declared.
  double gap;             ///< In the unit of state k, rounded down; the least size of that slope.
  double most = 0;        ///< What is declared of the slope; 0: no slope contradicts.
};

class AffineSet final {
 public:
  /** @param domain_lower, domain_upper d_z entries each: where queries are expected; with a rest, where queries and
  observations have to lie. @param rest G, d_z entries, or none for zeros. */
  AffineSet(std::vector<int> columns, std::span<const double> domain_lower, std::span<const double> domain_upper,
            std::span<const double> rest = {});

  /** Declares that |M_kl| <= most, positive; for column index j. Derive tests it, and it bounds nothing. */
  void Declare(std::size_t j, double most) { most_[j] = most; }
  /** Adds an observation, without a Derive. An interval that is not finite says nothing. */
  void Add(int id, std::span<const double> z, double lower, double upper);
  /** Derives contradiction, hull, slope and the vertices from which queries start. Of more than kMostKept observations
  those are kept that decide at a vertex, or, where A is not bounded, that span what they excite, and the latest: a
  bound by some of them holds, and no Learn takes longer for all that was learned before. With a rest, the latest are
  kept beside those at a vertex, too. Cost: about 100 linear programs of the observations and q unknowns; a millisecond
  for some hundred observations. With a rest as many more as there are new observations, at most kMostPlaces. */
  void Derive();
  /** Adds an observation to those of Derive. Cost: O(vertices), and Derive if the observation disagrees with one. */
  void Learn(int id, std::span<const double> z, double lower, double upper);

  static constexpr std::size_t kMostKept = 2048, kMostPlaces = 512;
  [[nodiscard]] std::size_t num_kept() const { return ids_.size(); }

  /** The observations of a proof that A is empty, if Derive found one. */
  [[nodiscard]] const std::optional<AffineContradiction>& contradiction() const { return contradiction_; }
  /** Whether A is bounded. If not, no query has a finite bound. */
  [[nodiscard]] bool IsBounded() const { return is_bounded_; }
  /** If the locations of the observations lie in a hyperplane: its normal, an entry for each column, the largest 1 in
  size. Otherwise none. */
  [[nodiscard]] const std::vector<double>& unexcited() const { return unexcited_; }

  /** The middle of the hull of M_kl over A, rounded to 2^-16 of its size so that who derives it again gets the same;
  for column index j. Meaningful if IsBounded(). */
  [[nodiscard]] double slope(std::size_t j) const { return slope_[j]; }
  /** At least |M_kl - slope| over A. */
  [[nodiscard]] double reach(std::size_t j) const { return reach_[j]; }
  /** Encloses {M_kl : theta in A}; the last entry is that of b. With a rest, A as seen from the middle of the domain.
   */
  [[nodiscard]] const Interval& hull(std::size_t j) const { return hull_[j]; }

  /** Bounds on r_k(z), z of at least d_z entries: infinite if A is not bounded. Allocates nothing. Cost: O(v q) for the
  v vertices, and some O(a q) for a observations: all of a few, or those that decide at a vertex. With a rest, of all:
  20 us for 400. */
  [[nodiscard]] Interval Enclose(std::span<const double> z) const noexcept;

 private:
  static constexpr std::size_t kMostUnknowns = AffineRows::kMaxColumns + 1;
  using Vector = std::array<double, kMostUnknowns>;
  using Basis = std::array<int, kMostUnknowns>;
  using Place = std::array<double, kMaxVariables>;  // in the variables of the rest
  class Factors;
  struct Vertex {
    Basis basis;
    Vector theta;
  };
  // Where a search looks from, and along which direction.
  struct Aim {
    Vector direction;
    Place from;
    int row = -1;  // the observation at that place, if it is one's
  };
  // lower_ and upper_ as seen from a place.
  struct Ends {
    const double *lower, *upper;
  };
  struct Climb {
    Basis basis{};
    Vector weights{}, theta{};
    int contradicted = -1;  // no vertex of `basis` agrees with this one, as far as plain arithmetic tells
  };

  [[nodiscard]] std::span<const double> phi(int i) const { return {&phi_[static_cast<std::size_t>(i) * size_], size_}; }
  [[nodiscard]] std::size_t ChooseBasis(Basis& basis);
  [[nodiscard]] bool BoundParameters(const Basis& basis);
  void Perturb(const Vector& weights, const Basis& basis, Vector& direction) const noexcept;
  [[nodiscard]] bool HasRest() const { return !rest_.empty(); }
  [[nodiscard]] double Apart(const double* a, const double* b) const noexcept;
  [[nodiscard]] double FarthestFrom(const double* place) const;
  [[nodiscard]] Ends EndsFrom(const Place& from, double* lower, double* upper) const noexcept;
  [[nodiscard]] Climb Search(const Vector& direction, const Ends& ends, std::span<const int> rows, const Basis& start,
                             int most_steps) const noexcept;
  [[nodiscard]] double SupportUpper(const Vector& direction, const Ends& ends, const Climb& found) const noexcept;
  [[nodiscard]] const Basis& Nearest(const Vector& direction) const noexcept;
  [[nodiscard]] std::size_t MostAlike(const Vector& direction, std::span<const Aim> aims) const noexcept;
  [[nodiscard]] Place PlaceOf(std::size_t i) const;
  [[nodiscard]] std::span<const int> SeenBest(const Ends& ends, std::span<int> rows) const noexcept;
  [[nodiscard]] std::vector<Aim> Aims() const;
  [[nodiscard]] bool Prove(const Climb& found, const Ends& ends, int seen_from);
  void SetHull();
  void TestSlope(std::size_t l, const Climb& least, const Climb& most);
  void FindVertices(const Basis& start);
  void TestPlaces();
  void SortActive();
  [[nodiscard]] bool LatestMayNarrow() const;
  void Forget();

  std::vector<int> columns_;
  std::size_t size_;                                    // q
  std::array<double, AffineRows::kMaxColumns> most_{};  // of each column; 0: nothing is declared
  std::vector<double> domain_lower_, domain_upper_;
  // The variables of the rest, their G_l, and the domain in them.
  std::vector<int> rest_variables_;
  std::vector<double> rest_, rest_lower_, rest_upper_;
  Place middle_{};                               // of the domain
  std::vector<double> phi_, lower_, upper_;      // q, one and one entries for each observation
  std::vector<double> places_;                   // an entry for each variable of the rest
  std::vector<double> seen_lower_, seen_upper_;  // room for EndsFrom while A is derived
  std::size_t tested_ = 0;                       // so many observations were looked at from their own places
  std::size_t derived_ = 0;                      // so many were left by the last Derive
  std::vector<int> ids_;
  std::vector<int> all_, active_;  // of the observations: all, and those that a query looks at or Forget keeps
  std::vector<Vertex> vertices_;
  std::vector<Aim> aims_;  // by which the vertices were found
  Vector limit_{}, slope_{}, reach_{};
  std::array<Interval, kMostUnknowns> hull_{};
  double size_of_values_ = 0;
  bool is_bounded_ = false;
  std::vector<double> unexcited_;
  std::optional<AffineContradiction> contradiction_;
};

}  // namespace forereach
