# Installs into a private prefix, moves it, and builds and runs the installed example examples/robot with it.
# Variables: BUILD_DIR, SCRATCH, GENERATOR, COMPILER, LAUNCHER, BUILD_TYPE
file(REMOVE_RECURSE ${SCRATCH})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${SCRATCH}/first
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(RENAME ${SCRATCH}/first ${SCRATCH}/moved)

# Prints output only on failure.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(NOTICE "${output}")
    message(FATAL_ERROR "${status} from ${ARGN}")
  endif()
endfunction()

# The package contains no paths outside itself, and sets no warnings for its users.
file(GLOB_RECURSE package_files ${SCRATCH}/moved/*/lk-emu-*.cmake)
list(LENGTH package_files count)
if(count LESS 4)
  message(FATAL_ERROR "no package: ${package_files}")
endif()
cmake_path(GET CMAKE_CURRENT_LIST_DIR PARENT_PATH tests)
cmake_path(GET tests PARENT_PATH sources)
foreach(file ${package_files})
  file(READ ${file} text)
  foreach(stranger ${sources}/ ${BUILD_DIR} ${SCRATCH} -Wall)
    string(FIND "${text}" ${stranger} at)
    if(NOT at EQUAL -1)
      message(FATAL_ERROR "${file} has ${stranger}")
    endif()
  endforeach()
endforeach()

# The headers are complete, and include no headers that compile slowly.
file(GLOB_RECURSE headers ${SCRATCH}/moved/include/*.hpp)
execute_process(COMMAND ${COMPILER} -std=c++20 -I ${SCRATCH}/moved/include -x c++ -M ${headers}
  OUTPUT_VARIABLE included ERROR_QUIET COMMAND_ERROR_IS_FATAL ANY)
foreach(heavy experimental/simd toml++ boost/ nlohmann/ spdlog/ CLI/)
  string(FIND "${included}" ${heavy} at)
  if(NOT at EQUAL -1)
    message(FATAL_ERROR "an installed header includes ${heavy}")
  endif()
endforeach()

set(robot ${SCRATCH}/robot)
run(${CMAKE_COMMAND} -S ${SCRATCH}/moved/share/lk-emu/examples/robot -B ${robot} -G ${GENERATOR}
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER} -DCMAKE_BUILD_TYPE=${BUILD_TYPE}
  -DCMAKE_PREFIX_PATH=${SCRATCH}/moved "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror")
run(${CMAKE_COMMAND} --build ${robot})
run(${CMAKE_CTEST_COMMAND} --test-dir ${robot} --no-tests=error --output-on-failure)

# With add_subdirectory: the same target names, no program, and no warning flags for the user's code.
set(in_tree ${SCRATCH}/in_tree)
file(WRITE ${in_tree}/main.cpp "#include <lk/emulator/core/bus/bus.hpp>\nint main() {}\n")
file(WRITE ${in_tree}/CMakeLists.txt "
cmake_minimum_required(VERSION 3.25)
project(robot LANGUAGES CXX)
add_subdirectory(${sources} lk-emu EXCLUDE_FROM_ALL)
add_executable(robot main.cpp)
target_link_libraries(robot PRIVATE lk::emulator)
if(NOT TARGET lk::config)
  message(FATAL_ERROR \"no lk::config\")
endif()
file(GENERATE OUTPUT flags.txt CONTENT \"$<TARGET_PROPERTY:robot,COMPILE_OPTIONS>\" TARGET robot)
if(TARGET lk-emu)
  message(FATAL_ERROR \"the program is built for a robot's tests\")
endif()
")
run(${CMAKE_COMMAND} -S ${in_tree} -B ${in_tree}/build -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER})
file(READ ${in_tree}/build/flags.txt flags)
if(NOT flags STREQUAL "-ffp-contract=off")
  message(FATAL_ERROR "flags for others: ${flags}")
endif()
file(REMOVE_RECURSE ${SCRATCH})
