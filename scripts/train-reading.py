#!/usr/bin/env python3
"""Learns from the table of readings what to do with a splat, and decides every row by what the others taught.

    scripts/train-reading.py data/reading.jsonl.gz -o decisions.jsonl [--caution 0.75]
    anchorsplat bench reading --score data/reading.jsonl.gz --decisions decisions.jsonl

Two ensembles of perceptrons look at a splat at pixels of a size that is tried. The first says how far that is from the true
pixel, by outlines and sizes alone, which the tables of earlier fits have, too (data/pixel-size-*.json.gz). The second looks at
everything, and says of filter and network, drawn either way, what they would gain there and how sure that is, and how the
splat was made. What is done is the best of gain − caution × deviation, or nothing. Rows of a fold are decided by ensembles
that have seen no mesh and no maker of it. Needs NumPy and PyTorch; six minutes of a core.
"""

import argparse
import gzip
import hashlib
import json
import pathlib

import numpy as np
import torch

DATA = pathlib.Path(__file__).resolve().parent.parent / "data"
FOLDS = 8
STEP = 0.5 * np.log(2)  # between the sizes of the features, ln
STEPS = range(-7, 8)
TRIED = np.arange(-6, 6.01, 0.5) * STEP  # ln(size / unit)
FARTHEST = 2.2  # ln: sizes that are tried in training, from the true one
TREATMENTS = [("classic", "filter"), ("classic", "network"), ("antialiased", "filter"), ("antialiased", "network")]
MADE = ["classic", "antialiased", "mip", "filtered", "enhanced", "raised", "mesh"]
SQUASH = 2.0  # dB: gains beyond count by their logarithm
MOST_LOST = -25.0  # dB, beyond what was measured


class Table:
    def __init__(self, path):
        lines = [json.loads(line) for line in gzip.open(path, "rt", encoding="utf-8")]
        self.names, self.multiples = lines[0]["features"], np.array(lines[0]["multiples"])
        self.rows = [row for row in lines[1:] if "features" in row]
        self.values = np.array([[np.nan if v is None else v for v in row["features"]] for row in self.rows])
        self.fold = np.array([row["fold"] for row in self.rows])
        place = {name: i for i, name in enumerate(self.names)}
        sized = sorted({(name.split("[")[0], name.split("].")[1]) for name in self.names if "[" in name})
        self.sized = np.array([[place[f"{a}[{k}].{b}"] for a, b in sized] for k in STEPS])
        self.outlines = [np.array([[place[f"{look}[{k}].{j}"] for j in range(24)] for k in STEPS])
                         for look in ("alpha", "thin")]
        self.sizes = [place[f"size.{k}"] for k in range(12)]
        self.opacities = [place[f"size.{k}"] for k in range(12, 16)]
        lengths = ("spacing", "footprint", "of_many", "dense", "closest", "harmless")
        self.lengths = self.sizes + [i for name, i in place.items()
                                     if name[:5] in ("axis0", "axis1", "axis2") or name[8:] in lengths]
        self.rest = [i for name, i in place.items() if "[" not in name and i not in self.lengths]

    def at(self, row, columns, log_sizes):
        """Between the two nearest steps."""
        steps = np.clip(log_sizes / STEP, STEPS[0], STEPS[-1])
        low = np.clip(np.floor(steps).astype(int), STEPS[0], STEPS[-1] - 1)
        part = (steps - low)[:, None]
        values = self.values[row]
        return values[columns[low - STEPS[0]]] * (1 - part) + values[columns[low - STEPS[0] + 1]] * part

    def of_pixel(self, row, t):
        """As the features of earlier tables: a profile, what it changes by over an octave, and how that changes."""
        parts = []
        for columns in self.outlines:
            middle, up, down = self.at(row, columns, t), self.at(row, columns, t + STEP), self.at(row, columns, t - STEP)
            parts += [middle, up - down, up + down - 2 * middle]
        opacities = np.broadcast_to(self.values[row][self.opacities], (len(t), 4))
        return np.concatenate([*parts, self.values[row][self.sizes] - t[:, None], opacities], 1)

    def of_gain(self, row, t, pixel):
        """`pixel`: ln(pixel / unit), its deviation, and how far the ensemble is apart."""
        log_pixel, deviation, apart = pixel
        off = t - log_pixel
        seen = np.stack([off, off / deviation, np.full(len(t), deviation), np.full(len(t), apart), np.minimum(off, 0),
                         np.maximum(off, 0)], 1)
        change = self.at(row, self.sized, t + STEP) - self.at(row, self.sized, t - STEP)
        rest = np.broadcast_to(self.values[row][self.rest], (len(t), len(self.rest)))
        return np.concatenate([self.at(row, self.sized, t), change, self.values[row][self.lengths] - t[:, None], rest, seen], 1)

    def log_pixel(self, row):
        return np.log(self.rows[row]["pixel"] / self.rows[row]["unit"])

    def gains(self, row, t):
        """[sizes, treatments], NaN where one was not measured."""
        out = np.full((len(t), len(TREATMENTS)), np.nan)
        multiple, measured = np.exp(t - self.log_pixel(row)), np.log(self.multiples)
        for k, (mode, method) in enumerate(TREATMENTS):
            gains = self.rows[row]["gains"].get(mode) or (mode == "classic" and self.rows[row]["gains"].get("mip"))
            if not gains:
                continue
            curve = np.array(gains[method])
            out[:, k] = np.interp(np.log(multiple), measured, curve)
            below, beyond = multiple < self.multiples[0], multiple > self.multiples[-1]
            out[below, k] = curve[0] * (multiple[below] / self.multiples[0]) ** 2
            slope = min((curve[-1] - curve[-2]) / (measured[-1] - measured[-2]), -1)
            out[beyond, k] = np.maximum(curve[-1] + slope * (np.log(multiple[beyond]) - measured[-1]), MOST_LOST)
        return out


class Perceptron(torch.nn.Module):
    def __init__(self, inputs, hidden, outputs, dropout):
        super().__init__()
        self.layers = torch.nn.Sequential(
            torch.nn.Linear(inputs, hidden), torch.nn.SiLU(), torch.nn.Dropout(dropout), torch.nn.Linear(hidden, hidden),
            torch.nn.SiLU(), torch.nn.Linear(hidden, outputs))

    def forward(self, x):
        return self.layers(x)


class Model:
    """Trained on rows of `x` with `loss` (outputs, rows) → mean."""

    def __init__(self, x, outputs, loss, *, hidden, dropout, noise, decay, epochs, seed):
        torch.manual_seed(seed)
        self.mean, self.deviation = np.nanmean(x, 0), np.nanstd(x, 0) + 1e-3
        z = self.scaled(x)
        self.net = Perceptron(x.shape[1], hidden, outputs, dropout)
        optimizer = torch.optim.AdamW(self.net.parameters(), 3e-3, weight_decay=decay)
        batches = len(z) // 256 + 1
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, epochs * batches)
        for _ in range(epochs):
            order = torch.randperm(len(z))
            for rows in order.split(256):
                value = loss(self.net(z[rows] + noise * torch.randn(len(rows), z.shape[1])), rows)
                optimizer.zero_grad()
                value.backward()
                optimizer.step()
                if schedule.last_epoch < schedule.T_max:
                    schedule.step()
        self.net.eval()

    def scaled(self, x):
        return torch.tensor(np.nan_to_num(np.clip((x - self.mean) / self.deviation, -4, 4)), dtype=torch.float32)

    def say(self, x):
        with torch.no_grad():
            return self.net(self.scaled(x)).numpy()


# How far a size is from the true pixel.


def fold_of_mesh(mesh):
    return int(hashlib.sha256(mesh.encode()).hexdigest(), 16) % FOLDS


def pixel_samples(table):
    """Inputs, ln(true / tried), fold and weight."""
    x, y, fold, weight = [], [], [], []
    for row, item in enumerate(table.rows):
        if "gains" not in item or item["made"] == "mesh":
            continue
        t = TRIED[np.abs(TRIED - table.log_pixel(row)) < FARTHEST]
        if len(t):
            x.append(table.of_pixel(row, t))
            y.append(table.log_pixel(row) - t)
            fold += [item["fold"]] * len(t)
            weight += [1.0] * len(t)
    for name in ("pixel-size-kinds", "pixel-size-antialiased"):
        for item in json.load(gzip.open(DATA / f"{name}.json.gz", "rt", encoding="utf-8"))["objects"]:
            for sample in item["samples"]:
                if None in sample["features"]:
                    continue
                v = np.array(sample["features"])  # of three looks, 72 each, then sizes
                x.append(np.concatenate([v[:144], v[216:232]])[None])
                y.append(np.log([item["pixel_size"] / sample["size"]]))
                fold.append(fold_of_mesh(item["object"].split("--")[0]))
                weight.append(1.5)
    return np.nan_to_num(np.concatenate(x)), np.concatenate(y), np.array(fold), np.array(weight)


def learn_pixels(table, seeds):
    """Of every row, by ensembles that have not seen its fold: ln(pixel / unit), deviation, distance of the ensemble."""
    x, y, fold, weight = pixel_samples(table)
    found = [None] * len(table.rows)
    for left_out in range(FOLDS):
        kept = fold != left_out
        wanted = torch.tensor(y[kept], dtype=torch.float32)
        counts = torch.tensor(weight[kept] * np.exp(-0.5 * (y[kept] / 0.8) ** 2), dtype=torch.float32)

        def loss(out, rows):
            spread = out[:, 1].clamp(-3.5, 1)
            return (counts[rows] * ((out[:, 0] - wanted[rows]).abs() * torch.exp(-spread) + spread)).mean()

        models = [Model(x[kept], 2, loss, hidden=96, dropout=0.1, noise=0.05, decay=0.05, epochs=20, seed=seed)
                  for seed in range(seeds)]
        for row in np.flatnonzero(table.fold == left_out):
            seen = np.nan_to_num(table.of_pixel(row, TRIED))
            said, spreads = [], []
            for model in models:
                out = model.say(seen)
                spread = np.exp(np.clip(out[:, 1], -3.5, 1))
                counts_here = np.exp(-0.5 * (out[:, 0] / 0.4) ** 2) / spread**2 + 1e-12
                said.append(np.average(TRIED + out[:, 0], weights=counts_here))
                spreads.append(np.average(spread, weights=counts_here))
            found[row] = (np.mean(said), np.mean(spreads), np.std(said))
        print(f"pixels: fold {left_out + 1} of {FOLDS}", flush=True)
    return found


# What treatments gain.


def gain_samples(table, pixels):
    x, gains, row_of = [], [], []
    for row, item in enumerate(table.rows):
        if "gains" not in item:
            continue
        t = TRIED[np.abs(TRIED - table.log_pixel(row)) < FARTHEST]
        t = t if len(t) else np.array([table.log_pixel(row)])
        x.append(table.of_gain(row, t, pixels[row]))
        gains.append(table.gains(row, t))
        row_of += [row] * len(t)
    return np.concatenate(x), np.arcsinh(np.concatenate(gains) / SQUASH) * SQUASH, np.array(row_of)


def learn_gains(table, pixels, seeds):
    """Of every row: gains [sizes, treatments], their deviations, and probabilities of how it was made."""
    x, gains, row_of = gain_samples(table, pixels)
    made = torch.tensor([MADE.index(table.rows[row]["made"]) if table.rows[row]["made"] in MADE else -1 for row in row_of])
    n = len(TREATMENTS)
    found = [None] * len(table.rows)
    for left_out in range(FOLDS):
        kept = table.fold[row_of] != left_out
        wanted, known = torch.tensor(np.nan_to_num(gains[kept]), dtype=torch.float32), torch.tensor(np.isfinite(gains[kept]))
        kinds = made[torch.tensor(kept)]

        def loss(out, rows):
            mean, spread = out[:, :n], out[:, n:2 * n].clamp(-3, 2)
            of_gain = (((mean - wanted[rows]) ** 2 * torch.exp(-2 * spread) / 2 + spread) * known[rows]).sum() / known[rows].sum()
            named = kinds[rows] >= 0
            return of_gain + 0.3 * torch.nn.functional.cross_entropy(out[named][:, 2 * n:], kinds[rows][named])

        models = [Model(x[kept], 2 * n + len(MADE), loss, hidden=64, dropout=0.2, noise=0.1, decay=0.1, epochs=20, seed=seed)
                  for seed in range(seeds)]
        for row in np.flatnonzero(table.fold == left_out):
            out = np.stack([model.say(table.of_gain(row, TRIED, pixels[row])) for model in models])
            mean = out[:, :, :n]
            variance = np.exp(2 * np.clip(out[:, :, n:2 * n], -3, 2)).mean(0) + mean.var(0)
            kind = np.exp(out[:, :, 2 * n:] - out[:, :, 2 * n:].max(-1, keepdims=True))
            found[row] = (mean.mean(0), np.sqrt(variance), (kind / kind.sum(-1, keepdims=True)).mean(0))
        print(f"gains: fold {left_out + 1} of {FOLDS}", flush=True)
    return found


def decide(table, row, pixel, gain, caution):
    item, (mean, deviation, kind) = table.rows[row], gain
    tag = item["tag"]
    score = mean - caution * deviation
    for k, (mode, _) in enumerate(TREATMENTS):
        if tag is not None and mode != ("classic" if tag == "mip" else tag):
            score[:, k] = -np.inf
    size, treatment = np.unravel_index(np.argmax(score), score.shape)
    nearest = int(np.argmin(np.abs(TRIED - pixel[0])))
    spread = 1.28 * np.hypot(pixel[1], pixel[2])
    decision = {"id": item["id"], "method": "none", "made": MADE[int(np.argmax(kind[nearest]))],
                "low": item["unit"] * np.exp(pixel[0] - spread), "high": item["unit"] * np.exp(pixel[0] + spread)}
    if score[size, treatment] > 0:
        mode, method = TREATMENTS[treatment]
        decision |= {"method": method, "mode": tag or mode, "pixel": item["unit"] * float(np.exp(TRIED[size]))}
    return decision


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    parser.add_argument("--caution", type=float, default=0.75)
    parser.add_argument("--seeds", type=int, default=4, help="perceptrons of each ensemble")
    arguments = parser.parse_args()
    table = Table(arguments.table)
    pixels = learn_pixels(table, arguments.seeds)
    gains = learn_gains(table, pixels, arguments.seeds)
    decisions = [decide(table, row, pixels[row], gains[row], arguments.caution) for row in range(len(table.rows))]
    arguments.output.write_text("".join(json.dumps(d) + "\n" for d in decisions), encoding="utf-8")


if __name__ == "__main__":
    main()
