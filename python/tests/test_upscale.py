"""Pictures enlarged by a network, which the test makes: one that gives every pixel four times."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest

import anchorsplat


@pytest.fixture
def network(tmp_path):
    tensors = {
        "input.mean": np.zeros(3),
        "input.scale": np.ones(1),
        "constants": np.zeros(1),
    }
    for k in range(12):
        outputs, inputs = (12 if k == 11 else 3), (4 if k == 0 else 3)
        weights = np.zeros((outputs, inputs, 3, 3))
        for o in range(outputs):
            weights[o, o * 3 // outputs, 1, 1] = 1
        tensors[f"conv.{k}.weight"], tensors[f"conv.{k}.bias"] = weights, np.zeros(outputs)
        if k < 11:
            tensors[f"conv.{k}.slope"] = np.zeros(outputs)
    header = {
        "__metadata__": {
            "format": "anchorsplat-upscaler-1",
            "architecture": "srmd-1",
            "scale": "2",
            "color_space": "sRGB",
            "input_range": "0-1",
        }
    }
    data = b""
    for name, values in tensors.items():
        part = values.astype("<f4").tobytes()
        header[name] = {"dtype": "F32", "shape": values.shape, "data_offsets": [len(data), len(data) + len(part)]}
        data += part
    text = json.dumps(header).encode()
    path = tmp_path / "network.safetensors"
    path.write_bytes(struct.pack("<Q", len(text)) + text + data)
    return path


def repeated(pictures, times):
    return pictures.repeat(times, axis=-3).repeat(times, axis=-2)


def test_pictures_are_enlarged(network):
    pictures = np.random.default_rng(0).integers(0, 256, (2, 5, 7, 3), dtype=np.uint8)
    large = anchorsplat.upscale(pictures, network)
    assert large.shape == (2, 10, 14, 3) and large.dtype == np.float32
    assert np.abs(large - repeated(pictures / 255, 2)).max() < 1e-6
    assert np.array_equal(anchorsplat.upscale(pictures[1], str(network), threads=1), large[1])
    assert anchorsplat.upscale(pictures[0], network, factor=4).shape == (20, 28, 3)


def test_alpha_is_kept(network):
    pictures = np.random.default_rng(1).random((1, 5, 7, 4), dtype=np.float32)
    large = anchorsplat.upscale(pictures, network, background=(1, 0, 0.5))
    assert np.abs(large[..., 3] - repeated(pictures, 2)[..., 3]).max() < 1e-6
    assert not np.array_equal(anchorsplat.upscale(pictures, network, alpha="bicubic")[..., 3], large[..., 3])


def test_what_cannot_be_enlarged(network, biplane):
    picture = np.zeros((4, 4, 3), np.float32)
    with pytest.raises(anchorsplat.BadArgumentError, match="factor"):
        anchorsplat.upscale(picture, network, factor=3)
    with pytest.raises(anchorsplat.BadArgumentError, match="channels"):
        anchorsplat.upscale(np.zeros((4, 4, 2), np.float32), network)
    with pytest.raises(anchorsplat.BadArgumentError):
        anchorsplat.upscale(np.zeros((4, 4, 1), np.float32), network)
    with pytest.raises(anchorsplat.BadFileError):
        anchorsplat.upscale(picture, biplane)
    with pytest.raises(anchorsplat.NotFoundError):
        anchorsplat.upscale(picture, "none.safetensors")
