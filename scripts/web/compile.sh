#!/usr/bin/env bash
# In the root that scripts/web/build.sh makes: compile.sh TARGET..., into build/web.
set -euo pipefail
cd "$(dirname "$0")/../.."
scripts/web/libraries.sh
emcmake cmake -S . -B build/web -G Ninja -DCMAKE_BUILD_TYPE=Release -DANCHORSPLAT_TESTS=ON -DANCHORSPLAT_UNITY=ON \
  -DANCHORSPLAT_WEB_PREFIX="$PWD/build/web-libraries/prefix" >build/web-configure.log 2>&1 || { cat build/web-configure.log; exit 1; }
cmake --build build/web -j "${JOBS:-$(nproc)}" --target "$@" -- -k 0
