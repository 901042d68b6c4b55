#!/bin/bash
# A small retraining, to see that the recipe of the shipped network works here: ten training objects, a few minutes.
#
#     scripts/retrain-smoke.sh WORK [PROGRAM]
#
# fetches the objects (scripts/fetch-objects.sh), makes small fits of ten of them and of two validation objects, trains
# configs/compact-k4.toml for two minutes and compares its validation with that of its start. Exit code 1 when it is not
# better. What is in WORK already is not made again, but the training is. Needs python3.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '4p' "$0" >&2; exit 2; }
root=$(cd "$(dirname "$0")/.." && pwd)
work=$1
program=${2:-$root/build/anchorsplat}
mkdir -p "$work"
objects=${ANCHORSPLAT_OBJECTS:-$work/objects}
[ -d "$objects" ] || "$root/scripts/fetch-objects.sh" "$objects"

first() { grep -v '^#' "$1" | head -n "$2"; }
first "$root/data/training-fits.txt" 10 >"$work/train.txt"
first "$root/data/validation.txt" 2 >"$work/validation.txt"
for list in train validation; do
  "$program" dataset build --list "$work/$list.txt" --objects "$objects" -o "$work/$list" --hr on-demand --min-psnr 28 \
    --steps 7000 --low-size 128 --size 512 --points 4000 --max-gaussians 7000
done

sed 's/^warm_up = .*/warm_up = 20/; s/^ema = .*/ema = 0.98/; s/^every = .*/every = 0/' "$root/configs/compact-k4.toml" \
  >"$work/recipe.toml"
rm -rf "$work/run"
"$program" train "$work/train" --validation "$work/validation" --config "$work/recipe.toml" -o "$work/run" \
  --cache "$work/cache" --minutes 2

python3 - "$work/run/log.jsonl" <<'PYTHON'
import json
import sys

with open(sys.argv[1], encoding="utf-8") as log:
    found = [v for v in map(json.loads, log) if "validation" in v]
first, last = found[0], found[-1]
filtered = last["validation"]["filter"]["psnr"]
for line in (first, last):
    psnr = line["validation"]["model"]["psnr"]
    print(f"step {line['step']}: {psnr:.2f} dB, {psnr - filtered:+.2f} over the filter")
gain = last["validation"]["model"]["psnr"] - first["validation"]["model"]["psnr"]
sys.exit(0 if last["step"] > first["step"] and gain > 0 else "the training did not improve on its start")
PYTHON
