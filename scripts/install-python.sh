#!/usr/bin/env bash
# Puts what the Python package is built and tested with into .venv of the checkout, from wherever pip looks. Quick when it is
# there already.
set -euo pipefail
cd "$(dirname "$0")/.."
packages=('nanobind>=2.9' 'numpy>=1.26' 'pytest>=8'
  'fastapi>=0.115' 'uvicorn>=0.30' 'python-multipart>=0.0.18' 'prometheus-client>=0.20' 'httpx>=0.27'  # of serve
  'ray>=2.40' 'fsspec>=2023.12')  # of batch
stamp=.venv/anchorsplat-python
[ "$(cat "$stamp" 2>/dev/null)" = "${packages[*]}" ] && exit 0
[ -x .venv/bin/python ] || python3 -m venv .venv
echo "Installing what the Python package is built with into .venv"
if ! .venv/bin/python -m pip --disable-pip-version-check install --quiet "${packages[@]}"; then
  echo "anchorsplat: pip could not install ${packages[*]}, without which the Python package is neither built nor tested;" >&2
  echo "'make build' builds the program alone." >&2
  exit 1
fi
echo "${packages[*]}" >"$stamp"
