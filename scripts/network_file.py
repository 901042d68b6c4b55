"""Files of compact networks (docs/network.md), for the scripts beside this one. Needs numpy."""

import json
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


def write(path, metadata, values, half):
    """`half`: whether a tensor of that name is kept in half precision. `path` must not be there yet."""
    header = {"__metadata__": metadata}
    out = bytearray()
    # What is kept whole first: then all of it lies at multiples of four bytes.
    for name in sorted(values, key=half):
        stored = values[name].astype("<f2" if half(name) else "<f4").tobytes()
        header[name] = {"dtype": "F16" if half(name) else "F32", "shape": list(values[name].shape),
                        "data_offsets": [len(out), len(out) + len(stored)]}
        out += stored
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    try:
        with open(path, "xb") as file:
            file.write(struct.pack("<Q", len(text)) + text + out)
    except FileExistsError:
        sys.exit(f"{path} exists: give another name, or take it away")
