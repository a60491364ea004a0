/** A nominal model f0 : (x, u) -> x+, known to the certifier by what it can enclose.

Every implementation comes from one definition of its equations (equations_model.h). z = (x, u) has
d_z = states + inputs entries. */
#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "certifier/numerics/interval.h"
#include "certifier/numerics/limits.h"
#include "certifier/sets/linear_map.h"

namespace forereach {

/** Encloses f0(z) and its Jacobian at one point. Entries of the Jacobian that are not listed are exactly zero. */
struct Linearization {
  std::array<Interval, kMaxStates> value;
  std::array<MatrixEntry, kMaxStates * kMaxVariables> entries;
  int count = 0;

  [[nodiscard]] std::span<const MatrixEntry> jacobian() const { return {entries.data(), static_cast<std::size_t>(count)}; }
};

/** Encloses the Hessians of all f0_k over a box. Entries with row <= column that are not listed are exactly zero;
the matrices are symmetric. */
struct HessianEnclosure {
  struct Entry {
    int output, row, column;
    Interval second_derivative;
  };
  static constexpr int kMaxEntries = 512;
  std::array<Entry, kMaxEntries> entries;
  int count = 0;
};

class NominalModel {
 public:
  virtual ~NominalModel() = default;

  [[nodiscard]] virtual const std::string& name() const = 0;
  [[nodiscard]] virtual const std::vector<std::string>& state_names() const = 0;
  [[nodiscard]] virtual const std::vector<std::string>& input_names() const = 0;
  /** Name and parameters, enough to tell two models apart: what the model's digest is made of. */
  [[nodiscard]] virtual std::string description() const = 0;
  /** The numbers in the equations by name, all of them, so that others can write the same equations down. Empty where
  a model cannot be told by numbers. */
  [[nodiscard]] virtual std::map<std::string, double> parameters() const { return {}; }

  [[nodiscard]] int num_states() const { return static_cast<int>(state_names().size()); }
  [[nodiscard]] int num_inputs() const { return static_cast<int>(input_names().size()); }
  [[nodiscard]] int num_variables() const { return num_states() + num_inputs(); }

  /** f0(z), evaluated in extended precision and rounded once. For planning, simulation and display, not for bounds. */
  virtual void Evaluate(std::span<const double> z, std::span<double> next) const noexcept = 0;

  /** Encloses f0(z) and D_z f0(z), Eq. (propagation). */
  virtual void Linearize(std::span<const double> z, Linearization& out) const noexcept = 0;

  /** Encloses every second derivative of f0 over the box of d_z intervals, Eq. (qt-formula). An entry may be
  infinite where no finite enclosure exists, for example where a steering interval meets the tangent's pole. */
  virtual void EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept = 0;
};

}  // namespace forereach
