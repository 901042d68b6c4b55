#!/usr/bin/env bash
# Writes THIRD_PARTY to stdout: what a binary of anchorsplat carries along (headers compiled into it) or is linked with,
# and the notices that go with it, as Debian's packages have them.
#
#   scripts/third-party.sh PROGRAM            the packages that install-dependencies.sh names, and the libraries of PROGRAM
#   scripts/third-party.sh PROGRAM --names    only the names of the sources
#
# Where there are no Debian packages to read, the THIRD_PARTY of the checkout, which was made on Debian 12.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
program=$1

give_up() {
  echo "third-party: $1; taking the THIRD_PARTY of the sources, made on Debian 12" >&2
  if [ "${2:-}" = --names ]; then sed -n 's/^=== \([^ ]*\) .*/\1/p' "$here/../THIRD_PARTY"; else cat "$here/../THIRD_PARTY"; fi
  exit 0
}
command -v dpkg-query >/dev/null || give_up "this is not a Debian system" "${2:-}"

# Tools and tests leave nothing in the program.
left_out='^(g\+\+|cmake|ninja-build|pkg-config|libgtest-dev|libgmock-dev|libbenchmark-dev|python3.*|libgloo-dev|dpkg-dev|file)$'
wanted=$("$here/install-dependencies.sh" --list | grep -vE "$left_out")
# A library may be known by its path of before /usr was merged. Some come from elsewhere than a package.
for library in $(ldd "$program" | sed -n 's/.* => \(\/[^ ]*\) .*/\1/p'); do
  for path in "$library" "$(readlink -f "$library")" "${library#/usr}" "/usr$library"; do
    if owner=$(dpkg-query -S "$path" 2>/dev/null); then
      wanted+=$'\n'${owner%%:*}
      break
    fi
  done
done

# C and C++ runtime belong to every system.
declare -A packages=() notices=()
while read -r package; do
  source=$(dpkg-query -W -f='${source:Package}\n' "$package" 2>/dev/null | head -n 1) || continue
  case "$source" in '' | glibc | gcc-*) continue ;; esac
  notice=/usr/share/doc/$package/copyright
  [ -r "$notice" ] || give_up "$notice is missing" "${2:-}"
  packages[$source]+="${packages[$source]:+, }$package"
  notices[$source]=$notice
done < <(sort -u <<<"$wanted")

# webgpu.h is in no package of Debian 12 (scripts/fetch-webgpu.sh). The library that it is the header of is never carried:
# it is loaded from where its user has it.
packages[webgpu-headers]=webgpu.h notices[webgpu-headers]=$here/webgpu-headers.notice

sorted=$(printf '%s\n' "${!packages[@]}" | LC_ALL=C sort)
if [ "${2:-}" = --names ]; then
  echo "$sorted"
  exit 0
fi
cat <<'HEAD'
What anchorsplat carries along

anchorsplat itself is under the Apache License 2.0 (LICENSE). Its programs are linked with, or hold compiled headers of, the
work of others that is listed here with its notices. A package of a Linux distribution holds the headers' part only and
uses the system's libraries; a binary that brings libraries along brings these. The C and C++ runtime (glibc, libstdc++,
libgcc) belong to the system. Some notices name files that are no part of the libraries, such as tests or build scripts:
they are quoted as a whole. Where one points to /usr/share/common-licenses/Apache-2.0, that is the text of LICENSE.

HEAD
for source in $sorted; do echo "  $source (${packages[$source]})"; done
for source in $sorted; do
  printf '\n=== %s (%s)\n\n' "$source" "${packages[$source]}"
  cat "${notices[$source]}"
done
