# How everything is compiled. A bound has to mean the same on every machine: no fast-math, no contraction into fused
# operations that the source did not ask for.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

add_library(forereach_options INTERFACE)
add_library(ForeReach::options ALIAS forereach_options)
set_target_properties(forereach_options PROPERTIES EXPORT_NAME options)
target_compile_options(forereach_options INTERFACE
  $<BUILD_INTERFACE:-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Woverloaded-virtual>
  $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:Clang>:-Wno-psabi;-Wno-bitwise-instead-of-logical>>  # lanes, and tests without a branch
  -ffp-contract=off -fno-fast-math)
if(FOREREACH_WERROR)
  target_compile_options(forereach_options INTERFACE $<BUILD_INTERFACE:-Werror>)
endif()
target_compile_definitions(forereach_options INTERFACE FOREREACH_ROUNDS_EACH_OPERATION)  # certifier/numerics/compilation.h
target_compile_features(forereach_options INTERFACE cxx_std_20)
target_include_directories(forereach_options INTERFACE
  $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/forereach>)
