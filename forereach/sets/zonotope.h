/** A zonotope <c, G> + [-s, s] = {c + G b + diag(s) b' : |b|_inf <= 1, |b'|_inf <= 1}, Eq. (zonotope-definition), in up
to 16 dimensions, with up to 120 generators in G.

The box [-s, s], called the slack, contains the rounding errors. It is separate from G so that errors of 1e-15 do not
count as generators and do not displace a real generator in the order reduction. A set without rounding errors has s =
0.

The type is a value of fixed capacity. It uses no heap and is trivially copyable, so the certify step can work on it in
place: its kernels do by ArraysOf (zonotope_arrays.h). order_reduction.h reduces the number of generators. */
#pragma once

#include <span>

#include "forereach/numerics/interval.h"
#include "forereach/numerics/size.h"
#include "forereach/sets/box.h"
#include "forereach/sets/eigen.h"
#include "forereach/sets/zonotope_arrays.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

class Zonotope final : private ZonotopeArrays {
 public:
  using ZonotopeArrays::axes_in_slack, ZonotopeArrays::centers, ZonotopeArrays::padded_row, ZonotopeArrays::padded_size,
      ZonotopeArrays::slacks;
  /** What a kernel writes in place, unchecked. */
  [[nodiscard]] friend ZonotopeArrays& ArraysOf(Zonotope& set) { return set; }

  /** The point of dimension 0. */
  Zonotope() = default;

  /** @param center c, n entries. @param generators G, n-by-m with m <= kMaxGenerators; m = 0 gives the point `center`.
  @throws std::invalid_argument if sizes disagree or exceed the capacity, or an entry is not finite. */
  Zonotope(const Eigen::VectorXd& center, const Eigen::MatrixXd& generators);

  /** The set {x : |x - center| <= half_width}, exactly. A zero half-width gives no generator.
  @throws std::invalid_argument if sizes disagree or exceed the capacity, or a half-width is negative or not finite. */
  [[nodiscard]] static Zonotope FromBox(const Eigen::VectorXd& center, const Eigen::VectorXd& half_width);

  /** An axis-aligned zonotope that contains the box, rounded outward. */
  [[nodiscard]] static Zonotope Enclose(const Box& box);

  /** Copies only the entries in use of another set: about 2 kB of the 15 kB of the whole value. */
  void Assign(const Zonotope& other) noexcept { ZonotopeArrays::Assign(other); }

  [[nodiscard]] int dim() const { return dim_; }
  [[nodiscard]] int num_generators() const { return num_generators_; }
  [[nodiscard]] double center(int k) const { return center_[ToSize(k)]; }
  [[nodiscard]] std::span<const double> center() const { return {center_.data(), ToSize(dim_)}; }
  [[nodiscard]] double generator(int k, int j) const { return row(k)[ToSize(j)]; }
  /** Coordinate k of every generator. */
  [[nodiscard]] std::span<const double> row(int k) const { return {rows_[ToSize(k)].data(), ToSize(num_generators_)}; }
  [[nodiscard]] double slack(int k) const { return slack_[ToSize(k)]; }
  [[nodiscard]] Eigen::VectorXd CenterVector() const;
  /** All generators as columns: the columns of G, then s_k e_k for each k with s_k > 0. */
  [[nodiscard]] Eigen::MatrixXd GeneratorMatrix() const;

  /** An upper bound on sum_j |G_kj| + s_k, the half-width of the interval hull in coordinate k. Cost O(m). */
  [[nodiscard]] double HalfWidthUpper(int k) const noexcept;
  /** An interval that contains coordinate k of every point of the set: Box(Z)_k, rounded outward. Cost O(m). */
  [[nodiscard]] Interval Hull(int k) const noexcept;
  /** An upper bound on the support function max {d . z : z in Z}, Eq. (zonotope-support).
  @param direction d, n entries. Cost O(n m). */
  [[nodiscard]] double SupportUpper(std::span<const double> direction) const noexcept;
};

}  // namespace forereach

FOREREACH_ARITHMETIC_END
