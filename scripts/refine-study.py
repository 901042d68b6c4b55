#!/usr/bin/env python3
"""What docs/refine.md says about pictures that are not perfect, splats that are fine already, and fits with area pixels.

    scripts/refine-study.py imperfect|fine|equal-time WORK [--program build/anchorsplat] [--objects a,b]

Everything is made from examples/ in the folder WORK. Each line says what was measured, PSNR and SSIM of the ten
high-resolution views that nothing was trained on (but the antialiased fits of `fine`), and seconds of processor
time of one thread. `imperfect` needs numpy and ImageMagick.
"""
import argparse
import json
import pathlib
import resource
import shutil
import subprocess

EXAMPLES = pathlib.Path(__file__).resolve().parent.parent / "examples"


def run(*command):
    """What the program printed, and its seconds of processor time."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    out = subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE, text=True).stdout
    return out, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def report(name, program, splat, truth, cameras, seconds):
    out, _ = run(program, "compare", splat, truth, "--cameras", cameras, "--threads", "1", "--json")
    mean = json.loads(out)["mean"]
    print(f"{name:60} {mean['psnr']:6.2f} dB  {mean['ssim']:.4f}  {seconds:4.0f} s", flush=True)


def enhance(args, name, splat, example, *options):
    out = args.work / f"{name.replace(' ', '_').replace('/', '_')}.ply"
    _, seconds = run(args.program, "enhance", splat, "-o", out, "-w", "-q", "--threads", "1", *options)
    report(name, args.program, out, example / "hr", example / "transforms_hr.json", seconds)


def spoil(example, kind, folder):
    """A project with the example's low-resolution pictures, spoiled; their cameras as they are."""
    import numpy
    random = numpy.random.default_rng(0)
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "lr").mkdir(parents=True)
    cameras = json.loads((example / "transforms_lr.json").read_text())
    size = f"{cameras['w']}x{cameras['h']}"
    for frame in cameras["frames"]:
        source, target = example / frame["file_path"], folder / frame["file_path"]
        if kind == "jpeg":
            frame["file_path"] = frame["file_path"].replace(".png", ".jpg")
            run("convert", source, "-quality", "70", folder / frame["file_path"])
            continue
        raw = subprocess.run(["convert", source, "-depth", "8", "rgb:-"], check=True, stdout=subprocess.PIPE).stdout
        pixels = numpy.frombuffer(raw, numpy.uint8).astype(float)
        if kind == "noise":
            pixels += random.normal(0, 5, pixels.shape)
        elif kind == "exposure":
            pixels *= random.uniform(0.9, 1.1)
        pixels = pixels.round().clip(0, 255).astype(numpy.uint8).tobytes()
        subprocess.run(["convert", "-size", size, "-depth", "8", "rgb:-", target], check=True, input=pixels)
    (folder / "transforms.json").write_text(json.dumps(cameras))


def imperfect(args, example):
    """Noise of 5/255, JPEG of quality 70, brightness of each picture off by up to 10 %."""
    flags_of = {"as they are": ((), ("--robust",)), "noise": ((), ("--robust",)), "jpeg": ((), ("--robust",)),
                "exposure": ((), ("--exposure",), ("--exposure", "--robust"))}
    for kind, tried in flags_of.items():
        folder = args.work / f"{example.name}-{kind.split()[0]}"
        spoil(example, kind, folder)
        for flags in tried:
            enhance(args, f"{example.name}, pictures: {kind} {' '.join(flags)}", example / "input.ply", example, "--method",
                    "refine", "--images", folder, "--hold-out", "0", "--k", args.k, "--steps", args.steps, *flags)


def fine(args, example):
    """Splats that are right when seen closer, through refinement at the low resolution's cameras and pictures."""
    low, init = example / "transforms_lr.json", ("--init-splat", example / "input.ply", "--max-gaussians", "20000")
    area, sharp = args.work / f"{example.name}-area.ply", args.work / f"{example.name}-antialiased.ply"
    _, seconds = run(args.program, "fit", low, "-o", area, "-w", "-q", "--threads", "1", "--hold-out", "0", "--pixel", "area",
                     "--steps", args.fit_steps, *init)
    report(f"{example.name}, fitted to pixel areas", args.program, area, example / "hr", example / "transforms_hr.json",
           seconds)
    # There are ten high-resolution pictures only; its fit is measured where it was trained, which hides no harm.
    _, seconds = run(args.program, "fit", example / "transforms_hr.json", "-o", sharp, "-w", "-q", "--threads", "1",
                     "--hold-out", "0", "--mode", "antialiased", "--steps", str(int(args.fit_steps) // 4), *init)
    report(f"{example.name}, antialiased at high resolution", args.program, sharp, example / "hr",
           example / "transforms_hr.json", seconds)
    for splat, name in ((area, "pixel areas"), (sharp, "antialiased")):
        enhance(args, f"{example.name}, {name}, refined without pictures", splat, example, "--method", "refine", "--cameras",
                low)
        enhance(args, f"{example.name}, {name}, refined with pictures", splat, example, "--method", "refine", "--images", low,
                "--hold-out", "0", "--k", args.k, "--steps", args.steps)


def equal_time(args, example):
    """A standard fit and its refinement, and a fit with area pixels that takes as long."""
    low, init = example / "transforms_lr.json", ("--init-splat", example / "input.ply")
    fit = (args.program, "fit", low, "-w", "-q", "--threads", "1", "--hold-out", "0", *init)
    plain, area = args.work / f"{example.name}-plain.ply", args.work / f"{example.name}-area.ply"
    _, first = run(*fit, "-o", plain, "--steps", args.fit_steps, "--max-gaussians", "20000")
    refined = args.work / f"{example.name}-refined.ply"
    _, second = run(args.program, "enhance", plain, "-o", refined, "-w", "-q", "--threads", "1", "--method", "refine", "--images",
                    low, "--hold-out", "0", "--k", args.k, "--steps", args.steps)
    report(f"{example.name}, fit, then refine", args.program, refined, example / "hr", example / "transforms_hr.json",
           first + second)
    gaussians = json.loads(run(args.program, "info", refined, "--json")[0])
    gaussians = gaussians[0] if isinstance(gaussians, list) else gaussians
    for most in (20000, gaussians["gaussians"]):
        # Steps are not equally dear: the number is corrected until the time is right.
        steps, seconds = int(args.fit_steps) // 2, first + second
        for _ in range(4):
            steps = int(steps * (first + second) / seconds)
            _, seconds = run(*fit, "-o", area, "--steps", steps, "--pixel", "area", "--max-gaussians", most)
            if abs(seconds / (first + second) - 1) < 0.1:
                break
        report(f"{example.name}, fit --pixel area, {steps} steps, {most} Gaussians", args.program, area, example / "hr",
               example / "transforms_hr.json", seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("imperfect", "fine", "equal-time"))
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--program", default="build/anchorsplat")
    parser.add_argument("--objects", default="biplane,stone_lantern")
    parser.add_argument("--k", default="4")
    parser.add_argument("--steps", default="400")
    parser.add_argument("--fit-steps", default="3000")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    for name in args.objects.split(","):
        {"imperfect": imperfect, "fine": fine, "equal-time": equal_time}[args.what](args, EXAMPLES / name)


if __name__ == "__main__":
    main()
