#!/usr/bin/env bash
# Usage, and what is done with splats: splats_test.sh PROGRAM SOURCE_DIR.
. "$(dirname "$0")/expectations.sh"

# Help, version, usage errors.
expect 0 "version" "$program" --version
says stdout "anchorsplat 0."
expect 0 "help" "$program" --help
for verb in enhance convert info render compare view views fit train bench; do
  says stdout "$verb"
  expect 0 "help of $verb" "$program" $verb --help
  says stdout "Example:"
  expect 0 "help again" "$program" --help
done
expect 2 "no verb" "$program"
expect 2 "unknown verb" "$program" polish
expect 2 "unknown flag" "$program" info "$input" --colour

# convert.
for to in compressed.ply spz sog splat glb gltf csv npz; do
  expect 0 "convert to $to" "$program" convert "$input" "$work/scan.$to" --max-gaussians 500 --sh-degree 1
  says stdout "500 of degree $([ $to = splat ] && echo 0 || echo 1) out"
done
for from in compressed.ply spz sog splat glb gltf; do
  expect 0 "info of $from" "$program" info "$work/scan.$from"
  says stdout "500"
done
expect 0 "info of an SPZ" "$program" info "$work/scan.spz" --json
says stdout '"positions": "1'
says stdout '"version": "4, a zstd stream per attribute"'
expect 0 "info of a GLB" "$program" info "$work/scan.glb"
says stdout "kernel  ellipse"
expect 0 "info of a SOG" "$program" info "$work/scan.sog"
says stdout "a ZIP archive"
expect 0 "convert with a report" "$program" convert "$work/scan.compressed.ply" "$work/again.spz" --report --spz-version 3
says stdout "PSNR"
expect 0 "convert a batch" "$program" convert "$work/scan.glb" "$work/again.spz" --out-dir "$work/batch" --to .x.ply --json
says stdout '"gaussians"'
expect 5 "convert over a file" "$program" convert "$input" "$work/scan.spz"
expect 2 "convert without a place to write" "$program" convert "$input"
expect 2 "convert with axes that are none" "$program" convert "$input" "$work/b.ply" --coords XYZ
expect 2 "convert with empty axes" "$program" convert "$input" "$work/b.ply" --coords ""
says stderr "--coords"
expect 2 "convert to no Gaussians" "$program" convert "$input" "$work/b.ply" --max-gaussians 0
says stderr "1 or more"
expect 1 "one bad file does not stop the others" "$program" convert "$work/scan.glb" "$work/none.ply" "$work/again.spz" --out-dir "$work/some" --to ply -w --json
says stderr "1 of 3 files"
says stdout '"failure"'
says stdout '"not_found"'
checks=$((checks + 1))
[ "$(grep -c '"gaussians"' "$work/stdout")" -eq 2 ] || { failures=$((failures + 1)); echo "FAILED: both good files should be reported"; }
expect 2 "a batch to no format" "$program" convert "$work/scan.glb" --out-dir "$work/some" --to obj
says stderr "--to"
expect 0 "a batch of folders" "$program" convert "$work/scan.glb" --out-dir "$work/folders" --to meta.json
expect 0 "info of a folder" "$program" info "$work/folders/scan/meta.json"
expect 0 "a folder by its name" "$program" convert "$work/folders/scan/meta.json" --out-dir "$work/folders" --to spz
expect 5 "folder and name" "$program" convert "$work/folders/scan/meta.json" "$work/folders/scan.spz"
expect 2 "half a meta.json" "$program" convert "$work/scan.glb" "$work/scan-meta.json"
expect 0 "harmonics without a place are said" "$program" convert "$work/scan.glb" "$work/dull.splat"
says stderr "harmonics beyond degree 0"
says stdout "of degree 0 out"
expect 0 "a report of what is not read" "$program" convert "$work/scan.glb" "$work/report.csv" --report
says stderr "nothing to compare"
checks=$((checks + 1))
"$program" convert - "$work/piped.ply" -q <"$work/scan.spz" && cat "$work/scan.spz" | "$program" convert /dev/stdin "$work/piped.ply" -w -q ||
  { failures=$((failures + 1)); echo "FAILED: convert from standard input"; }
expect 2 "convert to standard output" "$program" convert "$input" -
# What it is where neither content nor name tells.
from_pipe() { cat "$work/scan.splat" | "$program" "$@"; }
expect 4 "a pipe of unknown kind" from_pipe convert - "$work/told.ply"
expect 0 "a pipe of a kind that is said" from_pipe convert - "$work/told.ply" --from .splat
says stdout "(splat, 16.0 kB)"
expect 0 "info of a pipe" from_pipe info - --from splat
expect 2 "from no format" from_pipe info - --from csv
says stderr "--from: 'csv' is no format that is read"
# Folders.
expect 0 "info of a folder by its name" "$program" info "$work/folders/scan"
says stdout "SOG"
expect 0 "a folder by its name alone" "$program" convert "$work/folders/scan/" --out-dir "$work/named" --to glb
expect 0 "it is called like the folder" test -s "$work/named/scan.glb"
expect 0 "a page of a folder" "$program" view "$work/folders/scan/" -o "$work/folder.html"
expect 4 "a folder that is no splat" "$program" info "$work"
says stderr "without a meta.json"
# The input is not lost.
cp "$work/scan.spz" "$work/own.spz"
ln -s own.spz "$work/link.spz"
for output in own.spz link.spz; do
  expect 2 "convert over its own input, $output" "$program" convert "$work/own.spz" "$work/$output" -w
  says stderr "write to another name"
done
expect 2 "a batch over its own input" "$program" convert "$work/scan.glb" "$work/own.spz" --out-dir "$work" --to spz -w
expect 2 "enhance over its own input" "$program" enhance "$work/own.spz" -o "$work/link.spz" -w --pixel-size 0.0055
says stderr "write to another name"
expect 2 "enhance over its own input, by folder" "$program" enhance "$work/own.spz" --out-dir "$work" -w --pixel-size 0.0055
expect 0 "the input is as it was" cmp "$work/scan.spz" "$work/own.spz"
# Values that are none.
expect 2 "an opacity that is no number" "$program" convert "$input" "$work/b.ply" --min-opacity nan
says stderr "from 0 to 1"
head -c 3200 "$source/src/cli/behaviour/splats_test.sh" >"$work/text.splat"
expect 4 "text is no splat" "$program" info "$work/text.splat"
says stderr "is no .splat file"
: >"$work/empty.splat"
expect 4 "an empty file" "$program" info "$work/empty.splat"
says stderr "empty.splat: is empty"
{
  printf 'ply\nformat ascii 1.0\nelement vertex 2\n'
  for name in x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3; do echo "property float $name"; done
  printf 'end_header\n'
  for _ in 1 2; do echo 0 nan 0 0 0 0 0 -5 -5 -5 1 0 0 0; done
} >"$work/nan.ply"
expect 0 "info of NaN" "$program" info "$work/nan.ply"
says stdout "2 of 2 Gaussians with NaN"
checks=$((checks + 1))
! tail -n +2 "$work/stdout" | grep -v "with NaN" | grep -i "nan" || { failures=$((failures + 1)); echo "FAILED: info shows NaN"; }
expect 4 "a page of NaN" "$program" view "$work/nan.ply" -o "$work/nan.html"
says stderr "nan.ply: there is nothing to show"
expect 0 "convert of NaN says so" "$program" convert "$work/nan.ply" "$work/nan.csv"
says stderr "2 of 2 Gaussians have"
expect 3 "bytes of a name that could command a terminal" "$program" info "$work/"$'\x1b[2J\xff.ply'
says stderr '\x1b[2J\xff.ply: no such file'

# enhance.
expect 0 "enhance" "$program" enhance "$input" -o "$work/out.ply" --pixel-size 0.0055 --method filter
says stdout "20,000 Gaussians in, 20,000 out"
expect 5 "enhance does not overwrite" "$program" enhance "$input" -o "$work/out.ply" --pixel-size 0.0055
says stderr "exists"
expect 0 "enhance overwrites when told" "$program" enhance "$input" -o "$work/out.ply" --pixel-size 0.0055 -w -q
silent stdout
expect 0 "enhance with cameras" "$program" enhance "$input" -o "$work/cameras.ply" --cameras "$source/examples/biplane/transforms_lr.json" --json
says stderr "--camera-rule median: the cameras look at one thing from all around"
says stdout '"source": "cameras"'
says stdout '"camera_rule": "median"'
expect 0 "enhance with estimated pixel size" "$program" enhance "$input" -o "$work/auto.ply"
says stderr "estimated"
expect 0 "what contradicts the estimate" "$program" info "$input" --json
says stdout '"contradictions": []'
expect 0 "upscale 1 changes nothing" "$program" enhance "$input" -o "$work/same.ply" --upscale 1 --pixel-size 1
expect 0 "upscale 1 against its input" "$program" compare "$input" "$work/same.ply" --orbit 2 --size 64x64 --json
says stdout '"psnr": null'
expect 0 "enhance with a page" "$program" enhance "$input" -o "$work/viewed.ply" --pixel-size 0.0055 --view
says stdout "viewed.html: "
checks=$((checks + 1))
grep -q '<html' "$work/viewed.html" || { failures=$((failures + 1)); echo "FAILED: --view wrote no page"; }
expect 5 "the page is not overwritten" "$program" enhance "$input" -o "$work/viewed.splat" --pixel-size 0.0055 --view
expect 3 "a model that is not there" "$program" enhance "$input" -o "$work/bad.ply" --model "$work/none.pth"
expect 4 "a splat as a model" "$program" enhance "$input" -o "$work/bad.ply" --model "$input"
expect 2 "an empty model" "$program" enhance "$input" -o "$work/bad.ply" --model ""
expect 2 "model options without a model" "$program" enhance "$input" -o "$work/bad.ply" --precision bf16
expect 0 "the built-in network without the invisible" "$program" enhance "$input" -o "$work/pruned.ply" --pixel-size 0.0055 --prune-opacity 0.1 --json
checks=$((checks + 1))
grep -q '"pruned": [1-9]' "$work/stdout" || { failures=$((failures + 1)); echo "FAILED: --prune-opacity left nothing out"; }
expect 0 "a splat that has been enhanced" "$program" enhance "$work/pruned.ply" -o "$work/twice.ply" --pixel-size 0.0055
says stderr "enhanced already"
expect 0 "it stays as it is" cmp "$work/pruned.ply" "$work/twice.ply"
compact=$source/testdata/compact/small.safetensors
expect 0 "a compact network" "$program" enhance "$input" -o "$work/compact.ply" --model "$compact" --cameras "$source/examples/biplane/transforms_lr.json"
says stdout "20,000 Gaussians in, 40,000 out; model"
expect 0 "what is in a compact network" "$program" info "$compact"
says stdout "anchorsplat-compact"
expect 0 "the network that is part of the program" "$program" enhance "$input" -o "$work/shipped.ply" --pixel-size 0.0055
says stdout "20,000 Gaussians in, 80,000 out; model"
expect 0 "what is in it" "$program" info "$source/models/anchorsplat-compact.safetensors" --json
says stdout '"object_names"'
expect 4 "the same cut short" bash -c "head -c 400000 '$source/models/anchorsplat-compact.safetensors' >'$work/cut2.safetensors' && '$program' info '$work/cut2.safetensors'"
expect 0 "a compact network, then refinement" "$program" enhance "$input" -o "$work/compact.ply" -w --model "$compact" --pixel-size 0.0055 --method model+refine --steps 1 --poses 8 --json
says stdout '"method": "model+refine"'
expect 2 "options of the other architecture" "$program" enhance "$input" -o "$work/bad.ply" --model "$compact" --pixel-size 0.0055 --normalisation bbox
says stderr "--normalisation has no effect with --method model, which auto chose; it has one with a network of the published architecture"
# Options that would change nothing are refused, with the words for where they would.
expect 2 "blocks of a compact network" "$program" enhance "$input" -o "$work/bad.ply" --model "$compact" --pixel-size 0.0055 --block-gaussians 5000
says stderr "--block-gaussians has no effect"
expect 2 "a model for the filter" "$program" enhance "$input" -o "$work/bad.ply" --model "$compact" --pixel-size 0.0055 --method filter
says stderr "--model has no effect with --method filter; it has one with --method model"
expect 2 "pruning by the filter" "$program" enhance "$input" -o "$work/bad.ply" --prune-opacity 0.1 --pixel-size 0.0055 --method filter
says stderr "--prune-opacity has no effect"
expect 2 "pruning with pictures and the filter" "$program" enhance "$input" -o "$work/bad.ply" --prune-opacity 0.1 --method filter+refine-images --images "$source/examples/biplane/transforms_lr.json" --steps 1
says stderr "--prune-opacity has no effect with --method filter+refine-images; it has one with --method model"
expect 2 "places without a refinement" "$program" enhance "$input" -o "$work/bad.ply" --poses 5 --pixel-size 0.0055
says stderr "which auto chose; it has one with --method refine or refine-images"
expect 2 "places where cameras say them" "$program" enhance "$input" -o "$work/bad.ply" --poses 5 --method refine --cameras "$cameras"
says stderr "without --images and --cameras"
# Qualities.
expect 0 "quality fast" "$program" enhance "$input" -o "$work/fast.ply" --quality fast --pixel-size 0.0055 --json
says stdout '"quality": "fast"'
says stdout '"method": "model"'
expect 0 "quality good" "$program" enhance "$input" -o "$work/good.ply" --quality good --pixel-size 0.0055 --steps 1 --poses 8 --json
says stdout '"method": "model+refine"'
says stdout '"k": 1'
expect 2 "a quality and another method" "$program" enhance "$input" -o "$work/bad.ply" --quality good --method filter --pixel-size 0.0055
says stderr "--quality good is --method model+refine, and --method filter was given"
expect 2 "no such quality" "$program" enhance "$input" -o "$work/bad.ply" --quality perfect --pixel-size 0.0055
expect 2 "pictures that a quality does not look at" "$program" enhance "$input" -o "$work/bad.ply" --quality good --images "$source/examples/biplane/transforms_lr.json"
says stderr "--quality best"
head -c 9000 "$compact" >"$work/cut.safetensors"
expect 4 "a compact network cut short" "$program" enhance "$input" -o "$work/bad.ply" --model "$work/cut.safetensors"
expect 4 "a splat as weights" "$program" convert "$input" "$work/weights.safetensors"
expect 2 "upscale below 1" "$program" enhance "$input" -o "$work/bad.ply" --upscale 0.5
expect 2 "nonsense pixel size" "$program" enhance "$input" -o "$work/bad.ply" --pixel-size big
says stderr "pixel-size"
expect 2 "negative strength" "$program" enhance "$input" -o "$work/bad.ply" --filter-strength -1
expect 2 "unknown method" "$program" enhance "$input" -o "$work/bad.ply" --method magic
says stderr "filter"
expect 2 "nowhere to write" "$program" enhance "$input"
expect 2 "two inputs, one output" "$program" enhance "$input" "$input" -o "$work/bad.ply"
expect 2 "two inputs of one name" "$program" enhance "$input" "$source/examples/stone_lantern/input.ply" --out-dir "$work/many"
expect 3 "missing input" "$program" enhance "$work/nothing.ply" -o "$work/bad.ply"
says stderr "nothing.ply"
expect 0 "folder of outputs" "$program" enhance "$input" "$work/out.ply" --out-dir "$work/many" --pixel-size 0.0055
expect 5 "folder of outputs again" "$program" enhance "$input" "$work/out.ply" --out-dir "$work/many" --pixel-size 0.0055
checks=$((checks + 1))
[ ! -e "$work/bad.ply" ] || { failures=$((failures + 1)); echo "FAILED: an error left bad.ply behind"; }
checks=$((checks + 1))
[ "$(find "$work/many" -type f | wc -l)" -eq 2 ] || { failures=$((failures + 1)); echo "FAILED: --out-dir left something else than two files"; }

expect 2 "unknown extension, before reading" "$program" enhance "$work/nothing.ply" -o "$work/bad.xyz"
says stderr "bad.xyz"
expect 3 "no such folder" "$program" enhance "$input" -o "$work/nowhere/out.ply"
expect 2 "empty cameras" "$program" enhance "$input" -o "$work/bad.ply" --cameras ""
expect 2 "huge strength" "$program" enhance "$input" -o "$work/bad.ply" --filter-strength 1e300
expect 2 "command line error as JSON" "$program" enhance --json
says stdout '"bad_argument"'
printf '[{"id":0,"img_name":"a","width":4096,"height":4096,"position":[0,0,-1.7],"rotation":[[1,0,0],[0,1,0],[0,0,1]],"fx":4944,"fy":4944}]' >"$work/cameras.json"
expect 0 "wide cameras are said to be shrunk" "$program" enhance "$input" -o "$work/wide.ply" --cameras "$work/cameras.json" --json
says stderr "1600"
says stdout '"train_width": 1600'

# info.
expect 0 "info" "$program" info "$input"
says stdout "20,000, SH degree 3"
expect 0 "info as JSON" "$program" info "$input" --json
silent stderr
says stdout '"gaussians": 20000'
printf 'ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n' >"$work/points.ply"
expect 4 "info of a point cloud" "$program" info "$work/points.ply"
says stderr "points.ply"
expect 4 "error as JSON" "$program" info "$work/points.ply" --json
says stdout '"bad_file"'

# render.
expect 0 "render one" "$program" render "$input" -o "$work/one.png" --orbit 1 --size 96x64
expect 5 "render does not overwrite" "$program" render "$input" -o "$work/one.png" --orbit 1 --size 96x64
expect 0 "render a folder" "$program" render "$input" -o "$work/views" --cameras "$cameras" --size 128x128
checks=$((checks + 1))
[ "$(find "$work/views" -name '*.png' | wc -l)" -eq 10 ] || { failures=$((failures + 1)); echo "FAILED: ten cameras should make ten pictures"; }
expect 2 "several views into one file" "$program" render "$input" -o "$work/two.png" --orbit 2
expect 0 "one view by name" "$program" render "$input" -o "$work/016.png" --cameras "$cameras" --view 016 --size 64x64 --transparent
expect 2 "no such view" "$program" render "$input" -o "$work/x.png" --cameras "$cameras" --view 999
expect 2 "nonsense size" "$program" render "$input" -o "$work/x.png" --orbit 1 --size 0x5
expect 2 "other shape" "$program" render "$input" -o "$work/x" --cameras "$cameras" --size 100x50
expect 2 "a radius without an orbit" "$program" render "$input" -o "$work/x" --cameras "$cameras" --radius 3
# Up: −y unless somebody knows better.
expect 0 "up by itself" "$program" render "$input" -o "$work/up" --orbit 2 --size 64x64
expect 0 "up as it is said" "$program" render "$input" -o "$work/up-said" --orbit 2 --size 64x64 --up=-y
expect 0 "the same" cmp "$work/up/001.png" "$work/up-said/001.png"
expect 0 "up as the cameras hold it" "$program" render "$input" -o "$work/up-cameras" --orbit 2 --size 64x64 --cameras "$cameras"
expect 0 "up as the comment says" "$program" render "$work/cameras.ply" -o "$work/up-comment" --orbit 2 --size 64x64
expect 0 "a comment that says up" grep -qa '^comment world up: 0 [0-9]' "$work/cameras.ply"
expect 0 "compare takes the cameras' up" "$program" compare "$input" "$work/up-cameras" --orbit 2 --size 64x64 --cameras "$cameras" --json
expect 2 "up is no direction" "$program" render "$input" -o "$work/x" --orbit 2 --up 0,0,0
says stderr "--up: '0,0,0' is not a direction"
# What is in range.
expect 0 "nothing in range" "$program" render "$input" -o "$work/far" --cameras "$cameras" --size 64x64 --near 100
says stderr "shows nothing of the 20,000 Gaussians: 20,000 before the near plane (100)"
says stderr "--near and --far say what is in range (9 more of 10 views are as empty)"
expect 0 "nothing in range of a comparison" "$program" compare "$input" "$work/out.ply" --orbit 2 --size 64x64 --far 0.1
says stderr "20,000 beyond the far plane (0.1)"
expect 2 "near behind far" "$program" render "$input" -o "$work/x" --orbit 2 --near 3 --far 2
expect 2 "near of nothing" "$program" render "$input" -o "$work/x" --orbit 2 --near 0
expect 0 "what is not drawn is said" "$program" render "$work/nan.ply" -o "$work/none.png" --orbit 1 --size 64x64
says stderr "2 of 2 Gaussians are not drawn"
expect 2 "not a PNG" "$program" render "$input" -o "$work/x.jpg" --orbit 1
expect 2 "too many pixels" "$program" render "$input" -o "$work/x.png" --orbit 1 --size 32768x32768
expect 3 "missing cameras" "$program" render "$input" -o "$work/x" --cameras "$work/none.json"

# view.
expect 0 "page" "$program" view "$work/out.ply" --before "$input" --truth "$source/examples/biplane/hr" --cameras "$cameras" --views 3 -o "$work/page.html" --json
says stdout '"views": 3'
silent stderr
says_page() { checks=$((checks + 1)); grep -qF -- "$1" "$work/page.html" || { failures=$((failures + 1)); echo "FAILED: page.html does not hold '$1'"; }; }
says_page '"title":"out.ply"'
says_page 'id="picture-2"'
expect 5 "page does not overwrite" "$program" view "$input" -o "$work/page.html"
expect 0 "page of one splat" "$program" view "$input" -o "$work/page.html" -w --sh-degree 0 --title 'a</script>b'
says stdout "browser"
says_page '"degree":0'
says_page 'a\u003c/script\u003eb'
expect 2 "truth without cameras" "$program" view "$input" -o "$work/x.html" --truth "$work"
expect 3 "truth of other names" "$program" view "$input" -o "$work/x.html" --truth "$source/src" --cameras "$cameras"
says stderr "no PNG or JPEG"
expect 3 "truth that is not there" "$program" view "$input" -o "$work/x.html" --truth "$work/nowhere" --cameras "$cameras"
says stderr "no such folder"
expect 2 "a page over a splat" "$program" view "$input" -o "$work/scan.spz" -w
says stderr ".html"
expect 2 "SH degree 4" "$program" view "$input" -o "$work/x.html" --sh-degree 4

# compare.
expect 0 "two splats" "$program" compare "$input" "$work/out.ply" --orbit 2 --size 64x64 --json
says stdout '"views"'
silent stderr
expect 0 "a splat with itself" "$program" compare "$input" "$input" --orbit 2 --size 64x64
says stdout "inf"
expect 0 "identical, as JSON" "$program" compare "$input" "$input" --orbit 1 --size 64x64 --json
says stdout '"psnr": null'
expect 0 "splat with its renders" "$program" compare "$input" "$work/views" --cameras "$cameras" --size 128x128
expect 2 "nothing to compare" "$program" compare "" "$input" --orbit 1
mkdir "$work/empty"
expect 3 "an empty folder" "$program" compare "$input" "$work/empty" --orbit 1
says stderr "no PNG or JPEG"
expect 2 "splats without views" "$program" compare "$input" "$work/out.ply"
says stderr "--orbit"
expect 2 "views without partner" "$program" compare "$input" "$work/views" --cameras "$source/examples/biplane/transforms_lr.json"
expect 2 "different sizes" "$program" compare "$input" "$work/views" --cameras "$cameras"
says stderr "1024x1024"
expect 0 "two pictures of other names" "$program" compare "$work/views/000.png" "$work/views/016.png" --side-by-side "$work/sides.png"
expect 5 "side by side does not overwrite" "$program" compare "$work/views/000.png" "$work/views/016.png" --side-by-side "$work/sides.png"
expect 0 "both against truth" "$program" compare "$input" "$work/out.ply" --truth "$work/views" --cameras "$cameras" --size 128x128 --side-by-side "$work/truth.png"
says stdout "gain"

# LPIPS is missing without its weights; the other metrics are there all the same.
expect 0 "no weights" "$program" compare "$source/testdata/lpips/ex_p0.png" "$source/testdata/lpips/ex_ref.png" --lpips alex --lpips-weights "$work/empty" --json
says stderr "LPIPS missing"
says stdout '"ssim"'
mkdir "$work/weights" && echo "no tensors" >"$work/weights/alex.safetensors"
expect 4 "broken weights" "$program" compare "$source/testdata/lpips/ex_p0.png" "$source/testdata/lpips/ex_ref.png" --lpips alex --lpips-weights "$work/weights"
expect 2 "unknown network" "$program" compare "$input" "$input" --orbit 1 --lpips resnet
expect 2 "weights of nothing" "$program" compare "$input" "$input" --orbit 1 --lpips-weights "$work/weights"

# Same bits for any number of threads.
expect 0 "one thread" "$program" render "$input" -o "$work/t1.png" --orbit 1 --size 200x150 --threads 1
expect 0 "three threads" "$program" render "$input" -o "$work/t3.png" --orbit 1 --size 200x150 --threads 3
checks=$((checks + 1))
cmp -s "$work/t1.png" "$work/t3.png" || { failures=$((failures + 1)); echo "FAILED: threads change the picture"; }

finish
