# anchorsplat_room(NAME FOLDERS folders... USES rooms... LIBRARIES targets...)
#
# One library target `anchorsplat_NAME` of all foo.cc in the folder and in FOLDERS, and, when there are foo_test.cc, one test program
# `NAME_test` whose cases are found by CTest. Tests find files of the repository by core/source_dir_for_test.h. Tests that
# need a GPU have "gpu" in the file's name.
#
# With ANCHORSPLAT_UNITY several files of a room are compiled as one, which halves a build from nothing: reading headers
# and making the same templates is most of it. A name in an anonymous namespace must then be the only one of its room.
if(ANCHORSPLAT_TESTS)
  include(GoogleTest)
endif()
function(anchorsplat_unity target)
  if(NOT ANCHORSPLAT_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  get_target_property(sources ${target} SOURCES)
  foreach(source IN LISTS sources)
    # Highway includes such a file again and again, once per instruction set.
    file(STRINGS "${source}" dispatched REGEX "^#define HWY_TARGET_INCLUDE" LIMIT_COUNT 1)
    if(dispatched)
      set_source_files_properties("${source}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endforeach()
endfunction()

file(CONFIGURE OUTPUT "${CMAKE_BINARY_DIR}/source_dir_for_test.cc" CONTENT [[
#include "core/source_dir_for_test.h"
std::filesystem::path anchorsplat::SourceDirForTest() { return "@CMAKE_SOURCE_DIR@"; }
]] @ONLY)
add_library(anchorsplat_source_dir_for_test STATIC EXCLUDE_FROM_ALL "${CMAKE_BINARY_DIR}/source_dir_for_test.cc")
target_link_libraries(anchorsplat_source_dir_for_test PUBLIC anchorsplat_flags)

if(ANCHORSPLAT_SANITIZE)
  # For what opens a GPU. Not ours are what drivers never free, and what is left to a device that has failed, of which nothing may be
  # called any more. GCC's runtime up to 13 takes a thread's variables of a library loaded later, wherever they happen to lie 16 bytes
  # into a page, for those of an old glibc, reads garbage as their address and dies there at exit ("Tracer caught signal 11").
  # Without intercept_tls_get_addr it does not look; what only such variables point to is found all the same, as
  # they lie in memory that the loader has allocated, which counts as in use.
  file(CONFIGURE OUTPUT "${CMAKE_BINARY_DIR}/sanitizer_defaults.cc" CONTENT [[
extern "C" const char* __asan_default_options() { return "intercept_tls_get_addr=0"; }
extern "C" const char* __lsan_default_suppressions() { return "leak:libvulkan\nleak:libwgpu\nleak:libLLVM\n"; }
extern "C" const char* __lsan_default_options() { return "print_suppressions=0"; }
]] @ONLY)
  add_library(anchorsplat_sanitizer_defaults OBJECT EXCLUDE_FROM_ALL "${CMAKE_BINARY_DIR}/sanitizer_defaults.cc")
endif()

function(anchorsplat_room name)
  cmake_parse_arguments(ROOM "" "" "FOLDERS;USES;LIBRARIES" ${ARGN})
  set(patterns "${CMAKE_CURRENT_SOURCE_DIR}/*.cc")
  foreach(folder IN LISTS ROOM_FOLDERS)
    list(APPEND patterns "${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cc")
  endforeach()
  file(GLOB sources CONFIGURE_DEPENDS ${patterns})
  set(tests ${sources})
  list(FILTER sources EXCLUDE REGEX "_test\\.cc$")
  list(FILTER tests INCLUDE REGEX "_test\\.cc$")
  if(EMSCRIPTEN)  # Node has no GPU
    list(FILTER tests EXCLUDE REGEX "/[^/]*gpu[^/]*_test\\.cc$")
  endif()
  if(NOT sources)
    return()
  endif()
  add_library(anchorsplat_${name} STATIC ${sources})
  if(NOT EMSCRIPTEN)  # every room may become part of a shared library
    set_target_properties(anchorsplat_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  endif()
  anchorsplat_unity(anchorsplat_${name})
  target_link_libraries(anchorsplat_${name} PUBLIC anchorsplat_flags ${ROOM_LIBRARIES})
  foreach(used IN LISTS ROOM_USES)
    if(TARGET anchorsplat_${used})  # a room that is only headers has no library
      target_link_libraries(anchorsplat_${name} PUBLIC anchorsplat_${used})
    endif()
  endforeach()
  if(tests AND ANCHORSPLAT_TESTS)
    add_executable(${name}_test ${tests})
    if(EMSCRIPTEN)  # run by Node, on the files of this machine
      target_link_options(${name}_test PRIVATE -O1 -pthread -sPTHREAD_POOL_SIZE=8 -sNODERAWFS=1 -sENVIRONMENT=node -sEXIT_RUNTIME=1 -sALLOW_MEMORY_GROWTH=1
                          -sMAXIMUM_MEMORY=4GB -sSTACK_SIZE=4MB -sINITIAL_MEMORY=64MB)
    endif()
    if(ANCHORSPLAT_SANITIZE)
      target_link_libraries(${name}_test PRIVATE anchorsplat_sanitizer_defaults)
    endif()
    set(separate bench cameras cli compact dataset formats images io kernels metrics model model_torch network published render
        tensors)  # their tests call what they compare alike
    if(NOT name IN_LIST separate)
      anchorsplat_unity(${name}_test)
    endif()
    target_link_libraries(${name}_test PRIVATE anchorsplat_${name} anchorsplat_source_dir_for_test
                          GTest::gmock GTest::gtest GTest::gtest_main)
    # A busy machine needs its time to load LibTorch. Mesa's drivers look for no screen.
    gtest_discover_tests(${name}_test TEST_PREFIX "${name}." DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 120
                         PROPERTIES ENVIRONMENT NODEVICE_SELECT=1)
  endif()
endfunction()
