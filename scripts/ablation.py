#!/usr/bin/env python3
"""What each choice of the compact network's recipe is worth: one short training per variant, all for the same time.

    scripts/ablation.py TRAIN VALIDATION WORK [--minutes 2] [--jobs 2] [--only 0,3,…] [--program build/anchorsplat]

TRAIN and VALIDATION are data sets of `anchorsplat dataset build`; WORK gets a folder per variant and the true views that
all of them share, and a variant that is there already is not trained again. Every variant is configs/compact-k4.toml
with the changes of VARIANTS, trained for so many minutes by one thread; `--jobs` of them at once.
docs/benchmarks.md#training says what came out.
"""
import argparse
import concurrent.futures
import json
import pathlib
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
OBJECTS = "objects"  # as a key of a variant: train on so many objects only

# What the table says: {key of the recipe: value}.
VARIANTS = {
    "as it is: K = 4, H = 64, R = 2, M = 8": {},
    "K = 1": {"network.copies": 1},
    "K = 2": {"network.copies": 2},
    "K = 10": {"network.copies": 10},
    "K = 20": {"network.copies": 20},
    "no messages (R = 0)": {"network.rounds": 0},
    "R = 3": {"network.rounds": 3},
    "H = 32, heads 64": {"network.hidden": 32, "network.head_hidden": 64},
    "H = 128, heads 256": {"network.hidden": 128, "network.head_hidden": 256},
    "patches of 9 along a Hilbert curve": {"network.context": "patches"},
    "ε = 1 pixel": {"network.offset_unit": "pixel"},
    "ε = 0.015 of the cube, whole views": {"network.offset_unit": "cube", "network.epsilon": 0.015, "data.part": 0,
                                           "data.crop": 0, "data.views_per_step": 2},
    "whole views": {"data.part": 0, "data.crop": 0, "data.views_per_step": 2},
    "no filter under it": {"network.prior": False},
    "no anchors: offsets without bound": {"network.anchors": False},
    "SH of degree 1 to 3 as they are": {"network.sh": False},
    "L1 alone": {"loss.ssim": 0.0},
    "with LPIPS (AlexNet), 0.5": {"loss.lpips": 0.5, "loss.lpips_net": "alex"},
    "40 objects": {OBJECTS: 40},
    "10 objects": {OBJECTS: 10},
}


def toml(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    return json.dumps(value)


def write_recipe(path, changes):
    """The base recipe with the changes; validation at the start and the end only, LPIPS where the loss changes."""
    recipe = tomllib.loads((ROOT / "configs/compact-k4.toml").read_text(encoding="utf-8"))
    lpips = not changes or any(key.startswith("loss.") for key in changes)
    changes = {"validation.every": 0, "validation.lpips": lpips, "checkpoint_every": 0} | changes
    for key, value in changes.items():
        *tables, name = key.split(".")
        table = recipe
        for part in tables:
            table = table.setdefault(part, {})
        table[name] = value
    lines = [f"{key} = {toml(value)}" for key, value in recipe.items() if not isinstance(value, dict)]
    for key, table in recipe.items():
        if isinstance(table, dict):
            lines += ["", f"[{key}]"] + [f"{name} = {toml(value)}" for name, value in table.items()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def subset(train, count, folder):
    """A data set with so many objects of `train`, spread evenly over its manifest."""
    lines = (train / "manifest.jsonl").read_text(encoding="utf-8").splitlines()
    lines = [line for line in lines if not json.loads(line)["rejected"]]
    lines = [lines[i * len(lines) // count] for i in range(min(count, len(lines)))]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "manifest.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for line in lines:
        link = folder / json.loads(line)["name"]
        if not link.exists():
            link.symlink_to((train / link.name).resolve())
    return folder


def train(args, number, name):
    changes = dict(VARIANTS[name])
    folder = args.work / f"{number:02}"
    objects = changes.pop(OBJECTS, None)
    data = args.train if objects is None else subset(args.train, objects, args.work / f"objects-{objects}")
    if not (folder / "done").exists():
        folder.mkdir(parents=True, exist_ok=True)
        write_recipe(folder / "recipe.toml", changes)
        command = [args.program, "train", data, "--validation", args.validation, "--config", folder / "recipe.toml", "-o",
                   folder / "run", "--cache", args.work / "cache", "--minutes", args.minutes, "--threads", 1, "-w", "-q"]
        done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              check=False)
        if done.returncode != 0:
            return f"| {name} | failed: {done.stdout.strip().splitlines()[-1]} |"
        (folder / "done").touch()
    log = [json.loads(line) for line in (folder / "run/log.jsonl").read_text(encoding="utf-8").splitlines()]
    last = [line for line in log if "validation" in line][-1]
    filtered, model = last["validation"]["filter"], last["validation"]["model"]
    info = subprocess.run([args.program, "info", folder / "run/model.safetensors", "--json"], stdout=subprocess.PIPE, check=True)
    parameters = f"{json.loads(info.stdout)['parameters']:,}"
    lpips = f"{model['lpips']:.4f}" if "lpips" in model else ""
    return (f"| {name} | {parameters} | {last['step']:,} | {model['psnr']:.2f} | {model['psnr'] - filtered['psnr']:+.2f} "
            f"| {model['ssim']:.4f} | {lpips} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("train", type=pathlib.Path)
    parser.add_argument("validation", type=pathlib.Path)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--minutes", type=float, default=2)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", help="variants by their place in the list, separated by commas")
    parser.add_argument("--program", default=ROOT / "build/anchorsplat")
    args = parser.parse_args()
    names = list(VARIANTS)
    chosen = range(len(names)) if args.only is None else [int(part) for part in args.only.split(",")]
    failed = False
    print("| variant | parameters | steps | PSNR | over the filter | SSIM | LPIPS |\n|---|---:|---:|---:|---:|---:|---:|")
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for row in pool.map(lambda number: train(args, number, names[number]), chosen):
            print(row, flush=True)
            failed = failed or "failed" in row
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
