#!/usr/bin/env bash
# What the command line takes, refuses and prints, whatever the verb: commandline_test.sh PROGRAM SOURCE_DIR.
. "$(dirname "$0")/expectations.sh"

# Verbs.
expect 2 "a word that is no verb" "$program" convrt "$input"
says stderr "did you mean 'convert'?"
says stderr "enhance, info, render, convert, compare, eval, view, views, fit, dataset, train, bench"
expect 2 "a word far from all verbs, as JSON" "$program" xyzzyxyzzy --json
says stdout '"bad_argument"'
lacks stderr "did you mean"
expect 2 "a word that is no part of a verb" "$program" dataset chekc "$work"
says stderr "did you mean 'check'?"

# Numbers are finite, whatever the option; whole ones have 64 bits.
for verb in enhance convert render compare eval view views fit train bench\ {render,fit,network,convert,io} dataset\ {build,split}; do
  options=$("$program" $verb --help | grep -oE -- '--[a-z0-9-]+ (FLOAT|INT|UINT)' | sort -u)
  while read -r option type; do
    [ -n "$option" ] || continue
    [ "$type" = FLOAT ] && values="nan inf -inf 1e39 -nan" || values="99999999999999999999 -99999999999999999999"
    for value in $values; do
      expect 2 "$verb $option $value" "$program" $verb "$option=$value"
      says stderr "$option: "
      longest=$(wc -L <"$work/stderr")
      expect 0 "a message of $longest letters for $option $value" test "$longest" -lt 200
    done
  done <<<"$options"
done
expect 2 "a bound without an end" "$program" enhance "$input" -o "$work/x.ply" --train-width 0 --cameras "$cameras"
says stderr "must be a number above 0, found '0'"
expect 0 "the largest seed" "$program" convert "$input" "$work/seed.ply" --seed 18446744073709551615

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
expect 0 "convert" "$program" convert "$input" "$folder/$wild.ply" --max-gaussians 2000
clean
says stdout '\x1b[2J\x9b2J\x0a\x7f.ply'
expect 0 "info" "$program" info "$folder/$wild.ply"
clean
cp "$folder/$wild.ply" "$folder/"$'\xc2\x9b\x7f.ply'
expect 0 "info as JSON" "$program" info "$folder/"$'\xc2\x9b\x7f.ply' --json
clean
says stdout '\u009b\u007f.ply'
expect 0 "enhance" "$program" enhance "$folder/$wild.ply" -o "$folder/2$wild.ply" --pixel-size 0.0055 --method filter --view
clean
expect 0 "view" "$program" view "$folder/$wild.ply" -o "$folder/3$wild.html"
clean
printf '[{"id":0,"img_name":"\\u001b[2J\\u009b|a","width":64,"height":64,"position":[0,0,-1.7],"rotation":[[1,0,0],[0,1,0],[0,0,1]],"fx":64,"fy":64}]' >"$work/wild.json"
expect 0 "render" "$program" render "$folder/$wild.ply" -o "$folder/views" --cameras "$work/wild.json"
clean
expect 0 "compare" "$program" compare "$folder/$wild.ply" "$input" --cameras "$work/wild.json"
clean
says stdout '\x1b[2J\xc2\x9b|a'
expect 0 "compare with truth" "$program" compare "$folder/$wild.ply" "$input" --truth "$folder/$wild.ply" --cameras "$work/wild.json"
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

# Several inputs of which none can be done.
cp "$cameras" "$work/no-splat.ply" && cp "$source/README.md" "$work/text.ply"
expect 4 "convert, all fail" "$program" convert "$work/no-splat.ply" "$work/text.ply" --out-dir "$work/none" --to ply
says stderr "all 2 inputs failed"
expect 4 "enhance, all fail" "$program" enhance "$work/no-splat.ply" "$work/text.ply" --out-dir "$work/none"
expect 2 "--to that leads away" "$program" convert "$input" --out-dir "$work/away/in" --to ../x.ply
says stderr "--to: '../x.ply' is no format"
expect 1 "nothing came of it" test -e "$work/away"

# Pages of --view: known not to fit, or to be two, before the work begins.
expect 2 "two outputs with one page" "$program" enhance "$work/seed.ply" "$work/seed.spz" --out-dir "$work/pages" --view --pixel-size 0.0055
says stderr "would both be"
expect 1 "nothing was written" test -e "$work/pages"
# Of numbers that do not repeat themselves: what does would be packed away.
{
  printf 'ply\nformat ascii 1.0\nelement vertex 300000\n'
  for name in x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3; do echo "property float $name"; done
  echo end_header
  awk 'BEGIN { srand(1); for (i = 0; i < 300000; ++i) { for (k = 0; k < 13; ++k) printf "%.6g ", rand(); print rand() } }'
} >"$work/large.ply"
expect 2 "a page that no browser opens" "$program" enhance "$work/large.ply" -o "$work/huge.ply" --view --pixel-size 0.0055 --method refine --k 64
says stderr "huge.html: the page of --view would take about"
says stderr "enhance without --view"
expect 1 "nothing was made" test -e "$work/huge.ply"

# What a PLY says of its Gaussians beside them.
head -c 0 /dev/null >"$work/extras.ply"
{
  printf 'ply\nformat ascii 1.0\nelement vertex 300\nproperty uchar label\n'
  for name in x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3; do echo "property float $name"; done
  printf 'end_header\n'
  for i in $(seq 300); do echo "$((i % 200)) $i.5 $((i * 7 % 30)) $((i * 11 % 20)) 0 0 $i 0 0 0 $((i % 9)) -1 -1 -1 1 0 0 0"; done
} >"$work/extras.ply"
has_labels() { grep -aq "property uchar label" "$1"; }
expect 0 "convert with other properties" "$program" convert "$work/extras.ply" "$work/kept.ply" --min-opacity 0.6 --sort morton
silent stderr
expect 0 "they are kept" has_labels "$work/kept.ply"
expect 0 "convert to what has no place for them" "$program" convert "$work/extras.ply" "$work/lost.spz"
says stderr "other properties of the input are dropped: label, normals"
expect 0 "the filter leaves the Gaussians" "$program" enhance "$work/extras.ply" -o "$work/filtered.ply" --method filter --pixel-size 0.1
silent stderr
expect 0 "and what is beside them" has_labels "$work/filtered.ply"
expect 0 "a network makes others" "$program" enhance "$work/extras.ply" -o "$work/others.ply" --method model --pixel-size 0.4
says stderr "other properties of its Gaussians are dropped, as those of the result are others: label, normals"
expect 1 "without them" has_labels "$work/others.ply"
expect 0 "info names them" "$program" info "$work/kept.ply"
says stdout "other properties  nx ny nz label"

finish
