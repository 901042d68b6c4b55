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

import os
import sys

import numpy as np

import network_file


def mean(values, path, share):
    others = network_file.read(path)[1]
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
    metadata, values = network_file.read(sys.argv[1])
    if len(sys.argv) == 5:
        try:
            share = float(sys.argv[4])
        except ValueError:
            share = -1
        if not 0 <= share <= 1:
            sys.exit(f"{sys.argv[4]}: expected a share from 0 to 1")
        mean(values, sys.argv[3], share)
        metadata["mean"] = f"{share:g} of the weights of {os.path.basename(sys.argv[3])}, the rest of this recipe's"
    for name, tensor in values.items():
        if not name.startswith("domain.") and not np.all(np.abs(tensor) <= np.finfo(np.float16).max):
            sys.exit(f"{sys.argv[1]}: tensor {name} has values that half precision cannot hold")
    network_file.write(sys.argv[2], metadata, values, lambda name: not name.startswith("domain."))


if __name__ == "__main__":
    main()
