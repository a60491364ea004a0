# How everything is compiled. A bound has to mean the same on every machine: no fast-math, no contraction into fused
# operations that the source did not ask for.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
add_compile_options(-pthread)  # for all alike, or a header that was compiled without it is not taken

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

find_program(CCACHE ccache)
if(CCACHE)  # it keeps what was compiled with a precompiled header too, and finds it again from a clone in another directory
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros
    CCACHE_DEPEND=1 CCACHE_IGNOREOPTIONS=--param=* CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE})
endif()

# Precompiled headers hold no header of ours. clang's would hold the time at which they were made, and no cache would find
# what was compiled with them.
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  add_compile_options("SHELL:-Xclang -fno-pch-timestamp")
endif()
set(standard_headers <algorithm> <array> <cmath> <cstdint> <filesystem> <fstream> <functional> <iostream> <limits> <map>
  <memory> <optional> <set> <sstream> <stdexcept> <string> <thread> <variant> <vector>)

# g++ collects its garbage less often: the same code in less time, with up to 1.5 GB for each job where that is a tenth of
# the memory, or 0.5 GB.
cmake_host_system_information(RESULT mebibytes QUERY TOTAL_PHYSICAL_MEMORY)
set(kibibytes 524288)
if(mebibytes GREATER 15000)
  set(kibibytes 1572864)
endif()

add_library(forereach_options INTERFACE)
add_library(ForeReach::options ALIAS forereach_options)
set_target_properties(forereach_options PROPERTIES EXPORT_NAME options)
target_compile_options(forereach_options INTERFACE
  $<BUILD_INTERFACE:-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Woverloaded-virtual>
  $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:Clang>:-Wno-psabi;-Wno-bitwise-instead-of-logical;-fbracket-depth=1024>>  # lanes, tests without a branch, large models
  $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=${kibibytes}>>
  $<BUILD_INTERFACE:$<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${FOREREACH_UNITY}>>:-Wno-subobject-linkage>>  # it takes each file of several for a header
  -ffp-contract=off -fno-fast-math)
if(FOREREACH_WERROR)
  target_compile_options(forereach_options INTERFACE $<BUILD_INTERFACE:-Werror>)
endif()
target_compile_definitions(forereach_options INTERFACE FOREREACH_ROUNDS_EACH_OPERATION)  # forereach/numerics/compilation.h
target_compile_features(forereach_options INTERFACE cxx_std_20)
target_include_directories(forereach_options INTERFACE
  $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/forereach>)
