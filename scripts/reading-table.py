#!/usr/bin/env python3
"""Makes the table of readings: what splats show before they are enhanced, and what helps them (docs/reading.md).

    scripts/reading-table.py fits   --work WORK [--photos FOLDER] [--strangers FOLDER]
                                                                        of meshes, land, a room, photographs, pictures of splats
    scripts/reading-table.py splats --work WORK                         edits of them, and a task for every row
    scripts/reading-table.py rows   --work WORK [--jobs N]              features and gains, the most of the work
    scripts/reading-table.py pack   --work WORK -o data/reading.jsonl.gz [--extend]

    scripts/reading-table.py measure --work WORK --folds FOLDER         what models decide and really gain: WORK/model.jsonl

Each goes on where it was stopped; `all` is the first four of them. WORK/objects has the meshes (scripts/fetch-objects.sh);
`fits` also makes land (scripts/make-land.py) and a room (scripts/make-scenes.sh). --photos: a folder of projects of posed
photographs, --strangers: a folder with a folder of splats for every maker; later stages remember both. What they are called
enters no row: they are photographs-1, maker-1 and so on, and stay so (WORK/names.json). Needs NumPy.
"""

import argparse
import gzip
import json
import pathlib
import resource
import signal
import subprocess
import sys

import numpy as np

from reading_edits import COMMON, EDITS, Splat, added
from reading_originals import (FEW_EDITS, HERE, LOW_CAMERAS, UNMEASURED, digest, fitted_in, low_pixel, options_of, originals,
                               scenes, strangers, write_scene)

FOLDS = 8
EDITS_PER_SPLAT = 8  # besides the splat as it is and without its tag
EDITS_OF_STRANGERS = ("crop: half", "crop: ball", "thinned: half", "pruned: faint", "floaters")
LANDS = {"hills-1": ("hills", 1), "relief-2": ("relief", 2), "town-3": ("town", 3), "town-4": ("town", 4)}
LABELS = ("original", "mesh", "maker", "kind", "edit", "made")


def run(*command, **more):
    return subprocess.run([str(c) for c in command], check=True, **more)


def quietly(*command):
    """Its last words are shown where it fails."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}: {done.stderr.strip()[-400:]}")
    return done.stdout


class Clock:
    """Core-seconds of this process's children, by stage, kept in WORK/core-seconds.json."""

    def __init__(self, work, stage):
        self.path, self.stage = work / "core-seconds.json", stage

    def __enter__(self):
        self.begin = resource.getrusage(resource.RUSAGE_CHILDREN)

    def __exit__(self, *_):
        now = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = now.ru_utime + now.ru_stime - self.begin.ru_utime - self.begin.ru_stime
        kept = json.loads(self.path.read_text()) if self.path.exists() else {}
        kept[self.stage] = kept.get(self.stage, 0) + seconds
        self.path.write_text(json.dumps(kept))


# Stages.


def make_fits(arguments):
    work, program = arguments.work, arguments.program
    objects = work / "objects"
    with Clock(work, "fits"):
        for name in ("fits", "more", *UNMEASURED):
            objects_of = "fits" if name == "more" else name
            run(program, "dataset", "build", "--list", HERE / f"data/reading-{objects_of}.txt", "--objects", objects, "-o",
                work / name, "--recipe", HERE / f"data/reading-{name}.toml", "--jobs", arguments.jobs)
        meshes = [work / "land-meshes" / f"{name}.obj" for name in LANDS]
        for mesh, (kind, seed) in zip(meshes, LANDS.values()):
            mesh.parent.mkdir(exist_ok=True)
            if not mesh.exists():
                run(sys.executable, HERE / "scripts/make-land.py", kind, mesh, "--seed", seed)
        run(program, "dataset", "build", *meshes, "-o", work / "land", "--recipe", HERE / "data/reading-land.toml",
            "--jobs", 1, "--licence", "Apache-2.0")
        for splat, name, _, _ in strangers(arguments):
            project = work / "scenes-of-strangers" / name
            if not project.exists():
                write_scene(Splat(plain_of_stranger(arguments, splat, name)), project, lambda made, of=splat: quietly(
                    program, "render", of, "-o", made / "images", "--cameras", made / "transforms.json", "-w"))
        for project, name, _, ways in scenes(arguments):
            for way in ways:
                out = fitted_in(work, name, way)
                if not out.exists():
                    out.parent.mkdir(exist_ok=True)
                    run(program, "fit", project, "-o", out, *options_of(way), "--checkpoint-every", 500, "--resume")
        run(HERE / "scripts/make-scenes.sh", objects, work / "scenes", program,
            env={"STEPS": "4000", "GAUSSIANS": "60000", "PATH": "/usr/bin:/bin"})


def plain_of_stranger(arguments, splat, name):
    plain = arguments.work / "edits" / name / "plain.ply"
    if not plain.exists():
        plain.parent.mkdir(parents=True, exist_ok=True)
        quietly(arguments.program, "convert", splat, plain, "-w", "-q")
    return plain


def make_splats(arguments):
    work = arguments.work
    found = originals(arguments)
    tasks = []
    with Clock(work, "edits"):
        failed = []
        for original in found:
            tasks += splats_of(arguments, original, found, failed)
        for splat, name, maker, made in strangers(arguments):
            tasks += splats_of_stranger(arguments, splat, name, maker, made)
    (work / "tasks.jsonl").write_text("".join(json.dumps(task) + "\n" for task in tasks))
    print(f"{len(tasks)} tasks of {len(found)} splats")
    if failed:
        raise SystemExit(f"reading-table: {len(failed)} edits failed and have no task, such as {failed[0]}")


def splats_of_stranger(arguments, splat, name, maker, made):
    """As it is, and edited where it is known how it was made: of these, only that is known."""
    labels = {"original": name, "mesh": name, "maker": maker, "kind": "stranger", "made": made}
    tasks = [labels | {"id": name, "edit": "", "splat": str(splat)}]
    folder = arguments.work / "edits" / name
    if not made:
        return tasks
    plain = folder / "untagged.ply"
    if not plain.exists():
        whole = Splat(plain_of_stranger(arguments, splat, name))
        whole.with_rows(whole.rows).write(plain)
    whole = Splat(plain)
    axes = np.sort(np.exp(whole.get("scale_0", "scale_1", "scale_2")), axis=1)
    for edit in EDITS_OF_STRANGERS:
        slug = edit.replace(":", "").replace(" ", "-")
        path = folder / f"{slug}.ply"
        if not path.exists():
            random = np.random.default_rng(digest(f"{name} {edit}") % 2**32)
            EDITS[edit](whole, random, float(np.median(axes[:, 1])))[0].write(path)
        tasks.append(labels | {"id": f"{name}--{slug}", "edit": edit, "splat": str(path)})
    return tasks


def splats_of(arguments, original, found, failed):
    work = arguments.work
    labels = {key: original[key] for key in LABELS if key in original} | {"edit": ""}
    where = {"object": str(original["object"])} | {k: original[k] for k in ("downscale", "measure") if k in original}
    tasks = [labels | where | {"id": original["original"], "splat": str(original["splat"]), "places": places_of(original)}]
    folder = work / "edits" / original["original"]
    splat, pixel = Splat(original["splat"]), low_pixel(original)
    plain = folder / "untagged.ply"
    if not plain.exists():
        splat.with_rows(splat.rows).write(plain)
    if any("SplatRenderMode" in line for line in splat.comments):
        tasks.append(labels | where | {"id": original["original"] + "--untagged", "edit": "untagged", "splat": str(plain)})
    few = FEW_EDITS if len(splat.rows) > 40000 else original.get("edits", EDITS_PER_SPLAT)
    names = [name for name in (*EDITS, *COMMON) if applies(name, original)]
    order = sorted(range(len(names)), key=lambda k: digest(f"{original['original']} {names[k]} {k}"))
    chosen = list(dict.fromkeys(names[k] for k in order))[:few]
    for name in chosen:
        slug = name.replace(":", "").replace(",", "").replace(" ", "-").replace(".", "")
        path = folder / f"{slug}.ply"
        random = np.random.default_rng(digest(f"{original['original']} {name}") % 2**32)
        try:
            more = edited(arguments, original, splat, pixel, name, path, random, found)
        except RuntimeError as error:
            failed.append(f"{original['original']}, {name}: {error}")
            continue
        if more is not None:
            tasks.append(labels | where | {"id": f"{original['original']}--{slug}", "edit": name} | more)
    return tasks


def places_of(original):
    """How many are looked at one by one: many where pixels differ from place to place."""
    if original["made"] == "mesh":
        return 0
    if original["kind"] == "room" or "photographed" in original["kind"]:
        return 32
    return 6 if "downscale" in original else 3


def applies(name, original):
    if original["made"] == "mesh":  # nothing was fitted: what is enhanced or raised of it is nobody's question
        return name.startswith(("crop", "through", "scaled", "on", "before", "floaters", "thinned"))
    if original["kind"] == "room" or "photographed" in original["kind"]:  # what lies around is theirs already
        return name not in ("on ground", "before a sky", "floaters", "merged", "scaled and moved")
    return True


def fold_of(original):
    return digest(original["maker"] or original["mesh"]) % FOLDS


def edited(arguments, original, splat, pixel, name, path, random, found):
    """Writes the splat, and what its task says; nothing where too little of it is left."""
    program, note = arguments.program, path.with_suffix(".json")
    if note.exists():
        return json.loads(note.read_text())
    plain = path.parent / "untagged.ply"
    more = {}
    if name.startswith("through"):
        end = name.split()[1]
        passed = path.with_suffix(end)
        quietly(program, "convert", plain, passed, "-w", "-q")
        more["splat"] = str(passed)
    elif name == "turned":
        axes = str(random.choice(["RUB:", "RFU:", "LUF:", "FLU:", "DRF:"]))
        passed = path.with_name("turned.ply")
        quietly(program, "convert", plain, passed, "--coords", axes, "-w", "-q")
        after = Splat(passed)
        turn = np.linalg.lstsq(splat.places, after.places, rcond=None)[0].T
        if np.linalg.det(turn) < 0:  # a mirror is no move of cameras
            return None
        after.with_rows(after.rows).write(path)
        more["moved"] = {"scale": 1, "rotation": np.round(turn).ravel().tolist(), "translation": [0, 0, 0]}
    elif name in ("filtered before", "enhanced before", "enhanced before, one for one"):
        flags = ["--method", "filter"] if name == "filtered before" else ["--method", "model"]
        flags += ["--copies", 1] if name.endswith("one") else []
        passed = path.with_name("passed.ply")
        quietly(program, "enhance", original["splat"], "-o", passed, *cameras_of(original), *flags, "-w", "-q", "--threads", 1)
        after = Splat(passed)
        after.with_rows(after.rows).write(path)
        passed.unlink()
        more["made"] = "filtered" if name == "filtered before" else "enhanced"
    elif name == "merged":
        others = [o for o in found if fold_of(o) == fold_of(original) and o["mesh"] != original["mesh"] and
                  o["kind"] not in ("room", "example") and "downscale" not in o and o["made"] == original["made"] and
                  o.get("measure") == original.get("measure")]
        others = [o for o in others if Splat(o["splat"]).names == splat.names]
        if not others:
            return None
        other = others[int(random.integers(len(others)))]
        factor = float(random.choice([0.3, 0.5, 1, 2, 3]))
        beside = Splat(other["splat"])
        rows = beside.rows.copy()
        place, scale = beside.column("x", "y", "z"), beside.column("scale_0", "scale_1", "scale_2")
        (low, high), (other_low, _) = splat.box(), beside.box()
        rows[:, place] *= factor
        rows[:, place] += [high[0] - factor * other_low[0] + 0.15, low[1] - factor * other_low[1], 0]
        rows[:, scale] += np.log(factor)
        out, more = added(splat, rows, {"others": {"from": len(splat.rows), "pixel": factor * low_pixel(other)}})
        out.write(path)
    else:
        out, more = EDITS[name](splat, random, pixel)
        if (out.opacities > 0.1).sum() < 500:
            return None
        if "context" in more:
            context = path.with_name(path.stem + "-context.ply")
            more["context"].write(context)
            more["context"] = str(context)
        out.write(path)
    more = {"splat": str(path)} | more
    note.write_text(json.dumps(more))
    return more


def cameras_of(original):
    if "downscale" in original:
        return ["--cameras", original["object"], "--train-width", width_of_photographs(original["object"]) // original["downscale"]]
    for name in LOW_CAMERAS:
        if (original["object"] / name).exists():
            return ["--cameras", original["object"] / name]
    raise RuntimeError(f"{original['object']}: no cameras")


def width_of_photographs(project):
    """As the camera file says, of the first camera."""
    if (project / "transforms.json").exists():
        cameras = json.loads((project / "transforms.json").read_text())
        return int((cameras | cameras["frames"][0])["w"])
    data = next(project.rglob("cameras.bin")).read_bytes()  # count, then id, model and width of the first
    return int(np.frombuffer(data, "<u8", 1, 16)[0])


def run_tasks(arguments, tasks, folder):
    """Rows of tasks, by several processes; their exit codes."""
    folder.mkdir(exist_ok=True)
    jobs = []
    for job in range(arguments.jobs):
        path = folder.with_suffix(f".{job}.jsonl")
        # Whole originals, so that each process renders the truth of an object once.
        path.write_text("".join(json.dumps(t) + "\n" for t in tasks if digest(t["original"]) % arguments.jobs == job))
        with open(folder.with_suffix(f".{job}.log"), "w", encoding="utf-8") as log:
            jobs.append(subprocess.Popen([str(arguments.program), "bench", "reading", "--tasks", str(path), "-o", str(folder),
                                          "--threads", "1"], stdout=log, stderr=log))
    try:
        return [job.wait() for job in jobs]
    finally:
        for job in jobs:  # where this was stopped, they are, too
            job.terminate()
            job.wait()


def make_rows(arguments):
    work = arguments.work
    tasks = [json.loads(t) for t in (work / "tasks.jsonl").read_text().splitlines()]
    if arguments.only:  # of those that have no row, and nothing is looked at again
        tasks = [t for t in tasks if not row_of(work, t).exists()][: arguments.only]
    with Clock(work, "rows"):
        codes = run_tasks(arguments, tasks, work / "rows")
    print(f"{sum(row_of(work, t).exists() for t in tasks)} of {len(tasks)} rows are there")
    if any(codes):
        raise SystemExit(f"reading-table: some rows failed: see {work}/rows.*.log")


def row_of(work, task):
    return work / "rows" / (task["id"] + ".json")


def packed(path):
    """Rows of a table; none where it is not there."""
    if not path.exists():
        return []
    with gzip.open(path, "rt", encoding="utf-8") as lines:
        next(lines)
        return [json.loads(line) for line in lines]


def pack(arguments):
    work = arguments.work
    names = json.loads(quietly(arguments.program, "bench", "reading", HERE / "examples/biplane/input.ply", "--features",
                               "--json"))["names"]
    before = packed(arguments.output)
    # What the list of rules did that was there before there was a model. It cannot be asked any more.
    list_said = {row["id"]: row["list"] for row in before if "list" in row}
    tasks = [json.loads(task) for task in (work / "tasks.jsonl").read_text().splitlines()]
    made = {task["original"] for task in tasks}
    rows, missing = [row for row in before if arguments.extend and row["original"] not in made], []
    for task in tasks:
        path = row_of(work, task)
        if not path.exists():
            missing.append(task["id"])
            continue
        row = json.loads(path.read_text())
        row.pop("state", None)  # what it was made of has paths
        row["fold"] = fold_of(row)
        if row["id"] in list_said:
            row["list"] = list_said[row["id"]]
        rows.append(row)
    if not rows:
        raise SystemExit(f"reading-table: no rows in {work}/rows")
    rows.sort(key=lambda row: row["id"])
    if missing and not arguments.partial:
        raise SystemExit(f"reading-table: {len(missing)} rows are missing, such as {missing[0]}: the stage `rows` makes them, "
                         "--partial packs those that are there")
    clock = work / "core-seconds.json"
    kept = json.loads(clock.read_text()) if clock.exists() else {}
    head = {"table": "readings", "multiples": [0.25, 0.35, 0.5, 0.7, 1, 1.4, 2], "folds": FOLDS, "features": names,
            "core_hours": {stage: round(seconds / 3600, 2) for stage, seconds in kept.items()}}
    text = "".join(json.dumps(item, separators=(",", ":")) + "\n" for item in [head, *rows])
    with open(arguments.output, "wb") as file, gzip.GzipFile("", "wb", fileobj=file, mtime=0) as out:
        out.write(text.encode())  # the same bytes each time
    kinds = {row["kind"] for row in rows}
    print(f"{len(rows)} rows, {len(kinds)} kinds, {len({row['mesh'] for row in rows})} meshes, "
          f"{arguments.output.stat().st_size / 1e6:.1f} MB")


def measure(arguments):
    """What the program does by itself with the models of --folds, and gains, as `bench reading --decisions` takes it."""
    if not arguments.folds:
        raise SystemExit("reading-table: measure needs --folds, the models that scripts/train-reading.py --folds has written")
    work, folds = arguments.work, arguments.folds.resolve()
    tasks = [json.loads(t) for t in (work / "tasks.jsonl").read_text().splitlines()]
    tasks = [{k: v for k, v in t.items() if k != "places"} | {"model": str(folds / f"fold-{fold_of(t)}.safetensors")}
             for t in tasks if t.get("object") and t.get("measure", True)]
    codes = run_tasks(arguments, tasks, work / "measured")
    said = ("id", "method", "mode", "pixel", "low", "high", "made", "gain")
    path, decisions = work / "model.jsonl", []
    for task in tasks:
        row = work / "measured" / (task["id"] + ".json")
        if row.exists():
            row = json.loads(row.read_text())
            decisions.append({key: row[key] for key in said if key in row})
    path.write_text("".join(json.dumps(d) + "\n" for d in decisions))
    print(f"{path}: {len(decisions)} decisions of {len(tasks)} measured")
    if any(codes):
        raise SystemExit(f"reading-table: some failed: see {work}/measured.*.log")


def remember(arguments):
    """Folders that an earlier stage was told of."""
    path = arguments.work / "sources.json"
    known = json.loads(path.read_text()) if path.exists() else {}
    for name in ("photos", "strangers"):
        told = getattr(arguments, name)
        if told:
            known[name] = str(told.resolve())
        elif name in known:
            setattr(arguments, name, pathlib.Path(known[name]))
        told = getattr(arguments, name)
        if told and not told.is_dir() and arguments.stage in ("fits", "splats", "all"):
            raise SystemExit(f"reading-table: --{name}: {told} is no folder")
    path.write_text(json.dumps(known))


def stop(*_):
    raise KeyboardInterrupt


def positive(text):
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"must be 1 or more, found '{text}'")
    return int(text)


NEEDS = {"fits": ("objects", "scripts/fetch-objects.sh WORK/objects"), "splats": ("fits", "the stage `fits`"),
         "measure": ("tasks.jsonl", "the stage `splats`"),
         "rows": ("tasks.jsonl", "the stage `splats`"), "pack": ("rows", "the stage `rows`")}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    stages = {"fits": [make_fits], "splats": [make_splats], "rows": [make_rows], "pack": [pack], "measure": [measure]}
    stages["all"] = [make_fits, make_splats, make_rows, pack]
    parser.add_argument("stage", choices=stages)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--program", type=pathlib.Path, default=HERE / "build/anchorsplat")
    parser.add_argument("--photos", type=pathlib.Path)
    parser.add_argument("--strangers", type=pathlib.Path)
    parser.add_argument("--jobs", type=positive, default=2)
    parser.add_argument("--only", type=positive, help="rows: no more than so many new ones, to see how long they take")
    parser.add_argument("--partial", action="store_true", help="pack: although rows are missing")
    parser.add_argument("--extend", action="store_true", help="pack: keep the rows of splats that are not in WORK")
    parser.add_argument("--folds", type=pathlib.Path, help="measure: what scripts/train-reading.py --folds has written")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=HERE / "data/reading.jsonl.gz")
    arguments = parser.parse_args()
    arguments.work, arguments.program = arguments.work.resolve(), arguments.program.resolve()
    if not arguments.work.is_dir():
        raise SystemExit(f"reading-table: {arguments.work} is no folder; {NEEDS['fits'][1]} makes it")
    if not arguments.program.exists():
        raise SystemExit(f"reading-table: {arguments.program} is not there: `make` builds it, --program names another")
    signal.signal(signal.SIGTERM, stop)
    remember(arguments)
    names = ["fits", "splats", "rows", "pack"] if arguments.stage == "all" else [arguments.stage]
    for name, stage in zip(names, stages[arguments.stage]):
        what, maker = NEEDS[name]
        if not (arguments.work / what).exists():
            raise SystemExit(f"reading-table: {arguments.work / what} is missing: {maker} makes it")
        stage(arguments)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        raise SystemExit("reading-table: stopped; the same command goes on from here")
    except (RuntimeError, OSError, ValueError, KeyError, subprocess.CalledProcessError) as error:
        raise SystemExit(f"reading-table: {type(error).__name__}: {error}")
