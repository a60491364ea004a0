/** Girard's order reduction of a zonotope in place, Eq. (order-reduction). */
#pragma once

#include "forereach/numerics/instruction_set.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

class Zonotope;

/** Appends the nonzero generators among first_k e_k, then among second_k e_k, and reduces the order by Girard's method,
Eq. (order-reduction). If the set then has more than order * n generators, it keeps the (order - 1) * n columns of
largest |g|_1 - |g|_inf and encloses the others in a box, rounded outward. Of columns whose scores agree to 45 bits, the
earlier one is kept. Zero columns do not count. The result contains the set with all generators.
@param first, second n lengths; kMaxStates entries must be readable.
@param lasting a bit for each axis k whose columns are held by the slack, those of `first`, `second` and the box:
where every later step maps e_k to itself, this is the same set with fewer columns. They count as columns as before, in
the order in which they came, behind all others with a score of zero.
@param instructions changes the computing time only.
Cost O(n) for the columns that are appended; if others have to be boxed, O(n m + m^2) for m generators. */
void AppendAndReduce(Zonotope& set, const double* first, const double* second, int order, unsigned lasting = 0,
                     InstructionSet instructions = BestInstructionSet()) noexcept;

}  // namespace forereach

FOREREACH_ARITHMETIC_END
