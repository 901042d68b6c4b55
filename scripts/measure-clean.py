#!/usr/bin/env python3
"""What `enhance --clean` does to outlines: splats of a data set on black, seen over black, grey and white.

    scripts/measure-clean.py DATASET WORK [--program build/anchorsplat] [--views 12] [--method filter]

Every fit of DATASET (of `dataset build`, on black) is enhanced with its cameras, with --clean and without. Its meshes
must still be where they were; WORK keeps views and splats. Printed: IoU of the outline (alpha of one half) with the
mesh's true one, PSNR over the three backgrounds, and how many Gaussians went. Needs numpy and Pillow.
"""

import argparse
import json
import pathlib
import subprocess

import numpy as np
from PIL import Image

BACKGROUNDS = {"black": 0.0, "grey": 0.5, "white": 1.0}


def run(*command):
    return subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE, text=True).stdout


def pictures(folder):
    """Colours times alpha, and alpha, of all views: [views, height, width, channels]."""
    files = sorted(pathlib.Path(folder).glob("*.png"))
    if not files:
        raise SystemExit(f"{folder}: no pictures")
    rgba = np.stack([np.asarray(Image.open(f).convert("RGBA"), np.float32) / 255 for f in files])
    return rgba[..., :3] * rgba[..., 3:], rgba[..., 3:]


def score(views, truth):
    (colour, alpha), (true_colour, true_alpha) = views, truth
    mask, true_mask = alpha > 0.5, true_alpha > 0.5
    result = {"IoU": (mask & true_mask).sum() / max(1, (mask | true_mask).sum())}
    for name, level in BACKGROUNDS.items():
        difference = colour + level * (1 - alpha) - true_colour - level * (1 - true_alpha)
        result[name] = -10 * np.log10(np.mean(difference**2, axis=(1, 2, 3))).mean()
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=pathlib.Path)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--program", default="build/anchorsplat")
    parser.add_argument("--views", default="12")
    parser.add_argument("--method", default="filter")
    arguments = parser.parse_args()
    lines = (arguments.dataset / "manifest.jsonl").read_text(encoding="utf-8").splitlines()
    print("object, kind, gone, " + ", ".join(f"{k}, cleaned" for k in ["IoU", *BACKGROUNDS]))
    for record in map(json.loads, lines):
        if record["rejected"] or any(record["background"]):
            continue
        fit, work = arguments.dataset / record["name"], arguments.work / record["name"]
        mesh = arguments.work / record["name"].split("--")[0]
        if not (mesh / "transforms_256.json").exists():
            run(arguments.program, "views", record["source"], "-o", mesh, "--views", arguments.views, "--size", 256,
                "--low-size", 64, "-w")
        truth, cameras = pictures(mesh / "256/images"), mesh / "transforms_256.json"
        low = fit / f"transforms_{record['low_size']}.json"
        scores = []
        for clean in ([], ["--clean"]):
            out = work / ("cleaned.ply" if clean else "as-it-is.ply")
            out.parent.mkdir(parents=True, exist_ok=True)
            told = json.loads(run(arguments.program, "enhance", fit / "splat.ply", "-o", out, "--cameras", low,
                                  "--method", arguments.method, "--json", "-q", "-w", *clean))
            run(arguments.program, "render", out, "-o", out.with_suffix(""), "--cameras", cameras, "--transparent", "-w")
            scores.append(score(pictures(out.with_suffix("")), truth))
        gone = told[0]["cleaned"]
        share = 100 * gone["gaussians"] / record["gaussians"]
        print(f"{record['name']}, {record['recipe']}, {share:.1f} %, " + ", ".join(
            f"{a[k]:.3f}, {b[k]:.3f}" if k == "IoU" else f"{a[k]:.2f}, {b[k]:.2f}" for a, b in [scores] for k in a), flush=True)


if __name__ == "__main__":
    main()
