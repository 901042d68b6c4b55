#!/usr/bin/env bash
# The program that was built without the lab: it does a user's work, and its other verbs say what is missing:
# without_lab_test.sh PROGRAM SOURCE_DIR.
. "$(dirname "$0")/expectations.sh"

expect 0 "enhance" "$program" enhance "$input" --method filter -o "$work/out.ply"
expect 0 "info" "$program" info "$work/out.ply"
says stdout "Gaussians"
expect 0 "compare" "$program" compare "$input" "$work/out.ply" --orbit 2 --size 32x32 --lpips if-there
says stderr "LPIPS missing: this program was built without the lab"
expect 3 "compare by LPIPS" "$program" compare "$input" "$work/out.ply" --orbit 2 --size 32x32 --lpips alex
says stderr "LPIPS missing: this program was built without the lab; --lpips if-there continues without it"

for words in "eval $work -o $work/eval" "views $work/box.obj -o $work/views" "dataset build $work/box.obj -o $work/set --jobs 2" \
  "train $work/set --config none.toml -o $work/run" "bench render --repeats 1" eval; do
  # shellcheck disable=SC2086
  expect 3 "$words" "$program" $words
  says stderr "${words%% *} is missing: this program was built without the lab"
  silent stdout
done
expect 3 "as JSON" "$program" eval "$work" --json
says stdout '"code": "not_found"'
expect 0 "doctor" "$program" doctor
says stdout "missing: built without the lab"
expect 0 "the list of verbs" "$program" --help
says stdout "built without the lab"
finish
