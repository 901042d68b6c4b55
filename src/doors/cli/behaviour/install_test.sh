#!/usr/bin/env bash
# What `cmake --install` puts where, and that it works from anywhere without the build folder.
#   install_test.sh PROGRAM SOURCE_DIR BUILD_DIR CMAKE
. "$(dirname "$0")/expectations.sh"
build=$3
cmake=$4
prefix=$work/prefix
# An environment with nothing in it, as after login on another machine, and away from the sources.
elsewhere() { (cd / && env -i PATH=/usr/bin:/bin HOME="$work" LANG=C.UTF-8 "$@"); }
has_not() {
  checks=$((checks + 1))
  if grep -qaF -- "$2" "$1"; then
    failures=$((failures + 1))
    echo "FAILED: $1 holds '$2'"
  fi
}

expect 0 "install" "$cmake" --install "$build" --prefix "$prefix" --strip
installed=$prefix/bin/anchorsplat
for file in bin/anchorsplat share/man/man1/anchorsplat.1 share/bash-completion/completions/anchorsplat \
            share/zsh/site-functions/_anchorsplat share/doc/anchorsplat/THIRD_PARTY share/doc/anchorsplat/CHANGELOG.md \
            share/doc/anchorsplat/copyright share/doc/anchorsplat/model-card.md share/anchorsplat/fetch-upscaler.sh \
            share/anchorsplat/convert_upscaler.py; do
  expect 0 "$file" test -s "$prefix/$file"
done
# Nothing in it knows where it was built.
has_not "$installed" "$build"
has_not "$installed" "$source"
for part in "$installed" "$prefix"/lib/anchorsplat/*; do
  [ -e "$part" ] || continue
  expect 0 "dynamic section of $part" readelf -d "$part"
  has_not "$work/stdout" "$source"
  has_not "$work/stdout" "$build"
done

# One version everywhere.
version=$(sed -n 's/^project(anchorsplat VERSION \([0-9.]*\).*/\1/p' "$source/CMakeLists.txt")
expect 0 "version" elsewhere "$installed" --version
says stdout "anchorsplat $version"
expect 0 "version in the manual page" grep -qF "anchorsplat $version" "$prefix/share/man/man1/anchorsplat.1"
expect 0 "version in the changes" grep -q "^## $version\b" "$prefix/share/doc/anchorsplat/CHANGELOG.md"

# It works.
expect 0 "enhance" elsewhere "$installed" enhance "$input" -o "$work/enhanced.ply" --method model --json
says stdout '"method": "model"'
expect 0 "a page" elsewhere "$installed" view "$work/enhanced.ply" -o "$work/page.html"

# doctor: every part has a state, and what is missing comes with a command.
expect 0 "doctor" elsewhere "$installed" doctor
for word in "anchorsplat    $version" processor SIMD bfloat16 threads memory "built in, 4 Gaussians for each" training \
            LPIPS "none in $work/.local/share/anchorsplat/lpips" scripts/fetch-lpips.sh; do
  says stdout "$word"
done
expect 0 "doctor as JSON" elsewhere "$installed" doctor --json
says stdout "\"version\": \"$version\""
says stdout '"bfloat16_products": '
says stdout '"state": "ready"'
# Weights that are there and cannot be read are an illness, not an absence; so is a plugin that does not load.
mkdir "$work/damaged"
echo nothing >"$work/damaged/alex.safetensors"
expect 1 "doctor and damaged weights" elsewhere env ANCHORSPLAT_LPIPS="$work/damaged" "$installed" doctor
says stdout "broken: $work/damaged/alex.safetensors"
if [ ! -e "$prefix/lib/anchorsplat/anchorsplat-lpips.so" ]; then
  mkdir -p "$prefix/lib/anchorsplat"
  echo nothing >"$prefix/lib/anchorsplat/anchorsplat-lpips.so"
  expect 1 "doctor and a damaged plugin" elsewhere "$installed" doctor --json
  says stdout '"state": "broken"'
  rm -r "$prefix/lib/anchorsplat"
  expect 3 "train without the training" elsewhere "$installed" train "$work" --config "$input" -o "$work/run"
  says stderr "doctor"
fi

# The manual page knows every verb and option that --help-all shows, and roff has nothing to say against it.
page=$(sed 's/\\-/-/g; s/\\f[BIR]//g; s/\\&//g; s/\\e/\\/g' "$prefix/share/man/man1/anchorsplat.1")
for verb in enhance info render convert compare upscale eval view views fit train doctor "dataset build" "dataset check" "bench network"; do
  # shellcheck disable=SC2086
  expect 0 "help of $verb" "$program" $verb --help-all
  section=$(awk -v title=".SH \"anchorsplat $verb\"" '$0 == title {on = 1; next} /^\.SH/ {on = 0} on' <<<"$page")
  for option in $(grep -oE '^  (-[a-zA-Z], |    )--[a-z0-9-]+' "$work/stdout" | grep -oE -- '--[a-z0-9-]+' | sort -u); do
    case "$option" in --help | --overwrite | --quiet | --json | --progress | --threads | --seed) continue ;; esac
    expect 0 "$option of $verb in the manual page" grep -qF -- "$option" <(printf '%s' "$section")
  done
done
if command -v groff >/dev/null; then
  expect 0 "roff" groff -man -Kutf8 -Tutf8 -wall -z "$prefix/share/man/man1/anchorsplat.1"
  silent stderr
fi

# What bash would offer after these words.
offers() {
  bash -c '. "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _anchorsplat; echo -n "${COMPREPLY[@]}"' bash \
    "$prefix/share/bash-completion/completions/anchorsplat" "$@"
}
expect 0 "bash: verbs" offers anchorsplat en
says stdout enhance
expect 0 "bash: options" offers anchorsplat enhance in.ply --camera
says stdout "--cameras --camera-rule"
expect 0 "bash: values" offers anchorsplat enhance --camera-rule ""
says stdout "median"
expect 0 "bash: values after =" offers anchorsplat enhance --camera-rule = sm
says stdout smallest
expect 0 "bash: verbs below" offers anchorsplat dataset bu
says stdout build
expect 0 "bash: files are for the shell" offers anchorsplat render info
silent stdout
if command -v zsh >/dev/null; then
  expect 0 "zsh: syntax" zsh -n "$prefix/share/zsh/site-functions/_anchorsplat"
fi

# THIRD_PARTY: every library that the program loads, and on the Debian that the copy in the sources was made on that copy.
if command -v dpkg-query >/dev/null; then
  expect 0 "third party" "$source/scripts/third-party.sh" "$installed" --names
  cp "$work/stdout" "$work/names"
  for name in assimp embree draco onetbb libpng1.6 highway cli11 webgpu-headers; do
    expect 0 "$name among the third parties" grep -qx "$name" "$work/names"
  done
  while read -r name; do
    expect 0 "$name in THIRD_PARTY" grep -qF "=== $name (" "$prefix/share/doc/anchorsplat/THIRD_PARTY"
    if grep -qs '^VERSION_CODENAME=bookworm' /etc/os-release; then
      expect 0 "$name in THIRD_PARTY of the sources" grep -qF "=== $name (" "$source/THIRD_PARTY"
    fi
  done <"$work/names"
fi
finish
