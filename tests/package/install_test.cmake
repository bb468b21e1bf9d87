# Installs into a private prefix, moves the prefix, and runs the program from its new place.
# Variables: BUILD_DIR, SCRATCH
file(REMOVE_RECURSE ${SCRATCH})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${SCRATCH}/first
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(RENAME ${SCRATCH}/first ${SCRATCH}/moved)

set(program ${SCRATCH}/moved/bin/lk-emu)
execute_process(COMMAND ${program} --version WORKING_DIRECTORY / OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
# With an unknown motor the program lists the motors that it has found.
execute_process(COMMAND ${program} --bus vcan0 --ids 1 --motor none WORKING_DIRECTORY /
  ERROR_VARIABLE message RESULT_VARIABLE status)
if(NOT status EQUAL 2 OR NOT message MATCHES "there are: .*mf7015, .*mg4005, .*ms3506")
  message(FATAL_ERROR "status ${status}: ${message}")
endif()
foreach(file share/lk-emu/buses/example.toml share/doc/lk-emu/README.md share/doc/lk-emu/LICENSE
  share/man/man1/lk-emu.1 share/bash-completion/completions/lk-emu lib/systemd/system/lk-emu@.service)
  if(NOT EXISTS ${SCRATCH}/moved/${file})
    message(FATAL_ERROR "${file} is not installed")
  endif()
endforeach()
# The program draws with the Python package of its installation.
file(WRITE ${SCRATCH}/run.csv "time_s,1.iq_A\n0,1\n")
execute_process(COMMAND ${CMAKE_COMMAND} -E env --unset=PYTHONPATH PATH=/usr/bin:/bin ${program} plot ${SCRATCH}/run.csv
  WORKING_DIRECTORY / OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
if(NOT EXISTS ${SCRATCH}/run.svg)
  message(FATAL_ERROR "lk-emu plot has drawn nothing")
endif()
# A campaign finds its plan, its templates and the style sheet, and its workers find the package.
file(COPY ${CMAKE_CURRENT_LIST_DIR}/../engines/plan.toml DESTINATION ${SCRATCH})
execute_process(COMMAND ${CMAKE_COMMAND} -E env --unset=PYTHONPATH PATH=/usr/bin:/bin ${program} campaign ${SCRATCH}/plan.toml --shard 0/100
  --quiet -o ${SCRATCH}/plan.db --html ${SCRATCH}/plan.html WORKING_DIRECTORY / COMMAND_ERROR_IS_FATAL ANY)
file(READ ${SCRATCH}/plan.html page)
if(NOT page MATCHES "data-theme")
  message(FATAL_ERROR "the page of a campaign has no style sheet")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -E env --unset=PYTHONPATH PATH=/usr/bin:/bin ${program} campaign controller --case 1
  WORKING_DIRECTORY / OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
# The Python package finds the program of its installation.
execute_process(COMMAND ${CMAKE_COMMAND} -E env --unset=LKEMU PYTHONDONTWRITEBYTECODE=1
  PYTHONPATH=${SCRATCH}/moved/share/lk-emu/python /usr/bin/python3 -c "import lkemu.program as p; print(p.find_program())"
  WORKING_DIRECTORY / OUTPUT_VARIABLE found OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
file(REAL_PATH ${program} program)
if(NOT found STREQUAL program)
  message(FATAL_ERROR "lkemu takes ${found} for the program, which is ${program}")
endif()
file(REMOVE_RECURSE ${SCRATCH})
