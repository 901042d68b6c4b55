#!/usr/bin/env bash
# What the tests of the program from outside have in common; they are called with PROGRAM SOURCE_DIR, source this and end
# with `finish`. Prints every failed expectation.
set -uo pipefail
program=$1
source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
input=$source/examples/biplane/input.ply
cameras=$source/examples/biplane/transforms_hr.json
checks=0
failures=0

# expect CODE NAME COMMAND...: runs it, keeps stdout and stderr in $work.
expect() {
  local code=$1 name=$2
  shift 2
  "$@" >"$work/stdout" 2>"$work/stderr" </dev/null
  local got=$?
  checks=$((checks + 1))
  if [ $got -ne "$code" ]; then
    failures=$((failures + 1))
    echo "FAILED $name: exit code $got, expected $code: $*"
    cat "$work/stderr"
  fi
}
# says STREAM TEXT: the last command's stdout or stderr holds the text.
says() {
  checks=$((checks + 1))
  if ! grep -qF -- "$2" "$work/$1"; then
    failures=$((failures + 1))
    echo "FAILED: $1 does not say '$2', but:"
    head -n 5 "$work/$1"
  fi
}
# silent STREAM: it says nothing.
silent() {
  checks=$((checks + 1))
  if [ -s "$work/$1" ]; then
    failures=$((failures + 1))
    echo "FAILED: $1 should be empty:"
    head -n 5 "$work/$1"
  fi
}
# The test fails if any expectation did.
finish() {
  echo "$checks checks, $failures failed"
  [ $failures -eq 0 ]
}
