# Libraries of a build for the web: compiled from Debian's source packages by scripts/web/libraries.sh and put under
# ANCHORSPLAT_WEB_PREFIX, with the names that find_package gives them elsewhere.
set(ANCHORSPLAT_WEB_PREFIX "" CACHE PATH "Where scripts/web/libraries.sh has put the libraries")
if(NOT EXISTS "${ANCHORSPLAT_WEB_PREFIX}/include/hwy/highway.h")
  message(FATAL_ERROR "ANCHORSPLAT_WEB_PREFIX: no libraries in '${ANCHORSPLAT_WEB_PREFIX}'; `make web` builds them.")
endif()

include_directories(SYSTEM "${ANCHORSPLAT_WEB_PREFIX}/include")  # fast_float's, which are only headers

function(anchorsplat_web_library target)
  cmake_parse_arguments(LIBRARY "" "" "ARCHIVES;USES" ${ARGN})
  add_library(${target} INTERFACE IMPORTED GLOBAL)
  target_include_directories(${target} SYSTEM INTERFACE "${ANCHORSPLAT_WEB_PREFIX}/include")
  foreach(archive IN LISTS LIBRARY_ARCHIVES)
    target_link_libraries(${target} INTERFACE "${ANCHORSPLAT_WEB_PREFIX}/lib/lib${archive}.a")
  endforeach()
  target_link_libraries(${target} INTERFACE ${LIBRARY_USES})
endfunction()

anchorsplat_web_library(ZLIB::ZLIB ARCHIVES z)
anchorsplat_web_library(PNG::PNG ARCHIVES png USES ZLIB::ZLIB)
anchorsplat_web_library(JPEG::JPEG ARCHIVES jpeg)
anchorsplat_web_library(PkgConfig::WEBP ARCHIVES webp)
anchorsplat_web_library(PkgConfig::ZSTD ARCHIVES zstd)
anchorsplat_web_library(hwy::hwy ARCHIVES hwy)
anchorsplat_web_library(nlohmann_json::nlohmann_json)
anchorsplat_web_library(CLI11::CLI11)
anchorsplat_web_library(pugixml::pugixml ARCHIVES pugixml)
if(ANCHORSPLAT_TESTS)
  anchorsplat_web_library(GTest::gtest ARCHIVES gtest)
  anchorsplat_web_library(GTest::gmock ARCHIVES gmock USES GTest::gtest)
  anchorsplat_web_library(GTest::gtest_main ARCHIVES gtest_main USES GTest::gtest)
endif()
add_library(Threads::Threads INTERFACE IMPORTED GLOBAL)

# All of it, libraries included, must agree on these: C++ exceptions and longjmp (libpng's, libjpeg's) as WebAssembly has
# them, which Node 18 and browsers of 2022 know. scripts/web/libraries.sh has the same.
# Lengths in files have 64 bits and are compared with the file's own before they become addresses, which have 32.
add_compile_options(-Wno-c++11-narrowing)
add_compile_options(-fwasm-exceptions -sSUPPORT_LONGJMP=wasm -msimd128)
add_link_options(-fwasm-exceptions -sSUPPORT_LONGJMP=wasm)
# Threads of WebAssembly need a page that is isolated from other origins, and a file that is opened is none. So all is
# compiled once as for threads, and linked with them (-pthread) and without: then whoever starts a loop does all of it.
add_compile_options(-pthread)
add_compile_definitions(ANCHORSPLAT_WORKERS)
# Highway knows one instruction set here.
add_compile_definitions(HWY_COMPILE_ONLY_STATIC)
