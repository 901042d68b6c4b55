#!/usr/bin/env bash
# Two curves (docs/benchmarks.md#the-filter): PSNR of the examples over the filter's strength, and over an error of the pixel size.
set -euo pipefail
cd "$(dirname "$0")/.."
program=build/anchorsplat
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
true_pixel=0.0055013 # 1.7 / 309.02 px: the examples' distance and focal length at 256x256

# mean OBJECT ENHANCE-FLAGS...: mean PSNR / SSIM over the held-out views
mean() {
  local example=examples/$1
  shift
  "$program" enhance "$example/input.ply" -o "$work/out.ply" -w -q --method filter "$@"
  "$program" compare "$work/out.ply" "$example/hr" --cameras "$example/transforms_hr.json" |
    awk '$1 == "mean" {printf "%s / %s", $2, $3}'
}

for object in biplane stone_lantern; do
  echo "$object, over f, with the true pixel size"
  for f in 0 0.25 0.4 0.55 0.7 0.74 0.85 1 1.2; do
    echo "  f $f: $(mean "$object" --filter-strength "$f" --pixel-size $true_pixel)"
  done
  echo "$object, default f, over the error of the pixel size"
  for factor in 0.5 0.65 0.8 0.9 1 1.1 1.25 1.5 2; do
    echo "  x $factor: $(mean "$object" --pixel-size "$(awk "BEGIN {print $true_pixel * $factor}")")"
  done
  echo "$object, --cameras, --camera-rule smallest: $(mean "$object" --cameras "examples/$object/transforms_lr.json" --camera-rule smallest)"
  echo "$object, --cameras: $(mean "$object" --cameras "examples/$object/transforms_lr.json")"
  echo "$object, --pixel-size auto: $(mean "$object")"
done
