/** A nominal model f0 : (x, u) -> x+, Eq. (dynamics), with enclosures of its values and derivatives. z = (x, u) has
d_z = states + inputs entries.

| class | equations | evaluated by |
|---|---|---|
| EquationsModel (equations_model.h) | compiled | straight-line code |
| ProgramModel (program_model.h) | a program that was made at run time | interpretation, with the same bits |
| StagedModel (staged_model.h) | midpoint or Runge-Kutta steps of a program's rates | intervals, stage by stage | */
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "forereach/dynamics/expansion.h"
#include "forereach/dynamics/model_text.h"
#include "forereach/dynamics/program.h"
#include "forereach/dynamics/rounding.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/interval.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/sets/linear_map.h"

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
by states are listed, and those that are not listed are exactly zero. */
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
  std::shared_ptr<const ModelText> text = {};  ///< What the model was made from; null if it was compiled.
  std::vector<int> angles = {};                ///< The states that are angles (angles.h), by their indices, ascending.
};

class StepRate;

class NominalModel {
 public:
  /** @param program lists the derivatives of f0. What it refers to must outlive the model. @param parameters their
  values or ranges, in the order of the names, in the units of the equations. */
  NominalModel(const Program& program, std::vector<Interval> parameters, ModelNames names);
  virtual ~NominalModel() = default;
  NominalModel(const NominalModel&) = delete;
  NominalModel& operator=(const NominalModel&) = delete;

  [[nodiscard]] const std::string& name() const { return names_.name; }
  [[nodiscard]] const std::vector<std::string>& state_names() const { return names_.states; }
  [[nodiscard]] const std::vector<std::string>& input_names() const { return names_.inputs; }
  /** States, then inputs. */
  [[nodiscard]] std::vector<std::string> variable_names() const;
  [[nodiscard]] const std::vector<std::string>& parameter_names() const { return names_.parameters; }
  /** The middles of their ranges. */
  [[nodiscard]] std::span<const double> parameters() const { return middles_; }
  [[nodiscard]] std::span<const Interval> parameter_ranges() const { return ranges_; }
  /** The derivatives that are not identically zero. If the model has stages, their nodes are -1. */
  [[nodiscard]] const Program& program() const { return program_; }
  /** The text that the model was made from; null if it was compiled. */
  [[nodiscard]] const ModelText* text() const { return names_.text.get(); }
  /** The states that are angles, by their indices, ascending: x and x + 2 pi e_a are the same configuration, and the
  equations are the same for both (angles.h). docs/soundness.md, 3.14, says what this declares. */
  [[nodiscard]] const std::vector<int>& angles() const { return names_.angles; }
  [[nodiscard]] bool IsAngle(int state) const;
  /** Name and parameters, or all equations of a text, and the angles. It identifies the model; the model's digest is
  computed from it. */
  [[nodiscard]] std::string description() const;

  [[nodiscard]] int num_states() const { return program_.states; }
  [[nodiscard]] int num_inputs() const { return program_.variables - program_.states; }
  [[nodiscard]] int num_variables() const { return program_.variables; }

  /** Sets `next` (n entries) to f0(z) for the middles of the parameters, evaluated in extended precision and rounded
  once. Use it for planning, simulation and display, not for bounds. */
  void Evaluate(std::span<const double> z, std::span<double> next) const noexcept;
  /** The same before it is rounded. */
  virtual void EvaluateWide(std::span<const double> z, std::span<long double> next) const noexcept = 0;

  /** Encloses f0(z) and D_z f0(z), Eq. (propagation), for all parameters, by interval arithmetic. */
  void Linearize(std::span<const double> z, Linearization& out) const noexcept;
  /** The same for all z in a box of d_z intervals. Where f0 has a kink inside, the derivatives are the generalised
  gradient. They count only where the value is finite: then f0 is defined and continuous on the box. */
  virtual void LinearizeOver(std::span<const Interval> box, Linearization& out) const noexcept = 0;

  /** Encloses every second derivative of f0 by states over a box of d_z intervals, Eq. (qt-formula), by interval
  arithmetic. An entry is infinite if no finite enclosure exists, for example if a steering interval contains a pole of
  the tangent. */
  virtual void EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept = 0;

  /** Both at once, as a certify step uses them where Expand has no bound: sets middles of the enclosures of f0(z) and
  D f0(z) for z in `point`, with their distances as errors, and the ranges of the second derivatives over `box`, which
  contains `point`. An error that is infinite or NaN: no bound. */
  virtual void EncloseExpansion(std::span<const Interval> point, std::span<const Interval> box, Expansion& out,
                                ExpansionError& error) const noexcept;

  /** Bounds the error of Expand over a domain of d_z ranges; see rounding.h. Entries are infinite where there is no
  bound: a step then uses the two functions above. Cost O(operations), once for each task. */
  [[nodiscard]] virtual ExpansionError BoundError(std::span<const Interval> domain) const = 0;

  /** Sets value, Jacobian and Hessian ranges in plain arithmetic, for the certify step.
  @param z the center c of the box, d_z entries. @param box d_z intervals that contain c.
  @param instructions changes the computing time only, here and in the two functions below.
  @pre BoundError is finite. */
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
  friend std::shared_ptr<const StepRate> RateOf(const NominalModel& model);

  Program program_;
  std::vector<Interval> ranges_;
  std::vector<double> middles_;
  ModelNames names_;
  mutable std::once_flag rate_is_made_;
  mutable std::shared_ptr<const StepRate> rate_;
};

}  // namespace forereach
