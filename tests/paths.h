/** Where the sources, the build and its programs are, as texts: FOREREACH_SOURCE_DIR, FOREREACH_CERTIFIER and so on.
Who does not include this is compiled alike in every clone, so that a compiler cache serves them all. */
#pragma once

#include <forereach_paths.h>  // tests/CMakeLists.txt writes it
