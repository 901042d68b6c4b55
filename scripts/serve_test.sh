#!/usr/bin/env bash
# What takes long about `anchorsplat serve`: its page in headless Chromium, 1,000 malformed uploads, 200 requests, Ray.
#
#   serve_test.sh PYTHON PACKAGE [OUT]
#
# PYTHON   has the packages of requirements in pyproject.toml's extras serve and batch, pytest, httpx and playwright
# PACKAGE  folder with the package anchorsplat in it, as built (build/…/python)
# OUT      folder for screenshots (build/serve-test)
#
# The browser is Debian's chromium; playwright only drives it. Servers listen on loopback.
set -euo pipefail
cd "$(dirname "$0")/.."
python=$1
package=$(realpath "$2")
out=${3:-$PWD/build/serve-test}
mkdir -p "$out"

export CHROMIUM=${CHROMIUM:-/usr/bin/chromium}
scripts/install-missing.sh serve-test "$CHROMIUM=chromium" curl=curl

export PYTHONPATH=$package ANCHORSPLAT_PICTURES=$out ANCHORSPLAT_EXAMPLE=$PWD/examples/biplane/input.ply ANCHORSPLAT_MALFORMED=1000
tests=python/tests/serve
exec timeout 1800 "$python" -m pytest -q "$tests/test_malformed.py" "$tests/long_docs.py" "$tests/long_load.py" "$tests/long_browser.py" "$tests/long_ray.py"
