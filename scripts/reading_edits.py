"""Splats as rows of floats, and what people do to them: the edits of the table of readings (scripts/reading-table.py)."""

import pathlib

import numpy as np

SH0 = 0.28209479177387814  # of a constant colour


# Splats as rows of floats.


class Splat:
    """A binary PLY as `anchorsplat convert` writes it: float properties only."""

    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        end = data.index(b"end_header\n") + len(b"end_header\n")
        header = data[:end].decode().splitlines()
        self.comments = [line for line in header if line.startswith("comment")]
        self.names = [line.split()[2] for line in header if line.startswith("property float")]
        count = next(int(line.split()[2]) for line in header if line.startswith("element vertex"))
        self.rows = np.frombuffer(data, "<f4", count * len(self.names), end).reshape(count, -1).copy()

    def column(self, *names):
        return [self.names.index(name) for name in names]

    def get(self, *names):
        return self.rows[:, self.column(*names)]

    @property
    def places(self):
        return self.get("x", "y", "z")

    @property
    def opacities(self):
        return 1 / (1 + np.exp(-self.get("opacity")[:, 0]))

    def with_rows(self, rows):
        out = object.__new__(Splat)
        out.names, out.comments, out.rows = self.names, [], np.ascontiguousarray(rows, "<f4")
        return out

    def write(self, path, comments=()):
        lines = ["ply", "format binary_little_endian 1.0", *comments, f"element vertex {len(self.rows)}"]
        lines += [f"property float {name}" for name in self.names] + ["end_header"]
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part")
        part.write_bytes("\n".join(lines).encode() + b"\n" + self.rows.tobytes())
        part.rename(path)

    def gaussians(self, places, scales, opacities, colours):
        """Rows of round Gaussians with the same columns."""
        rows = np.zeros((len(places), len(self.names)), "<f4")
        rows[:, self.column("x", "y", "z")] = places
        rows[:, self.column("scale_0", "scale_1", "scale_2")] = np.log(scales)
        rows[:, self.column("rot_0")] = 1
        rows[:, self.column("opacity")] = np.log(opacities / (1 - opacities)).reshape(-1, 1)
        rows[:, self.column("f_dc_0", "f_dc_1", "f_dc_2")] = (colours - 0.5) / SH0
        return rows

    def box(self, margin=0.02):
        """Around what shows, but for the outermost of a thousand."""
        shown = self.places[self.opacities > 0.1]
        low, high = np.quantile(shown, [0.001, 0.999], axis=0)
        return low - margin * (high - low).max(), high + margin * (high - low).max()


# Edits. Each takes (splat, random, pixel) and returns what is left and what a task says of it. `pixel` is that of the
# middle of the object.


def turned(random):
    m, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return m


def cut(splat, inside):
    return splat.with_rows(splat.rows[inside]), {"context": splat.with_rows(splat.rows[~inside])}


def crop_box(splat, random, pixel, frame=np.eye(3), share=0.7):
    along = splat.places @ frame
    low, high = np.quantile(along[splat.opacities > 0.1], [0.5 - share / 2, 0.5 + share / 2], axis=0)
    return cut(splat, ((along >= low) & (along <= high)).all(axis=1))


def crop_turned_box(splat, random, pixel):
    return crop_box(splat, random, pixel, turned(random))


def crop_ball(splat, random, pixel):
    away = np.linalg.norm(splat.places - np.median(splat.places[splat.opacities > 0.1], axis=0), axis=1)
    return cut(splat, away <= np.quantile(away[splat.opacities > 0.1], 0.6))


def crop_lasso(splat, random, pixel):
    """A line drawn by hand around a part, as it is seen from somewhere."""
    seen = splat.places @ turned(random)[:, :2]
    middle = np.median(seen[splat.opacities > 0.1], axis=0)
    d = seen - middle
    angle, away = np.arctan2(d[:, 1], d[:, 0]), np.linalg.norm(d, axis=1)
    phases = random.uniform(0, 2 * np.pi, 3)
    line = 1 + sum(0.2 * np.sin((k + 2) * angle + phases[k]) for k in range(3))
    reach = np.quantile(away[splat.opacities > 0.1], 0.65)
    return cut(splat, away <= reach * line)


def half(splat, random, pixel):
    shown = splat.places[splat.opacities > 0.1]
    axis = np.argmax(np.ptp(shown, axis=0))
    return cut(splat, splat.places[:, axis] > np.median(shown[:, axis]))


def thinned(share):
    return lambda splat, random, pixel: (splat.with_rows(splat.rows[random.random(len(splat.rows)) < share]), {})


def pruned(least):
    return lambda splat, random, pixel: (splat.with_rows(splat.rows[splat.opacities >= least]), {})


def raised(logits):
    def edit(splat, random, pixel):
        rows = splat.rows.copy()
        rows[:, splat.column("opacity")] += logits
        return splat.with_rows(rows), {"made": "raised"}
    return edit


def opaque(splat, random, pixel):
    rows = splat.rows.copy()
    rows[:, splat.column("opacity")] = np.maximum(rows[:, splat.column("opacity")], np.log(0.9 / 0.1))
    return splat.with_rows(rows), {"made": "raised"}


def scaled(splat, random, pixel):
    factor, moved = float(random.choice([0.01, 0.3, 7, 300])), random.normal(size=3)
    rows = splat.rows.copy()
    rows[:, splat.column("x", "y", "z")] = factor * (rows[:, splat.column("x", "y", "z")] + moved)
    rows[:, splat.column("scale_0", "scale_1", "scale_2")] += np.log(factor)
    return splat.with_rows(rows), {"moved": {"scale": factor, "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1],
                                             "translation": (factor * moved).tolist()}}


def without_harmonics(splat, random, pixel):
    keep = [i for i, name in enumerate(splat.names) if not name.startswith("f_rest_")]
    out = splat.with_rows(splat.rows[:, keep])
    out.names = [splat.names[i] for i in keep]
    return out, {}


def added(splat, rows, more=None):
    low, high = splat.box()
    return splat.with_rows(np.concatenate([splat.rows, rows])), {"keep": [*low.tolist(), *high.tolist()]} | (more or {})


def floaters(splat, random, pixel):
    low, high = splat.box()
    middle, reach = (low + high) / 2, (high - low).max()
    places = middle + random.uniform(-1.2, 1.2, (4000, 3)) * reach
    places = places[~((places >= low) & (places <= high)).all(axis=1)][: int(random.integers(60, 800))]
    scales = pixel * np.exp(random.uniform(-1, 3, (len(places), 1))) * np.exp(random.normal(0, 0.5, (len(places), 3)))
    return added(splat, splat.gaussians(places, scales, random.uniform(0.05, 0.95, len(places)), random.random((len(places), 3))))


def on_ground(splat, random, pixel):
    low, high = splat.box()
    middle, side = (low + high) / 2, 1.6 * (high - low).max()
    spacing = pixel * float(random.choice([2, 4, 8]))
    along = np.arange(-side, side, spacing)
    x, z = np.meshgrid(along, along)
    places = np.stack([middle[0] + x.ravel(), np.full(x.size, low[1] - spacing), middle[2] + z.ravel()], -1)
    places[:, [0, 2]] += random.normal(0, 0.2 * spacing, (len(places), 2))
    scales = np.tile([0.7 * spacing, 0.1 * spacing, 0.7 * spacing], (len(places), 1))
    colours = 0.4 + 0.1 * random.normal(size=(len(places), 1)) + np.zeros(3)
    return added(splat, splat.gaussians(places, scales, np.full(len(places), 0.9), colours))


def before_sky(splat, random, pixel):
    low, high = splat.box()
    middle, reach = (low + high) / 2, (high - low).max()
    direction = random.normal(size=(1500, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    places = middle + direction * reach * random.uniform(6, 8, (1500, 1))
    scales = reach * random.uniform(0.2, 0.6, (1500, 3))
    return added(splat, splat.gaussians(places, scales, np.full(1500, 0.8), 0.5 + 0.2 * random.random((1500, 3))))


EDITS = {
    "crop: box": crop_box,
    "crop: turned box": crop_turned_box,
    "crop: ball": crop_ball,
    "crop: lasso": crop_lasso,
    "crop: half": half,
    "thinned: half": thinned(0.5),
    "thinned: fifth": thinned(0.2),
    "pruned: faint": pruned(0.1),
    "pruned: below 0.3": pruned(0.3),
    "raised: by 2 logits": raised(2),
    "raised: to 0.9": opaque,
    "scaled and moved": scaled,
    "without harmonics": without_harmonics,
    "floaters": floaters,
    "on ground": on_ground,
    "before a sky": before_sky,
    "merged": None,  # takes another splat of the same fold
    "turned": None,  # these take the program
    "through .spz": None,
    "through .sog": None,
    "through .splat": None,
    "through .compressed.ply": None,
    "through .glb": None,
    "filtered before": None,
    "enhanced before": None,
    "enhanced before, one for one": None,
}
COMMON = ("filtered before", "enhanced before")  # drawn twice as often: being enhanced is to be told from all else
