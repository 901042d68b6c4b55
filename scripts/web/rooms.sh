#!/usr/bin/env bash
# In the root that scripts/web/build.sh makes: the unit tests of the engine's rooms under Node. rooms.sh [ROOM...]
#
# rooms.txt names what cannot be tested there, and why.
set -euo pipefail
cd "$(dirname "$0")/../.."
rooms=("$@")
[ $# -gt 0 ] || rooms=(core gpu io images tensors cameras formats render metrics compare edit viewer fit upscale enhance kernels network
  published compact model web)
scripts/web/compile.sh "${rooms[@]/%/_test}" >build/web-rooms.log 2>&1 || { grep -A 20 '^FAILED' build/web-rooms.log; exit 1; }
failed=0
for room in "${rooms[@]}"; do
  program=$(find build/web/src -name "${room}_test.js")
  excluded=
  while read -r where pattern reason; do
    [ "$where" = "$room" ] || continue
    # A test that is gone is no excuse.
    node "$program" --gtest_list_tests "--gtest_filter=$pattern" | grep -q '^ ' || { echo "rooms.txt: $room has no $pattern"; failed=1; }
    echo "left out, $room $pattern: $reason"
    excluded+=:$pattern
  done < <(grep -v '^#' scripts/web/rooms.txt)
  if node "$program" --gtest_brief=1 "--gtest_filter=-${excluded#:}" >build/web-room.log 2>&1; then
    echo "$room: $(sed -n 's/.*PASSED  \] //p' build/web-room.log | tail -n 1)"
  else
    failed=1
    echo "FAILED $room"
    tail -n 60 build/web-room.log
  fi
done
exit "$failed"
