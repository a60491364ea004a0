/** Benchmarks of the certify call's stages, each alone. They look inside the library: where its parts change, this is
the place to follow. */
#pragma once

namespace forereach::bench {

/** Registers "stage/<name>/<scenario>/N" for stages that depend on the number of observations, and the others at N =
400. */
void RegisterStages(int observations);

}  // namespace forereach::bench
