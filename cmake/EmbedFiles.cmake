# Makes a C++ file out of files: cmake -DOUT=… -DROOT=… "-DFILES=a;b" -P EmbedFiles.cmake
function(type_of extension result)
  if(extension STREQUAL ".html")
    set(${result} "text/html; charset=utf-8" PARENT_SCOPE)
  elseif(extension STREQUAL ".css")
    set(${result} "text/css; charset=utf-8" PARENT_SCOPE)
  elseif(extension STREQUAL ".js")
    set(${result} "text/javascript; charset=utf-8" PARENT_SCOPE)
  elseif(extension STREQUAL ".svg")
    set(${result} "image/svg+xml" PARENT_SCOPE)
  else()
    message(FATAL_ERROR "EmbedFiles: no content type for ${extension}")
  endif()
endfunction()

set(bodies "")
set(table "")
set(n 0)
foreach(file ${FILES})
  get_filename_component(extension ${file} LAST_EXT)
  type_of(${extension} type)
  file(READ ${ROOT}/${file} hex HEX)
  file(SHA256 ${ROOT}/${file} hash)
  string(SUBSTRING ${hash} 0 16 hash)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," bytes "${hex}")
  string(APPEND bodies "constexpr char kFile${n}[] = {${bytes}'\\0'};\n")
  set(path ${file})
  if(path STREQUAL "index.html")
    set(path "")
  endif()
  string(APPEND table "    {\"/${path}\", \"${type}\", \"\\\"${hash}\\\"\", {kFile${n}, sizeof kFile${n} - 1}},\n")
  math(EXPR n "${n} + 1")
endforeach()
file(WRITE ${OUT} "#include <algorithm>
#include <iterator>

#include \"emulator/control/web_files.hpp\"

namespace lk::emulator {
namespace {

${bodies}
constexpr WebFile kFiles[] = {
${table}};

}  // namespace

const WebFile* find_web_file(std::string_view target) {
  const std::string_view path = target.substr(0, target.find('?'));
  const auto* const found = std::ranges::find(kFiles, path, &WebFile::path);
  return found != std::end(kFiles) ? found : nullptr;
}

}  // namespace lk::emulator
")
