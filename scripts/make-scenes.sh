#!/usr/bin/env bash
# Makes the closed scenes of data/scenes.txt: views at two sizes, and the low-quality splat that is fitted to the smaller
# ones, laid out for `anchorsplat eval`. Whatever ended it, the same command goes on from there:
#
#     scripts/fetch-objects.sh objects
#     scripts/make-scenes.sh objects scenes [PROGRAM=build/anchorsplat]
#
# STEPS and GAUSSIANS in the environment change the fit (8000 and 150000).
set -euo pipefail

if [ $# -lt 2 ] || [ $# -gt 3 ]; then
  sed -n '2,/^$/s/^# \{0,1\}//p' "$0" >&2
  exit 2
fi
objects="$1" scenes="$2" program="${3:-build/anchorsplat}"
steps="${STEPS:-8000}" gaussians="${GAUSSIANS:-150000}"
here="$(cd "$(dirname "$0")/.." && pwd)"

while read -r name furniture; do
  case "$name" in '' | '#'*) continue ;; esac
  folder="$scenes/$name"
  "$program" dataset room "$here/$furniture" --objects "$objects" -o "$folder"
  # Where the layout has the splat; it gets its name when the fit is done.
  splat="$folder/400/gaussian_splatting/ckpts/ckpt_$((steps - 1))_rank0.pt"
  if [ -e "$splat" ] && [ ! -e "$folder/splat.ply.checkpoint" ]; then
    echo "$splat: there already"
    continue
  fi
  mkdir -p "$(dirname "$splat")"
  "$program" fit "$folder/400" -o "$folder/splat.ply" --gsplat-checkpoint "$splat" --steps "$steps" \
    --max-gaussians "$gaussians" --checkpoint-every 1000 --resume
done <"$here/data/scenes.txt"
