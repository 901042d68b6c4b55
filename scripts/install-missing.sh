#!/usr/bin/env bash
# Debian packages for commands that are not there: install-missing.sh WHO COMMAND=PACKAGE...
#
# WHO      is named in the sentence that says what to install, where there is no apt-get
# COMMAND  a name, or the path of a program
# Needs root, or sudo; nothing where all are there.
set -euo pipefail
who=$1
shift
missing=()
for pair in "$@"; do
  command -v "${pair%%=*}" >/dev/null || missing+=("${pair##*=}")
done
[ ${#missing[@]} -gt 0 ] || exit 0
if ! command -v apt-get >/dev/null; then
  note=
  [[ " ${missing[*]} " != *" chromium "* ]] || note=" (CHROMIUM=PATH names a browser elsewhere)"
  echo "$who: please install ${missing[*]}$note" >&2
  exit 1
fi
sudo=()
[ "$(id -u)" -eq 0 ] || sudo=(sudo)
"${sudo[@]}" apt-get update -qq
"${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"
