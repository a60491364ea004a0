/** The certify step compiled without its rounding bounds, to measure their cost. It proves nothing. */
#pragma once

namespace benchmark {
class State;
}

/** As certify/bicycle/N. In no namespace: the library's is renamed there (CMakeLists.txt), so that both can be
linked. */
void RunCertifyWithoutRounding(benchmark::State& state, int observations);
