#!/usr/bin/env bash
# What `anchorsplat convert --lod` writes, opened by the PlayCanvas engine in headless Chromium: lod_test.sh PROGRAM [OUT].
# Needs the network once, for a browser (Debian's chromium), playwright-core and playcanvas (npm), which go to
# build/viewer-test; `make test` needs none of them. Screenshots of everything it looked at stay in OUT
# (build/viewer-test/pictures).
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "$1")
. scripts/browser-tools.sh
browser_tools lod-test playwright-core@1.65.1 playcanvas@2.23.3
out=${2:-$NODE_FOLDER/pictures}
mkdir -p "$out"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
example=examples/biplane
near=$example/transforms_hr.json
node -e '
  const fs = require("fs");
  const cameras = JSON.parse(fs.readFileSync(process.argv[1]));
  for (const frame of cameras.frames) for (const row of frame.transform_matrix.slice(0, 3)) row[3] *= 8;
  fs.writeFileSync(process.argv[2], JSON.stringify(cameras));' $near "$work/far.json"
# Small chunks, so that there are several of a level.
"$program" convert $example/input.ply --lod "$work/scene" --lod-chunk-count 8 -q
"$program" convert "$work/scene" "$work/level.ply" --lod-level 3 -q
render() { "$program" render "$1" -o "$work/$2" --cameras "$3" --size 512x512 -q; }
render $example/input.ply near $near
render $example/input.ply far "$work/far.json"
render "$work/level.ply" far-level "$work/far.json"
node scripts/lod_test.mjs "$work/scene" $near "$work/far.json" "$work" "$out"
