# find_package(anchorsplat): the target anchorsplat::anchorsplat. It needs nothing but a C++20 compiler.
include("${CMAKE_CURRENT_LIST_DIR}/anchorsplatTargets.cmake")
