#!/usr/bin/env bash
# The page of `anchorsplat view` in headless Chromium: viewer_test.sh PROGRAM [OUT]. Needs the network once, for a
# browser (Debian's chromium) and playwright-core (npm), which go to build/viewer-test; `make test` needs neither.
# Screenshots of everything it looked at stay in OUT (build/viewer-test/pictures).
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "$1")
. scripts/browser-tools.sh
browser_tools viewer-test playwright-core@1.65.1
out=${2:-$NODE_FOLDER/pictures}
mkdir -p "$out"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
example=examples/biplane
"$program" enhance $example/input.ply -o "$work/after.ply" --cameras $example/transforms_lr.json -q
"$program" render $example/input.ply -o "$work/before" --cameras $example/transforms_hr.json --size 512x512 -q
"$program" render "$work/after.ply" -o "$work/after" --cameras $example/transforms_hr.json --size 512x512 -q
"$program" view "$work/after.ply" --before $example/input.ply --truth $example/hr \
  --cameras $example/transforms_hr.json --open-your-own https://splats.example/ -o "$work/page.html" -q
# Sixteen side by side, whose data fill several parts; rows of 32 bytes that begin with x, y, z.
"$program" convert $example/input.ply "$work/one.splat" -q
node -e '
  const fs = require("fs");
  const one = fs.readFileSync(process.argv[1]);
  const copies = [];
  for (let k = 0; k < 16; ++k) {
    const copy = Buffer.from(one);
    for (let row = 0; row < copy.length; row += 32) {
      copy.writeFloatLE(copy.readFloatLE(row) + 1.1 * (k % 4), row);
      copy.writeFloatLE(copy.readFloatLE(row + 8) + 1.1 * Math.floor(k / 4), row + 8);
    }
    copies.push(copy);
  }
  fs.writeFileSync(process.argv[2], Buffer.concat(copies));' "$work/one.splat" "$work/many.splat"
"$program" view "$work/many.splat" -o "$work/one.html" -q
"$program" view "$work/many.splat" --folder -o "$work/many.html" -q
node scripts/viewer_test.mjs "$work/page.html" "$work" "$work" "$out"
