#!/usr/bin/env bash
# The program for browsers and Node.
#
# Compiles to WebAssembly in a bare Debian 13 (its Emscripten; Debian 12's is too old) that is kept in build/web/root, and
# leaves the page in build/web/dist and the npm package in build/web/npm. Needs root, or sudo, and 4 GB; the first time takes half an hour on two cores.
set -euo pipefail
cd "$(dirname "$0")/../.."
sudo=()
[ "$(id -u)" -eq 0 ] || sudo=(sudo)
scripts/install-missing.sh web debootstrap=debootstrap
mkdir -p build/web
"${sudo[@]}" scripts/bare-debian.sh --suite trixie --keep "$PWD/build/web/root" --env "JOBS=${JOBS:-$(nproc)}" -- \
  bash -c 'scripts/web/compile.sh anchorsplat_module anchorsplat_module_threads && node scripts/web/assemble.mjs build/web/src/doors/web build/web-libraries/prefix/notices build/web'
made=build/web/root/root/anchorsplat/build/web
for name in dist npm; do
  rm -rf "build/web/$name"
  cp -r "$made/$name" "build/web/$name"
done
