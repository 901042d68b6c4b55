#!/usr/bin/env bash
# In a bare Debian 13 (scripts/web/build.sh calls it there): Emscripten, and the libraries that the module links, compiled
# to WebAssembly from Debian's source packages into build/web-libraries. Emscripten's own ports are not used: they are
# downloads. Quick when all of it is there.
set -euo pipefail
cd "$(dirname "$0")/../.."
[ "$(id -u)" -eq 0 ] || { echo "libraries.sh: this is for the root that scripts/web/build.sh makes" >&2; exit 1; }
out=$PWD/build/web-libraries
prefix=$out/prefix
packages=(emscripten cmake ninja-build dpkg-dev patch xz-utils nlohmann-json3-dev libcli11-dev libfast-float-dev libstb-dev ccache)
sources=(zlib libpng1.6 libjpeg-turbo libwebp libzstd pugixml highway googletest)
stamp=$out/done-$(sha256sum "$0" | cut -c1-16)
[ ! -e "$stamp" ] || exit 0
rm -rf "$out"
mkdir -p "$prefix/include" "$prefix/lib" "$out/sources"

export DEBIAN_FRONTEND=noninteractive
sed -n 's/^deb /deb-src /p' /etc/apt/sources.list | sort -u >/etc/apt/sources.list.d/sources.list
apt-get update -qq
apt-get install -y -qq --no-install-recommends "${packages[@]}"

# As cmake/Web.cmake has them.
flags="-O3 -fwasm-exceptions -sSUPPORT_LONGJMP=wasm -msimd128 -pthread"
compile() {  # compile NAME COMPILER FOLDER FLAGS FILE...: libNAME.a of these files of the folder
  local name=$1 compiler=$2 folder=$3 more=$4
  shift 4
  echo "web: $name for WebAssembly"
  rm -rf "$out/objects"
  mkdir -p "$out/objects"
  # shellcheck disable=SC2016
  (cd "$folder" && printf '%s\n' "$@" | FLAGS="$flags $more" OBJECTS=$out/objects COMPILER=$compiler \
    xargs -P "${JOBS:-$(nproc)}" -I '{}' bash -c '$COMPILER $FLAGS -c {} -o "$OBJECTS/$(tr / _ <<<"{}").o"' >>"$out/log" 2>&1) &&
    emar rcs "$prefix/lib/lib$name.a" "$out/objects"/*.o >>"$out/log" 2>&1 || { tail -n 40 "$out/log" >&2; exit 1; }
}

# Debian's sources; where a mirror has lost a package's patches, upstream's archive as Debian keeps it. apt has compared
# either with the signed index.
fetch() {  # fetch PACKAGE: unpacked into $out/sources/PACKAGE
  local folder=$out/sources/$1
  mkdir -p "$folder.files"
  (cd "$folder.files" && apt-get source -qq --download-only "$1") >>"$out/log" 2>&1 || true
  if compgen -G "$folder.files/*.dsc" >/dev/null && compgen -G "$folder.files/*.debian.tar.*" >/dev/null; then
    (cd "$folder.files" && dpkg-source --no-check --extract ./*.dsc "$folder") >>"$out/log" 2>&1
  elif compgen -G "$folder.files/*.orig.tar.*z*" >/dev/null; then
    echo "web: no patches of Debian's for $1: as its authors have it"
    mkdir -p "$folder"
    tar -x --strip-components=1 -C "$folder" -f "$(ls "$folder.files"/*.orig.tar.{xz,gz,bz2} 2>/dev/null | head -n 1)"
  else
    tail -n 20 "$out/log" >&2
    echo "web: the source of $1 could not be fetched" >&2
    exit 1
  fi
}
for source in "${sources[@]}"; do fetch "$source"; done
here() { echo "$out/sources/$1"; }

cd "$(here zlib)"
# shellcheck disable=SC2046
compile z emcc "$PWD" "-DHAVE_UNISTD_H" $(ls -- *.c)
cp zlib.h zconf.h "$prefix/include/"

cd "$(here libpng1.6)"
cp scripts/pnglibconf.h.prebuilt pnglibconf.h
# shellcheck disable=SC2046
compile png emcc "$PWD" "-I$prefix/include" $(ls png*.c | grep -v pngtest)
cp png.h pngconf.h pnglibconf.h "$prefix/include/"

cd "$(here libwebp)"
# shellcheck disable=SC2046
compile webp emcc "$PWD" "-I." $(ls src/{dec,dsp,enc,utils}/*.c sharpyuv/*.c)
mkdir -p "$prefix/include/webp"
cp src/webp/*.h "$prefix/include/webp/"

cd "$(here libzstd)"
# shellcheck disable=SC2046
compile zstd emcc "$PWD/lib" "-DZSTD_DISABLE_ASM -DZSTD_LEGACY_SUPPORT=0" $(cd lib && ls {common,compress,decompress}/*.c)
cp lib/zstd.h lib/zstd_errors.h "$prefix/include/"

cd "$(here pugixml)"
compile pugixml em++ "$PWD" "-std=c++17 -Isrc" src/pugixml.cpp
cp src/pugixml.hpp src/pugiconfig.hpp "$prefix/include/"

cd "$(here highway)"
# shellcheck disable=SC2046
compile hwy em++ "$PWD" "-std=c++17 -I." $(ls hwy/{abort,aligned_allocator,per_target,print,targets,timer}.cc)
(find hwy -name '*.h' | tar -c -T -) | tar -x -C "$prefix/include"

cd "$(here googletest)"
compile gtest em++ "$PWD/googletest" "-std=c++17 -Iinclude -I." src/gtest-all.cc
compile gtest_main em++ "$PWD/googletest" "-std=c++17 -Iinclude -I." src/gtest_main.cc
compile gmock em++ "$PWD/googlemock" "-std=c++17 -Iinclude -I. -I../googletest/include" src/gmock-all.cc
cp -r googletest/include/gtest googlemock/include/gmock "$prefix/include/"

# Of libjpeg-turbo, what is compiled depends on what its own CMake finds.
echo "web: jpeg for WebAssembly"
emcmake cmake -S "$(here libjpeg-turbo)" -B "$out/jpeg" -G Ninja -DCMAKE_BUILD_TYPE=Release -DENABLE_SHARED=OFF -DENABLE_STATIC=ON \
  -DWITH_SIMD=OFF -DWITH_TURBOJPEG=OFF -DCMAKE_C_FLAGS="$flags" -DCMAKE_POLICY_VERSION_MINIMUM=3.5 >"$out/log" 2>&1 &&
  cmake --build "$out/jpeg" -j "${JOBS:-$(nproc)}" --target jpeg-static >>"$out/log" 2>&1 || { tail -n 40 "$out/log" >&2; exit 1; }
cp "$out/jpeg/libjpeg.a" "$prefix/lib/"
cp "$(here libjpeg-turbo)"/{jpeglib,jmorecfg,jerror}.h "$out/jpeg/jconfig.h" "$prefix/include/"

for headers in nlohmann CLI fast_float stb; do cp -r "/usr/include/$headers" "$prefix/include/"; done
# What the licences of what is linked ask for (scripts/web/assemble.mjs).
notice() { cat "${@:2}" >"$prefix/notices/$1"; }
mkdir -p "$prefix/notices"
notice zlib "$(here zlib)/zlib.h"
sed -i '/\*\//q' "$prefix/notices/zlib"  # its first comment is the licence
notice libpng "$(here libpng1.6)/LICENSE"
notice libjpeg-turbo "$(here libjpeg-turbo)/LICENSE.md" "$(here libjpeg-turbo)/README.ijg"
notice libwebp "$(here libwebp)/COPYING" "$(here libwebp)/PATENTS"
notice zstd "$(here libzstd)/LICENSE"
notice pugixml "$(here pugixml)/LICENSE.md"
notice highway "$(here highway)/LICENSE-BSD3"
notice nlohmann-json /usr/share/doc/nlohmann-json3-dev/copyright
notice cli11 /usr/share/doc/libcli11-dev/copyright
notice fast-float /usr/share/doc/libfast-float-dev/copyright
notice stb /usr/share/doc/libstb-dev/copyright
notice emscripten /usr/share/doc/emscripten/copyright
rm -rf "$out/jpeg" "$out/objects" "$out/log"
touch "$stamp"
