#!/usr/bin/env bash
# LPIPS with the trained weights against the values of testdata/lpips/README.md, to 1e-4:
#   scripts/lpips_check.sh PROGRAM [WEIGHTS_DIR]
# SqueezeNet is checked where its weights are (scripts/fetch-lpips.sh --squeeze).
set -euo pipefail
program="$1"
data="$(cd "$(dirname "$0")/.." && pwd)/testdata/lpips"
folder="${2:-${ANCHORSPLAT_LPIPS:-${XDG_DATA_HOME:-$HOME/.local/share}/anchorsplat/lpips}}"
failed=0
check() {  # network picture expected
  local value
  value="$("$program" compare "$data/$2.png" "$data/ex_ref.png" --lpips "$1" --lpips-weights "$folder" --json |
    sed -n '/"mean"/,/}/s/.*"lpips": \([0-9.e-]*\).*/\1/p')"
  if [ -n "$value" ] && awk -v a="$value" -v b="$3" 'BEGIN { d = a - b; exit !(d < 1e-4 && d > -1e-4) }'; then
    printf '%-8s %s  %s  published %s\n' "$1" "$2" "$value" "$3"
  else
    printf '%-8s %s  %s  PUBLISHED %s\n' "$1" "$2" "${value:-missing}" "$3"
    failed=1
  fi
}
check alex ex_p0 0.72188
check alex ex_p1 0.13757
check vgg ex_p0 0.56861
check vgg ex_p1 0.42166
if ls "$folder"/squeeze.* >/dev/null 2>&1; then
  check squeeze ex_p0 0.71105
  check squeeze ex_p1 0.14790
else
  echo "squeeze  not checked: there are no weights in $folder"
fi
exit $failed
