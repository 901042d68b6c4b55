#!/usr/bin/env bash
# Two types or functions of one name in different files are one to the linker, which takes either: link-time optimisation
# sees both and says so (-Wodr). A program is built for that alone, in build/one-definition; `make lint` runs it.
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p build
cmake -S . -B build/one-definition -G Ninja -DCMAKE_BUILD_TYPE=Release -DANCHORSPLAT_TESTS=OFF -DANCHORSPLAT_TORCH=OFF \
  -DANCHORSPLAT_UNITY=ON -DCMAKE_CXX_FLAGS_RELEASE="-O1 -flto=auto -Wodr -Wlto-type-mismatch" \
  -DCMAKE_EXE_LINKER_FLAGS="-Werror=odr -Werror=lto-type-mismatch" >build/one-definition.log
cmake --build build/one-definition -j "${JOBS:-$(nproc)}" --target anchorsplat
