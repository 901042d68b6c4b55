#!/usr/bin/env bash
# Another program against the installed package: found by find_package, built, run. Nothing of the sources or of the
# build folder is within its reach.
#   installed_package_test.sh SOURCE_DIR BUILD_DIR CMAKE COMPILER NM
set -uo pipefail
source=$1 build=$2 cmake=$3 compiler=$4 nm=$5
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "FAILED: $*"; [ -e "$work/log" ] && tail -n 30 "$work/log"; exit 1; }

"$cmake" --install "$build" --prefix "$work/prefix" >"$work/log" 2>&1 || fail "install"
for part in anchorsplat.h anchorsplatConfig.cmake anchorsplatConfigVersion.cmake libanchorsplat.so; do
  [ -n "$(find "$work/prefix/include" "$work"/prefix/lib* -name $part)" ] || fail "$part is not there"
done
grep -rqF -e "$source" -e "$build" "$work"/prefix/lib*/cmake "$work"/prefix/lib*/libanchorsplat.so "$work/prefix/include" 2>/dev/null && fail "the package knows where it was built"

cp -r "$source/examples/cpp" "$work/program"
"$cmake" -S "$work/program" -B "$work/built" -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="$compiler" \
  -DCMAKE_CXX_FLAGS="-Wall -Wextra -Werror" -DCMAKE_EXPORT_COMPILE_COMMANDS=ON >"$work/log" 2>&1 || fail "configure"
grep -F -e "$source" -e "$build" "$work/built/compile_commands.json" && fail "the program sees the sources"
"$cmake" --build "$work/built" >"$work/log" 2>&1 || fail "build"

cp "$source/examples/biplane/input.ply" "$work/in.ply"
(cd / && "$work/built/enhance_4x" "$work/in.ply" "$work/out.spz" "$work/picture.png") >"$work/log" 2>&1 || fail "run"
grep -q "Gaussians, .* by model" "$work/log" || fail "it does not say what it did"
[ "$(head -c 4 "$work/out.spz")" = NGSP ] || fail "no SPZ was written"
[ "$(head -c 4 "$work/picture.png" | tail -c 3)" = PNG ] || fail "no picture was drawn"
(cd / && "$work/built/enhance_4x" "$work/none.ply" "$work/out.spz" "$work/picture.png") >"$work/log" 2>&1 &&
  fail "a file that is not there was read"
grep -q "none.ply: no such file" "$work/log" || fail "it does not say what went wrong"

# Another version is not taken.
sed -i 's/anchorsplat 0.1/anchorsplat 99.0/' "$work/program/CMakeLists.txt"
"$cmake" -S "$work/program" -B "$work/other" -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="$compiler" \
  >"$work/log" 2>&1 && fail "version 99 was found"

# The program brings along only what the system has beside our library.
"$nm" -D --undefined-only -C "$work/built/enhance_4x" | grep -q 'anchorsplat::Enhance' || fail "it has the library inside"
echo "installed, found, built and run"
