#!/usr/bin/env python3
"""Learns to read splats from the table of readings: what is in models/reading.safetensors, and how good that is.

    scripts/train-reading.py data/reading.jsonl.gz -o models/reading.safetensors [--folds FOLDER]

An ensemble of perceptrons looks at what can be seen of a splat and says its training pixel and how sure that is, how it was made,
and what the filter and a network would gain and lose at multiples of that pixel: both are expectations, and only rows that lose
teach what is lost. Rows without gains teach the pixel, rows
without a pixel (strangers') how they were made. --folds: also writes FOLDER/fold-0.safetensors to fold-7, each of which has seen no mesh
and no maker of that fold, and prints how good these are; `anchorsplat bench reading --score TABLE --folds FOLDER` decides
every row by the one that has not seen it. The meshes of HELD_OUT are not in the model that is
written: a test asks it about them. Needs NumPy and PyTorch; some minutes of a core.
"""

import argparse
import gzip
import json
import multiprocessing
import pathlib
import struct

import numpy as np
import torch

FOLDS = 8
MADE = ["classic", "antialiased", "mip", "filtered", "enhanced", "raised", "mesh", "generated"]
TREATMENTS = [(mode, method) for mode in ("classic", "antialiased", "mip") for method in ("filter", "network")]
MULTIPLES = 7
OUTPUTS = "pixel provenance gains losses"  # as ReadingModel::Load checks it
MOST_DEVIATIONS = 4  # that count, of a feature; kMostDeviations in src/engine/reading/reading_model.cc
HIDDEN, MEMBERS, EPOCHS, BATCH = 96, 4, 90, 96
LOSSES = 4  # weight of their squared error in training
# Of which the model that is written has seen nothing, so that a test can ask it about them.
HELD_OUT = ["Scopia-spiceTower", "BlendSwap-CC-BY-wardrobe2", "Scopia-futon", "Scopia-bathroom_vanity",
            "BlendSwap-CC-0-emergencySign", "Scopia-mannequinMale"]
INTERVAL = 0.8  # of the pixels that intervals hold
FARTHEST = 0.98  # of splats not learned from that are no stranger than this


def places_of(row):
    """Places of a splat are splats of their own, of which nobody knows what helps them, seen without pictures."""
    labels = {key: row[key] for key in ("id", "mesh", "kind", "fold", "made")} | {"edit": "place"}
    return [labels | place for place in row.get("places", ())]


class Table:
    def __init__(self, path):
        with gzip.open(path, "rt", encoding="utf-8") as lines:
            head = json.loads(next(lines))
            self.names = head["features"]
            self.rows = [row for row in map(json.loads, lines) if "features" in row]
        self.rows += [place for row in self.rows for place in places_of(row)]
        self.x = np.array([[np.nan if v is None else v for v in row["features"]] for row in self.rows], dtype=np.float64)
        self.fold = np.array([row["fold"] for row in self.rows])
        known = [row.get("pixel") and row["made"] != "mesh" for row in self.rows]
        self.pixel = np.array([np.log(row["pixel"] / row["unit"]) if k else np.nan for row, k in zip(self.rows, known)])
        self.made = np.array([MADE.index(row["made"]) if row["made"] in MADE else -1 for row in self.rows])
        self.gains = np.full((len(self.rows), len(TREATMENTS), MULTIPLES), np.nan)
        for i, row in enumerate(self.rows):
            for k, (mode, method) in enumerate(TREATMENTS):
                curve = (row.get("gains") or {}).get(mode)
                if curve:
                    self.gains[i, k] = curve[method]
        self.gains = (2 * np.arcsinh(self.gains / 2)).reshape(len(self.rows), -1)
        self.teaches = (self.made >= 0) | np.isfinite(self.pixel)


class Perceptron(torch.nn.Module):
    def __init__(self, inputs, outputs):
        super().__init__()
        self.layers = torch.nn.ModuleList(
            [torch.nn.Linear(inputs, HIDDEN), torch.nn.Linear(HIDDEN, HIDDEN), torch.nn.Linear(HIDDEN, outputs)])
        self.dropout = torch.nn.Dropout(0.3)

    def forward(self, x):
        for layer in self.layers[:-1]:
            x = self.dropout(torch.nn.functional.silu(layer(x)))
        return self.layers[-1](x)


def scaled(x, mean, deviation):
    z = np.clip((x - mean) / deviation, -MOST_DEVIATIONS, MOST_DEVIATIONS)
    return torch.tensor(np.nan_to_num(z), dtype=torch.float32)


def known(values):
    return torch.tensor(np.nan_to_num(values), dtype=torch.float32), torch.tensor(np.isfinite(values), dtype=torch.float32)


def learn(table, rows, mean, deviation, seed, residuals=None):
    """How sure it is it learns from `residuals` of networks that had not seen the rows: of the pixel, and of gains; else
    from its own, which are too small. Deviations of gains serve to weigh rows, and are not written."""
    torch.manual_seed(seed)
    z = scaled(table.x[rows], mean, deviation)
    pixel, has_pixel = known(table.pixel[rows])
    gains, has_gains = known(table.gains[rows])
    made = torch.tensor(table.made[rows])
    n, curves = len(MADE), table.gains.shape[1]
    if residuals is not None:
        of_pixels, of_gains = (torch.tensor(np.nan_to_num(r), dtype=torch.float32) for r in residuals)
    net = Perceptron(z.shape[1], 2 + n + 3 * curves)
    optimizer = torch.optim.AdamW(net.parameters(), 3e-3, weight_decay=0.1)
    batches = (len(rows) + BATCH - 1) // BATCH
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, EPOCHS * batches)

    def mean_of(values, counts):
        return (values * counts).sum() / (counts.sum() + 1e-6)

    for _ in range(EPOCHS):
        for batch in torch.randperm(len(rows)).split(BATCH):
            out = net(z[batch] + 0.1 * torch.randn(len(batch), z.shape[1]))
            spread, log_deviation = out[:, 1].clamp(-3.5, 1), out[:, 2 + n + 2 * curves :].clamp(-3, 2)
            off, wrong = (out[:, 0] - pixel[batch]).abs(), out[:, 2 + n : 2 + n + curves] - gains[batch]
            if residuals is None:
                loss = mean_of(off * torch.exp(-spread) + spread, has_pixel[batch])
                loss = loss + mean_of(wrong**2 * torch.exp(-2 * log_deviation) / 2 + log_deviation, has_gains[batch])
            else:
                sure, surely = torch.exp(-spread.detach()), torch.exp(-2 * log_deviation.detach())
                unseen, unseen_gains = of_pixels[batch], of_gains[batch]
                loss = mean_of(off * sure + unseen * torch.exp(-spread) + spread, has_pixel[batch])
                loss = loss + mean_of(wrong**2 * surely / 2 + unseen_gains**2 * torch.exp(-2 * log_deviation) / 2 + log_deviation,
                                      has_gains[batch])
            lost = torch.nn.functional.softplus(out[:, 2 + n + curves : 2 + n + 2 * curves])
            loss = loss + LOSSES * mean_of((lost - gains[batch].clamp(max=0).neg()) ** 2, has_gains[batch])
            named = made[batch] >= 0
            loss = loss + 0.5 * torch.nn.functional.cross_entropy(out[named][:, 2 : 2 + n], made[batch][named])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
    return net.eval()


def unseen_residuals(table, rows, mean, deviation):
    """Of every row by a network that has seen no mesh of its fold: |error| of the pixel, errors of gains."""
    of_pixels, of_gains = np.full(len(rows), np.nan), np.full((len(rows), table.gains.shape[1]), np.nan)
    fold, n = table.fold[rows], len(MADE)
    for left_out in np.unique(fold):
        net = learn(table, rows[fold != left_out], mean, deviation, 1000 + left_out)
        own = fold == left_out
        with torch.no_grad():
            said = net(scaled(table.x[rows[own]], mean, deviation)).numpy()
        of_pixels[own] = np.abs(said[:, 0] - table.pixel[rows[own]])
        of_gains[own] = said[:, 2 + n : 2 + n + table.gains.shape[1]] - table.gains[rows[own]]
    return of_pixels, of_gains


class Ensemble:
    def __init__(self, table, rows, members=MEMBERS):
        self.mean = np.nan_to_num(np.nanmean(table.x[rows], 0)).astype(np.float16).astype(np.float64)
        self.deviation = (np.nan_to_num(np.nanstd(table.x[rows], 0)) + 1e-2).astype(np.float16).astype(np.float64)
        residuals = unseen_residuals(table, rows, self.mean, self.deviation)
        self.nets = [learn(table, rows, self.mean, self.deviation, seed, residuals) for seed in range(members)]
        self.calibration = (1.0, 1.0, 0.0)

    def say(self, x):
        """[members, rows, outputs]"""
        with torch.no_grad():
            return np.stack([net(scaled(x, self.mean, self.deviation)).numpy() for net in self.nets])

    def far(self, x):
        z = np.nan_to_num((x - self.mean) / self.deviation)
        return np.sqrt(np.minimum(100, z**2).mean(1))

    def write(self, path, names, metadata):
        tensors = {"mean": self.mean, "deviation": self.deviation, "calibration": np.array(self.calibration)}
        for k in range(3):
            layers = [net.layers[k] for net in self.nets]
            written = 2 + len(MADE) + 2 * MULTIPLES * len(TREATMENTS) if k == 2 else None
            tensors[f"layer{k}.weight"] = np.stack([layer.weight.detach().numpy()[:written] for layer in layers])
            tensors[f"layer{k}.bias"] = np.stack([layer.bias.detach().numpy()[:written] for layer in layers])
        header, data = {"__metadata__": {"features": " ".join(names), "outputs": OUTPUTS} | metadata}, b""
        for name, values in tensors.items():
            values = values.astype("<f4" if name == "calibration" else "<f2")
            header[name] = {"dtype": "F32" if name == "calibration" else "F16", "shape": list(values.shape),
                            "data_offsets": [len(data), len(data) + values.nbytes]}
            data += values.tobytes()
        text = json.dumps(header, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 8)
        path.write_bytes(struct.pack("<Q", len(text)) + text + data)


def pixel_of(table, rows, said):
    """ln(pixel / unit), and half of an interval that is not calibrated; of a whole splat with what is said of its places, as
    CombineWithPlaces in src/engine/reading/reading.cc does it."""
    middle, spread = said[:, :, 0].copy(), np.exp(np.clip(said[:, :, 1], -3.5, 1))
    log_unit = np.log([table.rows[row]["unit"] for row in rows])
    places = {}
    for i, row in enumerate(rows):
        if table.rows[row]["edit"] == "place":
            places.setdefault(table.rows[row]["id"], []).append(i)
    for i, row in enumerate(rows):
        own = places.get(table.rows[row]["id"], [])
        if table.rows[row]["edit"] == "place" or len(own) < 2:
            continue
        pixel = np.median(said[:, own, 0] + log_unit[own], axis=1) - log_unit[i]
        of_places = np.median(spread[:, own], axis=1)
        share, apart = 1 / (1 + (of_places / spread[:, i]) ** 2), pixel - middle[:, i]
        middle[:, i] += share * apart
        spread[:, i] = np.hypot(np.minimum(spread[:, i], of_places), np.sqrt(share * (1 - share)) * apart)
    return middle.mean(0), np.hypot(spread.mean(0), middle.std(0))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, help="the model that has seen all folds")
    parser.add_argument("--folds", type=pathlib.Path, help="folder for those that have not")
    parser.add_argument("--jobs", type=int, default=2, help="processes, of a core each")
    arguments = parser.parse_args()
    table = Table(arguments.table)
    metadata = {"table": arguments.table.name, "licence": "Apache-2.0"}

    kept = [np.flatnonzero((table.fold != fold) & table.teaches) for fold in range(FOLDS)]
    if arguments.output:
        meshes = np.array([row["mesh"] for row in table.rows])
        kept.append(np.flatnonzero(table.teaches & ~np.isin(meshes, HELD_OUT)))
    with multiprocessing.get_context("fork").Pool(arguments.jobs, torch.set_num_threads, (1,)) as pool:
        ensembles = pool.starmap(Ensemble, [(table, rows) for rows in kept], chunksize=1)
    folds = ensembles[:FOLDS]
    middle, half, far = np.zeros((3, len(table.rows)))
    for fold, ensemble in enumerate(folds):
        own = np.flatnonzero(table.fold == fold)
        middle[own], half[own] = pixel_of(table, own, ensemble.say(table.x[own]))
        far[own] = ensemble.far(table.x[own])
    error = np.abs(middle - table.pixel)
    judged = np.isfinite(error)

    edits = np.array([row["edit"] for row in table.rows])
    splats = np.array([row["id"] for row in table.rows])

    def calibrated(without):
        others = table.fold != without
        return (float(np.quantile((error / half)[judged & others & (edits != "place")], INTERVAL)),
                float(np.quantile(far[others & table.teaches & (edits != "place")], FARTHEST)), place_error(others))

    said = middle + np.log([row["unit"] for row in table.rows])  # ln(pixel), world units
    true = table.pixel + said - middle

    def places_by_splat(others):
        """{splat: ln of the pixels that are said of its places, and of the true ones}, each less its mean."""
        which = judged & others & (edits == "place")
        of = {splat: np.flatnonzero(which & (splats == splat)) for splat in np.unique(splats[which])}
        return {splat: (said[own] - said[own].mean(), true[own] - true[own].mean()) for splat, own in of.items() if len(own) > 1}

    def place_error(others):
        """Standard deviation of errors of the places of one splat, around their mean; every splat counts once."""
        variances = [((s - t) ** 2).sum() / (len(s) - 1) for s, t in places_by_splat(others).values()]
        return float(np.sqrt(np.mean(variances)))

    edited = edits != ""
    for name, which in (("as they were fitted", judged & ~edited), ("edited", judged & edited & (edits != "place")),
                        ("place by place", judged & (edits == "place"))):
        print(f"pixels of splats {name}: off by {np.median(error[which]):.3f} (median), {np.quantile(error[which], 0.9):.3f} (90 %), ln")
    kinds = np.array([row["kind"] for row in table.rows])
    print("by kinds of splats that nobody has edited, ln(said / true): median, median size, interval that holds it")
    for kind in np.unique(kinds[judged & ~edited]):
        which = judged & ~edited & (kinds == kind)
        off = (middle - table.pixel)[which]
        holds = np.mean(np.abs(off) <= calibrated(None)[0] * half[which])
        print(f"  {kind:24} {which.sum():4} {np.median(off):+.3f} {np.median(np.abs(off)):.3f} {100 * holds:4.0f} %")
    print("by splats whose true pixels differ by more than a tenth from place to place: they differ by, what is said of them, error, ln")
    alike = []
    for splat, (s, t) in places_by_splat(np.ones_like(judged)).items():
        if t.std() > 0.1:
            print(f"  {splat:44} {len(t):3} {t.std():.2f} {s.std():.2f} {(s - t).std():.2f}")
        else:
            alike.append(s.std())
    print(f"  {len(alike)} others: said to differ by {np.median(alike):.3f} in the median")
    if arguments.folds:
        arguments.folds.mkdir(parents=True, exist_ok=True)
        for fold, ensemble in enumerate(folds):
            ensemble.calibration = calibrated(fold)
            ensemble.write(arguments.folds / f"fold-{fold}.safetensors", table.names, metadata | {"without": f"fold {fold}"})
    if arguments.output:
        ensemble = ensembles[FOLDS]
        ensemble.calibration = calibrated(None)
        ensemble.write(arguments.output, table.names, metadata | {"held_out": " ".join(HELD_OUT)})
        interval, _, of_places = ensemble.calibration
        print(f"{arguments.output}: {arguments.output.stat().st_size / 1e6:.2f} MB, interval {interval:.2f}, places {of_places:.2f}")


if __name__ == "__main__":
    main()
