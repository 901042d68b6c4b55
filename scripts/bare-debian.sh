#!/usr/bin/env bash
# Runs a command, `make demo` unless told otherwise, where a new user would: on a Debian that has nothing but make, git and
# the certificates, in a copy of the tracked files as they are in the work tree, with an empty environment.
#
#   scripts/bare-debian.sh [options] [COMMAND]
#
#   --suite NAME     bookworm (the default) or trixie
#   --env NAME=VALUE sets a variable for the command (repeatable); it sees only these and HOME, PATH and LANG
#   --bind DIR       a folder of this machine, read-only, at the same path (repeatable)
#   --share DIR      the same, writable: what the command does in it stays done
#   --out FROM=TO    copies FROM of the checkout inside to the new folder TO here, whatever the command returned (repeatable)
#   --keep ROOT      goes on in the root at ROOT, made bare if it does not exist, and leaves it there; the checkout's build
#                    folder stays, all else in it is copied anew. Without it every run starts bare and leaves nothing
#   --fresh          makes the cached minimal system again
#   --mirror URL     the Debian archive; otherwise the one that this machine's apt uses, or deb.debian.org
#
# One word of COMMAND is a line for the shell, several are a program and its arguments. The exit code is the command's own;
# 125 means that it could not be started. The minimal system is kept in ${XDG_CACHE_HOME:-~/.cache}/anchorsplat (350 MB, two
# minutes); a build beside it needs 3 GB there. Mounts live in a namespace of the run and end with it, also when it is killed.
set -euo pipefail

fail() {
  echo "bare-debian: $1" >&2
  exit 125
}

usage() { sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "$0"; }

suite=bookworm
root=
mirror=
fresh=
variables=()
binds=()
shares=()
outs=()
need() { [ $# -ge 2 ] || fail "$1 needs a value (see --help)"; }
while [ $# -gt 0 ]; do
  case "$1" in
    --suite) need "$@"; suite=$2; shift ;;
    --env) need "$@"; variables+=("$2"); shift ;;
    --bind) need "$@"; binds+=("$2"); shift ;;
    --share) need "$@"; shares+=("$2"); shift ;;
    --out) need "$@"; outs+=("$2"); shift ;;
    --keep) need "$@"; root=$(realpath -m -- "$2"); shift ;;
    --mirror) need "$@"; mirror=$2; shift ;;
    --fresh) fresh=1 ;;
    --help | -h) usage; exit 0 ;;
    --) shift; break ;;
    -*) fail "there is no option $1 (see --help)" ;;
    *) break ;;
  esac
  shift
done
case "$suite" in bookworm | trixie) ;; *) fail "--suite is bookworm or trixie, not '$suite'" ;; esac
for pair in "${variables[@]}"; do [[ "$pair" == [A-Za-z_]*=* ]] || fail "--env wants NAME=VALUE, not '$pair'"; done
for pair in "${outs[@]}"; do
  [[ "$pair" == ?*=?* ]] || fail "--out wants FROM=TO, not '$pair'"
  [ ! -e "${pair#*=}" ] || fail "--out: ${pair#*=} exists already"
done
for folder in "${binds[@]}" "${shares[@]}"; do
  [[ "$folder" == /* && -d "$folder" ]] || fail "--bind and --share want the full path of a folder, not '$folder'"
done
case $# in
  0) command=(make demo) ;;
  1) command=(bash -c "$1") ;;
  *) command=("$@") ;;
esac

[ "$(id -u)" -eq 0 ] || fail "a root file system can only be made and entered by root: call it with sudo"
for program in debootstrap unshare chroot git tar; do
  command -v "$program" >/dev/null || fail "$program is missing: apt-get install debootstrap util-linux coreutils git tar"
done
unshare --mount --pid --fork true || fail "this machine allows no namespaces (in a container: run it with --privileged)"
checkout=$(cd "$(dirname "$0")/.." && pwd)
cache=${XDG_CACHE_HOME:-${HOME:-/root}/.cache}/anchorsplat
mkdir -p "$cache"

# The folder of a run that was killed outright is nobody's: its lock went with it.
for old in "$cache"/run-*; do
  [ ! -d "$old" ] || flock --nonblock "$old" rm -rf --one-file-system "$old" || true  # in use: of a run beside this one
done

# What runs in the background is ended by its first process inside, and with that one everything in its namespace.
child=
scratch=$(mktemp -d "$cache/run-XXXXXX")
exec 8<"$scratch"
flock 8
end_child() {
  [ -n "$child" ] || return 0
  # unshare itself is not killed: it returns when the namespace is empty, and only then may files be removed.
  local inside
  inside=$(cat "/proc/$child/task/$child/children" 2>/dev/null) || inside=
  # shellcheck disable=SC2086
  kill -KILL ${inside:-$child} 2>/dev/null || true
  wait "$child" 2>/dev/null || true
  child=
}
trap 'end_child; rm -rf --one-file-system "$scratch"' EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM

# In the background and waited for, since a shell that waits for its foreground hears no signals; stdin is kept.
exec 3<&0
in_namespace() {
  local code=0
  unshare --mount --pid --fork --kill-child "$@" <&3 3<&- &
  child=$!
  wait "$child" || code=$?
  child=
  return "$code"
}

base=$cache/bare-$suite
exec 9>"$cache/lock-$suite"
flock 9  # two runs make one base
if [ ! -d "$base" ] || [ -n "$fresh" ]; then
  if [ -z "$mirror" ]; then
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 2>/dev/null | grep -m1 '/debian/*$' || true)
    mirror=${mirror:-http://deb.debian.org/debian}
  fi
  echo "bare-debian: making a minimal $suite from $mirror in $base" >&2
  if ! in_namespace debootstrap --variant=minbase --include=make,git,ca-certificates "$suite" "$scratch/base" "$mirror" \
      >"$scratch/log" 2>&1; then
    tail -n 20 "$scratch/log" "$scratch/base/debootstrap/debootstrap.log" >&2 2>/dev/null || true
    fail "debootstrap of $suite from $mirror failed"
  fi
  rm -f "$scratch"/base/var/cache/apt/archives/*.deb
  rm -rf --one-file-system "$base"
  mv "$scratch/base" "$base"
fi

root=${root:-$scratch/root}
if [ ! -d "$root" ]; then
  mkdir -p "$(dirname "$root")"
  cp -a --reflink=auto "$base" "$root.partial"
  mv "$root.partial" "$root"
fi
exec 9>&-

cp -L /etc/resolv.conf "$root/etc/resolv.conf"
if [ -e /etc/ssl/certs/ca-certificates.crt ]; then
  cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/ca-certificates.crt"
fi
inside=/root/anchorsplat
mkdir -p "$root$inside"
find "$root$inside" -mindepth 1 -maxdepth 1 ! -name build ! -name .venv -exec rm -rf {} +
# Deleted files are still in git's list; times are kept, so that a kept build folder only compiles what changed.
git -c safe.directory="$checkout" -C "$checkout" ls-files -z --deduplicate |
  tar -C "$checkout" -c --null --no-recursion --ignore-failed-read -T - 2>"$scratch/log" |
  tar -C "$root$inside" -x --no-same-owner || { cat "$scratch/log" >&2; fail "the tracked files could not be copied"; }

cat >"$scratch/enter" <<'ENTER'
set -euo pipefail
root=$1 binds=$2 shares=$3
shift 3
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
for ((i = 0; i < binds + shares; i++)); do
  mkdir -p "$root$1"
  mount --bind "$1" "$root$1"
  [ "$i" -ge "$binds" ] || mount -o remount,bind,ro "$root$1"
  shift
done
: >"$root/.entered"
code=0
# Not by exec: the first process of a namespace hears no signals and inherits orphans, which make expects of neither.
chroot "$root" env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 "$@" || code=$?
exit "$code"
ENTER
rm -f "$root/.entered"
code=0
in_namespace bash "$scratch/enter" "$root" "${#binds[@]}" "${#shares[@]}" "${binds[@]}" "${shares[@]}" "${variables[@]}" \
  bash -c 'cd "$0" && exec "$@"' "$inside" "${command[@]}" || code=$?
[ -e "$root/.entered" ] || fail "the mounts in $root could not be made"
rm -f "$root/.entered"

for pair in "${outs[@]}"; do
  from=$root$inside/${pair%%=*}
  if [ -e "$from" ]; then
    mkdir -p "$(dirname "${pair#*=}")"
    cp -a -- "$from" "${pair#*=}"
  else
    echo "bare-debian: --out: the command left no ${pair%%=*}" >&2
    [ "$code" -ne 0 ] || code=125
  fi
done
exit "$code"
