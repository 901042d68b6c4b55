#!/usr/bin/env python3
"""The splats of `anchorsplat bench gpu` drawn by gsplat on the same machine, with the same rows.

  scripts/gpu-bench-gsplat.py PROGRAM [--repeats 5] [--json] [words of `bench gpu` that say what: --small, --gaussians, --size]

PROGRAM writes the splats and cameras (--write-scenes). Forward is a picture that is ready for its gradient, backward from
there to the gradients of all columns; both of a splat that is on the GPU, fastest of the repeats, after one that warms up.
Where this Python has no gsplat, or PyTorch no CUDA, it says so in one sentence and ends with exit code 3.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import time


def none(why):
    print(f"gpu-bench-gsplat: nothing beside it: {why}", file=sys.stderr)
    sys.exit(3)


try:
    import torch
    from gsplat import rasterization
except Exception as error:  # a wheel for another CUDA fails in many ways
    none(f"gsplat cannot be imported ({type(error).__name__}: {str(error).splitlines()[0] if str(error) else 'no reason'})")


def columns(path):
    """A binary PLY of floats, as the program writes it, as tensors on the GPU in gsplat's shapes."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode("ascii").split("\n")
    names = [line.split()[2] for line in header if line.startswith("property float ")]
    if len(names) != sum(line.startswith("property ") for line in header):
        raise SystemExit(f"gpu-bench-gsplat: {path} has properties that are not floats")
    rows = torch.frombuffer(bytearray(data[end:]), dtype=torch.float32).reshape(-1, len(names))
    pick = lambda *wanted: rows[:, [names.index(name) for name in wanted]].cuda().contiguous()
    rest = sum(name.startswith("f_rest_") for name in names)
    sh0 = pick("f_dc_0", "f_dc_1", "f_dc_2")[:, None, :]
    # The file has the coefficients of red, then those of green and of blue.
    more = pick(*[f"f_rest_{i}" for i in range(rest)]).reshape(-1, 3, rest // 3).transpose(1, 2)
    return {
        "means": pick("x", "y", "z"),
        "log_scales": pick("scale_0", "scale_1", "scale_2"),
        "quats": pick("rot_0", "rot_1", "rot_2", "rot_3"),
        "opacity_logits": pick("opacity")[:, 0].contiguous(),
        "sh": torch.cat([sh0, more], 1).contiguous(),
    }


def measure(cloud, camera, repeats):
    width, height = camera["width"], camera["height"]
    view = torch.eye(4)
    view[:3, :3] = torch.tensor(camera["rotation"]).reshape(3, 3)
    view[:3, 3] = torch.tensor(camera["translation"])
    k = torch.tensor([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1.0]])
    view, k = view[None].cuda(), k[None].cuda()
    torch.manual_seed(1)
    weights = torch.rand(1, height, width, 4, device="cuda") * 2 - 1
    leaves = {name: column.requires_grad_(True) for name, column in cloud.items()}
    best = (math.inf, math.inf)
    for repeat in range(repeats + 1):
        for leaf in leaves.values():
            leaf.grad = None
        torch.cuda.synchronize()
        begin = time.perf_counter()
        color, alpha, _ = rasterization(
            leaves["means"], leaves["quats"], leaves["log_scales"].exp(), leaves["opacity_logits"].sigmoid(), leaves["sh"],
            view, k, width, height, sh_degree=3, packed=False)
        torch.cuda.synchronize()
        drawn = time.perf_counter()
        (torch.cat([color, alpha], -1) * weights).sum().backward()
        torch.cuda.synchronize()
        end = time.perf_counter()
        if repeat > 0 and end - begin < sum(best):
            best = (drawn - begin, end - drawn)
    return best


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    flags, words = parser.parse_known_args()
    if not torch.cuda.is_available():
        none("PyTorch finds no CUDA here")
    import gsplat

    rows = []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder) / "scenes"
        subprocess.run([flags.program, "bench", "gpu", "--write-scenes", str(folder), "-q", *words], check=True)
        scenes = json.loads((folder / "scenes.json").read_text())
        for splat in scenes["splats"]:
            cloud = columns(folder / splat["file"])
            for camera in scenes["cameras"]:
                row = {"gaussians": splat["gaussians"], "width": camera["width"], "height": camera["height"]}
                try:
                    row["forward_seconds"], row["backward_seconds"] = measure(cloud, camera, flags.repeats)
                except RuntimeError as error:  # out of memory, too; the others go on
                    row["problem"] = str(error).splitlines()[0]
                rows.append(row)
            del cloud
            torch.cuda.empty_cache()
    name = torch.cuda.get_device_name()
    if flags.json:
        print(json.dumps({"bench": "gsplat", "gsplat": gsplat.__version__, "adapter": {"name": name}, "rows": rows}, indent=2))
        return
    print(f"gsplat {gsplat.__version__} on {name}, milliseconds per picture, fastest of {flags.repeats}\n")
    print(f"{'Gaussians':>10}  {'size':>9}  {'forward':>8}  {'backward':>8}")
    for row in rows:
        what = f"{row['gaussians']:>10,}  {row['width']}x{row['height']:<5}"
        if "problem" in row:
            print(f"{what}  {row['problem']}")
        else:
            print(f"{what}  {1e3 * row['forward_seconds']:8.2f}  {1e3 * row['backward_seconds']:8.2f}")


if __name__ == "__main__":
    main()
