# LibTorch for the rooms that need it: the target anchorsplat_torch, with one precompiled header for all of them.
#
# Only the wheel in .venv (scripts/install-torch.sh) or an explicit -DTorch_DIR=… is used, never what the system
# happens to carry: Debian's libtorch-dev is years older.
if(NOT Torch_DIR)
  set(python "${CMAKE_SOURCE_DIR}/.venv/bin/python")
  if(EXISTS "${python}")
    execute_process(COMMAND "${python}" -c "import torch; print(torch.utils.cmake_prefix_path)"
                    OUTPUT_VARIABLE torch_prefix OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  endif()
  if(NOT torch_prefix OR failed)
    message(FATAL_ERROR "No LibTorch: run make torch, pass -DTorch_DIR=<libtorch>/share/cmake/Torch, "
                        "or build without the network by 'make build LEAN=1' (-DANCHORSPLAT_TORCH=OFF).")
  endif()
  set(Torch_DIR "${torch_prefix}/Torch" CACHE PATH "Folder of TorchConfig.cmake" FORCE)
endif()

get_filename_component(torch_root "${Torch_DIR}/../../.." ABSOLUTE)
if(EXISTS "${torch_root}/lib/libtorch_cuda.so")
  find_program(ANCHORSPLAT_NVCC nvcc PATHS /usr/local/cuda/bin "$ENV{CUDA_HOME}/bin" "$ENV{CUDA_PATH}/bin")
  if(NOT ANCHORSPLAT_NVCC)
    message(FATAL_ERROR "The LibTorch at ${torch_root} is a CUDA build, which needs the CUDA toolkit (nvcc) to compile "
                        "against: install the toolkit or a CPU build of PyTorch.")
  endif()
endif()

# Torch's own configuration talks a lot about libraries that a shared LibTorch does not need.
set(saved_log_level "${CMAKE_MESSAGE_LOG_LEVEL}")
set(saved_cxx_flags "${CMAKE_CXX_FLAGS}")
set(CMAKE_MESSAGE_LOG_LEVEL ERROR)
find_package(Torch REQUIRED QUIET NO_DEFAULT_PATH PATHS "${Torch_DIR}")
set(CMAKE_MESSAGE_LOG_LEVEL "${saved_log_level}")
set(CMAKE_CXX_FLAGS "${saved_cxx_flags}")
message(STATUS "LibTorch: ${torch_root}")

# Reading torch.h takes half a minute, so it is read once.
file(WRITE "${CMAKE_BINARY_DIR}/torch_header.cc.in" "// Exists to carry the precompiled header.\n")
configure_file("${CMAKE_BINARY_DIR}/torch_header.cc.in" "${CMAKE_BINARY_DIR}/torch_header.cc" COPYONLY)
add_library(anchorsplat_torch_header STATIC "${CMAKE_BINARY_DIR}/torch_header.cc")
target_link_libraries(anchorsplat_torch_header PUBLIC anchorsplat_flags ${TORCH_LIBRARIES})
target_precompile_headers(anchorsplat_torch_header PRIVATE <torch/torch.h>)

add_library(anchorsplat_torch INTERFACE)
target_link_libraries(anchorsplat_torch INTERFACE ${TORCH_LIBRARIES})
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Lets ccache look through the precompiled header.
  target_compile_options(anchorsplat_torch_header PUBLIC -fpch-preprocess)
  target_compile_options(anchorsplat_torch INTERFACE -fpch-preprocess)
endif()

# anchorsplat_torch_sources(targets...): these targets include torch/torch.h in most of their files.
function(anchorsplat_torch_sources)
  foreach(target IN LISTS ARGN)
    if(TARGET ${target})
      target_precompile_headers(${target} REUSE_FROM anchorsplat_torch_header)
      set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)  # as the header
    endif()
  endforeach()
endfunction()
