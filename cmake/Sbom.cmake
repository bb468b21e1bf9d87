# Lists the third-party parts of a package in SPDX 2.3, share/doc/PACKAGE/PACKAGE.spdx.json, next to their licences as
# the distribution ships them. Runs at configuration; it needs no build.
#   in: core (lk-emu-dev and lk-emu), program (lk-emu), static (lk-emu, if LKEMU_STATIC links all of it)
set(sbom_parts
  #name          | licence                                 | in      | a file of it
  "Boost         | BSL-1.0                                 | program | boost/version.hpp"
  "CLI11         | BSD-3-Clause                            | program | CLI/CLI.hpp"
  "Eigen         | MPL-2.0                                 | program | eigen3/Eigen/Core"
  "fmt           | MIT                                     | program | fmt/format.h"
  "glibc         | LGPL-2.1-or-later                       | static  | libc.a"
  "libgcc        | GPL-3.0-or-later WITH GCC-exception-3.1 | static  | libgcc.a"
  "libstdc++     | GPL-3.0-or-later WITH GCC-exception-3.1 | core    | libstdc++.a"
  "nlohmann-json | MIT                                     | program | nlohmann/json.hpp"
  "spdlog        | MIT                                     | program | spdlog/spdlog.h"
  "toml++        | MIT                                     | core    | toml++/toml.h"
  "three.js      | MIT                                     | program | web/vendor/three.module.min.js"
  "uPlot         | MIT                                     | program | web/vendor/uPlot.min.js")

# sbom_entry(ID NAME LICENCE MEMBER...): appends one SPDX package to `entries` of the caller.
function(sbom_entry id name licence)
  set(members "\"SPDXID\": \"SPDXRef-${id}\"" "\"name\": \"${name}\"" ${ARGN}
    "\"filesAnalyzed\": false" "\"licenseConcluded\": \"${licence}\"" "\"licenseDeclared\": \"${licence}\""
    "\"copyrightText\": \"NOASSERTION\"")
  list(JOIN members ",\n      " members)
  list(APPEND entries "    {\n      ${members}\n    }")
  set(entries "${entries}" PARENT_SCOPE)
endfunction()

# Returns `members`, the SPDX fields of the distribution package that owns the file, and `copyright`, its licence file.
# Both lack version and licence if dpkg does not know the file.
function(sbom_of_distribution file)
  set(members "\"downloadLocation\": \"NOASSERTION\"")
  execute_process(COMMAND dpkg-query -S ${file} OUTPUT_VARIABLE owner ERROR_QUIET)
  if(owner MATCHES "^([^ :,]+)")
    set(package ${CMAKE_MATCH_1})
    execute_process(COMMAND dpkg-query -W -f "\${Version};\${Architecture}" ${package} OUTPUT_VARIABLE fields)
    list(GET fields 0 version)
    list(GET fields 1 architecture)
    cmake_host_system_information(RESULT distribution QUERY DISTRIB_ID)
    string(REPLACE ":" "%3A" purl "${version}")
    string(REPLACE "+" "%2B" purl "pkg:deb/${distribution}/${package}@${purl}?arch=${architecture}")
    list(APPEND members "\"versionInfo\": \"${version}\"" "\"externalRefs\": [{\"referenceCategory\": \"PACKAGE-MANAGER\", \
\"referenceType\": \"purl\", \"referenceLocator\": \"${purl}\"}]")
    file(REAL_PATH /usr/share/doc/${package}/copyright copyright)
  endif()
  return(PROPAGATE members copyright)
endfunction()

# As sbom_of_distribution, for a file of web/vendor, which has its own licence; web/vendor/SOURCES gives its origin.
function(sbom_of_vendor file)
  cmake_path(GET file PARENT_PATH vendor)
  cmake_path(GET file FILENAME file_name)
  file(STRINGS ${vendor}/SOURCES rows REGEX "^${file_name} ")
  if(NOT rows MATCHES "^[^ ]+ +([^ ]+) +([^ ]+) +[^ ]+ +([0-9a-f]+)$")
    message(FATAL_ERROR "${file}: not in ${vendor}/SOURCES")
  endif()
  set(npm ${CMAKE_MATCH_1})
  set(members "\"downloadLocation\": \"https://registry.npmjs.org/${npm}/-/${npm}-${CMAKE_MATCH_2}.tgz\""
    "\"versionInfo\": \"${CMAKE_MATCH_2}\"" "\"packageFileName\": \"${file_name}\""
    "\"checksums\": [{\"algorithm\": \"SHA256\", \"checksumValue\": \"${CMAKE_MATCH_3}\"}]")
  string(REGEX REPLACE "\\.[^/]*$" ".LICENSE" copyright ${file})
  return(PROPAGATE members copyright)
endfunction()

# lkemu_sbom(PACKAGE COMPONENT IN...): writes the list of a package and installs it with the component.
function(lkemu_sbom package component)
  set(doc ${CMAKE_INSTALL_DATAROOTDIR}/doc/${package})
  set(entries "")
  set(relations "SPDXRef-DOCUMENT DESCRIBES SPDXRef-${package}")
  sbom_entry(${package} ${package} MIT "\"versionInfo\": \"${PROJECT_VERSION}\"" "\"downloadLocation\": \"NOASSERTION\"")
  foreach(row ${sbom_parts})
    string(REGEX REPLACE " *\\| *" ";" row "${row}")
    list(POP_FRONT row name licence in file)
    if(NOT in IN_LIST ARGN)
      continue()
    endif()
    unset(copyright)
    if(file MATCHES "^web/")
      sbom_of_vendor(${PROJECT_SOURCE_DIR}/${file})
    elseif(file MATCHES "\\.a$")
      execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=${file}
        OUTPUT_VARIABLE path OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
      file(REAL_PATH ${path} path)
      sbom_of_distribution(${path})
    else()
      find_file(path ${file} NO_CACHE REQUIRED)
      sbom_of_distribution(${path})
    endif()
    unset(path)
    string(REGEX REPLACE "[^A-Za-z0-9]" "-" id ${name})
    sbom_entry(${id} ${name} ${licence} ${members})
    list(APPEND relations "SPDXRef-${package} CONTAINS SPDXRef-${id}")
    if(EXISTS "${copyright}")
      install(FILES ${copyright} DESTINATION ${doc}/licenses RENAME ${name} COMPONENT ${component})
    endif()
  endforeach()
  list(TRANSFORM relations REPLACE "(.+) (.+) (.+)"
    "    {\"spdxElementId\": \"\\1\", \"relationshipType\": \"\\2\", \"relatedSpdxElement\": \"\\3\"}")
  list(JOIN relations ",\n" relations)
  list(JOIN entries ",\n" entries)
  string(TIMESTAMP created %Y-%m-%dT%H:%M:%SZ UTC)  # SOURCE_DATE_EPOCH if set
  string(UUID uuid NAMESPACE 6ba7b811-9dad-11d1-80b4-00c04fd430c8 NAME "${created}${entries}" TYPE SHA1)
  set(list ${PROJECT_BINARY_DIR}/sbom/${package}.spdx.json)
  file(WRITE ${list} "{
  \"spdxVersion\": \"SPDX-2.3\",
  \"dataLicense\": \"CC0-1.0\",
  \"SPDXID\": \"SPDXRef-DOCUMENT\",
  \"name\": \"${package}-${PROJECT_VERSION}\",
  \"documentNamespace\": \"https://spdx.org/spdxdocs/${package}-${PROJECT_VERSION}-${uuid}\",
  \"creationInfo\": {\"created\": \"${created}\", \"creators\": [\"Tool: CMake-${CMAKE_VERSION}\"]},
  \"packages\": [\n${entries}\n  ],
  \"relationships\": [\n${relations}\n  ]
}
")
  install(FILES ${list} DESTINATION ${doc} COMPONENT ${component})
endfunction()

if(LKEMU_STATIC)
  lkemu_sbom(lk-emu program core program static)
else()
  lkemu_sbom(lk-emu program core program)
endif()
lkemu_sbom(lk-emu-dev development core)
if(LKEMU_BODY)
  lkemu_sbom(lk-emu-body body core program)  # MuJoCo is a shared library, not part of the package
endif()
