#!/usr/bin/env bash
# Puts what the Python package is built and tested with into .venv of the checkout, from wherever pip looks. Quick when it is
# there already.
set -euo pipefail
cd "$(dirname "$0")/.."
packages=('nanobind>=2.9' 'numpy>=1.26' 'pytest>=8' 'ray>=2.40' 'fsspec>=2023.12')
stamp=.venv/anchorsplat-python
[ "$(cat "$stamp" 2>/dev/null)" = "${packages[*]}" ] && exit 0
[ -x .venv/bin/python ] || python3 -m venv .venv
echo "Installing what the Python package is built with into .venv"
.venv/bin/python -m pip --disable-pip-version-check install --quiet "${packages[@]}"
echo "${packages[*]}" >"$stamp"
