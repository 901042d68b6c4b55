#!/usr/bin/env python3
"""Fits the regressions behind `--pixel-size auto` and writes their coefficients.

    anchorsplat bench pixel-size --features --json DATASET... > features.json
    scripts/train-pixel-size.py features.json [-o src/enhance/pixel_size_coefficients.cc]
    scripts/train-pixel-size.py --kinds data/pixel-size-kinds.json.gz [-o src/enhance/pixel_size_kinds_coefficients.cc]

Every object gives samples: the features of pixels 2^(k/4) times as large as the true ones. Ridge regression says from
them how far off the tried size is; the estimate is where it says: not at all. Errors are those of cross-validation:
objects of one mesh are left out together. With `--records DATASET` fits of less than `--long` iterations, as their
records in the data set say, count `--short-weight` times. Needs numpy.

With `--kinds` the regression is that for splats unlike standard fits. It looks at more features, and its ridge pulls
towards the regression of standard fits instead of towards zero. What is printed is what both together say, as in
src/enhance/pixel_size_estimate.cc, with all fits of a mesh left out and with all of a kind. Antialiased fits have no
part in it. `--keep FILE` writes all features to one small file. With `--correction FILE` a third regression learns what
those two leave, by kernels, and is written there; it is cross-validated, too, from estimates that were themselves made
without the mesh. Fits that have no "showing" (older features) are taken as if few of their Gaussians did.

With `--soft` the regression is the last one: what the estimate is still off by, learned from classic fits, those to soft
pictures (kinds that begin with `soft`) among them. It looks at what the program's estimate was before that. FILE of `--keep` has
only what it needs, and none of the fits of pixel-size-kinds.json.gz, which is given beside it.

With `--antialiased` regression and correction are those of antialiased fits, and only of these. The regression looks at
outlines as the antialiased rasterizer draws them, and at sizes. The ridge is that of the best corrected estimates.
"""

import argparse
import gzip
import json
import pathlib
import re

import numpy as np

MOST_DEVIATIONS = 3.0  # as in pixel_size_estimate.cc
SAME_MESH = {"biplane": "BlendSwap-CC-0-cartoon_biplane", "stone_lantern": "BlendSwap-CC-0-stoneLantern"}
SAMPLE_WIDTH = 0.35  # ln: samples count by exp(-½ (ln(size / true) / SAMPLE_WIDTH)²)
OUTLINE = 72  # features of one look
ALPHA = np.arange(OUTLINE)
ANTIALIASED = np.r_[np.arange(OUTLINE, 2 * OUTLINE), np.arange(3 * OUTLINE, 3 * OUTLINE + 16)]
KINDS = np.r_[np.arange(2 * OUTLINE), np.arange(3 * OUTLINE, 3 * OUTLINE + 16)]  # as kKindsPixelSize
STANDARD_FILE = pathlib.Path(__file__).parent.parent / "src/enhance/pixel_size_coefficients.cc"
SIZES, LENGTHS = slice(3 * OUTLINE, 3 * OUTLINE + 16), 12  # the first twelve of the sizes are in units of the pixel
LANDMARKS = 64  # kCorrectionLandmarks
KERNEL, STRAIGHT = 0.5, 0.3  # width of a kernel, and how much the straight part may say
CORRECTION_RIDGE = 0.05
CORRECTION = np.r_[np.arange(OUTLINE), np.arange(3 * OUTLINE, 3 * OUTLINE + 16)]  # as kCorrectionFeatures
SMALLEST_AXES = np.arange(OUTLINE, OUTLINE + 4)  # of CORRECTION; where they are next to nothing, as those of 2DGS, they say nothing
SOFT_WEIGHT, WIDENED_WEIGHT = 4.0, 0.5  # of a fit to soft pictures, and of one that somebody widened
LARGEST_STEP, LARGEST_STEP_UP = 1.0, 0.5  # that is learned, ln
HARDLY_SOFT, SOFT = 0.3, 0.5  # kHardlySoft, kSoft in pixel_size_estimate.cc
MOST_CORRECTION = 0.5  # kMostCorrection
UPWARDS = 0.5  # kUpwards
INTERVAL = 2  # kInterval
LEAST_HALF_OF_COMPENSATED = 0.5  # kLeastHalfOfCompensated
# Antialiased fits to soft pictures have lost next to nothing, those of few steps less than a pixel of theirs. What is learned
# for them is the share of the pixel that gives most.
SOFT_ANTIALIASED, HARMLESS = "aa-soft", 0.35
BEST_SHARE = {"aa-soft-05": 0.75, "aa-2k": 0.75, "aa-64-2k": 0.75, "aa-3k": 0.85}
STANDARD, OTHER = 0.6, 0.9  # kStandard, kOther in pixel_size_estimate.cc
FEW_SHOW, MOST_SHOW = 0.6, 0.75  # kFewShow, kMostShow
PLAUSIBLE, IMPLAUSIBLE = 1.5, 2.2  # kPlausible, kImplausible


def read_items(name):
    with (gzip.open if name.endswith(".gz") else open)(name, "rt", encoding="utf-8") as file:
        return json.load(file)["objects"]


def write_items(objects, path):
    text = json.dumps({"objects": objects}, separators=(",", ":"))
    with gzip.GzipFile(path, "wb", mtime=0) as out:  # the same bytes each time
        out.write(text.encode())


def load(files, weights=()):
    weights = dict(weights)
    objects = []
    for name in files:
        for item in read_items(name):
            samples = [s for s in item["samples"] if None not in s["features"]]
            mesh = item["object"].split("--")[0]  # recipes put the entry behind two hyphens
            kind = item.get("kind", "")
            wanted = BEST_SHARE.get(kind, HARMLESS if kind.startswith(SOFT_ANTIALIASED) else 1) * item["pixel_size"]
            objects.append({
                "name": item["object"],
                "kind": kind,
                "mode": item.get("mode", "classic"),
                "mesh": SAME_MESH.get(mesh, mesh),
                "showing": item.get("showing", 0.0),
                "weight": float(weights.get(item["object"], 1)),
                "offsets": np.log([s["size"] / wanted for s in samples]),
                "all": np.array([s["features"] for s in samples]),
                "start": np.log(item["start"] / wanted),
            })
    return objects


def keep(files, path):
    """All features in one file, to four decimals, which is far below what they vary by."""
    objects = [item for name in files for item in read_items(name)]
    for o in objects:
        for sample in o["samples"]:
            sample["features"] = [None if v is None else round(v, 4) for v in sample["features"]]
    write_items(objects, path)


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


def select(objects, columns):
    for o in objects:
        o["features"] = o["all"][:, columns]


def read_standard(path=STANDARD_FILE):
    """The coefficients as they were written."""
    text = path.read_text(encoding="utf-8")
    array = {key: np.array([float(v) for v in re.search(rf"\.{key} = {{(.*?)}}", text, re.S)[1].split(",")])
             for key in ("mean", "deviation", "weight")}
    return array | {key: float(re.search(rf"\.{key} = ([-+.\de]+)", text)[1]) for key in ("intercept", "error")}


def fit(objects, ridge, prior=None):
    x = np.concatenate([o["features"] for o in objects])
    offsets = np.concatenate([o["offsets"] for o in objects])
    weights = np.exp(-0.5 * (offsets / SAMPLE_WIDTH) ** 2)
    weights *= np.concatenate([np.full(len(o["offsets"]), o["weight"]) for o in objects])
    weights /= weights.sum()
    mean = weights @ x
    deviation = np.sqrt(weights @ (x - mean) ** 2) + 1e-6
    towards = np.zeros(x.shape[1])  # what the ridge pulls to: the first features' weights of `prior`, where they go on
    if prior is not None:
        n = len(prior["weight"])
        deviation[:n] = np.maximum(deviation[:n], prior["deviation"])
        towards[:n] = prior["weight"] * deviation[:n] / prior["deviation"]
    z = np.clip((x - mean) / deviation, -MOST_DEVIATIONS, MOST_DEVIATIONS)
    wanted = -offsets - z @ towards
    z_mean, y_mean = weights @ z, weights @ wanted
    centred = z - z_mean
    normal = (centred * weights[:, None]).T @ centred + ridge * np.eye(x.shape[1])
    weight = np.linalg.solve(normal, (centred * weights[:, None]).T @ (wanted - y_mean))
    return {"mean": mean, "deviation": deviation, "weight": weight + towards, "intercept": y_mean - z_mean @ weight}


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


def cross_validate(objects, ridge, folds=40, by="mesh", prior=None):
    groups = sorted({o[by] for o in objects})
    np.random.default_rng(1).shuffle(groups)
    errors = np.zeros(len(objects))
    for fold in range(min(folds, len(groups))):
        left_out = set(groups[fold::folds])
        model = fit([o for o in objects if o[by] not in left_out], ridge, prior)
        for k, o in enumerate(objects):
            if o[by] in left_out:
                errors[k] = estimate(model, o)
    return errors


def believe_standard(objects, standard, kinds):
    """Puts into every object what the standard regression says and how much the other one counts."""
    for o in objects:
        alpha = {"features": o["all"][:, ALPHA], "offsets": o["offsets"]}
        o["said"] = estimate(standard, alpha)
        at = [np.interp(o["said"], o["offsets"], column) for column in alpha["features"].T]
        strangeness = np.sqrt(np.mean(((at - standard["mean"]) / standard["deviation"]) ** 2))
        sizes = o["all"][0, SIZES].copy()
        sizes[:LENGTHS] -= o["said"] - o["offsets"][0]
        of_sizes = np.sqrt(np.mean(((sizes - kinds["mean"][-16:]) / kinds["deviation"][-16:]) ** 2))
        share = max((strangeness - STANDARD) / (OTHER - STANDARD), (of_sizes - PLAUSIBLE) / (IMPLAUSIBLE - PLAUSIBLE))
        like = np.clip((o["showing"] - FEW_SHOW) / (MOST_SHOW - FEW_SHOW), 0, 1) if o["mode"] != "mip" else 0.0
        o["unlike"] = 1 - like  # which has no part in the correction either
        o["share"] = np.clip(share, 0, 1) * o["unlike"]


def look_at(item, said):
    """The features of the correction where the estimate is exp(said) times the truth: of alpha, and sizes."""
    at = np.clip(said, item["offsets"][0], item["offsets"][-1])
    alpha = [np.interp(at, item["offsets"], column) for column in item["all"][:, ALPHA].T]
    sizes = item["all"][0, SIZES].copy()
    sizes[:LENGTHS] -= said - item["offsets"][0]
    return np.concatenate([alpha, sizes])


def fit_correction(x, y):
    """Ridge regression on z and on kernels around landmarks: rows far from each other."""
    mean, deviation = x.mean(0), x.std(0) + 1e-6
    z = np.clip((x - mean) / deviation, -MOST_DEVIATIONS, MOST_DEVIATIONS)
    chosen = [int(np.argmin((z**2).sum(1)))]
    distance = ((z - z[chosen[0]]) ** 2).sum(1)
    while len(chosen) < LANDMARKS:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, ((z - z[chosen[-1]]) ** 2).sum(1))
    model = {"mean": mean, "deviation": deviation, "landmark": z[chosen]}
    n = z.shape[1]
    straight = np.sqrt(STRAIGHT / n)
    basis = np.hstack([straight * z, kernels(model, z)])
    penalty = np.eye(basis.shape[1])
    penalty[n:, n:] = kernels(model, z[chosen]) + 1e-6 * np.eye(LANDMARKS)
    weights = np.linalg.solve(basis.T @ basis + CORRECTION_RIDGE * penalty, basis.T @ (y - y.mean()))
    return model | {"weight": straight * weights[:n], "height": weights[n:], "intercept": y.mean()}


def kernels(model, z):
    squares = ((z[:, None] - model["landmark"][None]) ** 2).sum(-1)
    return np.exp(-KERNEL * squares / z.shape[1])


def correct(model, x):
    z = np.clip((x - model["mean"]) / model["deviation"], -MOST_DEVIATIONS, MOST_DEVIATIONS)
    step = model["intercept"] + z @ model["weight"] + kernels(model, z) @ model["height"]
    return np.clip(step, -MOST_CORRECTION, MOST_CORRECTION)


def train_correction(objects, both, upwards=UPWARDS):
    """The correction of all, and what the estimates become: of cross-validation by mesh, and by kind."""
    x = np.array([look_at(o, e) for o, e in zip(objects, both)])
    unlike = np.array([o.get("unlike", 1.0) for o in objects])
    results = []
    for by in ("mesh", "kind"):
        corrected = both.copy()
        for group in sorted({o[by] for o in objects}):
            out = np.array([o[by] == group for o in objects])
            step = correct(fit_correction(x[~out], -both[~out]), x[out])
            corrected[out] += unlike[out] * np.where(step > 0, upwards * step, step)
        results.append(corrected)
    return fit_correction(x, -both), *results


def train_kinds(objects, arguments):
    standard = read_standard()
    select(objects, KINDS)
    believe_standard(objects, standard, fit(objects, arguments.ridge[0], standard))
    said, share = (np.array([o[key] for o in objects]) for key in ("said", "share"))
    print(f"standard alone: {describe(said)}")

    def together(alone):  # it may only lower
        return np.minimum(said, (1 - share) * said + share * alone)

    results = {}
    for ridge in arguments.ridge:
        alone = cross_validate(objects, ridge, prior=standard)
        results[ridge] = alone, together(alone)
        print(f"ridge {ridge:g}: {describe(results[ridge][1])}")
        print(f"  kinds left out: {describe(together(cross_validate(objects, ridge, by='kind', prior=standard)))}")
    best = min(results, key=lambda r: np.sqrt(np.mean(results[r][1] ** 2)))
    alone, both = results[best]
    print(f"ridge {best:g} chosen; estimate / truth by kind:")
    correction, corrected, unknown = train_correction(objects, both)
    print(f"corrected: {describe(corrected)}")
    print(f"  kinds left out: {describe(unknown)}")
    error = np.sqrt(np.mean(corrected[share > 0] ** 2))
    inside = np.abs(corrected) < INTERVAL * ((1 - share) * standard["error"] + share * error)
    print(f"inside of the interval: {inside.sum()} of {len(inside)}")
    for kind in sorted({o["kind"] for o in objects}):
        mine = [k for k, o in enumerate(objects) if o["kind"] == kind]
        ratios = " ".join(f"{r:.2f}" for r in sorted(np.exp(corrected[mine])))
        two = f"{np.exp(both[mine]).min():.2f}–{np.exp(both[mine]).max():.2f}"
        print(f"  {kind or 'others'}: {np.exp(said[mine]).min():.2f}–{np.exp(said[mine]).max():.2f} → {two} → {ratios}; "
              f"{inside[mine].sum()} of {len(mine)} inside")
    if arguments.list:
        for o, s, e, c in zip(objects, said, both, corrected):
            print(f"  {np.exp(s):.2f} → {np.exp(e):.2f} → {np.exp(c):.2f}  {o['kind']} {o['name']}")
    if arguments.correction:
        write_correction(arguments.correction, correction, len(objects), "kPixelSizeCorrection")
    if arguments.output:
        write(arguments.output, fit(objects, best, standard), error, len(objects), "<kKindsPixelSizeFeatures> kKindsPixelSize")


def train_antialiased(objects, arguments):
    standard = read_standard()
    select(objects, ANTIALIASED)
    results = {}
    for ridge in arguments.ridge:
        alone = cross_validate(objects, ridge, prior=standard)
        print(f"ridge {ridge:g}: {describe(alone)}")
        print(f"  kinds left out: {describe(cross_validate(objects, ridge, by='kind', prior=standard))}")
        results[ridge] = train_correction(objects, alone, upwards=1)
        print(f"  corrected: {describe(results[ridge][1])}")
        print(f"  kinds left out of the correction: {describe(results[ridge][2])}")
    ridge = min(results, key=lambda r: np.sqrt(np.mean(results[r][1] ** 2)))
    correction, corrected, _ = results[ridge]
    print(f"ridge {ridge:g} chosen; estimate / what it should learn, by kind:")
    sharp = np.array([not o["kind"].startswith(SOFT_ANTIALIASED) for o in objects])
    error = np.quantile(np.abs(corrected[sharp]), 0.9) / INTERVAL  # the interval holds nine in ten
    half = max(INTERVAL * error, LEAST_HALF_OF_COMPENSATED)
    for kind in sorted({o["kind"] for o in objects}):
        mine = sorted(c for c, o in zip(corrected, objects) if o["kind"] == kind)
        print(f"  {kind}: {' '.join(f'{np.exp(c):.2f}' for c in mine)}; "
              f"{sum(abs(c) < half for c in mine)} of {len(mine)} inside")
    if arguments.correction:
        write_correction(arguments.correction, correction, len(objects), "kAntialiasedPixelSizeCorrection")
    if arguments.output:
        write(arguments.output, fit(objects, ridge, standard), error, len(objects),
              "<kAntialiasedPixelSizeFeatures> kAntialiasedPixelSize")


def at_estimate(item):
    """Features of the estimate, between those of the samples; None where it lies far beyond them."""
    if "of_estimate" in item:
        return np.array(item["of_estimate"])
    size = np.log(item["estimate"] / item.get("softness", 1))
    samples = sorted((s for s in item["samples"] if None not in s["features"]), key=lambda s: s["size"])
    if not samples:
        return None
    sizes = np.log([s["size"] for s in samples])
    if not sizes[0] - 0.3 < size < sizes[-1] + 0.3:
        return None
    features = np.array([s["features"] for s in samples])[:, CORRECTION]
    return np.array([np.interp(size, sizes, column) for column in features.T])


def train_soft(arguments):
    items = [item | {"others": name.endswith("pixel-size-kinds.json.gz")}
             for name in arguments.features for item in read_items(name)]
    rows = []
    for item in items:
        features = at_estimate(item) if item.get("mode") not in ("antialiased", "mip") else None
        if features is not None and np.isfinite(features).all():
            kind = item.get("kind") or ""
            mesh = re.sub(r"--.*", "", item["object"])
            rows.append({"name": item["object"], "mesh": SAME_MESH.get(mesh, mesh), "kind": kind, "x": features,
                         "soft": kind.startswith("soft"), "widened": kind.startswith("widened"), "item": item,
                         "off": np.log(item["pixel_size"] / item["estimate"] * item.get("softness", 1))})
    if arguments.keep:
        kept = [{"object": r["name"], "kind": r["kind"], "pixel_size": r["item"]["pixel_size"],
                 "estimate": r["item"]["estimate"] / r["item"].get("softness", 1),
                 "of_estimate": [round(v, 4) for v in r["x"]]}
                for r in rows if not r["item"]["others"]]
        write_items(kept, arguments.keep)
    x = np.array([r["x"] for r in rows])
    off = np.array([r["off"] for r in rows])
    soft = np.array([r["soft"] for r in rows])
    meshes = np.array([r["mesh"] for r in rows])
    widened = np.array([r["widened"] for r in rows])
    weights = np.where(soft, SOFT_WEIGHT, np.where(widened, WIDENED_WEIGHT, 1.0))
    wanted = np.clip(off, -LARGEST_STEP, LARGEST_STEP_UP)
    print(f"{len(rows)} fits of {len(set(meshes))} meshes, {soft.sum()} to soft pictures")

    def standardised(x, mean, deviation):
        z = (x - mean) / deviation
        z[:, SMALLEST_AXES] = np.where(z[:, SMALLEST_AXES] < -MOST_DEVIATIONS, 0, z[:, SMALLEST_AXES])
        return np.clip(z, -MOST_DEVIATIONS, MOST_DEVIATIONS)

    def learn(of, ridge):
        w = weights[of] / weights[of].sum()
        mean = w @ x[of]
        deviation = np.sqrt(w @ (x[of] - mean) ** 2) + 1e-6
        z = standardised(x[of], mean, deviation)
        z_mean, y_mean = w @ z, w @ wanted[of]
        weight = np.linalg.solve(((z - z_mean) * w[:, None]).T @ (z - z_mean) + ridge * np.eye(x.shape[1]),
                                 ((z - z_mean) * w[:, None]).T @ (wanted[of] - y_mean))
        return {"mean": mean, "deviation": deviation, "weight": weight, "intercept": y_mean - z_mean @ weight}

    def apply(model, of):
        return standardised(x[of], model["mean"], model["deviation"]) @ model["weight"] + model["intercept"]

    results = {}
    for ridge in arguments.ridge:
        step = np.zeros(len(rows))
        for mesh in set(meshes):
            step[meshes == mesh] = apply(learn(meshes != mesh, ridge), meshes == mesh)
        share = np.clip((-step - HARDLY_SOFT) / (SOFT - HARDLY_SOFT), 0, 1)
        lowered = share * np.clip(step, -LARGEST_STEP, 0)
        results[ridge] = lowered
        sharp = ~soft & ~widened & (off > -0.3)
        before, now = np.exp(-off[soft]), np.exp((lowered - off)[soft])
        print(f"ridge {ridge:g}: estimate / truth of soft ones {np.median(before):.2f}, worst {before.max():.2f}, "
              f"now {np.median(now):.2f}, nine in ten {np.quantile(now, 0.9):.2f}, worst {now.max():.2f}; "
              f"of {sharp.sum()} right ones {(lowered[sharp] < 0).sum()} lowered, "
              f"{(lowered[sharp] < -0.2).sum()} by a fifth and more, at most to {np.exp(lowered[sharp].min()):.2f}")
    ridge = min(results, key=lambda r: np.mean(weights * (results[r] - off).clip(-0.5, 1) ** 2))
    print(f"ridge {ridge:g} chosen")
    if arguments.list:
        for r, o, l in sorted(zip(rows, off, results[ridge]), key=lambda t: t[2]):
            print(f"  {np.exp(-o):.2f} → {np.exp(l - o):.2f}  {r['kind']} {r['name']}")
    if arguments.output:
        error = np.sqrt(np.mean((results[ridge] - off)[soft] ** 2))
        model = learn(np.ones(len(rows), bool), ridge)
        write(arguments.output, model, error, len(rows), "<kCorrectionFeatures> kSoftPixelSize")


def describe(errors):
    relative = np.abs(np.exp(errors) - 1)
    return (f"off by {100 * np.median(relative):.1f} % in the median, {100 * np.percentile(relative, 95):.1f} % at the "
            f"95th percentile; mean of the logarithm {errors.mean():+.3f}, deviation {errors.std():.3f}")


def write(path, model, error, count, name="<kPixelSizeFeatures> kStandardPixelSize"):
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
const PixelSizeCoefficients{name} = {{
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


def write_correction(path, model, count, name):
    def numbers(values, decimals):
        text = ", ".join(f"{v:.{decimals}f}".rstrip("0").rstrip(".").replace("-0,", "0,") for v in values)
        lines, line = [], "     "
        for word in text.split(" "):
            if len(line) + len(word) + 1 > 118:
                lines.append(line)
                line = "     "
            line += " " + word
        return "\n".join(lines + [line])

    landmarks = ",\n".join(f"        {{{{\n{numbers(row, 2)}}}}}" for row in model["landmark"])
    with open(path, "w", encoding="utf-8") as out:
        out.write(f'''#include "enhance/pixel_size_coefficients.h"

namespace anchorsplat {{

// Written by scripts/train-pixel-size.py from {count} fits; not to be edited.
const PixelSizeCorrection {name} = {{
    .mean = {{
{numbers(model["mean"], 5)}}},
    .deviation = {{
{numbers(model["deviation"], 5)}}},
    .weight = {{
{numbers(model["weight"], 6)}}},
    .intercept = {model["intercept"]:.6g},
    .height = {{
{numbers(model["height"], 6)}}},
    .landmark = {{{{
{landmarks}}}}},
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
    parser.add_argument("--kinds", action="store_true", help="the regression for splats unlike standard fits")
    parser.add_argument("--antialiased", action="store_true", help="the regressions for antialiased splats")
    parser.add_argument("--soft", action="store_true", help="the regression for fits to soft pictures")
    parser.add_argument("--correction", metavar="FILE.cc", help="write the third regression")
    parser.add_argument("--keep", metavar="FILE.json.gz", help="write the features to one file")
    arguments = parser.parse_args()
    if arguments.soft:
        train_soft(arguments)
        return
    if arguments.keep:
        keep(arguments.features, arguments.keep)
    objects = load(arguments.features, (w.split("=") for w in arguments.weight))
    print(f"{len(objects)} fits of {len({o['mesh'] for o in objects})} meshes")
    if arguments.antialiased:
        train_antialiased([o for o in objects if o["mode"] == "antialiased"], arguments)
        return
    if arguments.kinds:
        train_kinds([o for o in objects if o["mode"] != "antialiased"], arguments)
        return
    select(objects, ALPHA)
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
