#!/usr/bin/env python3
"""Makes land as a drone sees it, to fit splats to: a mesh with colours at its corners, which ends at a rim.

    scripts/make-land.py hills|town|relief OUT.obj [--seed N]

Two units wide; hills are a fifth of a unit high, houses a quarter, a relief a tenth. `anchorsplat views OUT.obj --rig
rings --elevations 45 60 75` looks at it from above. Needs NumPy.
"""

import argparse

import numpy as np

SIDE = 300  # corners along a side


def noise(random, octaves):
    """Between 0 and 1, with detail of every size."""
    out = np.zeros((SIDE, SIDE))
    for octave in range(octaves):
        cells = 2 ** (octave + 2)
        grid = random.random((cells + 1, cells + 1))
        at = np.linspace(0, cells, SIDE, endpoint=False)
        whole = at.astype(int)
        y, x = (at - whole)[:, None], (at - whole)[None]
        a, b, c, d = (grid[np.ix_(whole + i, whole + j)] for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)))
        out += 0.6**octave * ((a * (1 - y) + b * y) * (1 - x) + (c * (1 - y) + d * y) * x)
    return out / out.max()


def blocks(random, houses):
    """Houses with flat roofs on flat ground: heights, and which house is where."""
    height, house = np.zeros((SIDE, SIDE)), np.zeros((SIDE, SIDE), int)
    for k in range(1, houses + 1):
        x, y = random.integers(10, SIDE - 40, 2)
        w, d = random.integers(12, 30, 2)
        height[x : x + w, y : y + d] = 0.05 + 0.2 * random.random()
        house[x : x + w, y : y + d] = k
    return height, house


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=["hills", "town", "relief"])
    parser.add_argument("out")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    random = np.random.default_rng(arguments.seed)
    colours = np.stack([noise(random, 8) for _ in range(3)], -1)
    if arguments.kind == "town":
        height, house = blocks(random, 60)
        colours *= (0.4 + 0.6 * random.random((61, 3)))[house]
    else:
        height = (0.2 if arguments.kind == "hills" else 0.1) * noise(random, 6 if arguments.kind == "hills" else 8)
    along = np.linspace(-1, 1, SIDE)
    x, z = np.meshgrid(along, along, indexing="ij")
    corners = np.stack([x, height, z], -1).reshape(-1, 3)
    with open(arguments.out, "w", encoding="utf-8") as out:
        for corner, colour in zip(corners, colours.reshape(-1, 3)):
            out.write("v %.5f %.5f %.5f %.3f %.3f %.3f\n" % (*corner, *colour))
        for i in range(SIDE - 1):
            for j in range(SIDE - 1):
                a = i * SIDE + j + 1
                out.write(f"f {a} {a + 1} {a + SIDE + 1}\nf {a} {a + SIDE + 1} {a + SIDE}\n")


if __name__ == "__main__":
    main()
