#!/usr/bin/env bash
# Data sets, whose objects are made by processes of their own, and what a kill in between costs:
# datasets_test.sh PROGRAM SOURCE_DIR.
. "$(dirname "$0")/expectations.sh"

mkdir "$work/mesh"
printf 'mtllib quad.mtl\nv -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n' >"$work/mesh/quad.obj"
printf 'newmtl m\nKd 0.2 0.8 0.4\n' >"$work/mesh/quad.mtl"
printf 'v 0 0 0\n' >"$work/mesh/point.obj"
sed 's/^v 1 1 0/v 1 1 1/' "$work/mesh/quad.obj" >"$work/mesh/ramp.obj"
small=(--views 8 --size 24 --low-size 12 --points 60 --steps 60 --max-gaussians 500 --min-psnr 5)
# kill_when NAME COMMAND...: starts it and kills it as soon as there is a file of that name.
kill_when() {
  local file=$1
  shift
  "$@" --quiet >/dev/null 2>&1 &
  local victim=$!
  until [ -e "$file" ] || ! kill -0 $victim 2>/dev/null; do :; done
  kill -9 $victim 2>/dev/null
  wait $victim 2>/dev/null
}

# Three meshes, one of them none, become two objects.
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
expect 0 "check" "$program" dataset check "$work/set" --decode
says stdout "complete and consistent"
says stdout "1 object failed"
expect 0 "info of a data set" "$program" dataset info "$work/set" --json
says stdout '"objects": 2'
says stdout '"failed": 1'
says stdout '"unfinished": 0'
expect 0 "evaluation of a data set" "$program" eval "$work/set" -o "$work/eval" --methods raw --json
says stdout '"objects": 2'

# Kinds: every entry for every mesh, one for the first alone, one made from the splat of another.
printf 'draws = "all"\nmin_train_psnr = 0\n[[mix]]\nname = "plain"\n[[mix]]\nname = "noisy"\nobjects = 1\nnoise = 9\n[[mix]]\nname = "packed"\nfrom = "plain"\nafter = "splat"\n' >"$work/kinds.toml"
kinds=("$program" dataset build "$work/mesh/ramp.obj" "$work/mesh/quad.obj" -o "$work/kinds" "${small[@]}" --recipe "$work/kinds.toml" --json)
expect 0 "kinds of splats" "${kinds[@]}"
says stdout '"built": 5'
expect 0 "what the fit saw" test -s "$work/kinds/ramp--noisy/captured/images/003.png"
expect 0 "check of kinds" "$program" dataset check "$work/kinds" --decode
says stdout "complete and consistent"
expect 0 "kinds again" "${kinds[@]}"
says stdout '"there_already": 5'
expect 0 "evaluation by kind" "$program" eval "$work/kinds" -o "$work/kinds-eval" --methods raw,filter --kinds plain,packed
says stdout "| packed | filter | 2 |"
expect 2 "a kind that is not there" "$program" eval "$work/kinds" -o "$work/kinds-eval" --methods raw --kinds enhanced
says stderr "known: noisy, packed, plain"
expect 2 "an object of another kind" "$program" eval "$work/kinds" -o "$work/kinds-eval" --methods raw --kinds packed --objects ramp--plain
says stderr "of the kind 'plain', which --kinds excludes"
expect 1 "what is made from a splat that failed" "$program" dataset build "$work/mesh/point.obj" -o "$work/kinds" "${small[@]}" --recipe "$work/kinds.toml" --json
expect 0 "says so" grep -q '"message":"is made from point--plain, which is missing.*"stage":"base"' "$work/kinds/failures.jsonl"

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

printf '# one object\nquad.obj\n' >"$work/list.txt"
expect 0 "a list of objects" "$program" dataset build --list "$work/list.txt" --objects "$work/mesh" -o "$work/demand" "${small[@]}" --hr on-demand --json
says stdout '"built": 1'
expect 0 "check of views on demand" "$program" dataset check "$work/demand" --decode
expect 0 "evaluation of views on demand" "$program" eval "$work/demand" -o "$work/eval2" --methods raw

# A folder that is no object of the data set is not replaced by one, nor one that holds what the object is made of.
mkdir -p "$work/taken/quad" && echo mine >"$work/taken/quad/file"
expect 1 "a folder in the way of an object" "$program" dataset build "$work/mesh/quad.obj" -o "$work/taken" "${small[@]}"
expect 0 "says what it is" grep -q "is a folder where the object's should be" "$work/taken/failures.jsonl"
expect 0 "it is still there" grep -q mine "$work/taken/quad/file"
expect 0 "build over an object of its own" "$program" dataset build "$work/mesh/quad.obj" -o "$work/demand" "${small[@]}" -w --json
says stdout '"built": 1'
cp "$work/mesh/ramp.obj" "$work/kept.obj" && mv "$work/mesh/ramp.obj" "$work/set/ramp/" && ln -s ../set/ramp/ramp.obj "$work/mesh/ramp.obj"
expect 1 "an object that holds its source" "$program" dataset build "$work/mesh/ramp.obj" -o "$work/set" "${small[@]}" -w
expect 0 "the source is still there" cmp "$work/kept.obj" "$work/set/ramp/ramp.obj"

# Killed as soon as the views are there, and gone on with in one process: the same from the beginning.
rm "$work/mesh/ramp.obj" && cp "$work/kept.obj" "$work/mesh/ramp.obj"
kill_when "$work/killed/.building/quad/views.json" "$program" dataset build "$work/mesh/quad.obj" "$work/mesh/ramp.obj" -o "$work/killed" "${small[@]}"
expect 0 "after a kill" "$program" dataset build "$work/mesh/quad.obj" "$work/mesh/ramp.obj" -o "$work/killed" "${small[@]}" --jobs 1
for file in quad/splat.ply quad/12/images/003.png quad/24/images/003.png ramp/splat.ply quad/12/sparse/0/points3D.bin; do
  expect 0 "the same $file after a kill" cmp "$work/set/$file" "$work/killed/$file"
done

# The fit of "bicubic", killed after its first checkpoint, goes on and comes to the same splat.
fit=(--objects quad --methods bicubic --fit-steps 800)
expect 0 "a fit in one go" "$program" eval "$work/killed" -o "$work/whole" "${fit[@]}"
kill_when "$work/parts/objects/quad/bicubic/fit.checkpoint" "$program" eval "$work/killed" -o "$work/parts" "${fit[@]}"
expect 0 "a fit that was killed" "$program" eval "$work/killed" -o "$work/parts" "${fit[@]}"
says stderr "resuming at step"
expect 0 "comes to the same splat" cmp "$work/whole/objects/quad/bicubic/splat.ply" "$work/parts/objects/quad/bicubic/splat.ply"

finish
