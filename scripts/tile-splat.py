#!/usr/bin/env python3
"""Copies of a splat side by side, as a large one for measurements: tile-splat.py IN.ply OUT.ply GAUSSIANS [NOISE]

IN is a binary PLY as `anchorsplat convert` writes it. The copies stand on a square grid. Their Gaussians are interleaved, so that
neighbours in space are far from each other in the file, as after training. With NOISE, say 0.03, every number x varies by NOISE (1 + |x|), normally distributed: copies that are all the same compress better
than any scan. Needs NumPy."""

import math
import sys

import numpy

source, target, wanted = sys.argv[1], sys.argv[2], int(sys.argv[3])
noise = float(sys.argv[4]) if len(sys.argv) > 4 else 0
random = numpy.random.default_rng(1)
data = open(source, "rb").read()
header_end = data.index(b"end_header\n") + len(b"end_header\n")
header = data[:header_end].decode().splitlines()
count = next(int(line.split()[2]) for line in header if line.startswith("element vertex"))
floats = sum(line.startswith("property float") for line in header)
rows = numpy.frombuffer(data, "<f4", count * floats, header_end).reshape(count, floats)

copies = math.ceil(wanted / count)
side = math.ceil(math.sqrt(copies))
extent = rows[:, :3].max(axis=0) - rows[:, :3].min(axis=0)
places = numpy.arange(copies)
offsets = numpy.zeros((copies, 3), "<f4")
offsets[:, 0] = places % side * extent[0] * 1.1
offsets[:, 2] = places // side * extent[2] * 1.1

with open(target, "wb") as out:
    out.write("\n".join(f"element vertex {wanted}" if line.startswith("element vertex") else line for line in header).encode() + b"\n")
    left = wanted
    for begin in range(0, count, 64):
        block = numpy.repeat(rows[begin : begin + 64, None], copies, axis=1)
        block[:, :, :3] += offsets
        block = block.reshape(-1, floats)[:left]
        left -= len(block)
        if noise:
            block = block + noise * (1 + abs(block)) * random.standard_normal(block.shape, dtype="<f4")
        out.write(block.tobytes())
