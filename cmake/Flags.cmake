# Compile flags of our own code, as one interface target that every room links.
add_library(anchorsplat_flags INTERFACE)
# A file is named by its room ("render/rasterizer.h"), whichever wing that is in.
target_include_directories(anchorsplat_flags INTERFACE "${CMAKE_SOURCE_DIR}/src/engine" "${CMAKE_SOURCE_DIR}/src/lab"
                                                       "${CMAKE_SOURCE_DIR}/src/doors")
target_compile_definitions(anchorsplat_flags INTERFACE ANCHORSPLAT_VERSION="${PROJECT_VERSION}")
target_compile_options(anchorsplat_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wnon-virtual-dtor
  # Calls within a shared library stay direct; WebAssembly has none.
  $<$<NOT:$<BOOL:${EMSCRIPTEN}>>:-fno-semantic-interposition>
  # a*b+c must round twice unless a kernel asks for FMA by name: row counts of the network's input depend on it, and
  # results must not change with the compiler's mood.
  -ffp-contract=off)
# Every file that stands behind another one shadows what is global there: where rooms are compiled as one, only what is
# local counts. Presets that compile file by file have the whole warnings.
if(NOT ANCHORSPLAT_UNITY)
  target_compile_options(anchorsplat_flags INTERFACE -Wshadow)
elseif(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(anchorsplat_flags INTERFACE -Wshadow=local -Wno-subobject-linkage)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # g++ 12 sees overlapping copies in std::string's operator+ that are not there (GCC bug 105651).
  target_compile_options(anchorsplat_flags INTERFACE -Wno-restrict)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
  target_compile_options(anchorsplat_flags INTERFACE -Wno-psabi)  # notes on what GCC 10 passed otherwise than GCC 9
endif()
if(ANCHORSPLAT_WERROR)
  target_compile_options(anchorsplat_flags INTERFACE -Werror)
endif()

if(ANCHORSPLAT_SANITIZE)
  # -O1 keeps the fuzz tests quick; frame pointers make their reports readable.
  add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer -O1 -g1)
  add_link_options(-fsanitize=address,undefined)
endif()
