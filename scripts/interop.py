#!/usr/bin/env python3
"""Files of ours read by independent programs, and theirs by us: attributes must agree within the step of the format.

    scripts/interop.py PROGRAM INPUT.ply

Needs `splat-transform` (npm @playcanvas/splat-transform; its path in $SPLAT_TRANSFORM, or on the PATH) and the Python
packages numpy, gsply and gaussforge. Each one that is missing is said and left out; with none, nothing was checked and the exit
code is 1. Prints a table: who wrote, who read, the largest differences.
"""

import os
import shutil
import subprocess
import sys
import tempfile

import numpy as np


def read_ply(path):
    """INRIA PLY as {name: array}."""
    data = open(path, "rb").read()
    end = data.index(b"end_header\n") + 11
    header = data[:end].decode().split("\n")
    count = int(next(line for line in header if line.startswith("element vertex")).split()[2])
    names = [line.split()[2] for line in header if line.startswith("property")]
    values = np.frombuffer(data[end:], "<f4", count * len(names)).reshape(count, len(names)).astype(np.float64)
    columns = dict(zip(names, values.T))
    stack = lambda prefix, n: np.stack([columns[f"{prefix}{k}"] for k in range(n)], 1)
    rest = sum(name.startswith("f_rest_") for name in names)
    quats = stack("rot_", 4)
    quats /= np.maximum(np.linalg.norm(quats, axis=1, keepdims=True), 1e-12)
    return {
        "means": np.stack([columns["x"], columns["y"], columns["z"]], 1),
        "scales": np.maximum(stack("scale_", 3), -20),
        "quats": quats,
        "opacity": 1 / (1 + np.exp(-np.clip(columns["opacity"], -50, 50))),
        "dc": stack("f_dc_", 3),
        "rest": stack("f_rest_", rest) if rest else np.zeros((count, 0)),
    }


def match(a, b, tolerance):
    """Rows of b in the order of a: formats reorder. Greedy by nearest mean, opacity and colour, with a k-d tree of cells."""
    if len(a["means"]) != len(b["means"]):
        raise ValueError(f"{len(a['means'])} and {len(b['means'])} Gaussians")
    feature = lambda c: np.concatenate([c["means"] / max(tolerance, 1e-6), c["opacity"][:, None] * 100, c["dc"] * 20,
                                        c["scales"] * 10], 1)
    fa, fb = feature(a), feature(b)
    free = np.ones(len(fb), bool)
    order = np.empty(len(fa), int)
    for i, x in enumerate(fa):
        distance = np.where(free, ((fb - x) ** 2).sum(1), np.inf)
        order[i] = distance.argmin()
        free[order[i]] = False
    return order


def differences(a, b, tolerance):
    order = match(a, b, tolerance)
    b = {name: value[order] for name, value in b.items()}
    dot = np.abs((a["quats"] * b["quats"]).sum(1)).clip(0, 1)
    columns = min(a["rest"].shape[1], b["rest"].shape[1])
    return {
        "means": np.abs(a["means"] - b["means"]).max(),
        "scales": np.abs(a["scales"] - b["scales"]).max(),
        "degrees": np.degrees(2 * np.arccos(dot)).max(),
        "opacity": np.abs(a["opacity"] - b["opacity"]).max(),
        "dc": np.abs(a["dc"] - b["dc"]).max(),
        "rest": np.sqrt(((a["rest"] - b["rest"]) ** 2).mean()) if columns and a["rest"].shape == b["rest"].shape else 0,
    }


# Largest differences that the formats explain, for scenes of about unit size: two roundings, as both sides may round.
STEPS = {
    "ply": dict(means=1e-6, scales=1e-5, degrees=0.05, opacity=1e-5, dc=1e-5, rest=1e-5),
    "compressed.ply": dict(means=0.002, scales=0.02, degrees=0.5, opacity=0.0045, dc=0.03, rest=0.032),
    "splat": dict(means=1e-6, scales=1e-4, degrees=2.5, opacity=0.0045, dc=0.016, rest=1),
    "spz": dict(means=4e-4, scales=0.0635, degrees=0.5, opacity=0.0045, dc=0.03, rest=0.07),
    "sog": dict(means=1e-3, scales=0.3, degrees=1.5, opacity=0.0045, dc=0.3, rest=0.05),
}


def main():
    program, source = sys.argv[1:3]
    work = tempfile.mkdtemp(prefix="anchorsplat-interop-")
    path = lambda name: os.path.join(work, name)
    ours = lambda *arguments: subprocess.run([program, "convert", "-w", "-q", *arguments], check=True)
    # Few enough for an exhaustive match; without faint ones, whose rows no reader can tell apart.
    ours(source, path("in.ply"), "--max-gaussians", "1000")
    truth = read_ply(path("in.ply"))

    peers = {}
    transform = os.environ.get("SPLAT_TRANSFORM") or shutil.which("splat-transform")
    if transform:
        def by_transform(a, b):
            subprocess.run([transform, "-q", "-w", "-g", "cpu", a, b], check=True, capture_output=True)
        peers["splat-transform"] = (by_transform, ["compressed.ply", "spz", "sog"],
                                    ["compressed.ply", "spz", "splat", "sog"])
    try:
        import gaussforge

        def by_gaussforge(a, b):
            kind = lambda name: "compressed.ply" if name.endswith(".compressed.ply") else name.rsplit(".", 1)[1]
            result = gaussforge.GaussForge().convert(open(a, "rb").read(), kind(a), kind(b))
            if "error" in result:
                raise RuntimeError(result["error"])
            open(b, "wb").write(result["data"])
        peers["gaussforge"] = (by_gaussforge, ["compressed.ply", "spz", "splat", "sog"],
                               ["compressed.ply", "spz", "splat", "sog"])
    except ImportError:
        print("gaussforge is missing: left out", file=sys.stderr)
    try:
        import gsply

        def by_gsply(a, b):
            cloud = gsply.read_spz(a) if a.endswith(".spz") else gsply.plyread(a)
            if b.endswith(".spz"):
                gsply.write_spz(b, cloud)
            else:
                gsply.plywrite(b, cloud, compressed=b.endswith(".compressed.ply"))
        peers["gsply"] = (by_gsply, ["compressed.ply", "spz"], ["compressed.ply", "spz"])
    except ImportError:
        print("gsply is missing: left out", file=sys.stderr)
    if not peers:
        sys.exit("no other program was found: nothing was checked")

    bad = 0
    print(f"{'format':16}{'written by':18}{'read by':18}{'means':>10}{'ln scale':>10}{'degrees':>10}{'opacity':>10}"
          f"{'f_dc':>10}{'SH rms':>10}")
    for name, (convert, writes, reads) in peers.items():
        for kind in sorted(set(writes) | set(reads)):
            # gsply and gaussforge keep RDF in SPZ files; the specification says RUB.
            for writer in (["anchorsplat"] if kind in reads else []) + ([name] if kind in writes else []):
                file, back = path(f"{name}.{kind}"), path("back.ply")
                row = f"{kind:16}{writer:18}{name if writer == 'anchorsplat' else 'anchorsplat':18}"
                axes = ["--coords", ":RDF"] if kind == "spz" and name in AXES_IGNORED else []
                version = ["--spz-version", "3"] if kind == "spz" and name == "gsply" else []  # 4 needs more packages
                try:
                    if writer == "anchorsplat":
                        ours(path("in.ply"), file, *axes, *version)
                        convert(file, back)
                    else:
                        convert(path("in.ply"), file)
                        ours(file, back, *(["--coords", "RDF"] if axes else []))
                    expected = dict(truth)
                    if kind == "splat":  # keeps colours from 0 to 1
                        expected["dc"] = expected["dc"].clip(-0.5 / SH0, 0.5 / SH0)
                    got = differences(expected, read_ply(back), STEPS[kind]["means"])
                except Exception as error:  # a row of the table, whatever went wrong in the other program
                    print(row + f"  failed: {str(error)[:90]}")
                    bad += 1
                    continue
                worst = [key for key, limit in STEPS[kind].items() if got[key] > limit]
                print(row + "".join(f"{got[key]:10.2g}" for key in STEPS[kind]) +
                      (f"  beyond the format's step: {', '.join(worst)}" if worst else "") +
                      (f" ({KNOWN[writer, kind]})" if (writer, kind) in KNOWN else ""))
                bad += bool(worst) and (writer, kind) not in KNOWN
    shutil.rmtree(work)
    sys.exit(f"{bad} rows do not agree" if bad else 0)


SH0 = 0.28209479177387814
# Files that splat-transform reads as we do, and which differ from their source: their writers' business.
KNOWN = {("gaussforge", "compressed.ply"): "SH with a step of its own", ("gaussforge", "sog"): "some rotations wrong"}
# Programs that write and read SPZ files in the axes of the PLY they come from.
AXES_IGNORED = {"gsply", "gaussforge"}

if __name__ == "__main__":
    main()
