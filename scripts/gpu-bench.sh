#!/usr/bin/env bash
# What a GPU takes for pictures and their gradients, beside the CPU and, where python3 has it, gsplat; then for a fit of 15,000 steps
# at 256 x 256 and a refinement with pictures (20 steps and no refinement with --small).
#
#   scripts/gpu-bench.sh [words of `anchorsplat bench gpu`]
#   scripts/gpu-bench.sh --pack FOLDER [PROGRAM]     all that it takes on a Linux that reaches no registry, in a new folder:
#                                                    bring that along and run gpu-bench.sh in it. PROGRAM: build/anchorsplat
#
# The machine needs this one's processor type and glibc, or a newer one, and the GPU's driver for Vulkan.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)

pack() {
  local folder=$1 program=${2:-$here/../build/anchorsplat} library file loader
  [ ! -e "$folder" ] || { echo "gpu-bench: $folder exists already" >&2; exit 1; }
  [ -x "$program" ] || { echo "gpu-bench: there is no $program (make gpu-bench builds it)" >&2; exit 1; }
  library=$here/../build/webgpu/libwgpu_native-release.so
  [ -e "$library" ] || { echo "gpu-bench: there is no $library (scripts/fetch-webgpu.sh)" >&2; exit 1; }
  loader=$(ldconfig -p | sed -n 's/.*libvulkan\.so\.1 .*=> //p' | head -n 1)
  [ -n "$loader" ] || { echo "gpu-bench: there is no libvulkan.so.1 to bring along (apt-get install libvulkan1)" >&2; exit 1; }
  mkdir -p "$folder/lib" "$folder/lib-compiler"
  cp "$here/gpu-bench.sh" "$here/gpu-bench-gsplat.py" "$folder/"
  cp "$program" "$folder/anchorsplat"
  mkdir -p "$folder/examples/"{stone_lantern,tankard}
  cp -r "$here/../examples/stone_lantern/"{lr,transforms_lr.json} "$folder/examples/stone_lantern/"
  cp -r "$here/../examples/tankard/"{lr,transforms_lr.json,input.ply} "$folder/examples/tankard/"
  strip "$folder/anchorsplat"
  cp "$library" "$folder/libwgpu_native.so"
  cp -L "$loader" "$folder/lib/libvulkan.so.1"
  # Embree is half of it and traces rays, which this does not: its functions only have to be there.
  local without
  without=$(mktemp -d)
  nm -D --undefined-only "$program" | sed -n 's/^ *U \(rtc[A-Za-z0-9_]*\)$/void \1(void) { __builtin_trap(); }/p' >"$without/embree.c"
  # Of glibc there must be only one, the machine's; the compiler's libraries it may have, and then they are newer.
  while read -r library file; do
    case "$library" in
      libembree*.so.*) cc -shared -fPIC -O1 -s -Wl,-soname,"$library" -o "$folder/lib/$library" "$without/embree.c" ;;
      libc.so.* | libm.so.* | libdl.so.* | libpthread.so.* | librt.so.*) ;;
      libstdc++.so.* | libgcc_s.so.*) cp -L "$file" "$folder/lib-compiler/$library" ;;
      *) cp -L "$file" "$folder/lib/$library" ;;
    esac
  done < <(ldd "$program" | sed -n 's/^\s*\(\S*\) => \(\/\S*\) .*/\1 \2/p')
  rm -rf "$without"
  du -sh "$folder"
}

if [ "${1:-}" = --pack ]; then
  [ $# -ge 2 ] || { sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "$0"; exit 2; }
  pack "${@:2}"
  exit
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -x "$here/anchorsplat" ]; then
  program=$here/anchorsplat
  export ANCHORSPLAT_WEBGPU=${ANCHORSPLAT_WEBGPU:-$here/libwgpu_native.so}
  path=$here/lib
  ldconfig -p 2>/dev/null | grep -q 'libstdc++\.so\.6 ' || path+=:$here/lib-compiler
  export LD_LIBRARY_PATH=$path${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
  # A container is often given NVIDIA's driver without the file by which Vulkan finds it.
  if [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] && ! ls /etc/vulkan/icd.d/*.json /usr/share/vulkan/icd.d/*.json >/dev/null 2>&1 &&
    { [ -d /usr/local/nvidia ] || ldconfig -p 2>/dev/null | grep -q 'libGLX_nvidia\.so\.0 '; }; then
    driver=/usr/local/nvidia/share/vulkan/icd.d/nvidia_icd.json
    if [ ! -e "$driver" ]; then
      driver=$work/nvidia.json
      echo '{"file_format_version": "1.0.0", "ICD": {"library_path": "libGLX_nvidia.so.0", "api_version": "1.3.0"}}' >"$driver"
    fi
    export VK_DRIVER_FILES=$driver VK_ICD_FILENAMES=$driver
  fi
else
  program=$here/../build/anchorsplat
  [ -x "$program" ] || { echo "gpu-bench: there is no $program (make gpu-bench builds it)" >&2; exit 1; }
fi

# Seconds, share of the GPU and agreement with pictures, from a report of `fit` or `enhance`.
summary='
import json, sys
title, report = sys.argv[1], json.load(sys.stdin)
report = report[0] if isinstance(report, list) else report
device, refined = report["device"], report.get("refine-images", {})
held_out = report.get("held_out", {}).get("psnr") or refined.get("consistency_after")
name = device["name"] if "share" not in device else "%s for %.0f %%" % (device["name"], 100 * device["share"])
print("%s: %.1f s (%s), %.2f dB" % (title, report.get("seconds_in_all", report["seconds"]), name, held_out))
if device.get("gave_up"): print("  gave up the GPU: " + device["gave_up"])
'
report_run() {
  local title=$1
  shift
  "$program" "$@" "${where[@]}" --quiet --json >"$work/report.json" || return 1
  if [ -n "$json" ]; then cat "$work/report.json"; else python3 -c "$summary" "$title" <"$work/report.json"; fi
}

# Words that say where, and words that say what, which the other program takes too.
all=("$@") where=() what=() small='' json=''
while [ $# -gt 0 ]; do
  case "$1" in
    --device | --max-gpu-memory) where+=("$1" "${2:-}") && shift ;;
    --device=* | --max-gpu-memory=*) where+=("$1") ;;
    --small) small=1 what+=("$1") ;;
    --json) json=1 what+=("$1") ;;
    *) what+=("$1") ;;
  esac
  shift || true
done
[[ " ${where[*]} " == *" --device"* ]] || where+=(--device gpu)

code=0
"$program" bench gpu "${all[@]}" || code=$?
[ -n "$json" ] || echo
python3 "$here/gpu-bench-gsplat.py" "$program" "${what[@]}" || [ $? -eq 3 ] || code=1

examples=$here/examples
[ -d "$examples" ] || examples=$here/../examples
steps=15000
[ -z "$small" ] || steps=20
[ -n "$json" ] || echo
report_run "Fit, $steps steps at 256 x 256, 20,000 Gaussians" fit "$examples/stone_lantern/transforms_lr.json" -o "$work/fit.ply" \
  --steps $steps --max-gaussians 20000 || code=1
[ -n "$small" ] || report_run "Refinement with 60 pictures, 1,500 steps" enhance "$examples/tankard/input.ply" -o "$work/best.ply" --quality best \
  --images "$examples/tankard/transforms_lr.json" --steps 1500 || code=1
exit "$code"
