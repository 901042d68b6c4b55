#!/usr/bin/env bash
# Puts the headers of CPython 3.13 into a folder, from Debian 13's package of them, by this machine's apt and its mirror:
# what compiles a module for 3.12 and all after it (abi3) where the machine's own Python is older. Nothing is installed.
#
#   scripts/fetch-python-headers.sh FOLDER
set -euo pipefail
folder=$1
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 2>/dev/null | grep -m1 '/debian/*$' || true)
mkdir -p "$scratch"/{lists/partial,cache/archives/partial,parts} "$folder"
key=/usr/share/keyrings/debian-archive-keyring.gpg
echo "deb [signed-by=$key] ${mirror:-http://deb.debian.org/debian} trixie main" >"$scratch/sources.list"
options=(-o "Dir::Etc::SourceList=$scratch/sources.list" -o "Dir::Etc::SourceParts=$scratch/parts"
  -o "Dir::State::Lists=$scratch/lists" -o "Dir::Cache=$scratch/cache" -o APT::Sandbox::User=root)
apt-get "${options[@]}" update -qq
(cd "$scratch" && apt-get "${options[@]}" download -qq libpython3.13-dev)
dpkg-deb -x "$scratch"/libpython3.13-dev_*.deb "$folder"
