#!/usr/bin/env bash
# What makes, improves and measures splats: views, fits, refinement, data sets, evaluation, training: captures_test.sh PROGRAM SOURCE_DIR.
. "$(dirname "$0")/expectations.sh"

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
mkdir "$work/empty"
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
expect 0 "the best quality there is with pictures" "$program" enhance "$work/whole.ply" --quality best --upscale 2 --pixel-size 0.02 -o "$work/best.ply" --images "$work/project" --hold-out 5 --steps 8 --json
says stdout '"method": "model+refine-images"'
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
expect 5 "an interrupted refinement is not forgotten" refine -o "$work/refined3.ply" --images "$work/project" --hold-out 5 --steps 9
expect 2 "an interrupted refinement is not mistaken for another" refine -o "$work/refined3.ply" --images "$work/project" --hold-out 5 --steps 9 --resume
says stderr "its steps is"
# No file is lost to a checkpoint.
expect 2 "the input as a checkpoint" refine -o "$work/x.ply" --steps 2 --checkpoint "$work/whole.ply"
expect 2 "the output as a checkpoint" refine -o "$work/x.ply" --steps 2 --checkpoint "$work/x.ply"
expect 5 "another file as a checkpoint" refine -o "$work/x.ply" --steps 2 --checkpoint "$work/mesh/quad.obj" -w
expect 0 "it is still there" test -s "$work/mesh/quad.obj"
expect 6 "where no file can be written" refine -o /proc/x.ply --steps 1000000
expect 2 "steps for the filter" "$program" enhance "$work/whole.ply" --method filter --pixel-size 0.02 -o "$work/x.ply" --steps 5
says stderr "--steps"
expect 2 "pictures for two splats" "$program" enhance "$work/whole.ply" "$work/area0.ply" --method refine --out-dir "$work/two" --images "$work/project"
echo none >"$work/broken.ply"
expect 1 "one of two is broken" "$program" enhance "$work/broken.ply" "$work/whole.ply" --method filter --pixel-size 0.02 --out-dir "$work/two" --json
says stdout '"failure"'
says stderr "broken.ply"
expect 0 "the other is enhanced" test -s "$work/two/whole.ply"
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
expect 0 "the network that is part of the program" "$program" eval "$source/examples" -o "$work/shipped" --max-views 1 --methods filter,model -q
checks=$((checks + 1))
awk -F, '$2 == "filter" { f[$1] = $4; s[$1] = $5 } $2 == "model" { ++n; good += $4 > f[$1] + 0.5 && $5 > s[$1] } END { exit !(n == 2 && good == 2) }' \
  "$work/shipped/table.csv" || { failures=$((failures + 1)); echo "FAILED: the shipped network beats the filter by 0.5 dB"; cat "$work/shipped/table.csv"; }
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

finish
