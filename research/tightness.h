/** Beyond the paper: how far tubes are from what no sound method can fall below, and how many safe plans are certified,
when an abstention is tried again in pieces of X_0. Of the bicycle's group C under the deployed declaration. */
#pragma once

#include <iosfwd>

namespace forereach::research {

/** Prints, of N = 25, 50 and 100, the mean half-width over the inner bound (certify/extremal.h), and recall. Cost: a
minute; `quick`: seconds. */
void RunTightness(bool quick, std::ostream& out);

}  // namespace forereach::research
