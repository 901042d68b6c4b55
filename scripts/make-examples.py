#!/usr/bin/env python3
"""Makes examples/ again: two CC0 meshes of Debian's furniture, traced, fitted and cut down to what an example needs.

    scripts/fetch-objects.sh objects
    scripts/make-examples.py objects examples [PROGRAM]

Ten minutes of one core, most of it the two fits. What is in the folder of an example already is replaced.
"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

LIBRARY = "usr/share/sweethome3d/furniture/BlendSwap-CC-0.sh3f"
OBJECTS = {"biplane": "cartoon_biplane", "stone_lantern": "stoneLantern"}
HELD_OUT = 8  # every eighth view is not trained on, as in `anchorsplat fit`
TRUTH = 16    # and every second one of those is kept


def cut(transforms, folder, keep):
    """The frames of a transforms file whose number is to be kept, with pictures renamed into `folder`."""
    cameras = json.loads(transforms.read_text())
    frames = []
    for frame in cameras["frames"]:
        picture = pathlib.Path(frame["file_path"])
        if not keep(int(picture.stem)):
            continue
        frames.append({**frame, "file_path": f"{folder}/{picture.stem}.png"})
    return {**cameras, "frames": frames}, [int(pathlib.Path(frame["file_path"]).stem) for frame in frames]


def make(built, to):
    to.mkdir(parents=True, exist_ok=True)
    for name, size, keep in (("lr", 256, lambda i: i % HELD_OUT != 0), ("hr", 1024, lambda i: i % TRUTH == 0)):
        shutil.rmtree(to / name, ignore_errors=True)
        (to / name).mkdir()
        cameras, views = cut(built / f"transforms_{size}.json", name, keep)
        for view in views:
            shutil.copyfile(built / str(size) / "images" / f"{view:03}.png", to / name / f"{view:03}.png")
        (to / f"transforms_{name}.json").write_text(json.dumps(cameras, indent=1) + "\n")
    shutil.copyfile(built / "splat.ply", to / "input.ply")


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    objects, examples = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    program = sys.argv[3] if len(sys.argv) == 4 else "build/anchorsplat"
    with tempfile.TemporaryDirectory(dir=examples.parent) as work:
        meshes = [f"{objects / LIBRARY}#{mesh}" for mesh in OBJECTS.values()]
        subprocess.run([program, "dataset", "build", *meshes, "-o", f"{work}/built", "--opaque", "--points", "10000",
                        "--max-gaussians", "20000", "--threads", "1"], check=True)
        for name, mesh in OBJECTS.items():
            make(pathlib.Path(work) / "built" / f"BlendSwap-CC-0-{mesh}", examples / name)


if __name__ == "__main__":
    main()
