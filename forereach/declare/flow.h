/** A model's equations in continuous time, x' = f(x, u), and enclosures of the first and second derivative of a motion.
They are derived from the program of f by automatic differentiation. */
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "forereach/dynamics/jet.h"
#include "forereach/dynamics/model.h"
#include "forereach/dynamics/program.h"
#include "forereach/numerics/limits.h"

namespace forereach {

/** A function of z = (x, u) over a box: its range, and the range of its derivative by each argument. */
struct RangeWithSlopes {
  Interval value{0.0};
  Jet::Row gradient{};
};

class Flow final {
 public:
  /** For each state k: x_k' = f_k(x, u), and x_k'' = sum over l of df_k/dx_l f_l while u is constant. */
  struct Derivatives {
    std::array<RangeWithSlopes, kMaxStates> first, second;
    std::vector<RangeWithSlopes> places;  ///< g'' of each place: the derivative along the flow of that of g.
  };

  /** @param rates f, one expression for each state. @param places functions g of the state that are looked at, too.
  @throws ExpressionError, std::invalid_argument as MakeProgram (text_program.h), and std::invalid_argument unless there
  is one rate for each state, if there are more than Jet::kMaxArguments states and inputs, and if there are places and
  an expression has no derivatives. */
  Flow(const ExpressionNames& names, std::span<const ExpressionText> rates,
       std::span<const ExpressionText> places = {});

  [[nodiscard]] std::size_t num_places() const { return num_places_; }

  /** Encloses all of it over a box z, for all values of the parameters. An interval that is not finite means that there
  is no finite bound. */
  void Enclose(std::span<const Interval> z, Derivatives& out) const;

 private:
  // The rates, the places, and the first derivatives of the places.
  [[nodiscard]] std::vector<Jet> Evaluate(std::span<const Jet> z) const;

  ProgramDraft program_;
  std::vector<unsigned char> needed_;
  std::vector<Jet> parameters_;
  std::size_t num_places_;
};

/** The equations of a model in continuous time. Null for a model as text that has none: it says what the next state is.
@param places as the constructor's. */
[[nodiscard]] std::unique_ptr<Flow> MakeFlow(const NominalModel& model, std::span<const ExpressionText> places = {});

}  // namespace forereach
