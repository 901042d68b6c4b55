#!/usr/bin/env bash
# Every system header that the built files depend on belongs to a package that scripts/install-dependencies.sh installs, or
# to one that such a package depends on: whatever else this machine happens to have, a bare one has not.
#
#   scripts/check-system-headers.sh BUILD-FOLDER
#
# Reads the compiler's dependency files as Ninja keeps them. Only Debian knows which package a header is of; elsewhere it
# says so and succeeds. Headers of a LibTorch that lies in the checkout or is named by Torch_DIR are not the system's.
set -euo pipefail
build=$1
here=$(cd "$(dirname "$0")" && pwd)
command -v dpkg-query >/dev/null && command -v apt-cache >/dev/null || { echo "not a Debian system: nothing to check"; exit 0; }

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export LC_ALL=C

ninja -C "$build" -t deps | sed -n 's|^ *\(/usr/.*\)|\1|p' | sort -u >"$scratch/named"
# Through links and "..", as dpkg knows them.
xargs -d '\n' -r realpath -m -- <"$scratch/named" | grep '^/usr/' | sort -u >"$scratch/headers"
count=$(wc -l <"$scratch/headers")
[ "$count" -ge 100 ] || { echo "only $count system headers in $build: is it built?" >&2; exit 2; }

"$here/install-dependencies.sh" --list --with-tests >"$scratch/list"
# shellcheck disable=SC2046
apt-cache depends --recurse --no-recommends --no-suggests --no-conflicts --no-breaks --no-replaces --no-enhances \
  $(cat "$scratch/list") 2>/dev/null | grep -E '^[a-z0-9]' | sed 's/:.*//' | sort -u >"$scratch/allowed"
[ "$(wc -l <"$scratch/allowed")" -gt "$(wc -l <"$scratch/list")" ] || {
  echo "apt knows no packages: run apt-get update first" >&2
  exit 2
}

# "package, package: /path" for all at once; a header of no package is printed on stderr.
xargs -d '\n' dpkg-query -S <"$scratch/headers" >"$scratch/owned" 2>"$scratch/stray" || true
sed -n 's/^dpkg-query: no path found matching pattern \(.*\)$/\1 belongs to no package/p' "$scratch/stray" >"$scratch/wrong"
sed 's/: \//\t\//' "$scratch/owned" | while IFS=$'\t' read -r owners path; do
  for owner in ${owners//,/ }; do
    grep -qxF -- "${owner%%:*}" "$scratch/allowed" && continue 2
  done
  echo "$path is of $owners, which is not in scripts/install-dependencies.sh"
done >>"$scratch/wrong"
if [ -s "$scratch/wrong" ]; then
  cat "$scratch/wrong" >&2
  echo "A bare machine cannot compile this: remove the include or add the package to scripts/install-dependencies.sh." >&2
  exit 1
fi
echo "$count system headers are all of packages that scripts/install-dependencies.sh brings"
