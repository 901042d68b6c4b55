#!/usr/bin/env bash
# What `make web` made: the unit tests of the engine's rooms and the npm package under Node, beside this machine's own program and under damaged
# files, and the page in headless Chromium. Needs what scripts/web/build.sh does, and the network once for a browser and
# playwright-core (as scripts/viewer_test.sh). Screenshots stay in build/web/pictures.
#
#   scripts/web/test.sh BUILD_DIR     BUILD_DIR: a build of this machine's own that can make web_reference
set -euo pipefail
cd "$(dirname "$0")/../.."
native=$1

scripts/web/build.sh
sudo=()
[ "$(id -u)" -eq 0 ] || sudo=(sudo)
"${sudo[@]}" scripts/bare-debian.sh --suite trixie --keep "$PWD/build/web/root" --env "JOBS=${JOBS:-$(nproc)}" -- scripts/web/rooms.sh
cmake --build "$native" -j "${JOBS:-$(nproc)}" --target web_reference web_mutants

. scripts/browser-tools.sh
browser_tools web-test playwright-core@1.65.1 three@0.165.0 \
  @mkkellogg/gaussian-splats-3d@0.4.7  # the viewer of examples/web

"$native/src/doors/web/web_mutants" build/web/mutants 4000 1
WEB_REFERENCE=$native/src/doors/web/web_reference node scripts/web/test.mjs build/web/npm build/web/reference build/web/mutants
mkdir -p build/web/pictures
node scripts/web/page_test.mjs build/web/dist examples/biplane/input.ply build/web/pictures
