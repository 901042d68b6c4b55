#!/usr/bin/env bash
# No file is lost: inputs stay, nothing is replaced that was not to be, names that cannot be are errors:
# files_test.sh PROGRAM SOURCE_DIR.
. "$(dirname "$0")/expectations.sh"

# stays NAME FILE... -- COMMAND...: the command is refused, and the files are what they were.
stays() {
  local name=$1 files=()
  shift
  while [ "$1" != -- ]; do files+=("$1"); shift; done
  shift
  local before after
  before=$(cat "${files[@]}" | md5sum)
  expect 2 "$name" "$@"
  says stderr "write to another name"
  after=$(cat "${files[@]}" | md5sum)
  checks=$((checks + 1))
  [ "$before" = "$after" ] || { failures=$((failures + 1)); echo "FAILED: $name destroyed an input"; }
}

"$program" convert "$input" "$work/scan.ply" --max-gaussians 300 --sh-degree 1 -q || exit 1
scan=$work/scan.ply

# The buffer of a glTF file is one of several files that are written.
cp "$scan" "$work/z.bin"
stays "convert to a glTF whose buffer is the input" "$work/z.bin" -- "$program" convert "$work/z.bin" "$work/z.gltf" -w
stays "enhance to a glTF whose buffer is the input" "$work/z.bin" -- "$program" enhance "$work/z.bin" -o "$work/z.gltf" --pixel-size 0.0055 -w
"$program" convert "$scan" "$work/a.gltf" -q && mv "$work/a.bin" "$work/b.bin" && sed -i 's/a\.bin/b.bin/' "$work/a.gltf"
stays "convert to a glTF over the buffer of the input" "$work/b.bin" "$work/a.gltf" -- "$program" convert "$work/a.gltf" "$work/b.gltf" -w
mkdir "$work/batch" && ln "$work/b.bin" "$work/batch" && cp "$scan" "$work/b.ply"
stays "a batch over the buffer of a later input" "$work/b.bin" -- "$program" convert "$work/b.ply" "$work/a.gltf" --out-dir "$work/batch" --to gltf -w

# The pictures of a SOG, also through links.
mkdir "$work/A" "$work/L" "$work/H"
"$program" convert "$scan" "$work/A/meta.json" -q && mv "$work/A/meta.json" "$work/A/old.json"
stays "a SOG over the pictures of the input" "$work"/A/*.webp -- "$program" convert "$work/A/old.json" "$work/A/meta.json" -w
ln -s "$work"/A/*.webp "$work/L"
stays "a SOG over the pictures of the input, by links" "$work"/A/*.webp -- "$program" convert "$work/A/old.json" "$work/L/meta.json" -w
ln "$work"/A/*.webp "$work/H"
stays "a SOG over the pictures of the input, by hard links" "$work"/A/*.webp -- "$program" convert "$work/A/old.json" "$work/H/meta.json" -w

# Pictures of compare, and of cameras that are read.
mkdir -p "$work/P" "$work/project/lr"
"$program" render "$scan" -o "$work/P" --orbit 2 --size 32x32 -q || exit 1
one=$(ls -d "$work"/P/* | head -n 1) two=$(ls -d "$work"/P/* | tail -n 1)
stays "side by side over a picture" "$one" -- "$program" compare "$one" "$two" --side-by-side "$one" -w
ln "$one" "$work/P/link"
ln -s "$one" "$work/linked.png"
stays "side by side over a link to a picture" "$one" -- "$program" compare "$one" "$two" --side-by-side "$work/linked.png" -w
"$program" render "$input" -o "$work/project/hr" --cameras "$cameras" --size 32x32 -q || exit 1
sed -e 's/"w": 1024/"w": 32/; s/"h": 1024/"h": 32/' "$cameras" >"$work/project/transforms.json"
picture=$(ls -d "$work"/project/hr/* | head -n 1)
stays "render over the pictures of the cameras" "$work"/project/hr/* -- "$program" render "$scan" --cameras "$work/project/transforms.json" -o "$work/project/hr" -w
stays "a page over a picture" "$picture" -- bash -c "ln -s '$picture' '$work/page.html' && '$program' view '$scan' -o '$work/page.html' --truth '$work/project/hr' --cameras '$work/project/transforms.json' -w"
fit() { "$program" fit "$work/project" --init-points 100 --hold-out 5 --steps 20 "$@"; }
stays "a gsplat checkpoint over a picture" "$work"/project/hr/* -- fit -o "$work/x.ply" --gsplat-checkpoint "$picture" -w
stays "a checkpoint over a picture" "$work"/project/hr/* -- fit -o "$work/x.ply" --checkpoint "$picture" -w
stays "a fit over its first splat" "$scan" -- fit -o "$scan" --init-splat "$scan" -w
checks=$((checks + 1))
cp "$scan" "$work/piped.ply"
"$program" convert - "$work/piped.ply" -w -q <"$work/piped.ply" 2>"$work/stderr"
[ $? -eq 2 ] && cmp -s "$scan" "$work/piped.ply" || { failures=$((failures + 1)); echo "FAILED: convert over standard input"; }

# What a verb left itself is replaced.
for time in first second; do
  expect 0 "convert, the $time time" "$program" convert "$scan" "$work/again.gltf" -w
  expect 0 "enhance, the $time time" "$program" enhance "$scan" -o "$work/again.ply" --pixel-size 0.0055 --method filter --view -w
  expect 0 "render, the $time time" "$program" render "$scan" -o "$work/renders" --cameras "$work/project/transforms.json" -w
  expect 0 "compare, the $time time" "$program" compare "$one" "$two" --side-by-side "$work/sides.png" -w
  expect 0 "fit, the $time time" fit -o "$work/fit.ply" --gsplat-checkpoint "$work/fit.pt" -w
  expect 0 "eval, the $time time" "$program" eval "$source/examples" -o "$work/eval" --objects biplane --max-views 1 --methods raw --seed "$([ $time = first ] && echo 1 || echo 2)"
done

# A folder that is no object of the data set is not replaced by one, nor one that holds what the object is made of.
printf 'v -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 1\nf 1 2 3 4\n' >"$work/quad.obj"
small=(--views 8 --size 24 --low-size 12 --points 60 --steps 20 --max-gaussians 100 --min-psnr 0)
mkdir -p "$work/set/quad" && echo mine >"$work/set/quad/file"
expect 1 "a folder in the way of an object" "$program" dataset build "$work/quad.obj" -o "$work/set" "${small[@]}"
expect 0 "says what it is" grep -q "is in the way of the object's folder" "$work/set/failures.jsonl"
expect 0 "it is still there" grep -q mine "$work/set/quad/file"
rm -r "$work/set"
for time in first second; do
  expect 0 "dataset build, the $time time" "$program" dataset build "$work/quad.obj" -o "$work/set" "${small[@]}" -w
  expect 0 "dataset split, the $time time" "$program" dataset split "$work/set" -w
done
cp "$work/quad.obj" "$work/kept.obj" && mv "$work/quad.obj" "$work/set/quad/" && ln -s set/quad/quad.obj "$work/quad.obj"
expect 1 "an object that holds its source" "$program" dataset build "$work/quad.obj" -o "$work/set" "${small[@]}" -w
expect 0 "the source is still there" cmp "$work/kept.obj" "$work/set/quad/quad.obj"

# A file that comes into being while a fit runs, and what a fit that goes on may replace.
running() {
  "$program" fit "$work/project" --init-points 100 --hold-out 5 --steps 2000 --max-gaussians 100 --checkpoint-every 1 --checkpoint "$work/state" "$@" &
  local child=$!
  while kill -0 $child 2>/dev/null && [ ! -e "$work/state" ]; do :; done
  [ -z "$meanwhile" ] || echo theirs >"$meanwhile"
  kill -INT $child
  wait $child
}
resume() { "$program" fit "$work/project" --init-points 100 --hold-out 5 --steps 2000 --max-gaussians 100 --checkpoint "$work/state" --resume -q "$@"; }
meanwhile=$work/taken.ply
expect 5 "a file that came into being meanwhile" running -o "$work/taken.ply" -q
says stderr "taken-2.ply"
expect 0 "it is what it was" grep -q theirs "$work/taken.ply"
expect 0 "and the work is kept" "$program" info "$work/taken-2.ply"
expect 5 "going on over a file that the interruption did not leave" resume -o "$work/taken.ply"
expect 0 "it is still what it was" grep -q theirs "$work/taken.ply"
rm "$work/state"
meanwhile=
expect 130 "an interrupted fit" running -o "$work/mine.ply" -q
echo theirs >"$work/other.ply" && cp "$work/other.ply" "$work/other.pt"
expect 5 "going on with another output" resume -o "$work/other.ply"
says stderr "other.ply: exists; -w replaces it"
expect 5 "going on with another gsplat checkpoint" resume -o "$work/mine.ply" --gsplat-checkpoint "$work/other.pt"
says stderr "other.pt: exists; -w replaces it"
expect 0 "they are what they were" cmp "$work/other.ply" "$work/other.pt"
expect 0 "going on with its own output" resume -o "$work/mine.ply"

# Names that are too long and links that lead nowhere are errors like others, for every path of every verb.
long=$work/$(printf 'x%.0s' $(seq 300))
ln -s loop2 "$work/loop1" && ln -s loop1 "$work/loop2"
no_report() {
  "$program" "$@" >"$work/stdout" 2>"$work/stderr" </dev/null
  local code=$?
  checks=$((checks + 1))
  if [ $code -gt 6 ] || grep -q "please report" "$work/stderr"; then
    failures=$((failures + 1))
    echo "FAILED with code $code: $*"
    head -n 3 "$work/stderr"
  fi
  return $code
}
refused() {
  no_report "$@"
  if [ $? -lt 2 ]; then
    failures=$((failures + 1))
    echo "FAILED to refuse: $*"
  fi
}
project=$work/project
printf '[optimizer]\n' >"$work/recipe.toml"
for bad in "$long" "$work/loop1" "$work/loop1/deeper"; do
  for extension in "" .ply .json .obj; do
    path=$bad$extension
    ln -sfn "$(basename "$path")" "$path" 2>/dev/null  # a link to itself, where that can be made
    refused info "$path"
    refused convert "$path" "$work/new.ply"
    refused convert "$scan" --out-dir "$path" --to ply
    refused enhance "$path" -o "$work/new.ply"
    refused enhance "$scan" --out-dir "$path"
    refused enhance "$scan" -o "$work/new.ply" --cameras "$path"
    refused enhance "$scan" -o "$work/new.ply" --model "$path"
    refused enhance "$scan" -o "$work/new.ply" --pixel-size 0.0055 --images "$path"
    refused render "$path" -o "$work/new.png" --orbit 1
    refused render "$scan" -o "$work/new.png" --cameras "$path"
    refused render "$scan" -o "$path" --orbit 2 --size 8x8
    refused compare "$path" "$scan" --orbit 1
    refused compare "$scan" "$scan" --truth "$path" --orbit 1
    refused eval "$path" -o "$work/neweval"
    refused eval "$source/examples" -o "$path"
    refused view "$path" -o "$work/new.html"
    refused view "$scan" -o "$work/new.html" --before "$path"
    refused view "$scan" -o "$work/new.html" --cameras "$path"
    refused view "$scan" -o "$work/new.html" --cameras "$project/transforms.json" --truth "$path"
    refused fit "$path" -o "$work/new.ply"
    refused fit "$project" -o "$work/new.ply" --init-splat "$path"
    refused views "$path" -o "$work/newviews"
    refused views "$work/quad.obj" -o "$path" --views 2 --size 8 --low-size 4
    refused dataset build "$work/quad.obj" -o "$path"
    refused dataset build --list "$path" --objects "$work" -o "$work/newset"
    refused dataset build "$work/quad.obj" --recipe "$path" -o "$work/newset"
    refused dataset split "$path"
    refused dataset check "$path"
    refused dataset info "$path"
    refused train "$path" --config "$work/recipe.toml" -o "$work/run"
    refused train "$project" --config "$path" -o "$work/run"
    refused bench pixel-size "$path"
  done
  for extension in .gltf .safetensors .png .html .pt; do ln -sfn "$(basename "$bad$extension")" "$bad$extension" 2>/dev/null; done
  refused convert "$scan" "$bad.ply"
  refused convert "$scan" "$bad.gltf"
  refused convert "$scan" "$bad/meta.json"
  refused convert "$source/testdata/compact/small.safetensors" "$bad.safetensors"
  refused enhance "$scan" -o "$bad.ply"
  refused render "$scan" -o "$bad.png" --orbit 1 --size 8x8
  refused compare "$scan" "$scan" --orbit 1 --size 8x8 --side-by-side "$bad.png"
  refused view "$scan" -o "$bad.html"
  refused fit "$project" -o "$bad.ply" --steps 2
  refused fit "$project" -o "$work/new.ply" --steps 2 --gsplat-checkpoint "$bad.pt"
  no_report fit "$project" -o "$work/checked.ply" --steps 2 --checkpoint "$bad" -w
  no_report fit "$project" -o "$work/checked.ply" --steps 2 --checkpoint "$bad" --resume -w
  no_report enhance "$scan" -o "$work/checked.ply" --method refine --pixel-size 0.0055 --steps 1 --poses 8 --checkpoint "$bad" --resume -w
done
expect 0 "nothing came into being" bash -c "! ls -d '$work'/new* 2>/dev/null"

finish
