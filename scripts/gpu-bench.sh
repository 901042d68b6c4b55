#!/usr/bin/env bash
# What a GPU takes for pictures and their gradients, beside the CPU and, where python3 has it, gsplat.
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

if [ -x "$here/anchorsplat" ]; then
  program=$here/anchorsplat
  export ANCHORSPLAT_WEBGPU=${ANCHORSPLAT_WEBGPU:-$here/libwgpu_native.so}
  path=$here/lib
  ldconfig -p 2>/dev/null | grep -q 'libstdc++\.so\.6 ' || path+=:$here/lib-compiler
  export LD_LIBRARY_PATH=$path${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
  # A container is often given NVIDIA's driver without the file by which Vulkan finds it.
  if [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] && ! ls /etc/vulkan/icd.d/*.json /usr/share/vulkan/icd.d/*.json >/dev/null 2>&1 &&
    ldconfig -p 2>/dev/null | grep -q 'libGLX_nvidia\.so\.0 '; then
    icd=$(mktemp -d)
    trap 'rm -rf "$icd"' EXIT
    echo '{"file_format_version": "1.0.0", "ICD": {"library_path": "libGLX_nvidia.so.0", "api_version": "1.3.0"}}' >"$icd/nvidia.json"
    export VK_DRIVER_FILES=$icd/nvidia.json VK_ICD_FILENAMES=$icd/nvidia.json
  fi
else
  program=$here/../build/anchorsplat
  [ -x "$program" ] || { echo "gpu-bench: there is no $program (make gpu-bench builds it)" >&2; exit 1; }
fi

code=0
"$program" bench gpu "$@" || code=$?
# The rows of gsplat, of the same splats. What concerns only our program is left out.
words=() device=
for word in "$@"; do
  [ -z "$device" ] || { device=; continue; }
  case "$word" in
    --device | --max-gpu-memory) device=1 ;;
    --device=* | --max-gpu-memory=*) ;;
    *) words+=("$word") ;;
  esac
done
[[ " $* " == *" --json "* ]] || echo
python3 "$here/gpu-bench-gsplat.py" "$program" "${words[@]}" || [ $? -eq 3 ] || code=1
exit "$code"
