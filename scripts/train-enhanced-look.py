#!/usr/bin/env python3
"""Learns to tell splats that a network has enhanced from fits, and writes the coefficients.

    scripts/train-enhanced-look.py make FEATURES.jsonl DATASET...
    scripts/train-enhanced-look.py fit FEATURES.jsonl... [--check FEATURES.jsonl...] [--keep FILE.json.gz]
        [-o src/enhance/enhanced_look_coefficients.cc]

`make` takes every splat of data sets as it is and enhanced, with cameras, without, and in other ways, through formats that lose the word for it, and appends what `anchorsplat bench looks --features` says; what is there
already is not made again, so it goes on where it was stopped. Half a second of a core for each.

`fit` trains a network of one small layer; every splat counts the same, however many ways it went. It prints how many are taken for what they are not, all splats of a mesh left out together, and of `--check`,
from which nothing is learned. FEATURES may be what `--keep` wrote. Needs numpy.
"""

import argparse
import collections
import gzip
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile

FORMATS = {"ply": ".ply", "spz": ".spz", "splat": ".splat", "sog": ".sog", "compressed": ".compressed.ply"}
ALL = ["ply", "spz", "splat"]
ROTATED = ["ply", "spz", "splat", "sog", "compressed"]
BUDGET = 1.6  # Gaussians for one, where there is one
MOST_DIFFERENT = 0.02 + 1  # as kMostDifferent in enhanced_look.cc
UPPER_QUARTILE, FLATNESS, ELONGATION = 3, 27, 28  # kTwinUpperQuartile, kFlatness, kElongation
NEARLY_ROUND = 0.2  # kNearlyRound
HIDDEN, MOST_DEVIATIONS, UNLIKE_ANY = 16, 4.0, 5.0  # kEnhancedLookHidden, kMostDeviations, kUnlikeAny
LEAST, LEAST_WHERE_UNCLEAR = 0, -2  # kEnhancedOdds, kEnhancedOddsWhereUnclear in trained_kind.cc
MADE = ("--enhanced", "--pixel-area", "--spz", "--sog", "--splat")  # splats of data/kinds-wide.toml made of others


def gaussians(path):
    with open(path, "rb") as file:
        for line in file:
            if line.startswith(b"element vertex"):
                return int(line.split()[-1])
    sys.exit(f"{path}: no Gaussians")


def ways(splat, cameras):
    """Name, options of enhance (None: as it is) and formats."""
    number = int(hashlib.md5(splat.parent.name.encode()).hexdigest(), 16)
    yield "as it is", None, ALL + ["sog" if number // 8 % 2 else "compressed"]
    yield "without cameras", [], ALL
    rotated = ROTATED[number // 16 % 5]
    yield "with cameras", ["--cameras", cameras], [rotated]
    count = gaussians(splat)
    other = [["--copies", "4"], ["--max-gaussians", str(int(BUDGET * count))], ["--upscale", "2"]][number % 3]
    for options in [["--copies", "1"], ["--max-gaussians", str(count)], other]:
        yield " ".join(options[:1 if "gaussians" in options[0] else 2])[2:], options + ["--cameras", cameras], [rotated]
    yield "copies 1, without cameras", ["--copies", "1"], [rotated]


def run(*words):
    return subprocess.run(words, capture_output=True, text=True, check=False)


def make(arguments):
    path = pathlib.Path(arguments.features)
    done = set()
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            item = json.loads(line)
            done.add((item["splat"], item["way"], item["format"]))
    with path.open("a", encoding="utf-8") as out:
        for splat in sorted(s for folder in arguments.datasets for s in pathlib.Path(folder).glob("*/splat.ply")):
            name = splat.parent.parent.name + "/" + splat.parent.name
            if name.endswith(MADE):
                continue
            low = min(splat.parent.glob("transforms_*.json"), key=lambda p: int(p.stem.split("_")[1]))
            for way, options, formats in ways(splat, str(low)):
                formats = [f for f in formats if (name, way, f) not in done]
                if formats:
                    look_at(arguments.program, name, splat, way, options, formats, out)
            print(name, file=sys.stderr)


def look_at(program, name, splat, way, options, formats, out):
    with tempfile.TemporaryDirectory() as folder:
        source = str(splat)
        if options is not None:
            source = os.path.join(folder, "enhanced.ply")
            done = run(program, "enhance", str(splat), "-o", source, "-q", *options)
            if done.returncode != 0:
                print(f"{name}, {way}: {done.stderr.strip()}", file=sys.stderr)
                return
        for kind in formats:
            file = source
            if kind != "ply":
                file = os.path.join(folder, "other" + FORMATS[kind])
                run(program, "convert", source, file, "-q")
            said = run(program, "bench", "looks", file, "--features", "--json")
            if said.returncode != 0:
                print(f"{name}, {way}, {kind}: {said.stderr.strip()}", file=sys.stderr)
                continue
            found = json.loads(said.stdout)["splats"][0]
            if "features" in found:
                out.write(json.dumps({"splat": name, "way": way, "format": kind, "sizes": found["by_sizes"],
                                      "features": [round(x, 4) for x in found["features"]]}) + "\n")
                out.flush()


def load(files):
    items = []
    for name in files:
        with (gzip.open if name.endswith(".gz") else open)(name, "rt", encoding="utf-8") as file:
            items += json.load(file) if name.endswith(".json.gz") else [json.loads(line) for line in file]
    return items


def mesh(item):
    return item["splat"].split("/")[1].split("--")[0]


def learn(np, features, enhanced, weights, decay, seed=0):
    """A network of one layer of HIDDEN tanh on standardised features; Adam on all of them at once, 3000 steps."""
    random = np.random.default_rng(seed)
    middle, width = features.mean(0), features.std(0) + 1e-9
    x = np.clip((features - middle) / width, -MOST_DEVIATIONS, MOST_DEVIATIONS)
    values = [random.normal(0, 1 / np.sqrt(x.shape[1]), (x.shape[1], HIDDEN)), np.zeros(HIDDEN),
              random.normal(0, 1 / np.sqrt(HIDDEN), HIDDEN), np.zeros(1)]
    moments = [[np.zeros_like(v), np.zeros_like(v)] for v in values]
    share = weights / weights.sum()
    steps = 3000
    for step in range(1, steps + 1):
        hidden = np.tanh(x @ values[0] + values[1])
        error = share * (1 / (1 + np.exp(-np.clip(hidden @ values[2] + values[3], -30, 30))) - enhanced)
        back = np.outer(error, values[2]) * (1 - hidden ** 2)
        gradients = [x.T @ back + decay * values[0], back.sum(0), hidden.T @ error + decay * values[2],
                     np.array([error.sum()])]
        rate = 0.01 * 0.5 * (1 + np.cos(np.pi * step / steps))
        for value, gradient, (first, second) in zip(values, gradients, moments):
            first += 0.1 * (gradient - first)
            second += 0.001 * (gradient ** 2 - second)
            value -= rate * (first / (1 - 0.9 ** step)) / (np.sqrt(second / (1 - 0.999 ** step)) + 1e-12)
    return [middle, width] + values


def odds(np, features, network):
    middle, width, inner, bias, outer, last = network
    x = (features - middle) / width
    unlike = np.abs(x).max(1) > UNLIKE_ANY
    x = np.clip(x, -MOST_DEVIATIONS, MOST_DEVIATIONS)
    out = np.tanh(x @ inner + bias) @ outer + last
    round_ones = (features[:, FLATNESS] > -NEARLY_ROUND) & (features[:, ELONGATION] < NEARLY_ROUND)
    return np.where(unlike | round_ones | (features[:, UPPER_QUARTILE] > np.log(MOST_DIFFERENT)), -np.inf, out)


def looks(item, score):
    """As TrainedKindOf in trained_kind.cc."""
    if item["sizes"] == "widened":
        return "widened"
    least = LEAST_WHERE_UNCLEAR if item["sizes"] == "unclear" else LEAST
    return "enhanced" if score > least else item["sizes"] or "too few"


def report(title, items, said):
    print(title)
    table = collections.defaultdict(collections.Counter)
    wrong = []
    for item, score in zip(items, said):
        look = looks(item, score)
        table[item["way"]][look] += 1
        if look != "widened" and (look == "enhanced") != (item["way"] != "as it is"):
            wrong.append((item["splat"], item["way"], item["format"], look, round(float(score), 1)))
    columns = ["enhanced", "widened", "unclear", "classic", "antialiased"]
    print(f"  {'files':16}" + "".join(f"{c:>12}" for c in columns))
    for way, row in sorted(table.items()):
        print(f"  {way:16}" + "".join(f"{row[c]:12}" for c in columns))
    for line in sorted(wrong):
        print("   ", *line)


def fit(arguments):
    import numpy as np

    items = load(arguments.features)
    features = np.array([i["features"] for i in items])
    enhanced = np.array([i["way"] != "as it is" for i in items]).astype(float)
    counts = collections.Counter((i["splat"], i["way"] != "as it is") for i in items)
    weights = np.array([1 / counts[i["splat"], i["way"] != "as it is"] for i in items])
    meshes = np.array([mesh(i) for i in items])
    folds = np.array_split(np.random.default_rng(1).permutation(sorted(set(meshes))), arguments.folds)
    said = np.zeros(len(items))
    for fold in folds:
        out = np.isin(meshes, fold)
        said[out] = odds(np, features[out], learn(np, features[~out], enhanced[~out], weights[~out], arguments.decay))
    print(f"{len(set(i['splat'] for i in items))} splats of {len(set(meshes))} meshes, {len(items)} files")
    report("Cross-validated, meshes left out:", items, said)
    network = learn(np, features, enhanced, weights, arguments.decay)
    if arguments.check:
        others = load(arguments.check)
        report("Not learned from:", others, odds(np, np.array([i["features"] for i in others]), network))
    if arguments.keep:
        with open(arguments.keep, "xb") as file:
            file.write(gzip.compress(json.dumps(items, separators=(",", ":")).encode(), 9, mtime=0))
    if arguments.output:
        write(arguments.output, network)


def write(path, network):
    def rows(values):
        words = [f"{x:.6g}" for x in values]
        lines = [", ".join(words[k:k + 10]) for k in range(0, len(words), 10)]
        return "{" + ",\n     ".join(lines) + "}"

    middle, width, inner, bias, outer, last = network
    pathlib.Path(path).write_text(
        '#include "enhance/enhanced_look_coefficients.h"\n\nnamespace anchorsplat {\n\n'
        "// Written by scripts/train-enhanced-look.py; not to be edited.\n// clang-format off\n"
        "const EnhancedLookNetwork kEnhancedLookNetwork = {\n"
        f"    .middle = {rows(middle)},\n    .width = {rows(width)},\n"
        "    .inner = {{\n     " + ",\n     ".join(rows(row) for row in inner.T) + "}},\n"
        f"    .bias = {rows(bias)},\n    .outer = {rows(outer)},\n    .last = {last[0]:.6g}}};\n"
        "// clang-format on\n\n}  // namespace anchorsplat\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(required=True)
    verb = verbs.add_parser("make")
    verb.add_argument("features")
    verb.add_argument("datasets", nargs="+")
    verb.add_argument("--program", default="anchorsplat")
    verb.set_defaults(run=make)
    verb = verbs.add_parser("fit")
    verb.add_argument("features", nargs="+")
    verb.add_argument("--check", nargs="+", default=[])
    verb.add_argument("--decay", type=float, default=3e-4)
    verb.add_argument("--folds", type=int, default=10)
    verb.add_argument("--keep")
    verb.add_argument("-o", "--output")
    verb.set_defaults(run=fit)
    arguments = parser.parse_args()
    arguments.run(arguments)


if __name__ == "__main__":
    main()
