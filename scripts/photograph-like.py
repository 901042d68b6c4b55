#!/usr/bin/env python3
"""Splats like those of photographs, with ground truth: what a reading of the training pixel has to survive.

    scripts/photograph-like.py WORK --objects objects [--program build/anchorsplat] [--low-size 256] [--steps 15000]

Meshes (scripts/fetch-objects.sh) are photographed from 30 to 60 places on black: colours made darker so that dark parts
come near the background, veiling glare, exposure that changes from picture to picture, noise, dust that only one picture
has, masks that cut pieces off, poses off by a fraction of a pixel. The fits begin with random points, as those of photographs without points do,
and keep black Gaussians and floaters around the object. Every eighth view, large and without any of this but the
darkness, is the truth. Each line says how the splat compares with it as it is, after `enhance` with nothing else given,
and with the cameras; and what `info` reads.

Everything is kept in WORK; the same command goes on from where it was stopped. Needs numpy and ImageMagick.
"""
import argparse
import json
import math
import pathlib
import struct
import subprocess
import zlib

import numpy

# Mesh, views, seed.
OBJECTS = [("BlendSwap-CC-0.sh3f#cuckooClock", 60, 1), ("BlendSwap-CC-BY.sh3f#armchair1", 45, 2),
           ("BlendSwap-CC-0.sh3f#seesaw", 30, 3)]
FURNITURE = "usr/share/sweethome3d/furniture"
DARKER = 1.8  # exponent of all colours
GLARE, EXPOSURE, NOISE, AIM = 0.06, 0.08, 3.0, 0.15  # share, share, of 255, low-resolution pixels


def read(path):
    """A picture as float array [H,W,3], 0 to 1."""
    raw = subprocess.run(["convert", str(path), "ppm:-"], check=True, stdout=subprocess.PIPE).stdout
    _, size, _, pixels = raw.split(b"\n", 3)
    width, height = map(int, size.split())
    return numpy.frombuffer(pixels, numpy.uint8)[:3 * width * height].reshape(height, width, 3) / 255.0


def write(path, picture):
    pixels = (picture * 255).round().clip(0, 255).astype(numpy.uint8)
    height, width, _ = pixels.shape

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(rows, 6)) + chunk(b"IEND", b""))


def blurred(picture, radius):
    """Three box filters along both axes, zero outside."""
    kernel = numpy.ones(2 * radius + 1) / (2 * radius + 1)
    for _ in range(3):
        for axis in (0, 1):
            picture = numpy.apply_along_axis(lambda line: numpy.convolve(line, kernel, "same"), axis, picture)
    return picture


def photographed(picture, random):
    """What a camera in a real room makes of a clean low-resolution picture."""
    size = picture.shape[0]
    picture = picture ** DARKER
    picture = (1 - GLARE) * picture + GLARE * blurred(picture, size // 12)
    picture = picture * (1 + EXPOSURE * random.uniform(-1, 1))
    rows, columns = numpy.mgrid[:size, :size]
    for _ in range(random.integers(2, 6)):  # dust and fluff
        y, x, radius = random.uniform(0, size), random.uniform(0, size), random.uniform(0.5, 2.5)
        speck = numpy.exp(-((rows - y) ** 2 + (columns - x) ** 2) / (2 * radius ** 2))
        picture = picture + 0.25 * random.uniform(0.2, 1) * speck[:, :, None]
    lit = picture.max(axis=2, keepdims=True) > 2 / 255  # the background is masked, as it is in such data sets
    for _ in range(random.integers(1, 4)):  # masks cut pieces off, each view others
        y, x = numpy.argwhere(lit[:, :, 0])[random.integers(lit.sum())]
        across, along = size * random.uniform(0.02, 0.1, 2)
        lit &= (((rows - y) / across) ** 2 + ((columns - x) / along) ** 2 > 1)[:, :, None]
    return numpy.where(lit, picture + random.normal(0, NOISE / 255, picture.shape), 0).clip(0, 1)


def turned(matrix, random, angle):
    """A camera-to-world matrix whose aim is off by about `angle`."""
    x, y, z = random.normal(0, angle, 3)
    turn = numpy.array([[1, -z, y], [z, 1, -x], [-y, x, 1]])
    out = numpy.array(matrix)
    axes, _ = numpy.linalg.qr(out[:3, :3] @ turn)
    out[:3, :3] = axes * numpy.sign(numpy.sum(axes * out[:3, :3], axis=0))
    return out.tolist()


def run(*command):
    return subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE, text=True).stdout


def take_photographs(folder, low_size, high_size, seed):
    random = numpy.random.default_rng(seed)
    low = json.loads((folder / "views" / f"transforms_{low_size}.json").read_text())
    high = json.loads((folder / "views" / f"transforms_{high_size}.json").read_text())
    angle = AIM / low.get("fl_x", low["w"] / (2 * math.tan(low.get("camera_angle_x", math.pi / 4) / 2)))
    for i, (small, large) in enumerate(zip(low["frames"], high["frames"])):
        name = f"{i:03}.png"
        if i % 8 == 0:
            write(folder / "hr" / name, read(folder / "views" / large["file_path"]) ** DARKER)
            large["file_path"] = f"hr/{name}"
            continue
        write(folder / "lr" / name, photographed(read(folder / "views" / small["file_path"]), random))
        small["file_path"] = f"lr/{name}"
        small["transform_matrix"] = turned(small["transform_matrix"], random, angle)
    high["frames"] = high["frames"][::8]
    low["frames"] = [frame for i, frame in enumerate(low["frames"]) if i % 8]
    (folder / "transforms_hr.json").write_text(json.dumps(high))
    (folder / "transforms_lr.json").write_text(json.dumps(low))


def measure(args, mesh, views, seed):
    name = mesh.split("#")[-1]
    folder = args.work / name
    low_size, high_size = args.low_size, 4 * args.low_size
    splat, cameras = folder / "input.ply", folder / "transforms_lr.json"
    if not (folder / "views" / f"transforms_{high_size}.json").exists():
        run(args.program, "views", args.objects / FURNITURE / mesh, "-o", folder / "views", "-w", "-q", "--views", views,
            "--low-size", low_size, "--size", high_size, "--opaque")
    if not cameras.exists():
        take_photographs(folder, low_size, high_size, seed)
    if not splat.exists():
        run(args.program, "fit", cameras, "-o", splat, "-q", "--resume", "--checkpoint-every", "1000", "--hold-out", "0",
            "--init", "view", "--init-points", args.init_points, "--max-gaussians", args.max_gaussians, "--steps", args.steps)
    found = json.loads(run(args.program, "info", splat, "--json"))["reading"]
    truth = json.loads(run(args.program, "enhance", splat, "-o", folder / "cameras.ply", "-w", "--json", "--cameras",
                           cameras))[0]["pixel_size"]["value"]
    used = json.loads(run(args.program, "enhance", splat, "-o", folder / "auto.ply", "-w", "--json"))[0]["pixel_size"]["value"]
    results = []
    for which in ("input", "auto", "cameras"):
        report = json.loads(run(args.program, "compare", folder / f"{which}.ply", folder / "hr", "--cameras",
                                folder / "transforms_hr.json", "--json"))
        results.append(report["mean"]["psnr"])
    print(f"{name:16} as it is {results[0]:.2f}, enhanced {results[1]:.2f}, with cameras {results[2]:.2f} dB; read as "
          f"{found['looks']}, pixel {found['pixel'] / truth:.2f} ({found['low'] / truth:.2f} to {found['high'] / truth:.2f}) and "
          f"used {used / truth:.2f} of the true one", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--objects", type=pathlib.Path, required=True)
    parser.add_argument("--program", default="build/anchorsplat")
    parser.add_argument("--low-size", type=int, default=256)
    parser.add_argument("--steps", type=int, default=15000)
    parser.add_argument("--init-points", type=int, default=100000)
    parser.add_argument("--max-gaussians", type=int, default=40000)
    parser.add_argument("--only", help="names of objects, comma-separated")
    args = parser.parse_args()
    for mesh, views, seed in OBJECTS:
        if not args.only or mesh.split("#")[-1] in args.only.split(","):
            measure(args, mesh, views, seed)


if __name__ == "__main__":
    main()
