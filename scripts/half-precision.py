#!/usr/bin/env python3
"""Rounds the weights of a compact network to half precision, as all in models/ are.

    scripts/half-precision.py run/model.safetensors OUT.safetensors

The range of the training data ("domain.low", "domain.high") stays as it is, and so does the metadata. A weight that half
precision cannot hold is an error, and OUT must not be there yet. Needs numpy.
"""

import json
import struct
import sys

import numpy as np


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], "rb") as file:
        length = struct.unpack("<Q", file.read(8))[0]
        tensors = json.loads(file.read(length))
        data = file.read()
    header = {"__metadata__": tensors.pop("__metadata__", {})}
    out = bytearray()
    # The range first: then all of it lies at multiples of four bytes.
    for name in sorted(tensors, key=lambda name: (not name.startswith("domain."), tensors[name]["data_offsets"][0])):
        tensor = tensors[name]
        if tensor["dtype"] != "F32":
            sys.exit(f"{sys.argv[1]}: tensor {name} is {tensor['dtype']}, expected F32")
        values = np.frombuffer(data[slice(*tensor["data_offsets"])], "<f4")
        keeps = name.startswith("domain.")
        if not keeps and not np.all(np.abs(values) <= np.finfo(np.float16).max):
            sys.exit(f"{sys.argv[1]}: tensor {name} has values that half precision cannot hold")
        stored = values.tobytes() if keeps else values.astype("<f2").tobytes()
        header[name] = {"dtype": "F32" if keeps else "F16", "shape": tensor["shape"],
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
