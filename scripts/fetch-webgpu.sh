#!/usr/bin/env bash
# Puts into build/webgpu what building for GPUs takes, webgpu.h, and the library that a build finds there at run time:
# wgpu-native, from the Python package wgpu, from wherever pip looks. Quick when they are there already.
#
#   scripts/fetch-webgpu.sh [--optional]      with --optional silent, and a success, where they cannot be had
set -euo pipefail
cd "$(dirname "$0")/.."

version=0.32.0
folder=build/webgpu
optional=
case "${1:-}" in
  '') ;;
  --optional) optional=1 ;;
  *) sed -n '2,5s/^# \{0,1\}//p' "$0"; exit 2 ;;
esac
give_up() {
  [ -z "$optional" ] || exit 0
  echo "fetch-webgpu: $1; without webgpu.h in $folder the build works on the CPU alone" >&2
  exit 1
}

case "$(uname -sm)" in
  'Linux x86_64') sum=6499a31b5a29a10b4f1089fea4a0806411f42605fa86b6c0b543a07ca0de8568 ;;
  'Linux aarch64') sum=00454ba1bc794d38c8365f4ad29f381b88ce0a7f115133bfaa6f1dfad7eb2764 ;;
  *) give_up "the sum of the package is not known for $(uname -sm)" ;;
esac
stamp="wgpu $version $sum"
[ "$(cat "$folder/fetched" 2>/dev/null)" = "$stamp" ] && exit 0

command -v python3 >/dev/null || give_up "there is no python3"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python=
for candidate in .venv/bin/python python3; do
  if "$candidate" -m pip --version >/dev/null 2>&1; then
    python=$candidate
    break
  fi
done
if [ -z "$python" ]; then
  python3 -m venv "$work/venv" >/dev/null 2>&1 || give_up "python3 has neither pip nor venv"
  python=$work/venv/bin/python
fi
[ -n "$optional" ] || echo "Fetching wgpu $version for the GPU (3.5 MB)"
"$python" -m pip --disable-pip-version-check download --quiet --retries 1 --timeout 20 --no-deps --only-binary :all: \
  --dest "$work" "wgpu==$version" >"$work/log" 2>&1 || {
  [ -n "$optional" ] || tail -n 3 "$work/log" >&2
  give_up "pip download wgpu==$version failed"
}
wheel=$(ls "$work"/wgpu-"$version"-*.whl)
# Before anything in it is looked at.
[ "$(sha256sum <"$wheel" | cut -d' ' -f1)" = "$sum" ] || give_up "the package is not the one this sum is of"
"$python" -m zipfile -e "$wheel" "$work/unpacked"
mkdir -p "$folder"
rm -f "$folder/fetched"
cp "$work"/unpacked/wgpu/resources/{webgpu.h,libwgpu_native-release.so} "$folder/"
cp "$work/unpacked/wgpu-$version.dist-info/licenses/LICENSE" "$folder/LICENSE"
echo "$stamp" >"$folder/fetched"
