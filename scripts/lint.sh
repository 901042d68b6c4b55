#!/usr/bin/env bash
# clang-format over our own code, clang-tidy over all of it that needs no LibTorch, and a build that finds names given twice.
# FILES="a.cc b.cc" looks at some.
set -euo pipefail
cd "$(dirname "$0")/.."
for tool in clang-format clang-tidy; do
  command -v "$tool" >/dev/null || { echo "make lint needs $tool (Debian: apt-get install clang-format clang-tidy)" >&2; exit 1; }
done
scripts/check-filesystem-calls.sh
scripts/check-includes.py
git ls-files 'src/*.h' 'src/*.cc' 'python/*.h' 'python/*.cc' 'include/*.h' 'examples/*.cc' | xargs clang-format --dry-run -Werror
cmake --preset lean >/dev/null
# Only files of the lean build have a command to be read with. g++ knows warnings that clang does not.
files=${FILES:-$(sed -n 's/^ *"file": "\(.*\)",*$/\1/p' build/lean/compile_commands.json | grep '/src/' | sort -u)}
# shellcheck disable=SC2086
if ! printf '%s\n' $files |
  xargs -P "$(nproc)" -n 1 clang-tidy --quiet -p build/lean --extra-arg=-Wno-unknown-warning-option 2>&1 |
  { grep -vE '^[0-9]+ warnings? (and [0-9]+ errors? )?generated\.$' || true; }; then
  echo "lint: see above" >&2
  exit 1
fi
# The package's types, where there is a build of it and a mypy.
if [ -e build/release/python/anchorsplat/_core.pyi ] && .venv/bin/python -c 'import mypy' 2>/dev/null; then
  (cd build/release/python && ../../../.venv/bin/python -m mypy --config-file ../../../pyproject.toml -p anchorsplat)
fi
[ -n "${FILES:-}" ] || scripts/check-one-definition.sh
echo "lint: clean"
