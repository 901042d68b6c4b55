#!/usr/bin/env bash
# What works on a GPU, with other drivers and compilers of shaders than `make test` has. All in software: no GPU is needed.
#
#   scripts/gpu-test.sh BUILD [PART...]     BUILD: a build folder with tests (build/release); all parts unless named
#
#   trixie     the tests of the rooms that have kernels, built and run in a bare Debian 13, whose Mesa is newer. Needs root (or
#              sudo), debootstrap, 4 GB and, the first time, half an hour on two cores; it is kept in build/gpu-test/trixie
#   dawn       the same tests of BUILD on Dawn, Chrome's WebGPU, and SwiftShader, the software driver of Debian's chromium. Needs
#              npm, which fetches Dawn once, and x86-64
#   chromium   all kernels compiled by headless Chromium, and pictures, gradients and a short fit that BUILD has recorded
#              calculated there again. Needs what scripts/browser-tools.sh installs
#   scenes     `anchorsplat bench gpu --small`: larger pictures against the CPU's, on the first adapter of this machine
#
# A part that cannot be run has failed. The others run all the same.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$PWD/build/gpu-test
rooms=(gpu render metrics fit enhance bench)  # with kernels, or what calls them
filter='*Gpu*:*Resident*'                     # their tests

# The tests of kernels in the build folder $1. None is a failure: they have been renamed.
run_tests() {
  local room program count=0 failed=()
  for room in "${rooms[@]}"; do
    program=$(echo "$1"/src/*/"$room/${room}_test")
    [ -x "$program" ] || { echo "gpu-test: there is no $program (cmake -DANCHORSPLAT_TESTS=ON)" >&2; return 1; }
    [ -n "$("$program" --gtest_list_tests --gtest_filter="$filter")" ] || continue
    count=$((count + 1))
    echo "== $room"
    NODEVICE_SELECT=1 "$program" --gtest_brief=1 --gtest_filter="$filter" || failed+=("$room")
  done
  [ "$count" -ge 3 ] || { echo "gpu-test: only $count rooms have tests of kernels" >&2; return 1; }
  [ ${#failed[@]} -eq 0 ] || { echo "gpu-test: failed: ${failed[*]}" >&2; return 1; }
}

trixie() {
  local sudo=()
  [ "$(id -u)" -eq 0 ] || sudo=(sudo)
  scripts/install-missing.sh gpu-test debootstrap=debootstrap
  mkdir -p "$folder"
  "${sudo[@]}" scripts/bare-debian.sh --suite trixie --keep "$folder/trixie" --env "JOBS=${JOBS:-$(nproc)}" -- \
    scripts/gpu-test.sh --inside
}

inside() {
  scripts/install-dependencies.sh --with-tests
  scripts/fetch-webgpu.sh
  cmake --preset lean -DANCHORSPLAT_TESTS=ON -DANCHORSPLAT_UNITY=ON >build/configure.log || { cat build/configure.log; return 1; }
  cmake --build --preset lean -j "${JOBS:-$(nproc)}" --target "${rooms[@]/%/_test}"
  run_tests build/lean
}

# A library for Bun that has all of Dawn in it, by the functions of webgpu.h. It needs more of a driver than Debian 12's Mesa has.
dawn() {
  local driver=/usr/lib/chromium/vk_swiftshader_icd.json version=0.1.7 library=$folder/dawn/package/libwebgpu_wrapper.so
  local sum=8badfecdad4e726ac12be4f29771f4cbd7ce7683b4418316a547c5bda94fb798
  [ "$(uname -sm)" = 'Linux x86_64' ] || { echo "gpu-test: bun-webgpu-linux-x64 is for x86-64" >&2; return 1; }
  scripts/install-missing.sh gpu-test npm=npm chromium=chromium
  [ -e "$driver" ] || { echo "gpu-test: there is no $driver, which Debian's chromium brings" >&2; return 1; }
  if [ ! -e "$library" ]; then
    mkdir -p "$folder/dawn"
    (cd "$folder/dawn" && npm pack --silent "bun-webgpu-linux-x64@$version" >/dev/null)
    local package=$folder/dawn/bun-webgpu-linux-x64-$version.tgz
    [ "$(sha256sum <"$package" | cut -d' ' -f1)" = "$sum" ] ||
      { echo "gpu-test: that is another bun-webgpu-linux-x64 $version" >&2; return 1; }
    tar -C "$folder/dawn" -xzf "$package"
  fi
  VK_DRIVER_FILES=$driver VK_ICD_FILENAMES=$driver ANCHORSPLAT_WEBGPU=$library run_tests "$build"
}

chromium() {
  . scripts/browser-tools.sh
  browser_tools gpu-test playwright-core@1.65.1
  mkdir -p "$folder/recording"
  cmake --build "$build" -j "${JOBS:-$(nproc)}" --target gpu_recording
  NODEVICE_SELECT=1 "$build/src/lab/bench/gpu_recording" "$folder/recording"
  node scripts/gpu_browser_test.mjs "$folder/recording"
}

scenes() {
  local program=$build/anchorsplat
  [ -x "$program" ] || program=build/anchorsplat
  NODEVICE_SELECT=1 "$program" bench gpu --small
}

if [ "${1:-}" = --inside ]; then
  inside
  exit
fi
if [ $# -eq 0 ] || [ ! -d "$1" ]; then
  sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "$0"
  exit 2
fi
build=$(realpath "$1")
shift
parts=("$@")
[ $# -gt 0 ] || parts=(scenes dawn chromium trixie)
failed=()
for part in "${parts[@]}"; do
  case "$part" in scenes | dawn | chromium | trixie) ;; *) echo "gpu-test: there is no part $part" >&2; exit 2 ;; esac
done
for part in "${parts[@]}"; do
  echo "=== $part"
  # A process of its own, so that what fails in it ends it; where it is part of a condition, nothing would.
  set +e
  (set -e; "$part")
  code=$?
  set -e
  [ "$code" -eq 0 ] || failed+=("$part")
done
[ ${#failed[@]} -eq 0 ] || { echo "gpu-test: failed: ${failed[*]}" >&2; exit 1; }
echo "gpu-test: ${parts[*]} passed"
