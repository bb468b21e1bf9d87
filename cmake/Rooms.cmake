# lk_room(DIRECTORY [IF OPTION] [USES DIRECTORY...] [LIBRARIES TARGET...]): makes the library lk_NAME of all sources in
# DIRECTORY, whose last part is NAME. A room may include the rooms that it uses, directly or through others;
# tests/rooms_test.py checks this. With IF the library exists only if the option is on.
function(lk_room directory)
  cmake_parse_arguments(PARSE_ARGV 1 room "" "IF" "USES;LIBRARIES")
  cmake_path(GET directory FILENAME name)
  lk_note_room(${directory} ${room_USES})
  if(room_IF AND NOT ${room_IF})
    return()
  endif()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${directory}/*.cpp)
  if(sources)
    add_library(lk_${name} STATIC ${sources})
    set(scope PUBLIC)
    set_property(GLOBAL APPEND PROPERTY LK_ROOM_TARGETS lk_${name})
  else()
    add_library(lk_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_link_libraries(lk_${name} ${scope} lk_options)
  foreach(used ${room_USES})
    cmake_path(GET used FILENAME used)
    if(TARGET lk_${used})
      target_link_libraries(lk_${name} ${scope} lk_${used})
    endif()
  endforeach()
  target_link_libraries(lk_${name} ${scope} ${room_LIBRARIES})
endfunction()

# Adds a line such as "emulator/config: emulator/core", which tests/rooms_test.py reads.
function(lk_note_room directory)
  list(JOIN ARGN " " uses)
  set_property(GLOBAL APPEND_STRING PROPERTY LK_ROOMS "${directory}: ${uses}\n")
endfunction()

# A room of the program itself, one compilation unit for each folder. -O1: most of the code is library templates, and none
# is time-critical. Full optimisation would double the build time.
function(lk_program_room directory)
  lk_room(${directory} ${ARGN})
  cmake_path(GET directory FILENAME name)
  if(NOT TARGET lk_${name})
    return()
  endif()
  set_target_properties(lk_${name} PROPERTIES UNITY_BUILD_MODE GROUP)
  get_target_property(sources lk_${name} SOURCES)
  foreach(source ${sources})
    cmake_path(GET source PARENT_PATH folder)
    cmake_path(GET folder FILENAME folder)
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${folder})
  endforeach()
  target_compile_options(lk_${name} PRIVATE
    -Wno-null-dereference  # GCC 12 warns falsely in Asio's lists
    $<$<CONFIG:Release>:-O1>)
  target_compile_definitions(lk_${name} PRIVATE LKEMU_VERSION="${PROJECT_VERSION}")
endfunction()

# `lk_embed_files(TARGET NAME name HEADER file DIRECTORY dir FILES file...)`: embeds the files unchanged in the room's
# library. The function find_NAME, which HEADER declares, finds them by their path below DIRECTORY.
function(lk_embed_files target)
  cmake_parse_arguments(PARSE_ARGV 1 embed "" "NAME;HEADER;DIRECTORY" "FILES")
  list(TRANSFORM embed_FILES PREPEND ${PROJECT_SOURCE_DIR}/${embed_DIRECTORY}/ OUTPUT_VARIABLE paths)
  set(out ${CMAKE_CURRENT_BINARY_DIR}/${embed_NAME}s.cpp)
  add_custom_command(OUTPUT ${out}
    COMMAND ${CMAKE_COMMAND} -DOUT=${out} -DROOT=${PROJECT_SOURCE_DIR} -DDIR=${embed_DIRECTORY} "-DFILES=${embed_FILES}"
      -DNAME=${embed_NAME} -DHEADER=${embed_HEADER} -P ${PROJECT_SOURCE_DIR}/cmake/EmbedFiles.cmake
    DEPENDS ${paths} ${PROJECT_SOURCE_DIR}/cmake/EmbedFiles.cmake VERBATIM)
  target_sources(${target} PRIVATE ${out})
  # With LTO the assembler runs in another directory and does not find the files.
  set_source_files_properties(${out} PROPERTIES COMPILE_OPTIONS -fno-lto)
endfunction()
