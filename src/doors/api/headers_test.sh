#!/usr/bin/env bash
# Every public header compiles alone, with nothing but the standard library beside it and all warnings on.
#   headers_test.sh INCLUDE_DIR COMPILER
set -uo pipefail
include=$1 compiler=$2
failed=0 checked=0
for header in "$include"/anchorsplat/*.h; do
  checked=$((checked + 1))
  echo "#include <anchorsplat/$(basename "$header")>" |
    "$compiler" -std=c++20 -fsyntax-only -Wall -Wextra -Wpedantic -Wshadow -Werror -I"$include" -x c++ - || failed=1
  # What only this machine has beside the standard library would not be missed by the compiler.
  if grep -nE '^#include' "$header" | grep -vE '<anchorsplat/[a-z_]+\.h>|<[a-z_0-9]+>$'; then
    echo "$header includes what is neither ours nor the standard library's"
    failed=1
  fi
done
echo "$checked headers"
[ "$checked" -ge 9 ] && exit "$failed"
