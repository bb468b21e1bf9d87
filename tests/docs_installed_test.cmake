# cmake -DROOT=DIR -DOUT=DIR -DCHECK=PROGRAM -P: the documents, laid out as an installation has them, have no link that
# leads nowhere.
file(REMOVE_RECURSE ${OUT})
set(documents ${OUT}/share/doc/lk-emu)
set(data ${OUT}/share/lk-emu)
file(INSTALL ${ROOT}/LICENSE ${ROOT}/README.md ${ROOT}/README.zh-CN.md ${ROOT}/CHANGELOG.md DESTINATION ${documents})
file(INSTALL ${ROOT}/docs DESTINATION ${documents} PATTERN decisions EXCLUDE)
file(INSTALL ${ROOT}/configs/ DESTINATION ${data})
file(INSTALL ${ROOT}/examples DESTINATION ${data})
file(INSTALL ${ROOT}/python/lkemu ${ROOT}/python/examples DESTINATION ${data}/python)
execute_process(COMMAND ${CHECK} --links ${documents} RESULT_VARIABLE before OUTPUT_QUIET)
if(before EQUAL 0)
  message(FATAL_ERROR "the check sees nothing: the documents as they are lead out of their directory")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -DDOCUMENTS=${documents} -DDATA=${data} -P ${ROOT}/cmake/InstalledLinks.cmake
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CHECK} --links ${documents} COMMAND_ERROR_IS_FATAL ANY)
