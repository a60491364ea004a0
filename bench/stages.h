/** Benchmarks of the certify call's stages, each alone. They look inside the library: where its parts change, this is
the place to follow. */
#pragma once

namespace forereach::bench {

/** Registers "stage/<name>/<scenario>/N" for what depends on the number of observations, and at N = 400 the rest. */
void RegisterStages(int observations);

}  // namespace forereach::bench
