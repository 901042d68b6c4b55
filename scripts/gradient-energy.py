#!/usr/bin/env python3
"""How much detail an enhanced splat keeps, without a truth to compare with: gradient energy of renders, after / before.

    scripts/gradient-energy.py SPLAT... [--program PROGRAM] [--size 1600] [--view 001] [--keep FOLDER]

Each splat is enhanced with the default method and nothing else given, and both are rendered from one place of an orbit
(`render --orbit 4`). The number is the sum of squared differences between neighbouring pixels, after over before. A splat
whose pixels were taken too large comes back blurred and far below 1. Pictures stay in FOLDER. Needs numpy and
ImageMagick.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

import numpy


def energy(path):
    raw = subprocess.run(["convert", str(path), "ppm:-"], check=True, stdout=subprocess.PIPE).stdout
    _, size, _, pixels = raw.split(b"\n", 3)
    width, height = map(int, size.split())
    picture = numpy.frombuffer(pixels, numpy.uint8)[:3 * width * height].reshape(height, width, 3).astype(float)
    return numpy.square(numpy.diff(picture, axis=0)).sum() + numpy.square(numpy.diff(picture, axis=1)).sum()


def run(*command):
    return subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE, text=True).stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("splats", nargs="+", type=pathlib.Path)
    program = pathlib.Path(__file__).resolve().parent.parent / "build/anchorsplat"
    parser.add_argument("--program", default=program, type=pathlib.Path)
    parser.add_argument("--size", type=int, default=1600)
    parser.add_argument("--view", default="001")
    parser.add_argument("--keep", type=pathlib.Path)
    args = parser.parse_args()
    if not args.program.exists():
        parser.error(f"there is no program {args.program}; --program says where it is (make build makes it)")
    with tempfile.TemporaryDirectory() as temporary:
        keep = args.keep or pathlib.Path(temporary)
        for splat in args.splats:
            folder = keep / splat.name
            folder.mkdir(parents=True, exist_ok=True)
            after = folder / "after.ply"
            report = json.loads(run(args.program, "enhance", splat, "-o", after, "-w", "--json"))[0]
            energies = []
            for which, file in (("before", splat), ("after", after)):
                run(args.program, "render", file, "-o", folder / which, "-w", "-q", "--orbit", 4, "--size",
                    f"{args.size}x{args.size}", "--view", args.view)
                energies.append(energy(next((folder / which).rglob("*.png"))))
            print(f"{splat.name:30} {energies[1] / energies[0]:.3f}  read {report['reading']['pixel']:.4g}, used "
                  f"{report['pixel_size']['value']:.4g}", flush=True)


if __name__ == "__main__":
    main()
