#!/usr/bin/env bash
# The program from outside: cli_test.sh PROGRAM SOURCE_DIR. Prints every failed expectation and fails if there is one.
set -uo pipefail
program=$1
source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
input=$source/examples/biplane/input.ply
cameras=$source/examples/biplane/transforms_hr.json
checks=0
failures=0

# expect CODE NAME COMMAND...: runs it, keeps stdout and stderr in $work.
expect() {
  local code=$1 name=$2
  shift 2
  "$@" >"$work/stdout" 2>"$work/stderr" </dev/null
  local got=$?
  checks=$((checks + 1))
  if [ $got -ne "$code" ]; then
    failures=$((failures + 1))
    echo "FAILED $name: exit code $got, expected $code: $*"
    cat "$work/stderr"
  fi
}
# says STREAM TEXT: the last command's stdout or stderr holds the text.
says() {
  checks=$((checks + 1))
  if ! grep -qF -- "$2" "$work/$1"; then
    failures=$((failures + 1))
    echo "FAILED: $1 does not say '$2', but:"
    head -n 5 "$work/$1"
  fi
}
silent() {
  checks=$((checks + 1))
  if [ -s "$work/$1" ]; then
    failures=$((failures + 1))
    echo "FAILED: $1 should be empty:"
    head -n 5 "$work/$1"
  fi
}

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
head -c 3200 "$source/src/cli/cli_test.sh" >"$work/text.splat"
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
silent stderr
says stdout '"source": "cameras"'
expect 0 "enhance with estimated pixel size" "$program" enhance "$input" -o "$work/auto.ply"
says stderr "estimated"
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
expect 2 "model options without a model" "$program" enhance "$input" -o "$work/bad.ply" --prune-opacity 0.1
compact=$source/testdata/compact/small.safetensors
expect 0 "a compact network" "$program" enhance "$input" -o "$work/compact.ply" --model "$compact" --cameras "$source/examples/biplane/transforms_lr.json"
says stdout "20,000 Gaussians in, 40,000 out; model"
expect 0 "a compact network, then refinement" "$program" enhance "$input" -o "$work/compact.ply" -w --model "$compact" --pixel-size 0.0055 --method model+refine --steps 1 --poses 8 --json
says stdout '"method": "model+refine"'
expect 2 "options of the other architecture" "$program" enhance "$input" -o "$work/bad.ply" --model "$compact" --pixel-size 0.0055 --normalisation bbox
says stderr "normalisation is for the published architecture"
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
expect 2 "cameras and orbit" "$program" render "$input" -o "$work/x" --cameras "$cameras" --orbit 3
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

# views: a textured square becomes the benchmark's layout.
mkdir "$work/mesh"
printf 'mtllib quad.mtl\nv -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n' >"$work/mesh/quad.obj"
printf 'newmtl m\nKd 0.2 0.8 0.4\n' >"$work/mesh/quad.mtl"
expect 0 "views of a mesh" "$program" views "$work/mesh/quad.obj" -o "$work/quad" --views 3 --size 32 --low-size 8 --points 100 --json
says stdout '"triangles": 2'
for file in 8/images/002.png 8/sparse/0/points3D.bin 8/images.txt 32/images/002.png 32/cameras.txt transforms_32.json; do
  expect 0 "views writes $file" test -s "$work/quad/$file"
done
expect 0 "our own cameras" "$program" render "$input" -o "$work/quadview" --cameras "$work/quad/32"
expect 5 "views do not overwrite" "$program" views "$work/mesh/quad.obj" -o "$work/quad" --views 3 --size 32 --low-size 8
expect 2 "views of one size" "$program" views "$work/mesh/quad.obj" -o "$work/quad2" --size 32 --low-size 32
expect 2 "unknown rig" "$program" views "$work/mesh/quad.obj" -o "$work/quad2" --rig spiral
expect 3 "no mesh" "$program" views "$work/mesh/none.obj" -o "$work/quad2"
printf 'v 0 0 0\n' >"$work/mesh/point.obj"
expect 4 "a mesh without triangles" "$program" views "$work/mesh/point.obj" -o "$work/quad2"

# fit: a tiny project made by the program itself.
mkdir "$work/project"
expect 0 "pictures to fit" "$program" render "$input" -o "$work/project/hr" --cameras "$cameras" --size 64x64
sed -e 's/"w": 1024/"w": 64/; s/"h": 1024/"h": 64/' "$cameras" >"$work/project/transforms.json"
fit() { "$program" fit "$work/project" --init-points 500 --hold-out 5 "$@"; }
expect 0 "fit" fit --steps 60 -o "$work/fit.ply" --gsplat-checkpoint "$work/ckpt_59_rank0.pt" --json
says stderr "training views"
says stdout '"initial_points": "view"'
says stdout '"held_out"'
checks=$((checks + 1))
[ ! -e "$work/fit.ply.checkpoint" ] || { failures=$((failures + 1)); echo "FAILED: a finished fit left its checkpoint"; }
expect 0 "fit made the same splat twice" "$program" compare "$work/fit.ply" "$work/ckpt_59_rank0.pt" --orbit 1 --size 64x64 --json
says stdout '"psnr": null'
expect 0 "the fit shows what was fitted" "$program" compare "$work/fit.ply" "$work/project/hr" --cameras "$work/project/transforms.json"
expect 5 "fit does not overwrite" fit --steps 60 -o "$work/fit.ply"
expect 2 "fit to an unknown format" fit --steps 60 -o "$work/fit.xyz"
expect 2 "fit from points that are not there" fit --steps 60 -o "$work/x.ply" --init points
says stderr "has none"
expect 2 "fit with everything held out" "$program" fit "$work/project" -o "$work/x.ply" --hold-out 1
expect 2 "no steps" fit -o "$work/x.ply" --steps 0
expect 2 "refinement never" fit --steps 60 -o "$work/x.ply" --refine-every 0
expect 3 "no project" "$program" fit "$work/none" -o "$work/x.ply"
expect 3 "a project without pictures" "$program" fit "$work/empty" -o "$work/x.ply"
expect 0 "views to fit" "$program" views "$work/mesh/quad.obj" -o "$work/object" --views 9 --size 32 --low-size 16 --points 100
expect 0 "fit of our own layout" "$program" fit "$work/object" --steps 30 -o "$work/object.ply" --json
says stdout '"initial_points": "points"'
# Ctrl-C while it runs, then on from there: the same file as in one go.
expect 0 "fit in one go" fit -o "$work/whole.ply" --steps 400 --seed 7 -q
interrupted() {
  "$program" fit "$work/project" --init-points 500 --hold-out 5 -o "$work/halves.ply" --steps 400 --seed 7 \
    --checkpoint-every 1 --checkpoint "$work/state" -q &
  local child=$!
  while kill -0 $child 2>/dev/null && [ ! -e "$work/state" ]; do :; done
  kill -INT $child
  wait $child
}
expect 130 "an interrupted fit" interrupted
says stderr "--resume"
expect 0 "what an interrupted fit leaves" "$program" info "$work/halves.ply"
expect 5 "an interrupted fit is not forgotten" fit -o "$work/halves.ply" --steps 400 --seed 7 --checkpoint "$work/state"
expect 2 "an interrupted fit is not mistaken for another" fit -o "$work/halves.ply" --steps 400 --seed 8 --checkpoint "$work/state" --resume
says stderr "seed"
expect 0 "an interrupted fit goes on" fit -o "$work/halves.ply" --steps 400 --seed 7 --checkpoint "$work/state" --resume
says stderr "going on"
checks=$((checks + 1))
cmp -s "$work/whole.ply" "$work/halves.ply" || { failures=$((failures + 1)); echo "FAILED: an interruption changes the splat"; }

# refine: on the project of the fits above.
refine() { "$program" enhance "$work/whole.ply" --method refine --upscale 2 --pixel-size 0.02 "$@"; }
expect 0 "refine" refine -o "$work/refined.ply" --steps 8 --poses 10 --k 2 --json
says stdout '"consistency_after"'
expect 0 "what refine wrote" "$program" info "$work/refined.ply"
expect 0 "refine with pictures" refine -o "$work/refined2.ply" --images "$work/project" --hold-out 5 --steps 8
says stderr "views with pictures"
expect 2 "refine with pictures of something else" "$program" enhance "$source/examples/stone_lantern/input.ply" -o "$work/x.ply" --method refine --pixel-size 0.0055 --images "$work/project" --steps 8
says stderr "order of their cameras"
expect 3 "refine with pictures that are not there" refine -o "$work/x.ply" --images "$work/none"
expect 2 "refine for steps and seconds" refine -o "$work/x.ply" --steps 8 --seconds 1
expect 2 "pictures for the filter" "$program" enhance "$work/whole.ply" --method filter --pixel-size 0.02 -o "$work/x.ply" --images "$work/project"
expect 2 "exposure without pictures" refine -o "$work/x.ply" --exposure
expect 2 "pictures that were not given" "$program" enhance "$work/whole.ply" -o "$work/x.ply" --method refine-images --pixel-size 0.02
says stderr "--images"
refine_interrupted() {
  "$program" enhance "$work/whole.ply" --method refine --upscale 2 --pixel-size 0.02 -o "$work/refined3.ply" \
    --images "$work/project" --hold-out 5 --steps 1000000 2>"$work/refine.log" &
  local child=$!
  while kill -0 $child 2>/dev/null && ! grep -q "views with pictures" "$work/refine.log"; do :; done
  kill -INT $child
  wait $child
  local code=$?
  cat "$work/refine.log" >&2
  return $code
}
expect 130 "an interrupted refinement" refine_interrupted
says stderr "--resume"
expect 0 "what an interrupted refinement leaves" "$program" info "$work/refined3.ply"
expect 0 "fit with area pixels" fit -o "$work/area.ply" --steps 40 --pixel area --upscale 2 -q
expect 2 "upscale without area pixels" fit -o "$work/x.ply" --steps 40 --upscale 2
# dataset: three meshes, one of them none, become two objects; a kill in between costs nothing.
sed 's/^v 1 1 0/v 1 1 1/' "$work/mesh/quad.obj" >"$work/mesh/ramp.obj"
small=(--views 8 --size 24 --low-size 12 --points 60 --steps 60 --max-gaussians 500 --min-psnr 5)
expect 1 "a data set" "$program" dataset build "$work/mesh/quad.obj" "$work/mesh/point.obj" "$work/mesh/ramp.obj" -o "$work/set" "${small[@]}" --jobs 2 --json
says stdout '"built": 2'
says stdout '"failed": 1'
expect 0 "the failure has its reason" grep -q '"name":"point".*"stage":"mesh"' "$work/set/failures.jsonl"
for file in manifest.jsonl quad/record.json quad/splat.ply quad/12/gaussian_splatting/ckpts/ckpt_59_rank0.pt quad/24/images/007.png ramp/splat.ply; do
  expect 0 "data set has $file" test -s "$work/set/$file"
done
expect 1 "build again" "$program" dataset build "$work/mesh/quad.obj" "$work/mesh/point.obj" -o "$work/set" "${small[@]}" --json
says stdout '"there_already": 1'
says stdout '"failed": 1'
expect 0 "the checkpoint is a splat" "$program" info "$work/set/quad/12/gaussian_splatting/ckpts/ckpt_59_rank0.pt"
expect 2 "no meshes" "$program" dataset build -o "$work/set2"
expect 2 "low not smaller" "$program" dataset build "$work/mesh/quad.obj" -o "$work/set2" --size 12 --low-size 12
mkdir "$work/mesh/copy" && cp "$work/mesh/quad.obj" "$work/mesh/copy/"
echo "no archive" >"$work/mesh/bad.sh3f"
cp "$work/mesh/quad.obj" "$work/mesh/manifest.jsonl.obj"
expect 1 "two of one name, a bad library and a name of the builder's own" "$program" dataset build "$work/mesh/quad.obj" "$work/mesh/copy/quad.obj" "$work/mesh/bad.sh3f" "$work/mesh/manifest.jsonl.obj" -o "$work/set3" "${small[@]}" --licence GPL-2.0-or-later --creator somebody --json
says stdout '"built": 3'
says stdout '"failed": 1'
expect 0 "the library has its reason" grep -q '"name":"bad.sh3f".*"stage":"read"' "$work/set3/failures.jsonl"
for name in mesh-quad copy-quad manifest.jsonl-object; do
  expect 0 "the manifest has $name" grep -q "\"licence\":\"GPL-2.0-or-later\".*\"name\":\"$name\"" "$work/set3/manifest.jsonl"
done
expect 0 "failures are no problem of what is there" "$program" dataset check "$work/set3"
says stdout "1 object failed"
printf 'steps = 60\n[[mix]]\nlow_size = 12\n[[mix]]\nlow_siize = 10\n' >"$work/bad.toml"
expect 4 "a recipe with a slip" "$program" dataset build "$work/mesh/quad.obj" -o "$work/set2" --recipe "$work/bad.toml"
says stderr "line 5: low_siize"
expect 0 "check" "$program" dataset check "$work/set" --decode
says stdout "everything is there"
expect 0 "info of a data set" "$program" dataset info "$work/set" --json
says stdout '"objects": 2'
says stdout '"failed": 1'
says stdout '"unfinished": 0'
expect 0 "split" "$program" dataset split "$work/set" --test 1 --validation 0 --json
says stdout '"test": 2'
expect 5 "split does not overwrite" "$program" dataset split "$work/set"
rm "$work/set/ramp/24/images/004.png"
expect 4 "check finds a gap" "$program" dataset check "$work/set"
says stdout "picture 004 is missing"
printf '# one object\nquad.obj\n' >"$work/list.txt"
expect 0 "a list of objects" "$program" dataset build --list "$work/list.txt" --objects "$work/mesh" -o "$work/demand" "${small[@]}" --hr on-demand --json
says stdout '"built": 1'
expect 0 "check of views on demand" "$program" dataset check "$work/demand" --decode
expect 2 "a list without a folder" "$program" dataset build --list "$work/list.txt" -o "$work/demand"
# The same from the beginning, killed as soon as the views are there and gone on with in one process.
"$program" dataset build "$work/mesh/quad.obj" "$work/mesh/ramp.obj" -o "$work/killed" "${small[@]}" --quiet >/dev/null 2>&1 &
victim=$!
until [ -e "$work/killed/.building/quad/views.json" ] || [ -e "$work/killed/quad" ] || ! kill -0 $victim 2>/dev/null; do :; done
kill -9 $victim 2>/dev/null
wait $victim 2>/dev/null
expect 0 "after a kill" "$program" dataset build "$work/mesh/quad.obj" "$work/mesh/ramp.obj" -o "$work/killed" "${small[@]}" --jobs 1
for file in quad/splat.ply quad/12/images/003.png quad/24/images/003.png ramp/splat.ply quad/12/sparse/0/points3D.bin; do
  expect 0 "the same $file after a kill" cmp "$work/set/$file" "$work/killed/$file"
done

# eval.
expect 0 "evaluation of an example" "$program" eval "$source/examples" -o "$work/eval" --objects biplane --max-views 2 --methods raw,upsample,filter --json
says stdout '"gain_over_raw"'
[ -s "$work/eval/table.md" ] && [ -s "$work/eval/table.csv" ] && [ -s "$work/eval/contact_sheet.png" ] || { failures=$((failures + 1)); echo "FAILED: tables of eval"; }
expect 0 "evaluation goes on" "$program" eval "$source/examples" -o "$work/eval" --objects biplane --max-views 2 --methods raw,filter --json
says stdout '"resumed": 2'
expect 0 "choosing f" "$program" eval "$source/examples" -o "$work/eval" --objects biplane --max-views 1 --choose-f
says stdout "Best f"
expect 2 "unknown method" "$program" eval "$source/examples" -o "$work/eval" --methods magic
says stderr "filter-auto"
expect 2 "unknown object" "$program" eval "$source/examples" -o "$work/eval" --objects triplane
expect 0 "bench pixel-size" "$program" bench pixel-size "$source/examples/biplane" --features --json
says stdout '"error_median"'
says stdout '"features"'
expect 3 "no benchmark" "$program" eval "$work/empty" -o "$work/eval"
expect 3 "no such checkpoint" "$program" eval "$source/examples" -o "$work/eval" --methods none.safetensors
mkdir -p "$work/bench/good" "$work/bench/bad" && cp -r "$source/examples/biplane/." "$work/bench/good/" && cp "$source/examples/biplane/transforms_hr.json" "$work/bench/bad/"
expect 1 "a bad object does not stop the others" "$program" eval "$work/bench" -o "$work/eval2" --max-views 1 --methods raw --json
says stdout '"failures"'
says stderr "bad"
expect 0 "evaluation of a data set" "$program" eval "$work/killed" -o "$work/eval3" --protocol upstream --methods raw,filter,bicubic --fit-steps 20 --json
says stdout '"objects": 2'
rm "$work/set/ramp/24/images/000.png"
expect 1 "evaluation of a data set with a gap" "$program" eval "$work/set" -o "$work/eval4" --methods raw
says stderr "no high-resolution picture 000"
expect 0 "evaluation of views on demand" "$program" eval "$work/demand" -o "$work/eval5" --methods raw
# The fit of "bicubic", killed after its first checkpoint, goes on and comes to the same splat.
fit=(--objects quad --methods bicubic --fit-steps 800)
expect 0 "a fit in one go" "$program" eval "$work/killed" -o "$work/whole" "${fit[@]}"
"$program" eval "$work/killed" -o "$work/parts" "${fit[@]}" --quiet >/dev/null 2>&1 &
victim=$!
until [ -e "$work/parts/objects/quad/bicubic/fit.checkpoint" ] || ! kill -0 $victim 2>/dev/null; do :; done
kill -9 $victim 2>/dev/null
wait $victim 2>/dev/null
expect 0 "a fit that was killed" "$program" eval "$work/killed" -o "$work/parts" "${fit[@]}"
says stderr "going on at step"
expect 0 "comes to the same splat" cmp "$work/whole/objects/quad/bicubic/splat.ply" "$work/parts/objects/quad/bicubic/splat.ply"
expect 3 "no split" "$program" eval "$work/demand" -o "$work/eval5" --split test

# train: in a program of its own where there is LibTorch.
printf '[optimizer]\nclip = -1\n' >"$work/recipe.toml"
if [ -x "$(dirname "$program")/anchorsplat-train" ]; then
  expect 4 "a bad recipe" "$program" train "$work" --config "$work/recipe.toml" -o "$work/run"
  says stderr "recipe.toml: line 2: optimizer.clip: expected a number from 0"
  expect 0 "help of the training program" "$(dirname "$program")/anchorsplat-train" train --help
else
  expect 3 "no LibTorch" "$program" train "$work" --config "$work/recipe.toml" -o "$work/run" --json
  says stderr "training is missing: this program was built without LibTorch"
fi
expect 2 "no recipe" "$program" train "$work" -o "$work/run"

# Same bits for any number of threads.
expect 0 "one thread" "$program" render "$input" -o "$work/t1.png" --orbit 1 --size 200x150 --threads 1
expect 0 "three threads" "$program" render "$input" -o "$work/t3.png" --orbit 1 --size 200x150 --threads 3
checks=$((checks + 1))
cmp -s "$work/t1.png" "$work/t3.png" || { failures=$((failures + 1)); echo "FAILED: threads change the picture"; }

echo "$checks checks, $failures failed"
[ $failures -eq 0 ]
