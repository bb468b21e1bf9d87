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

# Headers include each other from the root of the project. Those of the shell stay at home: it is no library.
install(DIRECTORY protocol model DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lk-emu
  COMPONENT development FILES_MATCHING PATTERN *.hpp)
install(DIRECTORY emulator/core emulator/config DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lk-emu/emulator
  COMPONENT development FILES_MATCHING PATTERN *.hpp)

set(configs_dir ${CMAKE_INSTALL_DATADIR}/lk-emu)
configure_package_config_file(cmake/lk-emu-config.cmake.in ${PROJECT_BINARY_DIR}/lk-emu-config.cmake
  INSTALL_DESTINATION ${package_dir} PATH_VARS configs_dir)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/lk-emu-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/lk-emu-config.cmake ${PROJECT_BINARY_DIR}/lk-emu-config-version.cmake
  DESTINATION ${package_dir} COMPONENT development)
