#!/usr/bin/env bash
# What a shell and a terminal see of the program, whatever the verb: exit codes, streams, pipes, characters:
# commandline_test.sh PROGRAM SOURCE_DIR. What verbs do is tested in src/doors/cli/*_test.cc.
. "$(dirname "$0")/expectations.sh"
scan=$work/scan.ply
"$program" convert "$input" "$scan" --max-gaussians 500 --sh-degree 1 -q || exit 1

# Every exit code, and which stream says what.
expect 0 "version" "$program" --version
says stdout "anchorsplat 0."
silent stderr
expect 0 "help" "$program" --help
silent stderr
expect 0 "done" "$program" info "$scan"
silent stderr
expect 1 "partly done" "$program" convert "$scan" "$work/none.ply" --out-dir "$work/some" --to spz
says stderr "1 of 2 files"
says stdout "scan.spz"
last_line() { "$program" "$@" 2>&1 | tail -n 1; }
expect 1 "partly done, into one stream" last_line convert "$scan" "$work/none.ply" --out-dir "$work/more" --to spz
says stdout "1 of 2 files failed"
expect 2 "no verb" "$program"
silent stdout
expect 2 "a word that is no verb" "$program" convrt "$input"
says stderr "did you mean 'convert'?"
expect 3 "no such file" "$program" info "$work/none.ply" --json
says stderr "none.ply"
says stdout '"not_found"'
echo none >"$work/text.ply"
expect 4 "no splat" "$program" info "$work/text.ply"
expect 5 "a file that exists" "$program" convert "$scan" "$work/some/scan.spz"
expect 6 "where no file can be written" "$program" convert "$scan" /proc/x.ply
expect 6 "a full disk under stdout" bash -c "'$program' info '$scan' >/dev/full"
says stderr "cannot write to standard output"

# Pipes, which can be read only once and have neither name nor size.
from_pipe() { cat "$piped" | "$program" "$@"; }
"$program" convert "$scan" "$work/scan.spz" -q && "$program" convert "$scan" "$work/scan.splat" -q || exit 1
piped=$work/scan.spz
expect 0 "convert from standard input" from_pipe convert - "$work/piped.ply" -q
expect 0 "convert from standard input by its name" from_pipe convert /dev/stdin "$work/piped2.ply" -q
expect 0 "both are the same" cmp "$work/piped.ply" "$work/piped2.ply"
piped=$work/scan.splat
expect 4 "a pipe of unknown kind" from_pipe convert - "$work/told.ply"
expect 0 "a pipe of a kind that is said" from_pipe convert - "$work/told.ply" --from .splat
says stdout "(splat, 16.0 kB)"
expect 0 "info of a pipe" from_pipe info - --from splat
# Packed ones, and the way out.
gzip -k "$work/scan.splat" && piped=$work/scan.splat.gz
expect 0 "a packed pipe, whose name is in it" from_pipe convert - "$work/unpacked.ply" -q
expect 0 "it is the same" cmp "$work/told.ply" "$work/unpacked.ply"
expect 2 "a pipe twice" from_pipe compare - - --orbit 2
says stderr "standard input is a pipe and was read already"
expect 2 "no folder for outputs" "$program" convert "$scan" --out-dir - --to spz
says stderr "--out-dir -: means standard output"
expect 2 "nor of enhance" "$program" enhance "$scan" --out-dir - --method filter
out() { "$program" "$@" >"$work/out" 2>"$work/err"; }
expect 0 "convert to standard output" out convert "$scan" - --to spz
expect 0 "it is what goes to a file" cmp "$work/scan.spz" "$work/out"
expect 0 "what is said goes to stderr" grep -q "standard output (SPZ" "$work/err"
expect 2 "no format is said" "$program" convert "$work/scan.spz" -
expect 0 "a PLY" out convert "$work/scan.spz" - --to ply
expect 0 "it begins as one" grep -qa "^ply" "$work/out"
expect 0 "through two pipes" bash -c "'$program' convert '$scan' - --to .ply -q | '$program' convert - - --to .spz -q | cmp - '$work/scan.spz'"
expect 0 "enhance to standard output" out enhance "$scan" -o - --to splat --method filter --pixel-size 0.01
expect 0 "a splat came out" "$program" info "$work/out" --from splat -q
expect 0 "a page to standard output" out view "$scan" -o -
expect 0 "it is one" grep -q "<html" "$work/out"
expect 0 "a picture to standard output" out render "$scan" -o - --orbit 1 --size 32x32
expect 0 "it is one" grep -qa "PNG" "$work/out"
cp "$work/out" "$work/picture.png"
expect 3 "no network to enlarge it with" "$program" upscale "$work/picture.png" -o "$work/large" --network "$work/none"
says stderr "none"
expect 4 "no network is a picture" "$program" upscale "$work/picture.png" -o "$work/large" --network "$work/picture.png"
expect 2 "enlarged with nothing" "$program" upscale "$work/picture.png" -o "$work/large"
says stderr "--network"
expect 1 "nothing was made" test -e "$work/large"
expect 2 "with JSON" "$program" convert "$scan" - --to ply --json
says stderr "--json and -o - both need standard output"
expect 2 "several files" "$program" convert "$scan" - --to gltf
says stderr "writes several files"
expect 2 "levels of detail" "$program" convert "$scan" - --to ply --lod
expect 2 "no format" "$program" convert "$scan" - --to obj
expect 2 "a format for a file" "$program" enhance "$scan" -o "$work/x.ply" --to spz
expect 6 "a full disk under it" bash -c "'$program' convert '$scan' - --to ply >/dev/full"
says stderr "cannot write to standard output"
expect 6 "nobody reads it" bash -c "set -o pipefail; '$program' convert '$input' - --to ply 2>'$work/err' | head -c 1 >/dev/null; exit \${PIPESTATUS[0]}"
expect 4 "nothing comes out of a bad file" out convert "$work/text.ply" - --to ply -q
expect 0 "not a byte" test ! -s "$work/out"
if command -v script >/dev/null; then
  expect 2 "a terminal" script -qec "'$program' convert '$scan' - --to ply" /dev/null
fi
expect 2 "a picture of a comparison is a file" "$program" compare "$scan" "$scan" --orbit 2 --side-by-side -
test -e "$work/-" -o -e ./- && echo "FAILED: there is a file called -" && failures=$((failures + 1))
over_input() { "$program" convert - "$work/own.ply" -w -q <"$work/own.ply"; }
cp "$scan" "$work/own.ply"
expect 2 "convert over standard input" over_input
says stderr "write to another name"
expect 0 "it is what it was" cmp "$scan" "$work/own.ply"

# Edits: their order, several inputs, what is said.
edit() { "$program" convert "$@"; }
expect 0 "edits" edit "$scan" "$work/edited.ply" -t 1,0,0 --filter-box 1,-,-,-,-,- -F --filter-harmonics 0
says stdout "axes of edits: LUF: x left, y up, z forward"
says stdout "--filter-box 1,-,-,-,-,-: "
says stdout " Gaussians removed, "
expect 0 "the other way round" edit "$scan" "$work/other.ply" --filter-box 0,-,-,-,-,- -t 1,0,0 -F -H 0 --json
says stdout '"action": "--filter-box 0,-,-,-,-,-"'
expect 0 "it is the same" cmp "$work/edited.ply" "$work/other.ply"
expect 0 "forth" edit "$scan" "$work/forth.ply" --mirror x --scale 2 -q
expect 0 "and back" edit "$work/forth.ply" "$work/back.ply" --scale 0.5 --mirror x -q
expect 0 "it is where it was" "$program" compare "$scan" "$work/back.ply" --orbit 2 --size 64x64
expect 0 "merged" edit "$scan" --translate=-1,0,0 "$scan" "$work/merged.ply" --filter-nan
says stdout "1,000 Gaussians of SH degree 1 in, 1,000 of degree 1 out"
expect 0 "merged from a pipe to a pipe" bash -c "'$program' convert - '$scan' - --to spz <'$scan' >'$work/out'"
says stderr "1,000 of degree 1 out"
expect 0 "only counted" edit "$scan" --dry-run -V opacity,gt,0.5 -q
says stdout " out (PLY, "
says stdout "; nothing was written"
expect 0 "how large it would be" edit "$scan" --dry-run -H 0 --json
says stdout '"predicted": '
expect 0 "counted for a name that is there" edit "$scan" "$work/merged.ply" --dry-run
expect 0 "nothing of it changed" "$program" info "$work/merged.ply"
says stdout "1,000"
expect 0 "many" edit "$scan" "$work/merged.ply" --out-dir "$work/many" --scale 2 -q
expect 0 "as splat-transform counts" edit "$scan" "$work/luf.ply" --translate 1,2,3 --json
says stdout '"axes": "LUF"'
expect 0 "as info counts" edit "$scan" "$work/rdf.ply" --action-axes RDF --translate=-1,-2,3 --scale 1
says stdout "axes of edits: RDF: x right, y down, z forward"
expect 0 "both are the same" cmp "$work/luf.ply" "$work/rdf.ply"
for bad in --scale=1,2,3 --scale=0 --scale=-1 --rotate=1,2 --mirror=w --up=0,0,0 --filter-sphere=0,0,0,-1 --filter-value=none,gt,1 \
  --filter-value=opacity,gt --filter-value=opacity,gt,nan --filter-harmonics=4 --filter-floaters=0 --filter-box=1,1,1,0,0,0 --action-axes=xyz \
  --translate=1e999,0,0 --translate= --filter-sphere=90,0,0,1; do
  expect 2 "$bad" edit "$scan" "$work/bad.ply" "$bad"
  says stderr "${bad%%=*}"
done
expect 2 "weights" edit "$scan" "$work/bad.safetensors" --scale 2
says stderr "edits and --dry-run work on splats"
expect 2 "no value" edit "$scan" "$work/bad.ply" --translate
expect 2 "an input among several" edit "$scan" "$work/back.ply" "$work/back.ply" -w
expect 3 "one that is not there" edit "$scan" "$work/none.ply" "$work/bad.ply"
expect 5 "a file that exists" edit "$scan" "$work/back.ply" --scale 2
test -e "$work/bad.ply" && echo "FAILED: there is a bad.ply" && failures=$((failures + 1))

# Nothing that is printed commands a terminal: neither names of files nor those of views.
clean() {
  checks=$((checks + 1))
  for stream in stdout stderr; do
    ! LC_ALL=C grep -q $'[\x01-\x08\x0b-\x1f\x7f]' "$work/$stream" && ! grep -qP '\xc2[\x80-\x9f]' "$work/$stream" && continue
    failures=$((failures + 1))
    echo "FAILED: $stream commands the terminal:"
    cat -v "$work/$stream"
  done
}
wild=$'\x1b[2J\x9b2J\n\x7f'
folder=$work/$wild
mkdir "$folder"
expect 0 "convert" "$program" convert "$scan" "$folder/$wild.ply"
clean
says stdout '\x1b[2J\x9b2J\x0a\x7f.ply'
expect 0 "info" "$program" info "$folder/$wild.ply"
clean
cp "$folder/$wild.ply" "$folder/"$'\xc2\x9b\x7f.ply'
expect 0 "info as JSON" "$program" info "$folder/"$'\xc2\x9b\x7f.ply' --json
clean
says stdout '\u009b\u007f.ply'
expect 3 "a name that is not there" "$program" info "$work/"$'\x1b[2J\xff.ply'
clean
expect 0 "enhance" "$program" enhance "$folder/$wild.ply" -o "$folder/2$wild.ply" --pixel-size 0.0055 --method filter --view
clean
expect 0 "view" "$program" view "$folder/$wild.ply" -o "$folder/3$wild.html"
clean
printf '[{"id":0,"img_name":"\\u001b[2J\\u009b|a","width":64,"height":64,"position":[0,0,-1.7],"rotation":[[1,0,0],[0,1,0],[0,0,1]],"fx":64,"fy":64}]' >"$work/wild.json"
expect 0 "render" "$program" render "$folder/$wild.ply" -o "$folder/views" --cameras "$work/wild.json"
clean
expect 0 "compare" "$program" compare "$folder/$wild.ply" "$scan" --cameras "$work/wild.json"
clean
says stdout '\x1b[2J\xc2\x9b|a'
expect 0 "compare with truth" "$program" compare "$folder/$wild.ply" "$scan" --truth "$folder/$wild.ply" --cameras "$work/wild.json"
clean
expect 0 "help" "$program" enhance --help
clean
mkdir -p "$work/benchmark/$wild"
cp -r "$source/examples/biplane/." "$work/benchmark/$wild/"
expect 0 "eval" "$program" eval "$work/benchmark" -o "$work/eval" --methods raw --max-views 1
clean
cp "$work/eval/table.md" "$work/stdout"
clean
says stdout '\x1b[2J'

# Devices. What was asked for is had or said; nothing is done on the CPU silently.
without_library() { env ANCHORSPLAT_WEBGPU="$work/none.so" "$program" "$@"; }
picture=(render "$scan" --orbit 1 --size 48x48 -w)
expect 2 "a word that is no device" "$program" "${picture[@]}" -o "$work/cpu.png" --device tpu
says stderr "'tpu' is not cpu, gpu, auto or the number of an adapter"
expect 2 "less memory than work needs" "$program" "${picture[@]}" -o "$work/cpu.png" --max-gpu-memory 1M
expect 3 "no library" without_library "${picture[@]}" -o "$work/gpu.png" --device gpu
says stderr "none.so"
expect 1 "nothing was drawn" test -e "$work/gpu.png"
expect 3 "no library for a number" without_library "${picture[@]}" -o "$work/gpu.png" --device 0 --json
says stdout '"not_found"'
expect 0 "the CPU needs none" without_library "${picture[@]}" -o "$work/cpu.png" --device cpu
expect 0 "auto does without" without_library "${picture[@]}" -o "$work/auto.png" --device auto --json
says stdout '"name": "cpu"'
silent stderr
expect 0 "it is the CPU's picture" cmp "$work/cpu.png" "$work/auto.png"
expect 1 "doctor with a library that is named and not there" without_library doctor
says stdout "GPU            broken: "
expect 0 "a GPU" "$program" "${picture[@]}" -o "$work/gpu.png" --device gpu --json
says stdout '"backend": '
expect 3 "no adapter of this number" "$program" "${picture[@]}" -o "$work/gpu.png" --device 1000
says stderr "1000"
expect 0 "doctor" "$program" doctor
says stdout "GPU            0: "
expect 0 "doctor as JSON" "$program" doctor --json
says stdout '"max_binding_bytes"'

# train starts another program, where there is LibTorch.
printf '[optimizer]\nclip = -1\n' >"$work/recipe.toml"
if [ -x "$(dirname "$program")/anchorsplat-train" ]; then
  expect 4 "a bad recipe" "$program" train "$work" --config "$work/recipe.toml" -o "$work/run"
  says stderr "recipe.toml: line 2: optimizer.clip: expected a number from 0"
  expect 0 "help of the training program" "$(dirname "$program")/anchorsplat-train" train --help
else
  expect 3 "no LibTorch" "$program" train "$work" --config "$work/recipe.toml" -o "$work/run" --json
  says stderr "this program was built without LibTorch"
fi

finish
