/** A model's equations in continuous time, x' = f(x, u), and enclosures of the first and second derivative of a motion.
They are derived from the template `Rate` of the model's equations. */
#pragma once

#include <array>
#include <memory>
#include <span>

#include "certifier/dynamics/jet.h"
#include "certifier/dynamics/model.h"
#include "certifier/numerics/limits.h"
#include "certifier/numerics/size.h"

namespace forereach {

/** A function of z = (x, u) over a box: its range, and the range of its derivative by each argument. */
struct RangeWithSlopes {
  Interval value{0.0};
  Jet::Row gradient{};
};

class Flow {
 public:
  /** For each state k: x_k' = f_k(x, u), and x_k'' = sum over l of df_k/dx_l f_l while u is constant. */
  struct Derivatives {
    std::array<RangeWithSlopes, kMaxStates> first, second;
  };

  virtual ~Flow() = default;
  /** Encloses both over a box z. An interval that is not finite means that there is no finite bound. */
  virtual void Enclose(std::span<const Interval> z, Derivatives& out) const = 0;
};

template <class Equations>
class EquationsFlow final : public Flow {
 public:
  static constexpr int kStates = Equations::kStates, kVariables = kStates + Equations::kInputs;
  static_assert(kVariables <= Jet::kMaxArguments);

  explicit EquationsFlow(std::span<const double> parameters) {
    for (std::size_t i = 0; i < parameters_.size(); ++i) parameters_[i] = Jet(parameters[i]);
  }

  void Enclose(std::span<const Interval> z, Derivatives& out) const override {
    std::array<Jet, kVariables> arguments;
    std::array<Jet, kStates> rate, change;
    for (std::size_t l = 0; l < arguments.size(); ++l) arguments[l] = Jet::Argument(z[l], static_cast<int>(l), false);
    Equations::template Rate<Jet>(parameters_, arguments, rate);
    // A Jet's slope is its derivative along one direction. Here this is the flow: dx_l/ds = f_l, du/ds = 0.
    for (std::size_t l = 0; l < rate.size(); ++l) {
      arguments[l].slope = rate[l].value;
      arguments[l].curvature = rate[l].gradient;
      arguments[l].size = kVariables;
    }
    Equations::template Rate<Jet>(parameters_, arguments, change);
    for (std::size_t k = 0; k < rate.size(); ++k) {
      out.first[k] = {rate[k].value, rate[k].gradient};
      out.second[k] = {change[k].slope, change[k].curvature};
    }
  }

 private:
  std::array<Jet, Equations::kParameterNames.size()> parameters_;
};

/** The equations of a model of dynamics/models.h. Null for another model. */
[[nodiscard]] std::unique_ptr<Flow> MakeFlow(const NominalModel& model);

}  // namespace forereach
