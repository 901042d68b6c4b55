#!/usr/bin/env bash
# Makes sure that everything the build needs is there: on Debian and its relatives by apt (sudo only when not root),
# elsewhere it says what is missing. Quick when nothing is missing. With --with-tests also what the tests take, with
# --with-torch what installing LibTorch takes, with --with-python what the Python package takes, with --with-packaging what
# `make deb` takes; with --without-lab not what only src/lab takes; --list only names the packages.
# They are called the same in Debian 12 and 13.
set -euo pipefail

packages=(g++ cmake ninja-build pkg-config
  libhwy-dev libtbb-dev libcli11-dev nlohmann-json3-dev libpugixml-dev libpng-dev libjpeg-dev zlib1g-dev libzstd-dev libwebp-dev libtiff-dev
  libstb-dev)
lab_packages=(libassimp-dev libembree-dev libtomlplusplus-dev)
headers=(hwy/highway.h tbb/parallel_for.h CLI/CLI.hpp nlohmann/json.hpp pugixml.hpp png.h jpeglib.h zlib.h zstd.h webp/decode.h tiffio.h
  stb/stb_image.h)
lab_headers=(assimp/scene.h toml++/toml.h)
with_lab=1
list=
with_torch=
with_python=
[ ! -e "$(dirname "$0")/../.venv/anchorsplat-python" ] || with_python=1
[ ! -e "$(dirname "$0")/../.venv/anchorsplat-torch" ] || with_torch=1
for option in "$@"; do
  case "$option" in
    --with-tests)
      packages+=(libgtest-dev libgmock-dev)
      packages+=(mesa-vulkan-drivers libvulkan1 python3-pip)  # a GPU in software, and what fetches the library for it
      headers+=(gtest/gtest.h gmock/gmock.h)
      ;;
    --with-torch) with_torch=1 ;;
    --with-python) with_python=1 ;;
    --with-packaging) packages+=(dpkg-dev file) ;;  # by which `make deb` reads the libraries of the program
    --without-lab) with_lab= ;;
    --list) list=1 ;;
    *)
      echo "anchorsplat: install-dependencies.sh has no option $option" >&2
      exit 2
      ;;
  esac
done

if [ -n "$with_lab" ]; then
  packages+=("${lab_packages[@]}")
  headers+=("${lab_headers[@]}")
fi
# LibTorch comes in a Python wheel (scripts/install-torch.sh) without the headers of Gloo, which training on several
# machines needs.
if [ -n "$with_torch" ]; then
  packages+=(python3-venv python3-pip libgloo-dev)
fi
if [ -n "$with_python" ]; then
  packages+=(python3-venv python3-pip python3-dev)
fi
if [ -n "$list" ]; then
  printf '%s\n' "${packages[@]}"
  exit 0
fi

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  # Not a Debian system: look for one header or program of each package.
  missing=()
  have_header() { echo "#include <$1>" | ${CXX:-c++} -std=c++20 -E -x c++ - >/dev/null 2>&1; }
  for program in "${CXX:-c++}" cmake ninja; do command -v "$program" >/dev/null || missing+=("$program"); done
  for header in "${headers[@]}"; do
    have_header "$header" || missing+=("<$header>")
  done
  [ -z "$with_lab" ] || have_header embree4/rtcore.h || have_header embree3/rtcore.h || missing+=("<embree4/rtcore.h>")
  [ ${#missing[@]} -eq 0 ] && exit 0
  echo "anchorsplat: this is not a Debian system, so nothing was installed. Missing: ${missing[*]}" >&2
  echo "Install a C++20 compiler, CMake >= 3.22, Ninja and the development packages of Highway (>= 1.0.3), oneTBB," >&2
  echo "CLI11, nlohmann-json, pugixml, libpng, libjpeg, zlib, zstd, libwebp, libtiff (>= 4.5), assimp (>= 5.2), stb, Embree (>= 3.13 or 4), toml++ and, for the" >&2
  echo "tests, GoogleTest, then call make again." >&2
  exit 1
fi

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

sudo=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "anchorsplat: missing packages and neither root nor sudo. Ask an administrator for:" >&2
    echo "  apt-get install ${missing[*]}" >&2
    exit 1
  fi
  sudo=(sudo)
fi
echo "Installing Debian packages: ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
"${sudo[@]}" apt-get update -qq
"${sudo[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}"
