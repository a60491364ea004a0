/** The certifier's process. A program of your own calls it from main, after UseCompiled (forereach/dynamics/
compiled_models.h), to certify with compiled equations. */
#pragma once

#include "forereach/numerics/compilation.h"

namespace forereach {

/** What forereach-certifier does, with its arguments (`--help` lists them). @return the program's exit code. */
int CertifierProcess(int argc, char** argv);

}  // namespace forereach
