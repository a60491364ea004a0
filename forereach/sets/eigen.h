/** Includes Eigen for all headers of the library. Eigen objects cross the library's boundary. Their allocation,
alignment and layout depend on the compiler's flags and on Eigen's macros: with -mavx2 a vector is freed by another
function than without. So the library fixes these settings, its CMake target exports them, and a different setting is a
compile error. */
#pragma once

#include <cstddef>
#include <type_traits>

#include "forereach/numerics/compilation.h"

#include <Eigen/Core>

// The values of forereach_certifier's compile definitions. x86-64 and aarch64 need 16, and malloc provides it.
#if EIGEN_MAX_ALIGN_BYTES != 16 || EIGEN_MAX_STATIC_ALIGN_BYTES != 16 || !EIGEN_MALLOC_ALREADY_ALIGNED
#error \
    "ForeReach passes Eigen's vectors, so all files have to agree how those are aligned: \
compile your whole program with -DEIGEN_MAX_ALIGN_BYTES=16 -DEIGEN_MALLOC_ALREADY_ALIGNED=1, or link ForeReach::forereach by CMake"
#endif
#ifdef EIGEN_DEFAULT_TO_ROW_MAJOR
#error "ForeReach passes Eigen's matrices by column: compile without EIGEN_DEFAULT_TO_ROW_MAJOR"
#endif

namespace forereach::internal {

static_assert(std::is_same_v<Eigen::Index, std::ptrdiff_t>,
              "ForeReach passes Eigen's vectors: compile without EIGEN_DEFAULT_DENSE_INDEX_TYPE");
static_assert(sizeof(Eigen::VectorXd) == 16 && sizeof(Eigen::MatrixXd) == 24 && sizeof(Eigen::Vector2d) == 16,
              "ForeReach passes Eigen's vectors: compile without plugins that add members to them");

// The library defines this symbol under a name that contains its Eigen version. A file that was compiled with another
// version does not link.
#define FOREREACH_PASTE(a, b, c) this_library_was_built_with_another_eigen_than_##a##_##b##_##c
#define FOREREACH_NAME(a, b, c) FOREREACH_PASTE(a, b, c)
#define FOREREACH_EIGEN FOREREACH_NAME(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)
extern const char FOREREACH_EIGEN;

}  // namespace forereach::internal

namespace {

[[gnu::used]] const char* const forereach_eigen = &forereach::internal::FOREREACH_EIGEN;

}  // namespace
