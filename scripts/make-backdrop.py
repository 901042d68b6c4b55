#!/usr/bin/env python3
"""A scene whose pictures show more than its points: things on a hilltop, houses and a painted sky far beyond them.

    scripts/make-backdrop.py WORK [--program build/anchorsplat] [--size 200] [--views 120]

Six boxes stand on a plate 4.8 wide, cameras around it at a distance of 3 look down a little. Points are on the boxes and
the plate alone, as structure from motion finds them where it can triangulate. Beyond are eight houses 9 to 15 away and a
sphere of radius 36 with hills and clouds.

    anchorsplat fit WORK/transforms.json -o shell.ply --steps 3000 --shell auto
    anchorsplat fit WORK/transforms.json -o none.ply --steps 3000 --shell 0

Needs numpy.
"""
import argparse
import json
import math
import pathlib
import struct
import subprocess
import zlib

import numpy

CAMERAS, SPHERE = 3.0, 36.0  # distances from the middle
POINTS = 12000


def write_png(path, pixels):
    height, width, _ = pixels.shape
    rows = numpy.concatenate([numpy.zeros((height, 1), numpy.uint8), pixels.reshape(height, -1)], 1).tobytes()

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def noise(random, height, width, coarsest, octaves):
    """Smooth noise in 0 to 1 that goes round in x."""
    total = numpy.zeros((height, width))
    for octave in range(octaves):
        cells = coarsest << octave
        grid = random.random((cells // 2 + 2, cells))
        y, x = numpy.linspace(0, cells // 2, height), numpy.linspace(0, cells, width, endpoint=False)
        iy, ix = y.astype(int), x.astype(int)
        fy, fx = (y - iy)[:, None], (x - ix)[None]
        a, b = grid[iy][:, ix % cells], grid[iy][:, (ix + 1) % cells]
        c, d = grid[iy + 1][:, ix % cells], grid[iy + 1][:, (ix + 1) % cells]
        total += ((a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy) / 1.6**octave
    return (total - total.min()) / (total.max() - total.min())


def sky(random):
    height, width = 1024, 2048
    clouds = noise(random, height, width, 8, 6)[..., None]
    up = numpy.linspace(1, -1, height)[:, None, None]
    picture = (0.35 + 0.3 * (1 - up)) * numpy.array([0.7, 0.85, 1.0]) * (1 - clouds) + clouds * 0.95
    grass = noise(random, height, width, 16, 6)[..., None]
    latitude = numpy.linspace(90, -90, height)[:, None]
    for lift, colour in ((12, [0.45, 0.5, 0.6]), (6, [0.35, 0.45, 0.3]), (0, [0.3, 0.4, 0.2])):
        ridge = lift * (0.3 + noise(random, 2, width, 8, 5)[0])
        picture = numpy.where((latitude < ridge)[..., None], numpy.array(colour) * (0.5 + grass), picture)
    return picture


def bricks(random):
    picture = noise(random, 256, 256, 4, 6)[..., None] * 0.7 * random.random(3) + 0.3 * random.random(3)
    for _ in range(30):
        y, x, h, w = (int(v) for v in random.integers((0, 0, 6, 6), (196, 196, 60, 60)))
        picture[y:y + h, x:x + w] = random.random(3) * (0.6 + 0.4 * noise(random, h, w, 4, 3)[..., None])
    return picture


class Mesh:
    def __init__(self):
        self.lines, self.count, self.surfaces = ["mtllib scene.mtl"], 0, []

    def grid(self, material, at, uv):
        """A grid of vertices [H,W,3] with texture places [H,W,2]."""
        height, width, _ = at.shape
        self.lines.append(f"usemtl {material}")
        self.lines += [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in at.reshape(-1, 3)]
        self.lines += [f"vt {u:.7g} {v:.7g}" for u, v in uv.reshape(-1, 2)]
        for i in range(height - 1):
            for j in range(width - 1):
                a = self.count + i * width + j + 1
                corners = (a, a + 1, a + width + 1, a + width)
                self.lines.append("f " + " ".join(f"{c}/{c}" for c in corners))
        self.count += height * width

    def patch(self, material, corner, along, across):
        u, v = numpy.meshgrid([0.0, 1.0], [0.0, 1.0])
        self.grid(material, corner + u[..., None] * along + v[..., None] * across, numpy.stack([u, v], -1))
        self.surfaces.append((material, corner, along, across))

    def box(self, material, middle, size, turn):
        x = numpy.array([math.cos(turn), 0, math.sin(turn)]) * size[0]
        z = numpy.array([-math.sin(turn), 0, math.cos(turn)]) * size[2]
        y = numpy.array([0, size[1], 0.0])
        corner = numpy.array(middle) - x / 2 - z / 2
        for at, a, b in ((corner, x, y), (corner + z, x, y), (corner, z, y), (corner + x, z, y), (corner + y, x, z)):
            self.patch(material, at, a, b)


def write_points(path, random, surfaces, pictures):
    area = numpy.array([numpy.linalg.norm(numpy.cross(a, b)) for _, _, a, b in surfaces])
    rows = []
    for (material, corner, along, across), count in zip(surfaces, random.multinomial(POINTS, area / area.sum())):
        for u, v in random.random((count, 2)):
            texture = pictures[material]
            pixel = texture[min(int((1 - v) * len(texture)), len(texture) - 1), min(int(u * texture.shape[1]), texture.shape[1] - 1)]
            rows.append(struct.pack("<fff", *(corner + u * along + v * across)) + pixel.tobytes())
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n"
    head += "".join(f"property {t}\n" for t in ("float x", "float y", "float z", "uchar red", "uchar green", "uchar blue"))
    path.write_bytes(head.encode() + b"end_header\n" + b"".join(rows))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--program", default="build/anchorsplat")
    parser.add_argument("--size", type=int, default=200)
    parser.add_argument("--views", type=int, default=120)
    arguments = parser.parse_args()
    work = arguments.work
    work.mkdir(parents=True, exist_ok=True)
    random = numpy.random.default_rng(19)
    names = ["plate"] + [f"box{i}" for i in range(6)] + [f"house{i}" for i in range(8)]
    pictures = {name: (numpy.clip(bricks(random), 0, 1) * 255).astype(numpy.uint8) for name in names}
    pictures["sky"] = (numpy.clip(sky(random), 0, 1) * 255).astype(numpy.uint8)
    for name, picture in pictures.items():
        write_png(work / f"{name}.png", picture)
    (work / "scene.mtl").write_text("".join(f"newmtl {n}\nKd 1 1 1\nmap_Kd {n}.png\n" for n in pictures))

    near = Mesh()
    near.patch("plate", numpy.array([-2.4, -0.4, -2.4]), numpy.array([4.8, 0, 0.0]), numpy.array([0, 0, 4.8]))
    for i in range(6):
        turn, away = i * math.pi / 3, 0.4 + 0.15 * i
        near.box(f"box{i}", (away * math.cos(turn), -0.4, away * math.sin(turn)), random.uniform(0.3, 0.8, 3), turn * 1.7)
    write_points(work / "points.ply", random, near.surfaces, pictures)
    for i in range(8):
        turn, away = i * math.pi / 4 + 0.3, 9 + 0.8 * i
        near.box(f"house{i}", (away * math.cos(turn), -2, away * math.sin(turn)), random.uniform(2, 4, 3), turn)
    latitude, longitude = numpy.meshgrid(numpy.linspace(math.pi / 2, -math.pi / 2, 49), numpy.linspace(0, 2 * math.pi, 97), indexing="ij")
    ball = numpy.stack([numpy.cos(latitude) * numpy.cos(longitude), numpy.sin(latitude), numpy.cos(latitude) * numpy.sin(longitude)], -1)
    near.grid("sky", SPHERE * ball, numpy.stack([longitude / (2 * math.pi), latitude / math.pi + 0.5], -1))

    (work / "scene.obj").write_text("\n".join(near.lines) + "\n")
    size = str(arguments.size)
    subprocess.run([arguments.program, "views", work / "scene.obj", "-o", work / "views", "-w", "--opaque", "--views",
                    str(arguments.views), "--size", size, "--low-size", str(arguments.size // 2), "--fov", "65",
                    "--points", "0", "--samples", "3", "--radius", repr(CAMERAS / (2 * SPHERE)), "--rig", "rings",
                    "--elevations", "2", "12", "25"], check=True)
    # The views are of the mesh with a longest side of 1.
    cameras = json.loads((work / f"views/transforms_{size}.json").read_text())
    for frame in cameras["frames"]:
        frame["file_path"] = "views/" + frame["file_path"]
        for row in frame["transform_matrix"][:3]:
            row[3] *= 2 * SPHERE
    del cameras["background"]  # there is none to be seen
    cameras["ply_file_path"] = "points.ply"
    (work / "transforms.json").write_text(json.dumps(cameras))


main()
