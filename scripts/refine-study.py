#!/usr/bin/env python3
"""What docs/benchmarks.md#refinement says of imperfect pictures, splats that are fine already, fits with area
pixels, a scene of NeRF-synthetic's kind.

    scripts/refine-study.py imperfect|fine|equal-time WORK [--program build/anchorsplat] [--objects a,b]
    scripts/refine-study.py trained-high|nerf WORK --objects objects/…/BlendSwap-CC-0.sh3f#chicken,…

The first three work on examples/, the others on meshes (scripts/fetch-objects.sh), all in the folder WORK. Each line says
what was measured, PSNR and SSIM of high-resolution views that nothing was trained on, and seconds of processor time of
one thread. `imperfect` needs numpy and ImageMagick.
"""
import argparse
import json
import math
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


def report(name, program, splat, truth, cameras, seconds, *more):
    out, _ = run(program, "compare", splat, truth, "--cameras", cameras, "--threads", "1", "--json", *more)
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
                    "filter+refine", "--images", folder, "--hold-out", "0", "--k", args.k, "--steps", args.steps, *flags)


def fine(args, example):
    """Splats that are right when seen closer, through refinement at the low resolution's cameras and pictures."""
    low, init = example / "transforms_lr.json", ("--init-splat", example / "input.ply", "--max-gaussians", "20000")
    area = args.work / f"{example.name}-area.ply"
    _, seconds = run(args.program, "fit", low, "-o", area, "-w", "-q", "--threads", "1", "--hold-out", "0", "--pixel", "area",
                     "--steps", args.fit_steps, *init)
    report(f"{example.name}, fitted to pixel areas", args.program, area, example / "hr", example / "transforms_hr.json",
           seconds)
    enhance(args, f"{example.name}, pixel areas, refined without pictures", area, example, "--method", "refine", "--cameras",
            low)
    enhance(args, f"{example.name}, pixel areas, refined with pictures", area, example, "--method", "filter+refine", "--images",
            low, "--hold-out", "0", "--k", args.k, "--steps", args.steps)


def trace(args, mesh, low, high, *more):
    """Views of a mesh at both sizes; the folder, and every eighth high-resolution view, which fits leave out."""
    folder = args.work / f"{mesh.split('#')[-1]}-{high}"
    if not (folder / f"transforms_{high}.json").exists():
        run(args.program, "views", mesh, "-o", folder, "-w", "-q", "--low-size", low, "--size", high, "--points", "10000", *more)
    cameras = json.loads((folder / f"transforms_{high}.json").read_text())
    cameras["frames"] = cameras["frames"][::8]
    (folder / "held_out.json").write_text(json.dumps(cameras))
    (folder / "held_out").mkdir(exist_ok=True)
    for frame in cameras["frames"]:
        shutil.copy(folder / frame["file_path"], folder / "held_out")
    return folder


def trained_high(args, mesh):
    """A splat that was fitted to pictures four times as large is refined with the small ones."""
    folder = trace(args, mesh, 128, 512, "--opaque")
    for mode in ("antialiased", "classic"):
        name, splat = f"{mesh.split('#')[-1]}, {mode} fit of 512 x 512", folder / f"{mode}.ply"
        _, seconds = run(args.program, "fit", folder / "transforms_512.json", "-o", splat, "-w", "-q", "--threads", "1", "--mode",
                         mode, "--steps", args.fit_steps, "--max-gaussians", "20000")
        report(name, args.program, splat, folder / "held_out", folder / "held_out.json", seconds)
        out = folder / f"{mode}-refined.ply"
        _, seconds = run(args.program, "enhance", splat, "-o", out, "-w", "-q", "--threads", "1", "--method",
                         "filter+refine", "--images", folder / "transforms_128.json", "--k", args.k, "--steps", args.steps)
        report(f"{name}, refined with 128 x 128", args.program, out, folder / "held_out", folder / "held_out.json", seconds)


def nerf(args, mesh):
    """A scene in the layout of NeRF-synthetic, 200 to 800 pixels on white: fit, filter, both kinds of refinement."""
    folder = trace(args, mesh, 200, 800)
    scene = folder / "scene"
    (scene / "train").mkdir(parents=True, exist_ok=True)
    cameras = json.loads((folder / "transforms_200.json").read_text())
    frames = []
    for i, frame in enumerate(cameras["frames"]):
        if i % 8 == 0:
            continue
        shutil.copy(folder / frame["file_path"], scene / "train" / f"r_{i}.png")
        frames.append({"file_path": f"./train/r_{i}", "transform_matrix": frame["transform_matrix"]})
    angle = 2 * math.atan(cameras["w"] / (2 * cameras["fl_x"]))
    (scene / "transforms_train.json").write_text(json.dumps({"camera_angle_x": angle, "frames": frames}))
    truth, name = (folder / "held_out", folder / "held_out.json"), mesh.split("#")[-1]
    splat = folder / "input.ply"
    _, seconds = run(args.program, "fit", scene, "-o", splat, "-w", "-q", "--threads", "1", "--hold-out", "0", "--background",
                     "1,1,1", "--max-gaussians", "50000")
    report(f"{name}, fit of 200 x 200", args.program, splat, *truth, seconds, "--background", "1,1,1")
    ways = {"filter": ("--method", "filter", "--cameras", scene / "transforms_train.json"),
            "refined without pictures": ("--method", "refine", "--cameras", scene / "transforms_train.json"),
            "refined with pictures": ("--method", "filter+refine", "--images", scene, "--hold-out", "0")}
    for way, options in ways.items():
        out = folder / f"{way.replace(' ', '-')}.ply"
        _, seconds = run(args.program, "enhance", splat, "-o", out, "-w", "-q", "--threads", "1", *options)
        report(f"{name}, {way}", args.program, out, *truth, seconds, "--background", "1,1,1")


def equal_time(args, example):
    """A standard fit and its refinement, and a fit with area pixels that takes as long."""
    low, init = example / "transforms_lr.json", ("--init-splat", example / "input.ply")
    fit = (args.program, "fit", low, "-w", "-q", "--threads", "1", "--hold-out", "0", *init)
    plain, area = args.work / f"{example.name}-plain.ply", args.work / f"{example.name}-area.ply"
    _, first = run(*fit, "-o", plain, "--steps", args.fit_steps, "--max-gaussians", "20000")
    refined = args.work / f"{example.name}-refined.ply"
    _, second = run(args.program, "enhance", plain, "-o", refined, "-w", "-q", "--threads", "1", "--method",
                    "filter+refine", "--images", low, "--hold-out", "0", "--k", args.k, "--steps", args.steps)
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


ON_EXAMPLES = {"imperfect": imperfect, "fine": fine, "equal-time": equal_time}
ON_MESHES = {"trained-high": trained_high, "nerf": nerf}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=(*ON_EXAMPLES, *ON_MESHES))
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--program", default="build/anchorsplat")
    parser.add_argument("--objects", default="biplane,stone_lantern")
    parser.add_argument("--k", default="4")
    parser.add_argument("--steps", default="400")
    parser.add_argument("--fit-steps", default="3000")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    for name in args.objects.split(","):
        if args.what in ON_MESHES:
            ON_MESHES[args.what](args, name)
        else:
            ON_EXAMPLES[args.what](args, EXAMPLES / name)


if __name__ == "__main__":
    main()
