#!/usr/bin/env bash
# Puts PyTorch, whose wheel carries LibTorch, into .venv of the checkout: from PyTorch's own index of CPU builds, else
# from wherever pip looks. Quick when it is there already.
#
#   TORCH_INDEX_URL=URL    another index, for example of builds for your CUDA version (needs its toolkit, nvcc)
#   TORCH_VERSION=X.Y.Z    another version (tested: 2.11 and 2.13)
set -euo pipefail
cd "$(dirname "$0")/.."

version="${TORCH_VERSION:-2.13.0}"
index="${TORCH_INDEX_URL:-https://download.pytorch.org/whl/cpu}"
stamp=".venv/anchorsplat-torch"
wanted="torch==$version from ${TORCH_INDEX_URL:-the default}"
[ "$(cat "$stamp" 2>/dev/null)" = "$wanted" ] && exit 0

give_up() {
  echo "anchorsplat: LibTorch could not be installed ($1); 'make build LEAN=1' builds and tests everything but training without it." >&2
  exit 1
}

command -v python3 >/dev/null || give_up "there is no python3"
[ -x .venv/bin/python ] || python3 -m venv .venv || give_up "python3 -m venv failed"
has_version() {
  .venv/bin/python -c "import sys, torch; sys.exit(torch.__version__.split('+')[0] != '$version')" 2>/dev/null
}
if [ -n "${TORCH_INDEX_URL:-}" ] || ! has_version; then
  echo "Installing PyTorch $version into .venv (a few hundred megabytes)"
  log="$(mktemp)"
  trap 'rm -f "$log"' EXIT
  pip=(.venv/bin/python -m pip --disable-pip-version-check install --quiet)
  [ -z "${TORCH_INDEX_URL:-}" ] || pip+=(--force-reinstall)  # a build of the same version for another device
  if ! "${pip[@]}" --retries 1 --timeout 20 --index-url "$index" "torch==$version" >"$log" 2>&1; then
    if [ -n "${TORCH_INDEX_URL:-}" ] || ! "${pip[@]}" "torch==$version" >"$log" 2>&1; then
      tail -n 5 "$log" >&2
      give_up "pip install torch==$version failed"
    fi
  fi
fi
has_version || give_up "the installed PyTorch does not start"
echo "$wanted" >"$stamp"
