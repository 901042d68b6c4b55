#!/usr/bin/env bash
# What a build leaves to the user: no GoogleTest where no tests are built, the flags that were asked for, and warnings that
# stop the build only where CI=true. Two configurations, nothing is compiled.
#
#   choices_test.sh SOURCE_DIR CMAKE COMPILER
set -euo pipefail
source_dir=$1 cmake=$2 compiler=$3
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# configure NAME CI OPTION...: its compile commands are then in $folder/NAME.
configure() {
  local name=$1 ci=$2
  shift 2
  CI=$ci "$cmake" -S "$source_dir" -B "$folder/$name" -G Ninja -DCMAKE_CXX_COMPILER="$compiler" -DANCHORSPLAT_TORCH=OFF \
    -DANCHORSPLAT_TESTS=OFF -DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON "$@" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
}

failed=0
expect() {  # expect yes|no NAME WORD
  local found=no
  grep -q -e "[ /]$3[ \"]" "$folder/$2/compile_commands.json" && found=yes
  [ "$found" = "$1" ] || { echo "compile commands of '$2': $3 is there: $found, expected: $1"; failed=1; }
}

configure user "" -DCMAKE_CXX_FLAGS_RELEASE=-O1
expect yes user -O1
expect no user -O3
expect no user -DNDEBUG
expect no user -Werror
expect no user 'text_test\.cc'
expect yes user 'text\.cc'

configure ci true
expect yes ci -O3
expect yes ci -DNDEBUG
expect yes ci -Werror
exit "$failed"
