#!/usr/bin/env bash
# clang-format and clang-tidy over our own code.
set -euo pipefail
cd "$(dirname "$0")/.."
for tool in clang-format clang-tidy; do
  command -v "$tool" >/dev/null || { echo "make lint needs $tool (Debian: apt-get install clang-format clang-tidy)" >&2; exit 1; }
done
git ls-files 'src/*.h' 'src/*.cc' | xargs clang-format --dry-run -Werror
[ -f build/release/compile_commands.json ] || cmake --preset release >/dev/null
git ls-files 'src/*.cc' | xargs -P "$(nproc)" -n 4 clang-tidy --quiet -p build/release
echo "lint: clean"
