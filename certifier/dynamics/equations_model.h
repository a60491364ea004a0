/** A nominal model from one definition of its equations: value, Jacobian and interval Hessian all come from the same
function, evaluated over extended precision, over dual intervals at a point, and over dual intervals on a box. */
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "certifier/dynamics/dual.h"
#include "certifier/dynamics/model.h"

namespace forereach {

template <class Equations>
class EquationsModel final : public NominalModel {
 public:
  static constexpr int kStates = Equations::kStates, kVariables = Equations::kStates + Equations::kInputs;
  static_assert(kStates <= kMaxStates && Equations::kInputs <= kMaxInputs);

  EquationsModel(Equations equations, std::string description, std::map<std::string, double> parameters)
      : equations_(equations),
        parameters_(std::move(parameters)),
        name_(Equations::kName),
        description_(std::move(description)),
        state_names_(Equations::kStateNames.begin(), Equations::kStateNames.end()),
        input_names_(Equations::kInputNames.begin(), Equations::kInputNames.end()) {}

  const std::string& name() const override { return name_; }
  const std::vector<std::string>& state_names() const override { return state_names_; }
  const std::vector<std::string>& input_names() const override { return input_names_; }
  std::string description() const override { return description_; }
  std::map<std::string, double> parameters() const override { return parameters_; }

  void Evaluate(std::span<const double> z, std::span<double> next) const noexcept override {
    std::array<long double, kVariables> wide;
    std::copy_n(z.begin(), kVariables, wide.begin());
    std::array<long double, kStates> result;
    equations_(std::span<const long double>(wide), std::span<long double>(result));
    for (std::size_t k = 0; k < kStates; ++k) next[k] = static_cast<double>(result[k]);
  }

  void Linearize(std::span<const double> z, Linearization& out) const noexcept override {
    const auto next = Differentiate<false>(z);
    out.count = 0;
    for (int k = 0; k < kStates; ++k) {
      const auto& f = next[static_cast<std::size_t>(k)];
      out.value[static_cast<std::size_t>(k)] = f.value();
      for (int l = 0; l < kVariables; ++l)
        if (f.HasGradient(l)) out.entries[static_cast<std::size_t>(out.count++)] = {k, l, f.gradient(l)};
    }
  }

  void EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept override {
    const auto next = Differentiate<true>(box);
    out.count = 0;
    for (int k = 0; k < kStates; ++k) {
      const auto& f = next[static_cast<std::size_t>(k)];
      for (int j = 0; j < kVariables; ++j)
        for (int i = 0; i <= j; ++i)
          if (f.HasHessian(i, j)) out.entries[static_cast<std::size_t>(out.count++)] = {k, i, j, f.hessian(i, j)};
    }
  }

 private:
  static_assert(kStates * kVariables * (kVariables + 1) / 2 <= HessianEnclosure::kMaxEntries);

  template <bool WithHessian, class Scalar>
  auto Differentiate(std::span<const Scalar> z) const noexcept {
    using D = Dual<Interval, kVariables, WithHessian>;
    std::array<D, kVariables> variables;
    for (int l = 0; l < kVariables; ++l)
      variables[static_cast<std::size_t>(l)] = D::Variable(Interval(z[static_cast<std::size_t>(l)]), l);
    std::array<D, kStates> next;
    equations_(std::span<const D>(variables), std::span<D>(next));
    return next;
  }

  Equations equations_;
  std::map<std::string, double> parameters_;
  std::string name_, description_;
  std::vector<std::string> state_names_, input_names_;
};

}  // namespace forereach
