# `cmake --install`: programs, headers, task files, and a CMake package: find_package(ForeReach), then link
# ForeReach::forereach, and on the robot ForeReach::supervisor, or ForeReach::guard alone.
include(CMakePackageConfigHelpers)

install(TARGETS forereach forereach-certifier forereach-planner forereach-logger forereach-robot-sim)
install(TARGETS forereach-live forereach-offline DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/forereach)
if(FOREREACH_FLEET)
  install(TARGETS forereach-fleet DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/forereach)
endif()
install(PROGRAMS scripts/drive-demo DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/forereach RENAME demo)
install(PROGRAMS scripts/ready-bus DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/forereach)

set_target_properties(forereach_library PROPERTIES EXPORT_NAME forereach OUTPUT_NAME forereach)
set_target_properties(forereach_guard PROPERTIES EXPORT_NAME guard)
set_target_properties(forereach_supervisor PROPERTIES EXPORT_NAME supervisor)
set_target_properties(forereach_lcmtypes PROPERTIES EXPORT_NAME lcmtypes)
set_target_properties(forereach_signing PROPERTIES EXPORT_NAME signing)
install(TARGETS forereach_options forereach_library forereach_lcmtypes forereach_signing forereach_guard
  forereach_supervisor EXPORT ForeReachTargets)
install(EXPORT ForeReachTargets NAMESPACE ForeReach:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/ForeReach)

# find_package(ForeReach COMPONENTS process): the certifier process as a library, for compiled equations;
# COMPONENTS clients: the ends of a bus, for planners and robots that read the task file.
set_target_properties(forereach_certifier_process PROPERTIES EXPORT_NAME certifier_process)
set_target_properties(forereach_planner_client PROPERTIES EXPORT_NAME planner_client)
set_target_properties(forereach_robot_client PROPERTIES EXPORT_NAME robot_client)
install(TARGETS forereach_command_line forereach_bus forereach_process forereach_task forereach_gate
  forereach_certifier_node forereach_certifier_process forereach_opened_bus forereach_planner_client forereach_robot_client EXPORT ForeReachProcessTargets)
install(EXPORT ForeReachProcessTargets NAMESPACE ForeReach:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/ForeReach)

# Users include <forereach/...>. In the tree the messages, too, are forereach/NAME_t.hpp; other folders stay folders.
set(headers ${CMAKE_INSTALL_INCLUDEDIR}/forereach)
foreach(floor numerics sets dynamics residual safety reach declare certify)
  install(DIRECTORY forereach/${floor} DESTINATION ${headers} FILES_MATCHING PATTERN "*.h")
endforeach()
install(FILES clients/candidate_start.h clients/client_options.h clients/planner_client.h clients/robot_client.h
  DESTINATION ${headers}/clients)
install(FILES certifier/process/certifier_process.h DESTINATION ${headers}/certifier/process)
install(FILES lcmtypes/angle.h lcmtypes/bad_input.h lcmtypes/codec.h lcmtypes/freshness.h lcmtypes/names.h lcmtypes/seal.h
  lcmtypes/sole_sender.h DESTINATION ${headers}/lcmtypes)
install(FILES bus/authentic.h bus/clock.h bus/keys.h DESTINATION ${headers}/bus)
install(FILES robot/brake.h robot/guard.h robot/report_queue.h robot/supervisor.h DESTINATION ${headers}/robot)
install(DIRECTORY ${CMAKE_BINARY_DIR}/generated/forereach/ DESTINATION ${headers})
install(DIRECTORY lcmtypes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/forereach/lcmtypes FILES_MATCHING PATTERN "*.lcm")
install(FILES ${CMAKE_BINARY_DIR}/share/forereach/task.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/forereach)
install(DIRECTORY config DESTINATION ${CMAKE_INSTALL_DATADIR}/forereach)

configure_package_config_file(cmake/ForeReachConfig.cmake.in ForeReachConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/ForeReach)
write_basic_package_version_file(ForeReachConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/ForeReachConfig.cmake ${CMAKE_BINARY_DIR}/ForeReachConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/ForeReach)

# For a system: units of systemd, completion for bash, and what pkg-config knows of the library.
file(READ systemd/hardening.conf hardening)
string(STRIP "${hardening}" hardening)
foreach(unit forereach-bus forereach-certifier@ forereach-logger@)
  configure_file(systemd/${unit}.service.in ${CMAKE_BINARY_DIR}/systemd/${unit}.service @ONLY)
  install(FILES ${CMAKE_BINARY_DIR}/systemd/${unit}.service DESTINATION lib/systemd/system)
endforeach()
foreach(program "" -certifier -planner -logger -robot-sim)  # bash looks for a file of the program's name
  install(FILES scripts/completion.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME forereach${program})
endforeach()
configure_file(cmake/forereach.pc.in ${CMAKE_BINARY_DIR}/forereach.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/forereach.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
