# CPack runs this on the files before packing: adds the files that Debian requires, in its places and formats.
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # SOURCE_DATE_EPOCH if set

function(compress file)
  execute_process(COMMAND gzip -9nf ${file} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

function(finish root package)
  set(doc ${root}/usr/share/doc/${package})
  file(MAKE_DIRECTORY ${doc})
  file(COPY ${CMAKE_CURRENT_LIST_DIR}/copyright DESTINATION ${doc})
  file(WRITE ${doc}/changelog "${package} (${CPACK_PACKAGE_VERSION}) unstable; urgency=medium

  * ${CPACK_PACKAGE_VERSION}: /usr/share/doc/lk-emu/CHANGELOG.md has what is new.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}
")
  compress(${doc}/changelog)
  file(GLOB pages ${root}/usr/share/man/man1/*.1)  # none without help2man
  foreach(page ${pages})
    compress(${page})
  endforeach()
  # Independent of the umask of the build.
  execute_process(COMMAND chmod -R u=rwX,go=rX ${root} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

set(program ${CPACK_TEMPORARY_DIRECTORY}/program)
file(REMOVE ${program}/usr/share/doc/lk-emu/LICENSE)  # Debian puts it in copyright
foreach(page README.md README.zh-CN.md)
  file(READ ${program}/usr/share/doc/lk-emu/${page} text)
  string(REPLACE "](LICENSE)" "](copyright)" text "${text}")
  file(WRITE ${program}/usr/share/doc/lk-emu/${page} "${text}")
endforeach()
finish(${program} lk-emu)
finish(${CPACK_TEMPORARY_DIRECTORY}/development lk-emu-dev)
if(EXISTS ${CPACK_TEMPORARY_DIRECTORY}/body)
  finish(${CPACK_TEMPORARY_DIRECTORY}/body lk-emu-body)
endif()
