#!/usr/bin/env bash
# Runs that end before their end, by a signal, a full disk or a lost folder, what goes on from there, and which files it
# may replace: interruptions_test.sh PROGRAM SOURCE_DIR.
. "$(dirname "$0")/expectations.sh"

mkdir "$work/project"
cp "$cameras" "$work/project/transforms.json"
expect 0 "pictures to fit" "$program" render "$input" -o "$work/project/hr" --cameras "$cameras" --size 48x48
some=5000  # three seconds with a checkpoint after each: a busy machine still stops one in the middle
long=1000000
fit() { "$program" fit "$work/project" --init-points 300 --max-gaussians 300 --hold-out 5 "$@"; }
# Waits until the test is true or the child has ended.
until_is() {
  while kill -0 "$child" 2>/dev/null && ! "$@"; do :; done
}
# stopped_by SIGNAL WORDS COMMAND...: sent as soon as it says the words; what it said and its exit code are passed on.
stopped_by() {
  local signal=$1 words=$2
  shift 2
  rm -f "$work/log"  # an earlier one may say the words, and the child would be hit before it is the program
  "$@" 2>"$work/log" &
  child=$!
  until_is grep -qsF -- "$words" "$work/log"
  kill -"$signal" $child
  wait $child
  local code=$?
  cat "$work/log" >&2
  return $code
}

# Ctrl-C while it runs, then on from there: the same file as in one go.
stopped() {
  "$program" fit "$work/project" --init-points 300 --max-gaussians 300 --hold-out 5 -o "$work/part.ply" --steps $some \
    --checkpoint-every 1 -q "$@" &
  child=$!
  until_is test -e "$work/part.ply.checkpoint"
  kill -INT $child
  wait $child
}
resumed() { fit -o "$work/part.ply" --steps $some --resume "$@"; }
expect 0 "fit in one go" fit -o "$work/whole.ply" --steps $some -q
expect 130 "an interrupted fit" stopped
says stderr "--resume"
expect 0 "what an interrupted fit leaves" "$program" info "$work/part.ply"
expect 5 "an interrupted fit is not forgotten" fit -o "$work/part.ply" --steps $some
expect 2 "an interrupted fit is not mistaken for another" resumed --seed 8
says stderr "seed"
expect 0 "an interrupted fit goes on" resumed
says stderr "resuming"
expect 0 "an interruption does not change the splat" cmp "$work/whole.ply" "$work/part.ply"
rm -f "$work"/part.ply*

# What a continuation has to have in common with its beginning: not the names alone.
expect 130 "a fit to go on with" stopped
picture=$(find "$work/project/hr" -name '*.png' | sort | sed -n 2p)
cp "$picture" "$work/picture.png" && cp "$(find "$work/project/hr" -name '*.png' | sort | sed -n 3p)" "$picture"
expect 2 "it does not go on with another picture" resumed
says stderr "its set of pictures differs"
cp "$work/picture.png" "$picture" && cp "$work/project/transforms.json" "$work/transforms.json"
sed -i 's/"fl_x": 1236/"fl_x": 1237/' "$work/project/transforms.json"
expect 2 "it does not go on with other cameras" resumed
says stderr "its set of cameras differs"
cp "$work/transforms.json" "$work/project/transforms.json"
expect 2 "it does not go on from another start" resumed --init-splat "$input"
says stderr "its start differs"
cp "$work/part.ply.checkpoint" "$work/checkpoint"
printf 'anchorsplat' | dd of="$work/part.ply.checkpoint" bs=1 seek=60000 conv=notrunc status=none
expect 4 "it does not go on from a damaged state" resumed
says stderr "is damaged"
cp "$work/checkpoint" "$work/part.ply.checkpoint"
expect 0 "it goes on with what it began with" resumed
says stderr "resuming"

# A closed terminal: SIGHUP, from the shell and from the system, and nobody to read what is said.
hung_up() {
  "$program" fit "$work/project" --init-points 300 --hold-out 5 -o "$work/hung.ply" --steps $long --checkpoint-every 1 \
    -q 2> >(:) &
  child=$!
  until_is test -e "$work/hung.ply.checkpoint"
  kill -HUP $child && kill -HUP $child 2>/dev/null
  wait $child
}
expect 130 "SIGHUP ends a fit in order" hung_up
expect 0 "its splat is there" "$program" info "$work/hung.ply"
expect 0 "its state is there" test -s "$work/hung.ply.checkpoint"
refine() { "$program" enhance "$input" --upscale 2 --pixel-size 0.02 --mode classic -o "$work/refined.ply" --images "$work/project" --k 1 "$@"; }
expect 130 "SIGHUP ends a refinement in order" stopped_by HUP "views with pictures" "$program" enhance "$input" --upscale 2 \
  --pixel-size 0.02 --mode classic -o "$work/refined.ply" --images "$work/project" --k 1 --steps $long
says stderr "--resume"
expect 0 "its splat is there, too" "$program" info "$work/refined.ply"
expect 0 "its state is there, too" test -s "$work/refined.ply.checkpoint"
expect 5 "an interrupted refinement is not forgotten" refine --steps 9
expect 2 "an interrupted refinement is not mistaken for another" refine --steps 9 --resume
says stderr "its --steps is"
hung_up_build() {
  "$program" dataset build "$work/square.obj" "$work/other.obj" -o "$work/set" --views 8 --size 24 --low-size 12 --points 60 \
    --steps $long --max-gaussians 100 --jobs 1 -q &
  child=$!
  until_is test -e "$work/set/.building/other/views.json"
  kill -HUP $child
  wait $child
}
printf 'v -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n' | tee "$work/square.obj" >"$work/other.obj"
expect 130 "SIGHUP ends the build of a data set in order" hung_up_build
expect 0 "the state of the fit is there" test -s "$work/set/.building/other/fit.checkpoint"
expect 4 "the data set is not whole" "$program" dataset check "$work/set"
says stdout "other: is missing: its build was interrupted"
says stdout "square: is missing: its build was interrupted"
expect 0 "info counts both" "$program" dataset info "$work/set" --json
says stdout '"unfinished": 2'
# What nobody can go on with ends at once and leaves nothing. A splat that takes a while: the small one over and over.
header=$(grep -aobm1 end_header "$input" | cut -d: -f1)
head -c $((header + 11)) "$input" | sed 's/^element vertex .*/element vertex 640000/' >"$work/large.ply"
count=$(sed -n 's/^element vertex //p;/^end_header/q' "$input")
tail -c +$((header + 12)) "$input" >"$work/body"
for _ in $(seq 5); do cat "$work/body" "$work/body" >"$work/twice" && mv "$work/twice" "$work/body"; done
cat "$work/body" >>"$work/large.ply"
sed -i "s/^element vertex 640000/element vertex $((count * 32))/" "$work/large.ply"
rm "$work/body"
gone() { [ ! -e "$1" ] && [ -z "$(find "$work" -name '.anchorsplat*')" ]; }
expect 130 "Ctrl-C ends the filter" stopped_by INT "looks like" "$program" enhance "$work/large.ply" --method filter \
  --mode classic -o "$work/gone.ply"
says stderr "error: stopped"
expect 0 "there is no splat of it" gone "$work/gone.ply"
expect 130 "and levels of detail" stopped_by INT '"levels of detail"' "$program" convert "$work/large.ply" "$work/lod" --lod \
  --progress json
says stderr "stopped; unfinished output was removed"
expect 0 "there is no folder of them" gone "$work/lod"
# While a pipe is read that nobody ends; from when on the signal is heard, the system knows (bit 1 is SIGINT).
mkfifo "$work/pipe"
hears() {
  [ "/proc/$child/exe" -ef "$program" ] || return 1  # the shell's own child, at first
  local caught
  caught=$(sed -n 's/^SigCgt:.*\(.\)$/\1/p' "/proc/$child/status" 2>/dev/null)
  (((0x${caught:-0} & 2) != 0))
}
stopped_reading() {
  "$program" "$@" <>"$work/pipe" &
  child=$!
  until_is hears
  kill -INT $child
  wait $child
}
expect 130 "Ctrl-C ends a conversion that reads" stopped_reading convert - "$work/gone.spz"
says stderr "error: stopped"
expect 130 "and a page" stopped_reading view - -o "$work/gone.html"
says stderr "error: stopped"
expect 0 "there is nothing of them" gone "$work/gone.spz"
# What is said of it beforehand counts only what is worked on.
expect 0 "a small region of it" "$program" enhance "$work/large.ply" --method model --pixel-size 0.005 --mode classic \
  --region 0,0,0,0.1 -o "$work/region.ply" --yes
says stderr "640,000 Gaussians become up to 6"
rm "$work/large.ply" "$work/region.ply"
# Under nohup it does not end at all.
not_hung_up() {
  (trap '' HUP && exec "$program" fit "$work/project" --init-points 300 --hold-out 5 -o "$work/nohup.ply" --steps 100 \
    --checkpoint-every 1 -q) &
  child=$!
  until_is test -e "$work/nohup.ply.checkpoint"
  kill -HUP $child 2>/dev/null
  wait $child
}
expect 0 "SIGHUP does not end a fit that is not to hear it" not_hung_up

# kill -9 of a network's run on several blocks, in the middle of writing down one of them, then on from there.
{
  body=$(($(grep -abo -m 1 end_header "$input" | cut -d: -f1) + 11))
  count=$(sed -n 's/^element vertex //p;/^end_header/q' "$input")
  head -c $body "$input" | sed "s/^element vertex .*/element vertex $((7 * count))/"
  for _ in 1 2 3 4 5 6 7; do tail -c +$((body + 1)) "$input"; done
} >"$work/blocks.ply"
network() {
  "$program" enhance "$work/blocks.ply" --method model --pixel-size 0.005 --mode classic "$@"
}
block=$((65536 * 4 * 200)) # bytes, at least
has_a_block() { [ "$(stat -c %s "$work/net.ply.checkpoint" 2>/dev/null || echo 0)" -gt $((block * 5 / 4)) ]; }
killed() {
  "$program" enhance "$work/blocks.ply" -o "$work/net.ply" --method model --pixel-size 0.005 --mode classic --resume -q &
  child=$!
  until_is has_a_block
  kill -KILL $child
  wait $child
}
expect 0 "a network in one go" network -o "$work/net-whole.ply" -q
expect 1 "which keeps nothing unasked" test -e "$work/net-whole.ply.checkpoint"
expect 137 "a killed network" killed
expect 1 "it leaves no half file" test -e "$work/net.ply"
expect 5 "a killed network is not forgotten" network -o "$work/net.ply" --checkpoint "$work/net.ply.checkpoint"
says stderr "--resume"
expect 2 "a killed network is not mistaken for another" network -o "$work/net.ply" --resume --merge-cost 0.1
says stderr "its merge cost is"
cp "$work/net.ply.checkpoint" "$work/notes" && printf 'notes' | dd of="$work/notes" conv=notrunc status=none
expect 4 "it does not go on from what is no checkpoint" network -o "$work/net.ply" --resume --checkpoint "$work/notes"
expect 0 "which stays" test -e "$work/notes"
expect 0 "a killed network goes on" network -o "$work/net.ply" --resume
says stderr "resuming after block"
expect 0 "a kill does not change the splat" cmp "$work/net-whole.ply" "$work/net.ply"
expect 1 "its state is gone" test -e "$work/net.ply.checkpoint"
rm -f "$work"/net*.ply "$work/notes" "$work/blocks.ply"

# No room for the state, which is three times as large as the splat: the splat is written.
limited() { ulimit -f 200 && exec "$@"; }
no_room() { (limited "$program" fit "$work/project" --init-points 300 --max-gaussians 300 --hold-out 5 "$@"); }
expect 0 "a fit without room for its checkpoints" no_room -o "$work/room.ply" --steps 30 --checkpoint-every 1
says stderr "no new checkpoint"
expect 0 "its splat" "$program" info "$work/room.ply"
expect 130 "an interrupted fit without room for its state" stopped_by INT "no new checkpoint" limited "$program" fit \
  "$work/project" --init-points 300 --max-gaussians 300 --hold-out 5 -o "$work/room2.ply" --steps $long --checkpoint-every 1
says stderr "no checkpoint to resume from"
expect 0 "its splat as it was" "$program" info "$work/room2.ply"

# Nowhere to write the splat: the state is kept.
mkdir "$work/gone"
homeless() {
  "$program" fit "$work/project" --init-points 300 --max-gaussians 300 --hold-out 5 -o "$work/gone/splat.ply" --steps $some \
    --checkpoint "$work/state" --checkpoint-every 1 &
  child=$!
  until_is test -e "$work/state"
  rm -r "$work/gone"
  wait $child
}
expect 3 "a fit that loses its folder" homeless
says stderr "the state after step 5,000 is saved in $work/state"
mkdir "$work/gone"
expect 0 "it is finished at once" fit -o "$work/gone/splat.ply" --steps $some --checkpoint "$work/state" --resume
expect 0 "its splat is there at last" "$program" info "$work/gone/splat.ply"

# A file that comes into being while a fit runs, and what a fit that goes on may replace.
running() {
  "$program" fit "$work/project" --init-points 100 --hold-out 5 --steps $some --max-gaussians 100 --checkpoint-every 1 \
    --checkpoint "$work/running" -q "$@" &
  child=$!
  until_is test -e "$work/running"
  [ -z "$meanwhile" ] || echo theirs >"$meanwhile"
  kill -INT $child
  wait $child
}
goes_on() { "$program" fit "$work/project" --init-points 100 --hold-out 5 --steps $some --max-gaussians 100 --checkpoint "$work/running" --resume -q "$@"; }
meanwhile=$work/taken.ply
expect 5 "a file that came into being meanwhile" running -o "$work/taken.ply"
says stderr "taken-2.ply"
expect 0 "it is what it was" grep -q theirs "$work/taken.ply"
expect 0 "and the work is kept" "$program" info "$work/taken-2.ply"
expect 5 "going on over a file that the interruption did not leave" goes_on -o "$work/taken.ply"
expect 0 "it is still what it was" grep -q theirs "$work/taken.ply"
rm "$work/running"
meanwhile=
expect 130 "an interrupted fit" running -o "$work/mine.ply"
echo theirs >"$work/other.ply" && cp "$work/other.ply" "$work/other.pt"
expect 5 "going on with another output" goes_on -o "$work/other.ply"
says stderr "other.ply: exists; -w replaces it"
expect 5 "going on with another gsplat checkpoint" goes_on -o "$work/mine.ply" --gsplat-checkpoint "$work/other.pt"
says stderr "other.pt: exists; -w replaces it"
expect 0 "they are what they were" cmp "$work/other.ply" "$work/other.pt"
expect 0 "going on with its own output" goes_on -o "$work/mine.ply"

finish
