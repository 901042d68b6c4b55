"""What the table of readings is made of, before anybody edits it: fits, land, a room, photographs, what converters make of
meshes, strangers' splats (scripts/reading-table.py)."""

import hashlib
import json
import pathlib

import numpy as np

from reading_edits import Splat, without_harmonics

HERE = pathlib.Path(__file__).resolve().parent.parent
UNMEASURED = ("pixels", "pixels-256", "pixels-standard")  # fits of which no gains are measured
DOWNSCALE = 4  # of photographs
# How posed pictures are fitted: real photographs the first way, at an eighth, and in some of the others, drawn by a hash;
# those that are made of strangers' splats in two of the others.
WAYS = {
    "photographed": ["--steps", 5000],
    "photographed, 1500 steps": ["--steps", 1500, "--max-gaussians", 20000],
    "photographed, 6000 steps": ["--steps", 6000, "--max-gaussians", 20000],
    "photographed, few": ["--steps", 3000, "--max-gaussians", 8000],
    "photographed, random": ["--steps", 3000, "--max-gaussians", 20000, "--init", "view", "--init-points", 15000],
    "photographed, absgrad": ["--steps", 3000, "--max-gaussians", 20000, "--strategy", "absgrad"],
    "photographed, mcmc": ["--steps", 3000, "--max-gaussians", 20000, "--strategy", "mcmc"],
    "antialiased, photographed": ["--steps", 3000, "--max-gaussians", 20000, "--mode", "antialiased"],
    "antialiased, photographed, mcmc": ["--steps", 3000, "--max-gaussians", 20000, "--mode", "antialiased", "--strategy", "mcmc"],
    "mip, photographed": ["--steps", 3000, "--max-gaussians", 20000, "--mip-filter"],
}
SMALL_WAY = "photographed, eighth"  # the same pictures, other pixels
WAYS_OF_STRANGERS, WAYS_OF_PHOTOGRAPHS = 2, 2
FEW_EDITS, LATER_EDITS = 4, 2  # of large splats and those without gains; of those that joined the table later
SCENE_VIEWS, SCENE_SIZE, SCENE_ANGLE = 64, 512, 40  # of strangers' splats: pictures, their pixels, degrees
SPLATS = (".ply", ".spz", ".splat", ".sog", ".ksplat", ".glb", ".gltf", ".npz", ".csv")  # of strangers
LOW_CAMERAS = [f"transforms_{size}.json" for size in (64, 96, 128, 192, 256, 400, "lr")]  # of the pictures that were fitted


def digest(text):
    return int(hashlib.sha256(text.encode()).hexdigest(), 16)


def read_objects(folder, made_of):
    """Fits of a data set; nothing where it was not made."""
    if not (folder / "manifest.jsonl").exists():
        return
    for line in sorted((folder / "manifest.jsonl").read_text().splitlines()):
        record = json.loads(line)
        name = record["name"]
        mesh, kind = (name.split("--") + [record.get("recipe", "")])[:2]
        yield {"original": name, "mesh": mesh, "maker": "", "kind": kind, "made": made_of(kind), "object": folder / name,
               "splat": folder / name / "splat.ply"}


def made_by(kind):
    return "antialiased" if kind.startswith("antialiased") else "mip" if kind.startswith("mip") else "classic"


class Names:
    """Numbers instead of names, in the order of a hash at first; who joins later gets the next ones."""

    def __init__(self, work):
        self.path = work / "names.json"
        self.known = json.loads(self.path.read_text()) if self.path.exists() else {}

    def of(self, things, word):
        """{thing: number} of paths, by the names of their files."""
        numbers = self.known.setdefault(word, {})
        for thing in sorted(things, key=lambda p: digest(p.name)):
            numbers.setdefault(thing.name, len(numbers) + 1)
        self.path.write_text(json.dumps(self.known, indent=1))
        return {thing: numbers[thing.name] for thing in sorted(things, key=lambda p: numbers[p.name])}


def folders(path):
    return [p for p in path.iterdir() if p.is_dir()]


def photographs(arguments):
    """{project: name}."""
    if not arguments.photos:
        return {}
    return {p: f"photographs-{k}" for p, k in Names(arguments.work).of(folders(arguments.photos), "photographs").items()}


def strangers(arguments):
    """(splat, its name, its maker's, how it was made: what made.txt of the maker's folder says, or nothing)."""
    if not arguments.strangers:
        return
    names = Names(arguments.work)
    for maker, k in names.of(folders(arguments.strangers), "makers").items():
        made = (maker / "made.txt").read_text().strip() if (maker / "made.txt").exists() else ""
        splats = [p for p in maker.iterdir() if p.is_file() and p.name.endswith(SPLATS)]
        for splat, n in names.of(splats, f"maker-{k}").items():
            yield splat, f"maker-{k}-{n}", f"maker-{k}", made


def scenes(arguments):
    """Posed pictures to fit: (project, its name, whose it is, ways to fit it): photographs, and pictures of strangers' splats."""
    for project, name in photographs(arguments).items():
        yield project, name, name, ["photographed", SMALL_WAY, *ways_of(name, WAYS_OF_PHOTOGRAPHS)]
    for _, name, maker, _ in strangers(arguments):
        project = arguments.work / "scenes-of-strangers" / name
        if project.exists():
            yield project, f"{name}--refitted", maker, ways_of(name, WAYS_OF_STRANGERS)


def ways_of(name, count):
    return sorted(list(WAYS)[1:], key=lambda way: digest(f"{name} {way}"))[:count]


def downscale_of(way):
    return 2 * DOWNSCALE if way == SMALL_WAY else DOWNSCALE


def options_of(way):
    return ["--downscale", downscale_of(way), *WAYS["photographed" if way == SMALL_WAY else way]]


def write_scene(splat, project, render):
    """Cameras around a splat, and what they see of it."""
    shown = splat.places[splat.opacities > 0.1]
    middle = np.median(shown, axis=0)
    away = np.quantile(np.linalg.norm(shown - middle, axis=1), 0.95) / np.sin(np.radians(SCENE_ANGLE / 2))
    frames = []
    for k in range(SCENE_VIEWS):
        height, turn = 1.4 * (k + 0.5) / SCENE_VIEWS - 0.7, k * np.pi * (3 - 5**0.5)
        back = np.array([np.cos(turn) * (1 - height**2) ** 0.5, height, np.sin(turn) * (1 - height**2) ** 0.5])
        right = np.cross([0, 1, 0], back)
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
        pose[:3, 3] = middle + away * back
        frames.append({"file_path": f"images/{k:03}.png", "transform_matrix": pose.tolist()})
    focal = 0.5 * SCENE_SIZE / np.tan(np.radians(SCENE_ANGLE / 2))
    cameras = {"w": SCENE_SIZE, "h": SCENE_SIZE, "fl_x": focal, "fl_y": focal, "cx": SCENE_SIZE / 2, "cy": SCENE_SIZE / 2,
               "frames": frames}
    part = project.with_name(project.name + ".part")
    part.mkdir(parents=True, exist_ok=True)
    (part / "transforms.json").write_text(json.dumps(cameras))
    render(part)
    part.rename(project)


def originals(arguments):
    work = arguments.work
    found = list(read_objects(work / "fits", made_by)) + list(read_objects(work / "land", made_by))
    found += [o | {"original": o["original"] + "--more", "edits": LATER_EDITS} for o in read_objects(work / "more", made_by)]
    for name in UNMEASURED:
        found += [o | {"measure": False, "edits": FEW_EDITS} for o in read_objects(work / name, made_by)]
    found += list(mesh_splats(work, found))
    room = work / "scenes/room"
    if (room / "splat.ply").exists():
        found.append({"original": "room", "mesh": "room", "maker": "", "kind": "room", "made": "classic", "object": room,
                      "splat": room / "splat.ply"})
    for example in sorted((HERE / "examples").iterdir()):
        if (example / "input.ply").exists():
            mesh = {"biplane": "BlendSwap-CC-0-cartoon_biplane", "stone_lantern": "BlendSwap-CC-0-stoneLantern"}
            found.append({"original": example.name, "mesh": mesh.get(example.name, example.name), "maker": "",
                          "kind": "example", "made": "classic", "object": example, "splat": example / "input.ply"})
    for project, name, maker, ways in scenes(arguments):
        for way in ways:
            splat = fitted_in(work, name, way)
            if splat.exists():
                kind = way.replace("photographed", "refitted") if "--refitted" in name else way
                found.append({"original": splat.stem, "mesh": name, "maker": maker, "kind": kind, "made": made_by(way),
                              "object": project, "downscale": downscale_of(way), "splat": splat, "edits": LATER_EDITS})
    return found


def fitted_in(work, name, way):
    end = "" if way == "photographed" else "--" + way.replace(",", "").replace(" ", "-")
    return work / "photographs" / f"{name}{end}.ply"


def mesh_splats(work, fits):
    """What converters make of a mesh: a disc on every point of its surface, all alike. Of every third mesh."""
    for mesh in sorted({fit["mesh"] for fit in fits if "--" in fit["original"]}):
        if digest("points of " + mesh) % 3:
            continue
        fit = next(f for f in fits if f["mesh"] == mesh)
        low = sorted(p.name for p in fit["object"].iterdir() if p.name.isdigit())
        low = min(low, key=int)
        out = work / "meshes" / f"{mesh}.ply"
        if not out.exists():
            places, colours = colmap_points(fit["object"] / low / "sparse/0/points3D.bin")
            splat = Splat(fit["splat"])
            away = np.sort(((places[:200, None] - places[None]) ** 2).sum(-1), axis=1)[:, 4] ** 0.5
            scales = np.full((len(places), 3), 0.6 * np.median(away))
            made = splat.with_rows(splat.gaussians(places, scales, np.full(len(places), 0.99), np.clip(colours, 0.01, 0.99)))
            made, _ = without_harmonics(made, None, None)
            made.write(out)
        yield fit | {"original": f"{mesh}--points", "kind": "points of a mesh", "made": "mesh", "splat": out}


def colmap_points(path):
    data = path.read_bytes()
    count, at = int(np.frombuffer(data, "<u8", 1)[0]), 8
    places, colours = np.zeros((count, 3)), np.zeros((count, 3))
    for i in range(count):
        places[i] = np.frombuffer(data, "<f8", 3, at + 8)
        colours[i] = np.frombuffer(data, "u1", 3, at + 32) / 255
        at += 8 + 24 + 3 + 8
        at += 8 + 8 * int(np.frombuffer(data, "<u8", 1, at)[0])
    return places, colours


def low_pixel(original):
    """Of the middle of a mesh's views; of what is no object, a size that is about right."""
    for name in LOW_CAMERAS:
        path = original["object"] / name
        if path.exists():
            cameras = json.loads(path.read_text())
            centres = np.array([np.array(f["transform_matrix"])[:3, 3] for f in cameras["frames"]])
            frame = cameras | cameras["frames"][0]
            focal = frame.get("fl_x") or 0.5 * frame["w"] / np.tan(0.5 * frame["camera_angle_x"])
            return float(np.median(np.linalg.norm(centres, axis=1)) / focal)
    splat = Splat(original["splat"])
    axes = np.sort(np.exp(splat.get("scale_0", "scale_1", "scale_2")), axis=1)
    return float(np.median(axes[:, 1]))
