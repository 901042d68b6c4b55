#!/usr/bin/env bash
# Builds for 64-bit ARM in a bare Debian of this machine's own processor and runs the tests of the rooms that do arithmetic
# (or those named) under QEMU: once as a processor with NEON alone, once as one that has everything QEMU knows.
#
#   scripts/cross-aarch64.sh [options of bare-debian.sh] [-- ROOM...]
#
# Rooms: core gpu io images tensors cameras formats render enhance unless named. What speaks WebGPU is built, and tests that
# need a device are left out, which the output says: kernels are the same on every processor, and with a driver that makes
# machine code at run time it would be QEMU that is tested.
#
# Needs root and debootstrap. Not a part of CI.
set -euo pipefail

if [ "${1:-}" != --inside ]; then
  options=()
  while [ $# -gt 0 ] && [ "$1" != -- ]; do
    options+=("$1")
    shift
  done
  [ $# -eq 0 ] || shift
  exec "$(dirname "$0")/bare-debian.sh" "${options[@]}" -- scripts/cross-aarch64.sh --inside "$@"
fi
shift
rooms=("$@")
[ $# -gt 0 ] || rooms=(core gpu io images tensors cameras formats render enhance)

export DEBIAN_FRONTEND=noninteractive
dpkg --add-architecture arm64
apt-get update -qq
# Tools are this machine's, libraries the other's; packages that are headers alone are nobody's.
packages=(cmake ninja-build pkg-config crossbuild-essential-arm64 qemu-user python3-pip)
for package in $(scripts/install-dependencies.sh --with-tests --list | grep -- -dev); do
  if apt-cache show "$package" | grep -q '^Architecture: all'; then packages+=("$package"); else packages+=("$package:arm64"); fi
done
apt-get install -y -qq --no-install-recommends "${packages[@]}"

scripts/fetch-webgpu.sh  # of the two files only the header, which is the same for every processor, is of use here

cmake -S . -B build/aarch64 -G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/aarch64-linux-gnu.cmake" -DCMAKE_BUILD_TYPE=Release \
  -DANCHORSPLAT_TORCH=OFF -DANCHORSPLAT_TESTS=ON -DANCHORSPLAT_UNITY=ON
cmake --build build/aarch64 -j "${JOBS:-$(nproc)}" --target "${rooms[@]/%/_test}"
on_a_device='*Gpu*:*Resident*:FaultyDevice*'
echo "== tests that need a GPU are left out ($on_a_device)"
failed=()
for processor in cortex-a72 max; do
  for room in "${rooms[@]}"; do
    echo "== $room on $processor"
    qemu-aarch64 -cpu "$processor" build/aarch64/src/*/"$room/${room}_test" --gtest_brief=1 --gtest_filter="-$on_a_device" || failed+=("$room on $processor")
  done
done
[ ${#failed[@]} -eq 0 ] || { printf 'failed: %s\n' "${failed[@]}"; exit 1; }
