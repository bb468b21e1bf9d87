# find_package(lk-emu) gives lk::emulator; COMPONENTS config (needs toml++) adds lk::config. add_subdirectory and
# FetchContent give the same names. For users: docs/guides/tests.md.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/lk-emu)

# Exports targets lk_NAME as lk::NAME, and lk_core as lk::emulator, in the file lk-emu-EXPORT.cmake.
function(lk_package export)
  foreach(name ${ARGN})
    string(REGEX REPLACE "^core$" "emulator" public ${name})
    add_library(lk::${public} ALIAS lk_${name})
    set_target_properties(lk_${name} PROPERTIES EXPORT_NAME ${public})
    install(TARGETS lk_${name} EXPORT lk-emu-${export} COMPONENT development)
  endforeach()
  install(EXPORT lk-emu-${export} NAMESPACE lk:: DESTINATION ${package_dir} COMPONENT development)
endfunction()

lk_package(core-targets options protocol model core)
if(TARGET lk_config)
  lk_package(config-targets config)
endif()

# Public headers (<lk/...>) and those that they include. Not installed: the tick's vector storage, the TOML parser, and
# the shell, which is not a library.
file(GLOB_RECURSE headers RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS
  protocol/*.hpp emulator/core/*.hpp)
list(APPEND headers
  model/drive_bank.hpp model/drive_params.hpp model/faults.hpp model/lane_kernel.hpp model/setpoint.hpp
  emulator/config/candump_log.hpp emulator/config/config.hpp emulator/config/config_error.hpp
  emulator/config/motor_file.hpp emulator/config/profile.hpp emulator/config/rom_file.hpp
  emulator/config/scenario/scenario_file.hpp)
foreach(header ${headers})
  cmake_path(GET header PARENT_PATH directory)
  install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lk/${directory} COMPONENT development)
endforeach()
# The sources include each other relative to the project root; installed headers use <lk/...>.
install(CODE "
  file(GLOB_RECURSE headers \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}/lk/*.hpp\")
  foreach(header \${headers})
    file(READ \${header} text)
    string(REGEX REPLACE \"#include \\\"((protocol|model|emulator)/[^\\\"]+)\\\"\" \"#include <lk/\\\\1>\" text \"\${text}\")
    file(WRITE \${header} \"\${text}\")
  endforeach()" COMPONENT development)

# An example project for users to copy.
install(DIRECTORY examples/robot DESTINATION ${CMAKE_INSTALL_DATADIR}/lk-emu/examples COMPONENT development)

set(configs_dir ${CMAKE_INSTALL_DATADIR}/lk-emu)
configure_package_config_file(cmake/lk-emu-config.cmake.in ${PROJECT_BINARY_DIR}/lk-emu-config.cmake
  INSTALL_DESTINATION ${package_dir} PATH_VARS configs_dir)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/lk-emu-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/lk-emu-config.cmake ${PROJECT_BINARY_DIR}/lk-emu-config-version.cmake
  DESTINATION ${package_dir} COMPONENT development)
