# Debian 12's packages that more than one directory uses, each in docs/dependencies.md. The others are found where they are
# used, so that nothing is needed for what is not built.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json REQUIRED)
find_package(spdlog REQUIRED)

# forereach_pkg_config(NAME module...): the target PkgConfig::NAME, of a package that has no CMake package. Headers of
# others are not ours to warn about.
function(forereach_pkg_config name)
  pkg_check_modules(${name} REQUIRED IMPORTED_TARGET GLOBAL ${ARGN})
  get_target_property(directories PkgConfig::${name} INTERFACE_INCLUDE_DIRECTORIES)
  if(directories)
    set_target_properties(PkgConfig::${name} PROPERTIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${directories}")
  endif()
endfunction()
forereach_pkg_config(LCM lcm)
forereach_pkg_config(SODIUM libsodium)
forereach_pkg_config(SYSTEMD libsystemd)
forereach_pkg_config(CLP clp)
