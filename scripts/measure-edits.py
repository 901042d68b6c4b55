#!/usr/bin/env python3
"""What `enhance` does, without cameras, to splats that somebody has edited.

    scripts/measure-edits.py parts FOLDER... --work WORK [--captures SPLAT...]
    scripts/measure-edits.py edits EXAMPLE... --work WORK [--only TEXT]

parts: every fit of FOLDER (as for `anchorsplat eval`) is cut by boxes, a ball and a plane. Printed is the pixel that
`enhance` takes over the true one; of captures, whose pixels nobody knows, over what it takes of the whole. Where the
estimate is contradicted no region gets more than it bears, and at most so much.
edits: the splats of EXAMPLE (input.ply, transforms_hr.json, hr/) before a sky, on a ground, beside a second thing, with
floaters, without faint Gaussians, wider, more opaque. PSNR of the subject as it was edited, then the gain; what was
added is taken out again before it is looked at. Needs NumPy.
"""

import argparse
import json
import pathlib
import subprocess
import sys

import numpy as np

SEED = 5


def run(*command):
    return subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE, text=True).stdout


class Splat:
    """The rows of a binary PLY as `anchorsplat convert` writes it: float properties only."""

    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        end = data.index(b"end_header\n") + len(b"end_header\n")
        self.header = data[:end].decode().splitlines()
        names = [line.split()[2] for line in self.header if line.startswith("property float")]
        count = next(int(line.split()[2]) for line in self.header if line.startswith("element vertex"))
        self.rows = np.frombuffer(data, "<f4", count * len(names), end).reshape(count, len(names)).copy()
        self.column = {name: i for i, name in enumerate(names)}

    def columns(self, *names):
        return [self.column[name] for name in names]

    @property
    def places(self):
        return self.rows[:, self.columns("x", "y", "z")]

    @property
    def opacities(self):
        return 1 / (1 + np.exp(-self.rows[:, self.column["opacity"]]))

    def write(self, path, rows):
        lines = [f"element vertex {len(rows)}" if line.startswith("element vertex") else line for line in self.header]
        pathlib.Path(path).write_bytes("\n".join(lines).encode() + b"\n" + np.ascontiguousarray(rows, "<f4").tobytes())


def splat_of(program, source, work):
    out = work / "whole.ply"
    run(program, "convert", source, out, "-w", "-q")
    return Splat(out)


# Parts: which Gaussians are left.


def turn(axis, degrees):
    a, m = np.radians(degrees), np.eye(3)
    i, j = [k for k in range(3) if k != axis]
    m[i, i] = m[j, j] = np.cos(a)
    m[i, j], m[j, i] = -np.sin(a), np.sin(a)
    return m


def box(places, visible, share, frame=np.eye(3)):
    along = places @ frame
    low, high = np.quantile(along[visible], [0.5 - share / 2, 0.5 + share / 2], axis=0)
    return ((along >= low) & (along <= high)).all(axis=1)


def ball(places, visible, share):
    away = np.linalg.norm(places - np.median(places[visible], axis=0), axis=1)
    return away <= np.quantile(away[visible], share)


def half(places, visible):
    axis = np.argmax(np.ptp(places[visible], axis=0))
    return places[:, axis] > np.median(places[visible, axis])


PARTS = {
    "box": lambda p, v: box(p, v, 0.7),
    "turned box": lambda p, v: box(p, v, 0.7, turn(0, 30) @ turn(1, 20) @ turn(2, 40)),
    "ball": lambda p, v: ball(p, v, 0.6),
    "half": half,
    "small box": lambda p, v: box(p, v, 0.4),
}


def pixel_taken(program, path, out):
    told = json.loads(run(program, "enhance", path, "-o", out, "--method", "filter", "--json", "-q", "-w"))[0]
    return told.get("pixel_size")


def parts_of(program, name, source, truth, work):
    """Pixels taken of all parts with 500 Gaussians or more, over the truth or over that of the whole."""
    splat = splat_of(program, source, work)
    visible = splat.opacities > 0.1
    if truth is None:
        truth = pixel_taken(program, source, work / "out.ply")["value"]
    ratios = []
    for part, inside in PARTS.items():
        kept = splat.rows[inside(splat.places, visible)]
        if len(kept) < 500:
            continue
        splat.write(work / "part.ply", kept)
        found = pixel_taken(program, work / "part.ply", work / "out.ply")
        if found is None or found["value"] is None:
            continue
        ratio, doubted = found["value"] / truth, bool(found["contradictions"])
        ratios.append((ratio, doubted))
        print(f"  {name}, {part}: {len(kept)} Gaussians, {ratio:.2f}{' at most' if doubted else ''}", flush=True)
    return ratios


def measure_parts(arguments):
    for folder in arguments.folders:
        found = json.loads(run(arguments.program, "bench", "pixel-size", folder, "--json", "-q"))
        ratios = []
        for fit in found["objects"]:
            own = folder / fit["object"]
            source = own / ("splat.ply" if (own / "splat.ply").exists() else "input.ply")
            ratios += parts_of(arguments.program, fit["object"], source, fit["pixel_size"], arguments.work)
        summary(folder, ratios)
    if arguments.captures:
        ratios = []
        for source in arguments.captures:
            ratios += parts_of(arguments.program, source.name, source, None, arguments.work)
        summary("captures", ratios)


def summary(name, ratios):
    r, doubted = np.array([ratio for ratio, _ in ratios]), np.array([d for _, d in ratios])
    print(f"{name}: {len(r)} parts; median {np.median(r):.2f}, 90 % {np.quantile(r, 0.9):.2f}; {doubted.sum()} contradicted; "
          f"of the others the worst {r[~doubted].max(initial=0):.2f}, {(r[~doubted] > 1.25).sum()} above 1.25", flush=True)


# Edits: rows of the subject, and rows that are added to it.


def discs(splat, places, normals, width, random):
    """Opaque discs of random colours, as far surroundings are fitted."""
    rows = np.zeros((len(places), splat.rows.shape[1]), "<f4")
    rows[:, splat.columns("x", "y", "z")] = places
    wide = np.log(width) + 0.3 * random.standard_normal((len(places), 2))
    rows[:, splat.columns("scale_0", "scale_1", "scale_2")] = np.column_stack([wide, np.full(len(places), np.log(0.1 * width))])
    w = np.sqrt(np.maximum(0.5 * (1 + normals[:, 2]), 1e-6))  # z onto the normal
    rows[:, splat.columns("rot_0", "rot_1", "rot_2")] = np.stack([w, -normals[:, 1] / (2 * w), normals[:, 0] / (2 * w)], 1)
    rows[:, splat.column["opacity"]] = 3 + random.standard_normal(len(places))
    rows[:, splat.columns("f_dc_0", "f_dc_1", "f_dc_2")] = random.uniform(-1, 1, (len(places), 3))
    return rows


def sky(count, away):
    def added(splat, random):
        normals = random.standard_normal((count, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        middle, size = extent(splat)
        spacing = np.sqrt(4 * np.pi / count) * away * size
        return discs(splat, middle + away * size * normals, normals, 0.5 * spacing, random)
    return added


def ground(count, reach):
    def added(splat, random):
        middle, size = extent(splat)
        places = middle + size * np.column_stack([random.uniform(-reach, reach, (count, 2)), np.full(count, -0.7)])
        return discs(splat, places, np.tile([0, 0, 1.0], (count, 1)), reach * size / np.sqrt(count), random)
    return added


def second(scale, times=1):
    """The subject once more, so many times as large, beside itself; or several of that size in a row."""
    def added(splat, _):
        middle, size = extent(splat)
        place, axes = splat.columns("x", "y", "z"), splat.columns("scale_0", "scale_1", "scale_2")
        copies = []
        for k in range(times):
            rows = splat.rows.copy()
            rows[:, place] = (rows[:, place] - middle) * scale + middle + [1.5 * (k + 1) * scale * size, 0, 0]
            rows[:, axes] += np.log(scale)
            copies.append(rows)
        return np.concatenate(copies)
    return added


def floaters(count):
    def added(splat, random):
        rows = splat.rows[random.integers(0, len(splat.rows), count)]
        middle, size = extent(splat)
        rows[:, splat.columns("x", "y", "z")] = middle + size * random.uniform(-1, 1, (count, 3))
        rows[:, splat.columns("scale_0", "scale_1", "scale_2")] += np.log(5)
        return rows
    return added


def extent(splat):
    seen = splat.places[splat.opacities > 0.1]
    return np.median(seen, axis=0), np.ptp(np.quantile(seen, [0.02, 0.98], axis=0), axis=0).max()


def wider(factor):
    def changed(splat):
        rows = splat.rows.copy()
        rows[:, splat.columns("scale_0", "scale_1", "scale_2")] += np.log(factor)
        return rows
    return changed


def more_opaque(logits):
    def changed(splat):
        rows = splat.rows.copy()
        rows[:, splat.column["opacity"]] += logits
        return rows
    return changed


EDITS = {  # name: (the subject's rows, what is added)
    "as it is": (None, None),
    "a sky of 80,000, 20 times as far": (None, sky(80000, 20)),
    "a sky of 80,000, 5 times as far": (None, sky(80000, 5)),
    "a sky of 40,000, 20 times as far": (None, sky(40000, 20)),
    "a near sky of 4,000": (None, sky(4000, 1.2)),
    "a ground of 70,000": (None, ground(70000, 5)),
    "a second one, twice as large": (None, second(2)),
    "a second one, 3 times as large": (None, second(3)),
    "a second one, 8 times as large": (None, second(8)),
    "twelve more, 3 times as large": (None, second(3, 12)),
    "500 floaters": (None, floaters(500)),
    "5,000 floaters": (None, floaters(5000)),
    "without those below 0.1": (lambda s: s.rows[s.opacities > 0.1], None),
    "without those below 0.5": (lambda s: s.rows[s.opacities > 0.5], None),
    "every second one": (lambda s: s.rows[::2], None),
    "opacity + 1 logit": (more_opaque(1), None),
    "1.1 times as wide": (wider(1.1), None),
    "1.3 times as wide": (wider(1.3), None),
}


def psnr(arguments, splat, example):
    told = run(arguments.program, "compare", splat, example / "hr", "--cameras",
               example / "transforms_hr.json", "--json", "-q")
    return json.loads(told)["mean"]["psnr"]


def measure_edits(arguments):
    print("| edit | " + " | ".join(e.name for e in arguments.folders) + " |\n|---|" + "---:|" * len(arguments.folders))
    wholes = {}
    for example in arguments.folders:
        wholes[example] = splat_of(arguments.program, example / "input.ply", arguments.work)
    for name, (changed, added) in EDITS.items():
        if arguments.only and arguments.only not in name:
            continue
        cells = []
        for example in arguments.folders:
            splat, random = wholes[example], np.random.default_rng(SEED)
            subject = changed(splat) if changed else splat.rows
            everything = np.concatenate([subject, added(splat, random)]) if added else subject
            cells.append(gain(arguments, example, splat, subject, everything, added is not None))
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def gain(arguments, example, splat, subject, everything, taken_out):
    """Before and gain, of the subject alone: what lies within what holds all of its Gaussians."""
    work = arguments.work
    splat.write(work / "before.ply", subject)
    splat.write(work / "edited.ply", everything)
    out = work / "after.ply"
    run(arguments.program, "enhance", work / "edited.ply", "-o", out, "-q", "-w")
    if taken_out:
        run(arguments.program, "convert", out, work / "plain.ply", "-w", "-q")
        after = Splat(work / "plain.ply")
        places = subject[:, splat.columns("x", "y", "z")]
        low, high = places.min(axis=0), places.max(axis=0)
        margin = 0.01 * (high - low)
        # Floaters lie among the subject's Gaussians, before as after.
        splat.write(work / "before.ply", cut(splat, everything, low - margin, high + margin))
        after.write(out, cut(after, after.rows, low - margin, high + margin))
    before = psnr(arguments, work / "before.ply", example)
    return f"{before:.2f} {psnr(arguments, out, example) - before:+.2f}"


def cut(splat, rows, low, high):
    places = rows[:, splat.columns("x", "y", "z")]
    return rows[((places >= low) & (places <= high)).all(axis=1)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["parts", "edits"])
    parser.add_argument("folders", nargs="*", type=pathlib.Path)
    parser.add_argument("--captures", nargs="*", type=pathlib.Path, default=[])
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--program", default="build/anchorsplat")
    parser.add_argument("--only", help="of the edits those that have this in their names")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    (measure_parts if arguments.what == "parts" else measure_edits)(arguments)


if __name__ == "__main__":
    sys.exit(main())
