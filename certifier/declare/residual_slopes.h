/** Enclosures of the partial derivatives of a residual over boxes of coordinates and parameters. They are derived from
the residual's equations, which are a template over the scalar type (dynamics/residuals.h). */
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "certifier/dynamics/jet.h"
#include "certifier/dynamics/occurrence.h"
#include "certifier/dynamics/parametric_residual.h"
#include "certifier/numerics/size.h"

namespace forereach {

/** A residual r : (z, theta) -> R^n with d_z coordinates z and parameters theta. Its arguments are w = (z, theta). */
class ResidualSlopes {
 public:
  ResidualSlopes(std::string name, int num_states, int num_variables, std::vector<std::string> parameter_names)
      : name_(std::move(name)),
        num_states_(num_states),
        num_variables_(num_variables),
        parameter_names_(std::move(parameter_names)) {}
  virtual ~ResidualSlopes() = default;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] int num_states() const { return num_states_; }
  [[nodiscard]] int num_variables() const { return num_variables_; }
  [[nodiscard]] int num_arguments() const { return num_variables_ + static_cast<int>(parameter_names_.size()); }
  [[nodiscard]] const std::vector<std::string>& parameter_names() const { return parameter_names_; }

  /** Whether r_row may depend on an argument. If not, the derivative is exactly zero. */
  [[nodiscard]] virtual bool Occurs(int row, int argument) const = 0;

  /** Encloses r_row and its derivatives over a box.
  @param w num_arguments() ranges. @param active the arguments for which gradient entries are computed, at most
  Jet::kMaxArguments; it contains `column`.
  @return r_row as a Jet: `slope` encloses the generalised partial derivative by z_column over w, and `curvature[i]` the
  derivative of `slope` by active[i]. `curvature[i]` is unbounded if that derivative does not exist. */
  [[nodiscard]] virtual Jet Enclose(int row, int column, std::span<const Interval> w,
                                    std::span<const int> active) const = 0;

 private:
  std::string name_;
  int num_states_, num_variables_;
  std::vector<std::string> parameter_names_;
};

template <class Residual>
class EquationsSlopes final : public ResidualSlopes {
 public:
  static constexpr int kStates = Residual::Nominal::kStates, kVariables = kStates + Residual::Nominal::kInputs,
                       kParameters = static_cast<int>(Residual::kParameterNames.size());
  static_assert(kVariables + kParameters <= 64);

  EquationsSlopes()
      : ResidualSlopes(Residual::kName, kStates, kVariables,
                       {Residual::kParameterNames.begin(), Residual::kParameterNames.end()}) {
    std::array<Occurrence, kVariables + kParameters> w;
    for (int i = 0; i < kVariables + kParameters; ++i) w[ToSize(i)] = Occurrence::Argument(i);
    Call<Occurrence>(w, occurrence_);
  }

  [[nodiscard]] bool Occurs(int row, int argument) const override { return occurrence_[ToSize(row)].Of(argument); }

  [[nodiscard]] Jet Enclose(int row, int column, std::span<const Interval> w,
                            std::span<const int> active) const override {
    std::array<Jet, kVariables + kParameters> jets;
    for (std::size_t i = 0; i < jets.size(); ++i) jets[i] = Jet(w[i]);
    for (std::size_t i = 0; i < active.size(); ++i) {
      const auto argument = ToSize(active[i]);
      jets[argument] = Jet::Argument(w[argument], static_cast<int>(i), active[i] == column);
    }
    std::array<Jet, kStates> residual;
    Call<Jet>(jets, residual);
    return residual[ToSize(row)];
  }

 private:
  template <class T>
  static void Call(const std::array<T, kVariables + kParameters>& w, std::array<T, kStates>& residual) {
    const std::span<const T> all(w);
    Residual::template Evaluate<T>(all.subspan(kVariables), all.first(kVariables), residual);
  }

  std::array<Occurrence, kStates> occurrence_;
};

/** The slopes of the residual of dynamics/residuals.h with this name. @throws std::invalid_argument if there is
none. */
[[nodiscard]] std::unique_ptr<ResidualSlopes> MakeResidualSlopes(const std::string& name);

/** The ranges of the parameters, in the order of the equations.
@throws std::invalid_argument with the parameter's name unless the parameters are exactly those of the equations, in
their order, with lower <= upper, both finite. */
[[nodiscard]] std::vector<Interval> ParameterRanges(const ResidualSlopes& slopes, const ParametricResidual& residual);

}  // namespace forereach
