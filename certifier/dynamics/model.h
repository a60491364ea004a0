/** A nominal model f0 : (x, u) -> x+, Eq. (dynamics), with enclosures of its values and derivatives.

A model consists of the program of its equations (program.h) and the values of its parameters. z = (x, u) has
d_z = states + inputs entries. */
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "certifier/dynamics/expansion.h"
#include "certifier/dynamics/program.h"
#include "certifier/dynamics/rounding.h"
#include "certifier/numerics/instruction_set.h"
#include "certifier/numerics/interval.h"
#include "certifier/numerics/limits.h"
#include "certifier/numerics/size.h"
#include "certifier/sets/linear_map.h"

namespace forereach {

/** Enclosures of f0(z) and of its Jacobian at one point. Entries of the Jacobian that are not listed are exactly
zero. */
struct Linearization {
  std::array<Interval, kMaxStates> value;
  std::array<MatrixEntry, Program::kMaxFirst> entries;
  int count = 0;

  [[nodiscard]] std::span<const MatrixEntry> jacobian() const { return {entries.data(), ToSize(count)}; }
};

/** Enclosures of the Hessians of all f0_k over a box. The matrices are symmetric; only entries with row <= column are
listed, and those that are not listed are exactly zero. */
struct HessianEnclosure {
  struct Entry {
    int output, row, column;
    Interval second_derivative;
  };
  std::array<Entry, Program::kMaxSecond> entries;
  int count = 0;
};

/** The names of a model, its states, inputs and parameters, for messages and digests. */
struct ModelNames {
  std::string name;
  std::vector<std::string> states, inputs, parameters;
};

class NominalModel {
 public:
  /** @param program must outlive the model. @param parameters its values, in the program's order, in the units of the
  equations. */
  NominalModel(const Program& program, std::vector<double> parameters, ModelNames names)
      : program_(program), parameters_(std::move(parameters)), names_(std::move(names)) {}
  virtual ~NominalModel() = default;

  [[nodiscard]] const std::string& name() const { return names_.name; }
  [[nodiscard]] const std::vector<std::string>& state_names() const { return names_.states; }
  [[nodiscard]] const std::vector<std::string>& input_names() const { return names_.inputs; }
  /** States, then inputs. */
  [[nodiscard]] std::vector<std::string> variable_names() const;
  [[nodiscard]] const std::vector<std::string>& parameter_names() const { return names_.parameters; }
  [[nodiscard]] std::span<const double> parameters() const { return parameters_; }
  [[nodiscard]] const Program& program() const { return program_; }
  /** Name and parameters as text. It identifies the model; the model's digest is computed from it. */
  [[nodiscard]] std::string description() const;

  [[nodiscard]] int num_states() const { return program_.states; }
  [[nodiscard]] int num_inputs() const { return program_.variables - program_.states; }
  [[nodiscard]] int num_variables() const { return program_.variables; }

  /** Sets `next` (n entries) to f0(z), evaluated in extended precision and rounded once. Use it for planning,
  simulation and display, not for bounds. */
  void Evaluate(std::span<const double> z, std::span<double> next) const noexcept;

  /** Encloses f0(z) and D_z f0(z), Eq. (propagation), by interval arithmetic. */
  void Linearize(std::span<const double> z, Linearization& out) const noexcept;

  /** Encloses every second derivative of f0 over a box of d_z intervals, Eq. (qt-formula), by interval arithmetic. An
  entry is infinite if no finite enclosure exists, for example if a steering interval contains a pole of the tangent. */
  void EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept;

  /** Sets value, Jacobian and Hessian ranges in plain arithmetic, for the certify step. rounding.h bounds the error.
  @param z the center c of the box, d_z entries. @param box d_z intervals that contain c.
  @param instructions changes the computing time only, here and in the two functions below. */
  virtual void Expand(std::span<const double> z, std::span<const PlainInterval> box, Expansion& out,
                      InstructionSet instructions = BestInstructionSet()) const noexcept = 0;

  /** Encloses the Taylor remainder of the expansion; see remainder.h. */
  virtual void EncloseRemainder(Method method, const Zonotope& slice, const double* half_width,
                                const PlainInterval* hessian, const double* error, Remainder& out,
                                InstructionSet instructions = BestInstructionSet()) const noexcept = 0;

  /** Sets the generators and the slack of `next` to the image of the slice under the expansion's Jacobian; see
  image.h. */
  virtual void Map(const Expansion& expansion, const StepError& error, const Zonotope& slice, Zonotope& next,
                   ImageSums& sums, InstructionSet instructions = BestInstructionSet()) const noexcept = 0;

 private:
  const Program& program_;
  std::vector<double> parameters_;
  ModelNames names_;
};

}  // namespace forereach
