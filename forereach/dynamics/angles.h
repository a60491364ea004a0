/** States that are angles: two values that differ by whole turns stand for the same configuration. */
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "forereach/dynamics/model_text.h"
#include "forereach/dynamics/program.h"
#include "forereach/numerics/interval.h"

namespace forereach {

/** Encloses 2 pi. */
inline constexpr Interval kTurn(0x1.921fb54442d18p+2, 0x1.921fb54442d19p+2);
/** The largest double below pi / 2. */
inline constexpr double kQuarterTurn = kTurn.lower / 4;

/** For each node v of the program a number c with v(z + 2 pi e) = v(z) + 2 pi c wherever either side is defined, e the
unit vector of the variable; nothing where these rules find none:

    the variable 1;  other variables, parameters, constants 0;  a +- b  c_a +- c_b;  -a  -c_a;
    k a, a / k for a constant k  k c_a, c_a / k, if that is a double;
    sin a, cos a  0 if c_a is whole;  tan a  0 if 2 c_a is whole;
    every operation on operands whose c are 0  0. */
[[nodiscard]] std::vector<std::optional<double>> Windings(const Program& program, int variable);

/** Whether Windings proves that a value of the program is the same after a turn of an angle. */
[[nodiscard]] bool IsSameAfterTurn(const Program& program, int value, int angle);

/** Requires that a value of the program is the same after a turn of each angle. @param text of the value. @param what
it is, for the message. @param angles indices of states. @param states their names.
@throws ExpressionError (expression.h) at the text's place. */
void RequireSameAfterTurns(const Program& program, int value, const ExpressionText& text, const std::string& what,
                           const std::vector<int>& angles, const std::vector<std::string>& states);

/** An equation for which there is no proof that it does not tell how often an angle has turned. */
class TurnError final : public std::invalid_argument {
 public:
  TurnError(int equation, const std::string& what) : std::invalid_argument(what), equation_(equation) {}

  /** Its index, that of its state. */
  [[nodiscard]] int equation() const { return equation_; }

 private:
  int equation_;
};

/** Proves by Windings that a model's equations do not tell how often an angle has turned: for every angle a,

    f0(z + 2 pi e_a) = f0(z) + 2 pi e_a    of the next state, or    f(z + 2 pi e_a) = f(z)    of rates.

@param program the values are x+, or x' if `of_rates`. @param angles indices of states. @param states their names.
@throws std::invalid_argument if an index is not that of a state or is there twice.
@throws TurnError if there is no proof; the message names the angle and the equation. */
void RequireAngles(const Program& program, const std::vector<int>& angles, const std::vector<std::string>& states,
                   bool of_rates);

}  // namespace forereach
