# anchorsplat_embed(TARGET NAMESPACE files...)
#
# The text of foo_bar.wgsl beside the caller's CMakeLists.txt becomes the constant NAMESPACE::kFooBarWgsl
# (std::string_view) of the target, declared in "ROOM/NAMESPACE.h", where ROOM is the caller's folder in its wing. An edit
# of the file compiles one generated source again.
if(CMAKE_SCRIPT_MODE_FILE)
  set(text "#include \"${HEADER}\"\n\nnamespace anchorsplat::${NAMESPACE} {\n")
  foreach(file IN LISTS FILES)
    file(READ "${file}" content)
    get_filename_component(name "${file}" NAME)
    string(LENGTH "${content}" length)
    if(length GREATER 65000)
      message(FATAL_ERROR "${file}: ${length} bytes; compilers need not take strings longer than 65,536")
    endif()
    if(content MATCHES "[)]~text~")
      message(FATAL_ERROR "${file}: holds )~text~, the end of the raw string")
    endif()
    list(POP_FRONT NAMES constant)
    string(APPEND text "\nconstinit const std::string_view ${constant} = R\"~text~(${content})~text~\";\n")
  endforeach()
  string(APPEND text "\n}  // namespace anchorsplat::${NAMESPACE}\n")
  file(WRITE "${OUTPUT}" "${text}")
  return()
endif()

set(ANCHORSPLAT_EMBED_SCRIPT "${CMAKE_CURRENT_LIST_FILE}")
function(anchorsplat_embed target namespace)
  file(RELATIVE_PATH room "${CMAKE_SOURCE_DIR}/src" "${CMAKE_CURRENT_SOURCE_DIR}")
  string(REGEX REPLACE "^[^/]+/(.*)$" "\\1" room "${room}")  # without its wing, as in every include
  set(folder "${CMAKE_BINARY_DIR}/embedded")
  set(declarations "")
  set(names "")
  set(paths "")
  foreach(file IN LISTS ARGN)
    get_filename_component(words "${file}" NAME)
    string(REGEX REPLACE "[^A-Za-z0-9]" ";" words "${words}")
    set(constant k)
    foreach(word IN LISTS words)
      string(SUBSTRING "${word}" 0 1 first)
      string(SUBSTRING "${word}" 1 -1 rest)
      string(TOUPPER "${first}" first)
      string(APPEND constant "${first}${rest}")
    endforeach()
    list(APPEND names "${constant}")
    list(APPEND paths "${CMAKE_CURRENT_SOURCE_DIR}/${file}")
    string(APPEND declarations "extern const std::string_view ${constant};  // ${file}\n")
  endforeach()
  # At configuration, so that whoever includes it need not wait for a target.
  file(CONFIGURE OUTPUT "${folder}/${room}/${namespace}.h" @ONLY CONTENT [[
#pragma once

#include <string_view>

namespace anchorsplat::@namespace@ {

@declarations@
}  // namespace anchorsplat::@namespace@
]])
  add_custom_command(
    OUTPUT "${folder}/${room}/${namespace}.cc"
    COMMAND ${CMAKE_COMMAND} "-DHEADER=${room}/${namespace}.h" "-DNAMESPACE=${namespace}" "-DNAMES=${names}"
            "-DFILES=${paths}" "-DOUTPUT=${folder}/${room}/${namespace}.cc" -P "${ANCHORSPLAT_EMBED_SCRIPT}"
    DEPENDS ${paths} "${ANCHORSPLAT_EMBED_SCRIPT}"
    VERBATIM)
  target_sources(${target} PRIVATE "${folder}/${room}/${namespace}.cc")
  set_source_files_properties("${folder}/${room}/${namespace}.cc" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  target_include_directories(${target} PUBLIC "${folder}")
endfunction()
