# find_package(lk-emu): lk::emulator, and with COMPONENTS config, which wants toml++, lk::config. The same names
# in a build tree, for add_subdirectory and FetchContent. docs/cpp.md is for those who use it.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/lk-emu)

# The targets lk_NAME become lk::NAME, from an install by way of the file lk-emu-EXPORT.cmake.
function(lk_package export)
  foreach(name ${ARGN})
    add_library(lk::${name} ALIAS lk_${name})
    set_target_properties(lk_${name} PROPERTIES EXPORT_NAME ${name})
    install(TARGETS lk_${name} EXPORT lk-emu-${export} COMPONENT development)
  endforeach()
  install(EXPORT lk-emu-${export} NAMESPACE lk:: DESTINATION ${package_dir} COMPONENT development)
endfunction()

lk_package(core-targets options protocol model emulator)
if(TARGET lk_config)
  lk_package(config-targets config)
endif()

# What a user includes, and what that includes in turn; from the root of the project. All else stays at home: how the
# tick stores a drive in vector registers, how TOML is taken apart, and the shell, which is no library.
function(lk_install_headers directory)
  install(FILES ${ARGN} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lk-emu/${directory} COMPONENT development)
endfunction()
file(GLOB protocol_headers CONFIGURE_DEPENDS protocol/*.hpp)
lk_install_headers(protocol ${protocol_headers})
lk_install_headers(model
  model/drive_bank.hpp model/drive_params.hpp model/faults.hpp model/lane_kernel.hpp model/setpoint.hpp)
foreach(folder emulator/core emulator/core/bus emulator/core/faults emulator/core/node emulator/core/scenario
    emulator/core/servo emulator/core/wire)
  file(GLOB headers CONFIGURE_DEPENDS ${folder}/*.hpp)
  lk_install_headers(${folder} ${headers})
endforeach()
lk_install_headers(emulator/config
  emulator/config/candump_log.hpp emulator/config/config.hpp emulator/config/config_error.hpp
  emulator/config/motor_figures.hpp emulator/config/motor_file.hpp emulator/config/profile.hpp emulator/config/rom_file.hpp)

set(configs_dir ${CMAKE_INSTALL_DATADIR}/lk-emu)
configure_package_config_file(cmake/lk-emu-config.cmake.in ${PROJECT_BINARY_DIR}/lk-emu-config.cmake
  INSTALL_DESTINATION ${package_dir} PATH_VARS configs_dir)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/lk-emu-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/lk-emu-config.cmake ${PROJECT_BINARY_DIR}/lk-emu-config-version.cmake
  DESTINATION ${package_dir} COMPONENT development)
