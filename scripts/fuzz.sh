#!/usr/bin/env bash
# Damaged files against all readers, under AddressSanitizer and UndefinedBehaviorSanitizer, for the given seconds.
# A new seed every time; it is printed, and inputs that crash are saved in build/fuzz.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds="${1:-60}"
seed="${2:-$(date +%s)}"
mkdir -p build/fuzz
echo "fuzzing all readers for $seconds s with seed $seed"
build/debug/src/engine/formats/fuzz_readers --seconds "$((seconds - seconds / 4))" --seed "$seed" --save-in build/fuzz
exec build/debug/src/lab/scene/fuzz_meshes --seconds "$((seconds / 4 + 1))" --seed "$seed" --save-in build/fuzz
