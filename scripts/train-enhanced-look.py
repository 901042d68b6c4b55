#!/usr/bin/env python3
"""Learns to tell splats that a network has enhanced from fits, and writes the coefficients.

    scripts/train-enhanced-look.py make FEATURES.jsonl DATASET...
    scripts/train-enhanced-look.py fit FEATURES.jsonl... [--check FEATURES.jsonl...] [--keep FILE.json.gz]
        [-o src/enhance/enhanced_look_coefficients.cc]

`make` takes every splat of data sets as it is and enhanced, with cameras, without, and in one of four other ways,
through formats that lose the word for it, and appends what `anchorsplat bench looks --features` says; what is there
already is not made again, so it goes on where it was stopped. Half a second of a core for each.

`fit` is logistic regression with a ridge, on standardised features; every splat counts the same, however many ways it
went. It prints how many are taken for what they are not, all splats of a mesh left out together, and of `--check`,
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
UPPER_QUARTILE = 3  # kTwinUpperQuartile
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
    budget = str(int(BUDGET * gaussians(splat)))
    other = [["--copies", "1"], ["--copies", "4"], ["--max-gaussians", budget], ["--upscale", "2"]][number % 4]
    yield other[0][2:] + (other[1] if other[0] == "--copies" else ""), other + ["--cameras", cameras], [rotated]


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


def learn(np, features, enhanced, weights, ridge):
    """Standardised; Newton's method."""
    middle, width = features.mean(0), features.std(0) + 1e-9
    x = np.c_[(features - middle) / width, np.ones(len(features))]
    penalty = np.r_[np.full(features.shape[1], ridge), 0]
    w = np.zeros(x.shape[1])
    for _ in range(60):
        p = 1 / (1 + np.exp(-np.clip(x @ w, -30, 30)))
        gradient = x.T @ (weights * (p - enhanced)) + penalty * w
        hessian = (x * (weights * p * (1 - p))[:, None]).T @ x + np.diag(penalty + 1e-9)
        step = np.linalg.solve(hessian, gradient)
        w -= step
        if np.abs(step).max() < 1e-9:
            break
    slopes = w[:-1] / width
    return slopes, w[-1] - slopes @ middle


def odds(np, features, slopes, intercept):
    out = features @ slopes + intercept
    return np.where(features[:, UPPER_QUARTILE] > np.log(MOST_DIFFERENT), -np.inf, out)


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
        said[out] = odds(np, features[out], *learn(np, features[~out], enhanced[~out], weights[~out], arguments.ridge))
    print(f"{len(set(i['splat'] for i in items))} splats of {len(set(meshes))} meshes, {len(items)} files")
    report("Cross-validated, meshes left out:", items, said)
    slopes, intercept = learn(np, features, enhanced, weights, arguments.ridge)
    if arguments.check:
        others = load(arguments.check)
        report("Not learned from:", others, odds(np, np.array([i["features"] for i in others]), slopes, intercept))
    if arguments.keep:
        with open(arguments.keep, "xb") as file:
            file.write(gzip.compress(json.dumps(items, separators=(",", ":")).encode(), 9, mtime=0))
    if arguments.output:
        write(arguments.output, slopes, intercept)


def write(path, slopes, intercept):
    rows = [", ".join(f"{x:.8g}" for x in slopes[k:k + 5]) for k in range(0, len(slopes), 5)]
    pathlib.Path(path).write_text(
        '#include "enhance/enhanced_look_coefficients.h"\n\nnamespace anchorsplat {\n\n'
        f"const double kEnhancedLookIntercept = {intercept:.8g};\n\n// clang-format off\n"
        "const EnhancedLook kEnhancedLookWeights = {\n    " + ",\n    ".join(rows) + "};\n// clang-format on\n\n"
        "}  // namespace anchorsplat\n", encoding="utf-8")


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
    verb.add_argument("--ridge", type=float, default=1)
    verb.add_argument("--folds", type=int, default=10)
    verb.add_argument("--keep")
    verb.add_argument("-o", "--output")
    verb.set_defaults(run=fit)
    arguments = parser.parse_args()
    arguments.run(arguments)


if __name__ == "__main__":
    main()
