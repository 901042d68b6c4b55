#!/usr/bin/env bash
# Fetches the objects of the lists in data/ from the Debian archive and unpacks them into a folder; needs no root:
#
#     scripts/fetch-objects.sh [FOLDER=objects]
#
# sweethome3d-furniture 1.8 (CC0 and CC-BY, licences by object in data/objects.csv; 130 MB) holds the furniture
# libraries, flightgear-data-ai 2020.3 (GPL; 290 MB, 510 MB unpacked) the aircraft of domain-10. On a system without
# apt, get the two .deb files at https://packages.debian.org/ and name them: FOLDER FILE.deb...
set -euo pipefail

case "${1:-}" in
  -h | --help) sed -n '2,8s/^# \{0,1\}//p' "$0"; exit ;;
  -*) echo "fetch-objects: no option $1; --help says what there is" >&2; exit 2 ;;
esac
folder="${1:-objects}"
shift || true
furniture=usr/share/sweethome3d/furniture
aircraft=usr/share/games/flightgear/AI/Aircraft
mkdir -p "$folder"
folder="$(cd "$folder" && pwd)"

unpack() {
  if command -v dpkg-deb >/dev/null; then
    dpkg-deb -x "$1" "$folder"
  else # a .deb is an `ar` archive with the files in data.tar.xz
    ar p "$1" data.tar.xz | tar -xJ -C "$folder" -f -
  fi
}

if [ $# -gt 0 ]; then
  for package in "$@"; do unpack "$(realpath "$package")"; done
else
  if ! command -v apt-get >/dev/null; then
    echo "fetch-objects: no apt-get here; download the two packages and name their files (see the head of this script)" >&2
    exit 1
  fi
  download="$(mktemp -d)"
  trap 'rm -rf "$download"' EXIT
  [ -d "$folder/$furniture" ] || (cd "$download" && apt-get download sweethome3d-furniture)
  [ -d "$folder/$aircraft" ] || (cd "$download" && apt-get download flightgear-data-ai)
  for package in "$download"/*.deb; do [ -e "$package" ] && unpack "$package"; done
fi

for part in "$furniture" "$aircraft"; do
  if [ ! -d "$folder/$part" ]; then
    echo "fetch-objects: $folder/$part is still missing" >&2
    exit 1
  fi
done
echo "furniture libraries: $folder/$furniture"
echo "aircraft:            $folder/$aircraft"
