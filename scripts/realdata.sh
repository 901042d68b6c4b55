#!/usr/bin/env bash
# Runs the program over every splat in a folder of yours: info, render, enhance, render again. Fails when anything
# crashes, hangs or writes nothing; a file that this version does not read must say so in one sentence.
#   make realdata DATA=DIR
set -uo pipefail
cd "$(dirname "$0")/.."
data=${1:-}
[ -d "$data" ] || { echo "usage: make realdata DATA=DIR (a folder with splat files)" >&2; exit 2; }
program=build/anchorsplat
out=build/realdata
mkdir -p "$out"
failed=0
read_ok=0
refused=0

check() { # NAME COMMAND...: the command must end well, and within five minutes
  local name=$1
  shift
  if ! timeout 300 "$@" >"$out/log" 2>&1; then
    echo "FAILED  $name: $*"
    tail -n 3 "$out/log"
    failed=$((failed + 1))
    return 1
  fi
}

while IFS= read -r file; do
  name=$(basename "$file")
  timeout 300 "$program" info "$file" --json >"$out/$name.json" 2>"$out/log"
  code=$?
  if [ $code -eq 4 ]; then # bad_file: said in one sentence, not a crash
    echo "refused $name: $(tail -n 1 "$out/log")"
    refused=$((refused + 1))
    continue
  elif [ $code -ne 0 ]; then
    echo "FAILED  $name: info ended with $code"
    failed=$((failed + 1))
    continue
  fi
  check "$name" "$program" enhance "$file" -o "$out/$name-4x.ply" -w --json || continue
  check "$name" "$program" render "$file" -o "$out/$name-before.png" --orbit 1 -w || continue
  check "$name" "$program" render "$out/$name-4x.ply" -o "$out/$name-after.png" --orbit 1 -w || continue
  read_ok=$((read_ok + 1))
  echo "ok      $name: $(grep -m1 '"gaussians"' "$out/$name.json" | tr -d ' ,'), pictures in $out"
done < <(find "$data" -maxdepth 2 -type f \( -name '*.ply' -o -name '*.splat' -o -name '*.spz' -o -name '*.sog' -o -name '*.ksplat' \) | sort)

echo "$read_ok enhanced, $refused refused, $failed failed"
[ "$failed" -eq 0 ] && [ $((read_ok + refused)) -gt 0 ]
