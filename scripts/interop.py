#!/usr/bin/env python3
"""Files of ours read by independent programs, and theirs by us: attributes must agree within the step of the format.

    scripts/interop.py PROGRAM INPUT.ply [--allow-missing]

Needs `splat-transform` (npm @playcanvas/splat-transform; its path in $SPLAT_TRANSFORM, or on the PATH) and the Python
packages numpy, gsply and gaussforge. Each one that is missing is said; the exit code is then 1 even if all others agree,
unless --allow-missing is given and there is one at least. Prints a table: who wrote, who read, the largest differences.

No program among them reads glTF, so what we write is read here, by the text of KHR_gaussian_splatting alone ("numpy").
"""

import argparse
import json
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


def read_glb(path):
    """A GLB of one primitive with KHR_gaussian_splatting and float attributes, as read_ply has it. glTF has y up and z
    forward (LUF), PLYs y down (RDF): a turn by 180 degrees about z, which takes a sign from what is odd in x and y."""
    data = open(path, "rb").read()
    length = int.from_bytes(data[12:16], "little")
    document, binary = json.loads(data[20:20 + length]), data[20 + length + 8:]
    primitive = document["meshes"][0]["primitives"][0]
    assert primitive["extensions"]["KHR_gaussian_splatting"]["kernel"] == "ellipse"

    def values(name):
        accessor = document["accessors"][primitive["attributes"][name]]
        view = document["bufferViews"][accessor["bufferView"]]
        assert accessor["componentType"] == 5126 and "byteStride" not in view
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return np.frombuffer(binary, "<f4", accessor["count"] * width, begin).reshape(-1, width).astype(np.float64)

    own = lambda name: values("KHR_gaussian_splatting:" + name)
    sh = []
    for degree in range(4):
        for n in range(2 * degree + 1):
            if f"KHR_gaussian_splatting:SH_DEGREE_{degree}_COEF_{n}" in primitive["attributes"]:
                # Coefficient n is of order m = n - degree, and turns by 180 degrees times m.
                sh.append(own(f"SH_DEGREE_{degree}_COEF_{n}") * (-1) ** (n - degree))
    rest = np.stack(sh[1:], 2).reshape(len(sh[0]), -1) if len(sh) > 1 else np.zeros((len(sh[0]), 0))  # channel-major
    x, y, z, w = own("ROTATION").T
    return {
        "means": values("POSITION") * [-1, -1, 1],
        "scales": np.maximum(np.log(np.maximum(own("SCALE"), 1e-30)), -20),
        "quats": np.stack([w, -x, -y, z], 1),
        "opacity": own("OPACITY")[:, 0],
        "dc": sh[0],
        "rest": rest,
    }


def matrices(quats):
    w, x, y, z = quats.T
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                     2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                     2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1).reshape(-1, 3, 3)


def shape_error(a, b):
    """Largest relative difference of covariances with the rotations of a and of b, the scales of a: unlike the angle it
    is nothing where a rotation does nothing, as of a ball."""
    variances = np.exp(2 * a["scales"])[:, None, :]
    covariance = lambda rotations: (rotations * variances) @ rotations.transpose(0, 2, 1)
    truth = covariance(matrices(a["quats"]))
    size = np.linalg.norm(truth, axis=(1, 2))
    return (np.linalg.norm(covariance(matrices(b["quats"])) - truth, axis=(1, 2)) / size).max()


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
        "shape": shape_error(a, b),
        "opacity": np.abs(a["opacity"] - b["opacity"]).max(),
        "dc": np.abs(a["dc"] - b["dc"]).max(),
        "rest": np.sqrt(((a["rest"] - b["rest"]) ** 2).mean()) if columns and a["rest"].shape == b["rest"].shape else 0,
    }


# Largest differences that the formats explain, for scenes of about unit size: two roundings, as both sides may round.
# Angles are only told: what counts is what they do to the shape.
STEPS = {
    "ply": dict(means=1e-6, scales=1e-5, shape=1e-5, opacity=1e-5, dc=1e-5, rest=1e-5),
    "compressed.ply": dict(means=0.002, scales=0.02, shape=0.01, opacity=0.0045, dc=0.03, rest=0.032),
    "splat": dict(means=1e-6, scales=1e-4, shape=0.06, opacity=0.0045, dc=0.016, rest=1),
    "spz": dict(means=4e-4, scales=0.0635, shape=0.01, opacity=0.0045, dc=0.03, rest=0.07),
    "sog": dict(means=1e-3, scales=0.3, shape=0.05, opacity=0.0045, dc=0.3, rest=0.05),
    "ksplat": dict(means=1e-6, scales=1e-4, shape=1e-3, opacity=0.0045, dc=0.016, rest=0.02),
    "glb": dict(means=1e-6, scales=1e-4, shape=1e-4, opacity=1e-5, dc=1e-5, rest=1e-5),
}
COLUMNS = ["means", "scales", "degrees", "shape", "opacity", "dc", "rest"]


def main():
    parser = argparse.ArgumentParser(description="Our files read by other programs and theirs by ours")
    parser.add_argument("program")
    parser.add_argument("source", metavar="input.ply")
    parser.add_argument("--allow-missing", action="store_true", help="programs that are not there do not count as failures")
    options = parser.parse_args()
    work = tempfile.mkdtemp(prefix="anchorsplat-interop-")
    path = lambda name: os.path.join(work, name)
    ours = lambda *arguments: subprocess.run([options.program, "convert", "-w", "-q", *arguments], check=True)
    # Few enough for an exhaustive match; without faint ones, whose rows no reader can tell apart.
    ours(options.source, path("in.ply"), "--max-gaussians", "1000")
    truth = read_ply(path("in.ply"))
    missing = []

    def without(name):
        missing.append(name)
        print(f"{name} is missing: left out", file=sys.stderr)

    peers = {}
    transform = os.environ.get("SPLAT_TRANSFORM") or shutil.which("splat-transform")
    if transform:
        def by_transform(a, b):
            subprocess.run([transform, "-q", "-w", "-g", "cpu", a, b], check=True, capture_output=True)
        peers["splat-transform"] = (by_transform, ["ply", "compressed.ply", "spz", "sog", "glb"],
                                    ["ply", "compressed.ply", "spz", "splat", "sog"])
    else:
        without("splat-transform ($SPLAT_TRANSFORM)")
    try:
        import gaussforge

        def by_gaussforge(a, b):
            kind = lambda name: "compressed.ply" if name.endswith(".compressed.ply") else name.rsplit(".", 1)[1]
            result = gaussforge.GaussForge().convert(open(a, "rb").read(), kind(a), kind(b))
            if "error" in result:
                raise RuntimeError(result["error"])
            open(b, "wb").write(result["data"])
        peers["gaussforge"] = (by_gaussforge, ["ply", "compressed.ply", "spz", "splat", "sog", "ksplat"],
                               ["ply", "compressed.ply", "spz", "splat", "sog"])
    except ImportError:
        without("gaussforge")
    try:
        import gsply

        def by_gsply(a, b):
            cloud = gsply.read_spz(a) if a.endswith(".spz") else gsply.plyread(a)
            if b.endswith(".spz"):
                gsply.write_spz(b, cloud)
            else:
                gsply.plywrite(b, cloud, compressed=b.endswith(".compressed.ply"))
        peers["gsply"] = (by_gsply, ["ply", "compressed.ply", "spz"], ["ply", "compressed.ply", "spz"])
    except ImportError:
        without("gsply")
    if not peers:
        sys.exit("no other program was found: nothing was checked")
    peers["numpy"] = (None, [], ["glb"])

    bad = 0
    print(f"{'format':16}{'written by':18}{'read by':18}{'means':>10}{'ln scale':>10}{'degrees':>10}{'shape':>10}"
          f"{'opacity':>10}{'f_dc':>10}{'SH rms':>10}")
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
                        if convert is not None:
                            convert(file, back)
                    else:
                        convert(path("in.ply"), file)
                        ours(file, back, *(["--coords", "RDF"] if axes else []))
                    expected = dict(truth)
                    if kind in ("splat", "ksplat"):  # they keep colours from 0 to 1
                        expected["dc"] = expected["dc"].clip(-0.5 / SH0, 0.5 / SH0)
                    read = read_glb(file) if convert is None else read_ply(back)
                    got = differences(expected, read, STEPS[kind]["means"])
                except Exception as error:  # a row of the table, whatever went wrong in the other program
                    print(row + f"  failed: {str(error)[:90]}")
                    bad += 1
                    continue
                worst = [key for key, limit in STEPS[kind].items() if got[key] > limit]
                print(row + "".join(f"{got[key]:10.2g}" for key in COLUMNS) +
                      (f"  beyond the format's step: {', '.join(worst)}" if worst else "") +
                      (f" ({KNOWN[writer, kind]})" if (writer, kind) in KNOWN else ""))
                bad += bool(worst) and (writer, kind) not in KNOWN
    shutil.rmtree(work)
    if bad:
        sys.exit(f"{bad} rows do not agree")
    if missing and not options.allow_missing:
        sys.exit(f"all that was checked agrees, but not all was: {', '.join(missing)} missing (--allow-missing accepts that)")


SH0 = 0.28209479177387814
# Files that splat-transform reads as we do, and which differ from their source: their writers' business.
KNOWN = {("gaussforge", "compressed.ply"): "SH with a step of its own", ("gaussforge", "sog"): "some rotations wrong",
         ("gaussforge", "ksplat"): "SH with a step of its own"}
# Programs that write and read SPZ files in the axes of the PLY they come from.
AXES_IGNORED = {"gsply", "gaussforge"}

if __name__ == "__main__":
    main()
