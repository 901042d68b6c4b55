#!/usr/bin/env python3
"""Fits the regression behind `--pixel-size auto` and writes src/enhance/pixel_size_coefficients.cc.

    anchorsplat bench pixel-size --features --json DATASET... > features.json
    scripts/train-pixel-size.py features.json [-o src/enhance/pixel_size_coefficients.cc]

Every object gives samples: the features of pixels 2^(k/4) times as large as the true ones. Ridge regression says from
them how far off the tried size is; the estimate is where it says: not at all. Errors are those of cross-validation:
objects of one mesh are left out together. With `--records DATASET` fits of less than `--long` iterations, as their
records in the data set say, count `--short-weight` times. Needs numpy.
"""

import argparse
import json
import pathlib
import re

import numpy as np

MOST_DEVIATIONS = 3.0  # as in pixel_size_estimate.cc
SAME_MESH = {"biplane": "BlendSwap-CC-0-cartoon_biplane", "stone_lantern": "BlendSwap-CC-0-stoneLantern"}
SAMPLE_WIDTH = 0.35  # ln: samples count by exp(-½ (ln(size / true) / SAMPLE_WIDTH)²)


def load(files, weights=()):
    weights = dict(weights)
    objects = []
    for name in files:
        with open(name, encoding="utf-8") as file:
            for item in json.load(file)["objects"]:
                samples = [s for s in item["samples"] if None not in s["features"]]
                mesh = re.sub(r"--\d+-\d+.*$", "", item["object"])  # recipes put steps and size behind two hyphens
                objects.append({
                    "name": item["object"],
                    "mesh": SAME_MESH.get(mesh, mesh),
                    "weight": float(weights.get(item["object"], 1)),
                    "offsets": np.log([s["size"] / item["pixel_size"] for s in samples]),
                    "features": np.array([s["features"] for s in samples]),
                    "start": np.log(item["start"] / item["pixel_size"]),
                })
    return objects


def weigh_short_fits(objects, datasets, long, weight):
    short = 0
    for o in objects:
        for dataset in datasets:
            record = pathlib.Path(dataset) / o["name"] / "record.json"
            if record.exists() and int(json.loads(record.read_text(encoding="utf-8"))["recipe"].split("-")[0]) < long:
                o["weight"] *= weight
                o["short"] = True
                short += 1
    print(f"{short} of {len(objects)} fits have less than {long} iterations and count {weight:g} times")


def fit(objects, ridge):
    x = np.concatenate([o["features"] for o in objects])
    offsets = np.concatenate([o["offsets"] for o in objects])
    weights = np.exp(-0.5 * (offsets / SAMPLE_WIDTH) ** 2)
    weights *= np.concatenate([np.full(len(o["offsets"]), o["weight"]) for o in objects])
    weights /= weights.sum()
    mean = weights @ x
    deviation = np.sqrt(weights @ (x - mean) ** 2) + 1e-6
    z = np.clip((x - mean) / deviation, -MOST_DEVIATIONS, MOST_DEVIATIONS)
    z_mean, y_mean = weights @ z, weights @ -offsets
    centred = z - z_mean
    normal = (centred * weights[:, None]).T @ centred + ridge * np.eye(x.shape[1])
    weight = np.linalg.solve(normal, (centred * weights[:, None]).T @ (-offsets - y_mean))
    return {"mean": mean, "deviation": deviation, "weight": weight, "intercept": y_mean - z_mean @ weight}


def estimate(model, item):
    """ln(estimate / true): where the predicted step is 0, between the samples and beyond them along the last two."""
    z = np.clip((item["features"] - model["mean"]) / model["deviation"], -MOST_DEVIATIONS, MOST_DEVIATIONS)
    steps = z @ model["weight"] + model["intercept"]
    offsets = item["offsets"]
    for k in range(len(steps) - 1):
        if steps[k] > 0 >= steps[k + 1]:
            return offsets[k] + (offsets[k + 1] - offsets[k]) * steps[k] / (steps[k] - steps[k + 1])
    nearest = np.argmin(np.abs(steps))
    return offsets[nearest] + steps[nearest]


def cross_validate(objects, ridge, folds=40):
    meshes = sorted({o["mesh"] for o in objects})
    np.random.default_rng(1).shuffle(meshes)
    errors = np.zeros(len(objects))
    for fold in range(min(folds, len(meshes))):
        left_out = set(meshes[fold::folds])
        model = fit([o for o in objects if o["mesh"] not in left_out], ridge)
        for k, o in enumerate(objects):
            if o["mesh"] in left_out:
                errors[k] = estimate(model, o)
    return errors


def describe(errors):
    relative = np.abs(np.exp(errors) - 1)
    return (f"off by {100 * np.median(relative):.1f} % in the median, {100 * np.percentile(relative, 95):.1f} % at the "
            f"95th percentile; mean of the logarithm {errors.mean():+.3f}, deviation {errors.std():.3f}")


def write(path, model, error, count):
    def numbers(values):
        text = ", ".join(f"{v:.6g}" for v in values)
        lines, line = [], "     "
        for word in text.split(" "):
            if len(line) + len(word) + 1 > 118:
                lines.append(line)
                line = "     "
            line += " " + word
        return "\n".join(lines + [line])

    with open(path, "w", encoding="utf-8") as out:
        out.write(f'''#include "enhance/pixel_size_coefficients.h"

namespace anchorsplat {{

// Written by scripts/train-pixel-size.py from {count} fits; not to be edited.
const PixelSizeCoefficients kPixelSizeCoefficients = {{
    .mean = {{
{numbers(model["mean"])}}},
    .deviation = {{
{numbers(model["deviation"])}}},
    .weight = {{
{numbers(model["weight"])}}},
    .intercept = {model["intercept"]:.6g},
    .error = {error:.4g},
}};

}}  // namespace anchorsplat
''')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("features", nargs="+")
    parser.add_argument("-o", "--output")
    parser.add_argument("--ridge", type=float, nargs="+", default=[0.1])
    parser.add_argument("--weight", nargs="+", default=[], metavar="OBJECT=W", help="objects that count more than once")
    parser.add_argument("--records", nargs="+", default=[], metavar="DATASET", help="with the fits' records")
    parser.add_argument("--long", type=int, default=15000, help="iterations")
    parser.add_argument("--short-weight", type=float, default=1.0)
    parser.add_argument("--lean", type=float, default=0.0, help="ln, added to the estimate: negative is cautious")
    parser.add_argument("--list", action="store_true", help="the cross-validated error of every object")
    arguments = parser.parse_args()
    objects = load(arguments.features, (w.split("=") for w in arguments.weight))
    print(f"{len(objects)} fits of {len({o['mesh'] for o in objects})} meshes")
    if arguments.records:
        weigh_short_fits(objects, arguments.records, arguments.long, arguments.short_weight)
    results = {}
    for ridge in arguments.ridge:
        results[ridge] = cross_validate(objects, ridge)
        print(f"ridge {ridge:g}: {describe(results[ridge])}")
    best = min(results, key=lambda r: np.sqrt(np.mean(results[r] ** 2)))
    if arguments.records:
        for name, short in (("long", False), ("short", True)):
            print(f"{name} fits: {describe(results[best][[o.get('short', False) == short for o in objects]])}")
    if arguments.list:
        for o, e in zip(objects, results[best]):
            print(f"  {np.exp(e):.2f}  {o['name']}")
    model = fit(objects, best)
    model["intercept"] += arguments.lean
    print(f"ridge {best:g} chosen; on the fits themselves {describe(np.array([estimate(model, o) for o in objects]))}")
    if arguments.output:
        write(arguments.output, model, np.sqrt(np.mean(results[best] ** 2)), len(objects))


if __name__ == "__main__":
    main()
