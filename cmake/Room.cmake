# anchorsplat_room(NAME USES rooms... LIBRARIES targets...)
#
# One library target `anchorsplat_NAME` of all foo.cc in the folder, and, when there are foo_test.cc, one test program
# `NAME_test` whose cases are found by CTest. Tests find files of the repository by core/source_dir_for_test.h.
include(GoogleTest)

file(CONFIGURE OUTPUT "${CMAKE_BINARY_DIR}/source_dir_for_test.cc" CONTENT [[
#include "core/source_dir_for_test.h"
std::filesystem::path anchorsplat::SourceDirForTest() { return "@CMAKE_SOURCE_DIR@"; }
]] @ONLY)
add_library(anchorsplat_source_dir_for_test STATIC EXCLUDE_FROM_ALL "${CMAKE_BINARY_DIR}/source_dir_for_test.cc")
target_link_libraries(anchorsplat_source_dir_for_test PUBLIC anchorsplat_flags)

function(anchorsplat_room name)
  cmake_parse_arguments(ROOM "" "" "USES;LIBRARIES" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cc")
  set(tests ${sources})
  list(FILTER sources EXCLUDE REGEX "_test\\.cc$")
  list(FILTER tests INCLUDE REGEX "_test\\.cc$")
  if(NOT sources)
    return()
  endif()
  add_library(anchorsplat_${name} STATIC ${sources})
  target_link_libraries(anchorsplat_${name} PUBLIC anchorsplat_flags ${ROOM_LIBRARIES})
  foreach(used IN LISTS ROOM_USES)
    if(TARGET anchorsplat_${used})  # a room that is only headers has no library
      target_link_libraries(anchorsplat_${name} PUBLIC anchorsplat_${used})
    endif()
  endforeach()
  if(tests)
    add_executable(${name}_test ${tests})
    target_link_libraries(${name}_test PRIVATE anchorsplat_${name} anchorsplat_source_dir_for_test
                          GTest::gmock GTest::gtest GTest::gtest_main)
    # A busy machine needs its time to load LibTorch.
    gtest_discover_tests(${name}_test TEST_PREFIX "${name}." DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 120)
  endif()
endfunction()
