#!/usr/bin/env python3
"""Rounds the weights of a compact network to half precision, as all in models/ are.

    scripts/half-precision.py run/model.safetensors OUT.safetensors
    scripts/half-precision.py run/model.safetensors OUT.safetensors OTHER.safetensors SHARE

The second line takes the mean of two networks of the same shape first, SHARE (0 to 1) of the weights of OTHER, which
the run began with: what it has learned, without much of what it has forgotten. The range of the training data
("domain.low", "domain.high") is that of both then.

Else the range stays as it is, and so does the metadata. A weight that half precision cannot hold is an error, and OUT
must not be there yet. Needs numpy.
"""

import json
import os
import struct
import sys

import numpy as np

TYPES = {"F32": "<f4", "F16": "<f2"}


def read(path):
    """Metadata, and tensors by name in the order of the file, as float32."""
    with open(path, "rb") as file:
        length = struct.unpack("<Q", file.read(8))[0]
        tensors = json.loads(file.read(length))
        data = file.read()
    metadata = tensors.pop("__metadata__", {})
    values = {}
    for name in sorted(tensors, key=lambda name: tensors[name]["data_offsets"][0]):
        tensor = tensors[name]
        if tensor["dtype"] not in TYPES:
            sys.exit(f"{path}: tensor {name} is {tensor['dtype']}, expected F32 or F16")
        values[name] = np.frombuffer(data[slice(*tensor["data_offsets"])], TYPES[tensor["dtype"]]).astype("<f4")
        values[name] = values[name].reshape(tensor["shape"])
    return metadata, values


def mean(values, path, share):
    others = read(path)[1]
    for name, own in values.items():
        if name not in others or others[name].shape != own.shape:
            sys.exit(f"{path}: has no tensor {name} of shape {list(own.shape)}: a network of another shape")
        other = others[name]
        if name.startswith("domain."):
            values[name] = np.minimum(own, other) if name.endswith("low") else np.maximum(own, other)
        else:
            values[name] = (share * other.astype(np.float64) + (1 - share) * own).astype("<f4")


def main():
    if len(sys.argv) not in (3, 5):
        sys.exit(__doc__)
    metadata, values = read(sys.argv[1])
    if len(sys.argv) == 5:
        try:
            share = float(sys.argv[4])
        except ValueError:
            share = -1
        if not 0 <= share <= 1:
            sys.exit(f"{sys.argv[4]}: expected a share from 0 to 1")
        mean(values, sys.argv[3], share)
        metadata["mean"] = f"{share:g} of the weights of {os.path.basename(sys.argv[3])}, the rest of this recipe's"
    header = {"__metadata__": metadata}
    out = bytearray()
    # The range first: then all of it lies at multiples of four bytes.
    for name in sorted(values, key=lambda name: not name.startswith("domain.")):
        keeps = name.startswith("domain.")
        if not keeps and not np.all(np.abs(values[name]) <= np.finfo(np.float16).max):
            sys.exit(f"{sys.argv[1]}: tensor {name} has values that half precision cannot hold")
        stored = values[name].tobytes() if keeps else values[name].astype("<f2").tobytes()
        header[name] = {"dtype": "F32" if keeps else "F16", "shape": list(values[name].shape),
                        "data_offsets": [len(out), len(out) + len(stored)]}
        out += stored
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    try:
        with open(sys.argv[2], "xb") as file:
            file.write(struct.pack("<Q", len(text)) + text + out)
    except FileExistsError:
        sys.exit(f"{sys.argv[2]} exists: give another name, or take it away")


if __name__ == "__main__":
    main()
