#!/usr/bin/env bash
# Enhances the example splats, compares them with ground truth that no fit has seen, and makes the pictures.
set -euo pipefail
cd "$(dirname "$0")/.."
program=build/anchorsplat
out=build/demo
mkdir -p "$out"

for object in biplane stone_lantern tankard; do
  example=examples/$object
  echo
  case $object in
    tankard) echo "== $object: the same of 60 photographs of a real thing; tankard of the Mary Rose, Mark Boss, CC BY 4.0, changed" ;;
    *) echo "== $object: a 3DGS fit of 256x256 pictures, seen at 1024x1024 from ten new places" ;;
  esac
  "$program" info "$example/input.ply" | sed -n '2,6p'
  echo
  "$program" enhance "$example/input.ply" -o "$out/$object-4x.ply" --cameras "$example/transforms_lr.json" -w
  echo
  "$program" compare "$example/input.ply" "$out/$object-4x.ply" --truth "$example/hr" \
    --cameras "$example/transforms_hr.json" --side-by-side "$out/$object.png" -w
  "$program" view "$out/$object-4x.ply" --before "$example/input.ply" --truth "$example/hr" \
    --cameras "$example/transforms_hr.json" -o "$out/$object.html" -w
done

echo
echo "== All three by every method that takes seconds at most, mean over nine or ten views each that no fit has seen"
"$program" eval examples -o "$out/eval" --methods raw,upsample,filter,filter-auto,model -w

echo
echo "Look at   $out/biplane.png, stone_lantern.png and tankard.png  (before, after, ground truth)"
echo "Open      $out/biplane.html in a browser: turn it, zoom in, pull the slider"
echo "Tables    $out/eval/table.md; raw, filter, model and truth side by side in $out/eval/contact_sheet.png"
echo "Enhanced  $out/biplane-4x.ply, stone_lantern-4x.ply and tankard-4x.ply"
