/** The declared bounds on the true system x+ = f0(z) + r(z) + w, z = (x, u): Assumption 1, |r_k(z) - r_k(z')| <= sum_l
L_kl |z_l - z'_l| for all z, z' in Z_cert, Eq. (regularity); the bound sigma on the observation error, Eq. (data); and a
bound on the disturbance w, which the paper does not have (docs/soundness.md, 1). */
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "forereach/numerics/interval.h"
#include "forereach/sets/eigen.h"

namespace forereach {

class GrowingDisturbance;

/** Rows k of the residual that are affine up to a rest g_k: there are M_k, b_k and g_k, the same in every step, with
    r_k(z) = sum over columns l of M_kl z_l + b_k + g_k(z),   |g_k(z) - g_k(z')| <= sum_l G_kl |z_l - z'_l|
for all z, z' in Z_cert. Data bound them (affine_set.h). An entry L_kl > 0 says |M_kl| <= L_kl, and that r_k changes by
no more, as in other rows, by which errors of z_l count. */
struct AffineRows {
  static constexpr std::size_t kMaxColumns = 12;

  std::vector<int> rows = {}, columns = {};  ///< Ascending: states, and variables of z.
  Eigen::MatrixXd rest = {};                 ///< G, as L, zero in other rows; no entries: zeros.

  [[nodiscard]] bool Contains(Eigen::Index k) const { return std::ranges::binary_search(rows, static_cast<int>(k)); }
  /** G_kl. */
  [[nodiscard]] double Rest(Eigen::Index k, Eigen::Index l) const { return rest.size() == 0 ? 0 : rest(k, l); }
  /** Whether row k may depend on variable l: a column, or G_kl > 0. */
  [[nodiscard]] bool DependsOn(Eigen::Index k, Eigen::Index l) const {
    return Contains(k) && (Rest(k, l) > 0 || std::ranges::binary_search(columns, static_cast<int>(l)));
  }
  /** Whether any row may. */
  [[nodiscard]] bool DependsOn(Eigen::Index l) const {
    return std::ranges::any_of(rows, [&](int k) { return DependsOn(k, l); });
  }
};

/** A box in some variables of z in which less holds than in the whole domain: for all z, z' of it in Z_cert
    |r_k(z) - r_k(z')| <= sum_l min(L'_kl, L_kl) |z_l - z'_l|,   |r_k(z)| <= bound_k,
and w^_k, sigma_k are at most these of a step from z. Where no region lies, the declaration alone holds; where several
do, the least of their numbers, entry by entry. The sides of a box belong to it. */
struct Region {
  static constexpr std::size_t kMaxRegions = 256, kMaxVariables = 3, kMaxCells = 1024;

  struct Side {
    int variable;
    Interval range;  ///< May reach beyond the domain.
  };
  std::vector<Side> box;      ///< The other variables have no bound here.
  Eigen::MatrixXd lipschitz;  ///< L', as L.
  /** n entries, not negative, infinite where nothing is said of a state; or none. No bound of an affine row. */
  Eigen::VectorXd disturbance = {}, noise_bound = {}, bound = {};

  /** Whether z, of all variables, lies in the box. */
  [[nodiscard]] bool Contains(std::span<const double> z) const;
};

struct Declaration {
  Eigen::MatrixXd
      lipschitz;  ///< L, n-by-d_z, not negative; unit of state k per unit of z_l. A zero row: r_k is constant.
  Eigen::VectorXd noise_bound;  ///< sigma, n entries, not negative, in the units of the states.
  /** w^: |w_k| <= w^_k in every step, by a value of its own in each step that may depend on everything before; n
  entries, not negative, in the units of the states. No entries: zeros. */
  Eigen::VectorXd disturbance = {};
  /** e: |recorded - true| <= e in every state, input and successor that is recorded; n and m entries, not negative, in
  the units of the states and inputs. No entries: not declared, and then what is recorded is taken as exact, as with
  zeros. It counts beside sigma and w^ (docs/soundness.md, 3.16). */
  Eigen::VectorXd state_error = {}, input_error = {};
  /** e is not that of the given transitions, which are exact, as those of a simulation are; of those that are learned
  it is (Transitions::num_learned). */
  bool given_are_exact = false;
  /** Rows that are affine: their rows of L are zero but where they depend on a variable. */
  AffineRows affine = {};
  /** At most kMaxRegions, which bound at most kMaxVariables variables and cut their ranges into kMaxCells cells. They
  narrow no affine row. */
  std::vector<Region> regions = {};
  /** What w^ has beyond that in a step at z: |w_k| <= w^_k + |d_k(z)|. Null: nothing. */
  std::shared_ptr<const GrowingDisturbance> growing = {};

  /** Whether some w^_k is not zero, or some d_k is given. */
  [[nodiscard]] bool IsDisturbed() const { return growing || (disturbance.array() != 0).any(); }
  /** Whether d_k is given. */
  [[nodiscard]] bool Grows(Eigen::Index k) const;
  /** w^_k + |d_k| as a task file has it: an expression if d_k is given, of which the absolute value counts, otherwise a
  number. */
  [[nodiscard]] std::string DisturbanceText(Eigen::Index k) const;
  /** w^_k, without d_k, where no region says less. */
  [[nodiscard]] double DisturbanceBound(Eigen::Index k) const { return disturbance.size() == 0 ? 0 : disturbance[k]; }
  /** Whether a bound on the error of recorded states is declared, be it zero. */
  [[nodiscard]] bool DeclaresStateError() const { return state_error.size() != 0; }
  /** Whether some e_l is not zero, so that z_i is not known exactly. */
  [[nodiscard]] bool HasErrorInZ() const { return !state_error.isZero(0) || !input_error.isZero(0); }
  /** e_l of variable l of z: the states, then the inputs. */
  [[nodiscard]] double VariableError(Eigen::Index l) const;
  /** The box of the true z of what was recorded as z: z_l +- e_l rounded outward, z_l itself where e_l is zero. */
  [[nodiscard]] std::vector<Interval> BoxAround(std::span<const double> z) const;
  /** The least that `everywhere`, the declaration's own number, and any region say of state k. */
  [[nodiscard]] double LeastOf(Eigen::VectorXd Region::*bound, Eigen::Index k, double everywhere) const;
  /** Whether a region says any such thing. */
  [[nodiscard]] bool AnyRegionHas(Eigen::VectorXd Region::*bound) const;
  /** sigma_k + w^_k rounded up: how far an observed residual may lie from r_k, apart from the successor's last bit. It
  is sigma_k itself if w^_k is zero. With regions it is the least of these anywhere: what the place of an observation
  adds, and d_k, is in the observation (observations.h). */
  [[nodiscard]] double ObservationError(Eigen::Index k) const;

  /** @throws std::invalid_argument if L is not n-by-d_z, sigma has not n entries, w^ or e has another number of entries
  and not none, an entry is negative or not finite, or `affine` or a region is not as above; the message names the
  entry. */
  void Validate(int num_states, int num_variables) const;
  /** The same for w^ alone. */
  void ValidateDisturbance(int num_states) const;
};

}  // namespace forereach
