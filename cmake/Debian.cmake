# cpack in a build directory makes lk-emu, lk-emu-dev (libraries) and, if MuJoCo is installed, lk-emu-body.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "lk-emu maintainers <maintainers@lk-emu.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "virtual LK-TECH servo drives for SocketCAN")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program development)
if(LKEMU_BODY)
  list(APPEND CPACK_COMPONENTS_ALL body)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME lk-emu)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION electronics)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "python3, python3-jinja2, python3-matplotlib, python3-numpy, python3-regex, python3-scipy")  # for lk-emu campaign, identify and plot
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "can-utils, iproute2, python3-pytest, python3-can, python3-distributed, user-mode-linux, wireshark")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_CONTROL_EXTRA
  ${PROJECT_SOURCE_DIR}/packaging/debian/prerm ${PROJECT_SOURCE_DIR}/packaging/debian/postrm)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION
  "Software for robots talks to these drives as to real ones: over SocketCAN,
byte for byte, with a modelled motor behind each. Faults can be injected,
scenarios judged, and runs recorded and replayed.")

# lk-emu-body uses the files of lk-emu, hence the exact version.
set(CPACK_DEBIAN_BODY_PACKAGE_NAME lk-emu-body)
set(CPACK_DEBIAN_BODY_PACKAGE_SECTION electronics)
set(CPACK_DEBIAN_BODY_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_BODY_PACKAGE_DEPENDS "lk-emu (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_BODY_PACKAGE_RECOMMENDS "python3, python3-can")  # for lk-emu demo
set(CPACK_DEBIAN_BODY_PACKAGE_SUGGESTS xdg-utils)
set(CPACK_COMPONENT_BODY_DESCRIPTION
  "lk-emu with the bodies of robots: its drives turn the joints of a model
that MuJoCo computes, in lock step. lk-emu-body demo shows one that walks.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME lk-emu-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS libtomlplusplus-dev)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
  "Headers and static libraries: the drives of lk-emu for tests in C++,
without a bus, without sockets and threads, as fast as can be computed.")

set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/packaging/debian/finish.cmake)
set(CPACK_POST_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/packaging/debian/anonymous.cmake)
include(CPack)
