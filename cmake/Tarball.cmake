# cpack in a build directory with LKEMU_STATIC makes lk-emu-VERSION-SYSTEM-PROCESSOR.tar.gz, to unpack anywhere.
string(TOLOWER ${PROJECT_NAME}-${PROJECT_VERSION}-${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR} CPACK_PACKAGE_FILE_NAME)
# Not TGZ: its archives record the user and the umask of the build.
set(CPACK_GENERATOR External)
set(CPACK_EXTERNAL_ENABLE_STAGING ON)
set(CPACK_EXTERNAL_PACKAGE_SCRIPT ${PROJECT_SOURCE_DIR}/packaging/tarball.cmake)
set(CPACK_PACKAGING_INSTALL_PREFIX /${CPACK_PACKAGE_FILE_NAME})
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program)
include(CPack)
