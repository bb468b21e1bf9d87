# Embeds files in a C++ file: cmake -DOUT=… -DROOT=… -DDIR=… "-DFILES=a;b" -DNAME=… -DHEADER=… -P EmbedFiles.cmake.
# The C++ file defines find_NAME, which HEADER declares. lk_embed_files (Rooms.cmake) calls this script.
# The assembler includes the files by .incbin from DIR below ROOT. ROOT is on its include path, so the output does not
# depend on the build directory.
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

set(blobs "")
set(declarations "")
set(table "")
set(n 0)
foreach(file ${FILES})
  get_filename_component(extension ${file} LAST_EXT)
  type_of(${extension} type)
  file(SIZE ${ROOT}/${DIR}/${file} size)
  file(SHA256 ${ROOT}/${DIR}/${file} hash)
  string(SUBSTRING ${hash} 0 16 hash)
  string(APPEND blobs "lk_${NAME}_${n}: .incbin \"${DIR}/${file}\"\n")
  string(APPEND declarations "extern const char lk_${NAME}_${n}[];\n")
  set(path ${file})
  if(path STREQUAL "index.html")
    set(path "")
  endif()
  string(APPEND table "    {\"/${path}\", \"${type}\", \"\\\"${hash}\\\"\", {lk_${NAME}_${n}, ${size}}},\n")
  math(EXPR n "${n} + 1")
endforeach()
file(WRITE ${OUT} "#include <algorithm>
#include <iterator>

#include \"${HEADER}\"

asm(R\"(
.pushsection .rodata
${blobs}.popsection
)\");

extern \"C\" {
${declarations}}

namespace lk::emulator {
namespace {

constexpr EmbeddedFile kFiles[] = {
${table}};

}  // namespace

const EmbeddedFile* find_${NAME}(std::string_view target) {
  const std::string_view path = target.substr(0, target.find('?'));
  const auto* const found = std::ranges::find(kFiles, path, &EmbeddedFile::path);
  return found != std::end(kFiles) ? found : nullptr;
}

}  // namespace lk::emulator
")
