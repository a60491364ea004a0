/** Systems that differ from the paper's two in one respect. */
#pragma once

#include "research/systems.h"

namespace forereach::research {

/** `system` with at most so many plans a group and seed, the first. Made once for each count; not for several threads
at once. */
[[nodiscard]] const System& WithFewerPlans(const System& system, int scenarios);

/** `system` with a nominal model that knows only a part of the dynamics,  f0_d = (1 - d) f0,  of the same target. What
the model lacks is residual, r_d = r + d f0, and the declaration is as much larger, L_d = L + d sup |D f0|. So d = 0 is
the paper's model, and d = 1 none at all, where L_d is L_f of the norm ratios. "Nominal degradation" is not defined in
the paper; this path between its two ends is ours. The others: a model that moves the state by a part of what it
should, f0_d = x + (1 - d)(f0 - x), with L_d = L + d sup |D(f0 - x)|; and f0 itself, with the L_d of the one or the
other. Made once for each; not for several threads at once. @pre 0 <= d < 1 */
enum class Lacking { kModel, kMotion, kDeclaration, kDeclarationOfMotion };
[[nodiscard]] const System& Degraded(const System& system, double part, Lacking lacking = Lacking::kModel);

/** The point mass of the affine control example: the target's residual is affine, drag and sideways force
a = 0.15 M v in place of the knee, and declared exactly; the paper gives no figure for it. The knee's target has the
same model, domain and data region. */
[[nodiscard]] const System& LinearPointMass();

/** The adversarial residual family, on the point mass: the knee's residual r, steepened beyond the knee,
    r_lambda(z) = [1 + (lambda - 1) SmoothGate((s - v_knee) / beta_pm)] r(z),   s the speed.
Smooth; r_1 = r; no member differs from r up to the knee, bit by bit, and far beyond it r_lambda nears lambda r. The
declaration bounds the slopes of r_lambda over the domain by branch and bound, to 0.1 %. The paper draws such a family
and gives no formula: this one is ours. Made once for each lambda; not for several threads at once. @pre lambda >= 1 */
[[nodiscard]] const System& Escaping(double lambda);

/** |a| = |(r_lambda)_v|_2 / dt at a speed, m/s^2; the direction does not matter. */
[[nodiscard]] double EscapeAt(double lambda, double speed);

}  // namespace forereach::research
