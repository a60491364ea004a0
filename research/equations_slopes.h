/** The slopes of a residual that is compiled: a template over the scalar type (forereach/dynamics/models/residuals.h).
 */
#pragma once

#include <array>
#include <span>

#include "forereach/declare/residual_slopes.h"
#include "research/occurrence.h"

namespace forereach {

template <class Residual>
class EquationsSlopes final : public ResidualSlopes {
 public:
  static constexpr int kStates = Residual::Nominal::kStates, kVariables = kStates + Residual::Nominal::kInputs,
                       kParameters = static_cast<int>(Residual::kParameterNames.size());
  static_assert(kVariables + kParameters <= 64);

  EquationsSlopes() : ResidualSlopes(kStates, kVariables, kParameters) {
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

}  // namespace forereach
