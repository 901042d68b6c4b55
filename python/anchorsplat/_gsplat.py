"""Parameters of gsplat's trainer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from ._cloud import Cloud
from ._errors import BadArgumentError

NAMES = ("means", "scales", "quats", "opacities", "sh0", "shN")


def from_gsplat(params: Mapping[str, Any]) -> Cloud:
    given = params["splats"] if "splats" in params and "means" not in params else params
    missing = [name for name in NAMES if name not in given]
    if missing:
        raise BadArgumentError(f"no {', '.join(missing)}; gsplat's parameters are {', '.join(NAMES)}")
    arrays = {name: given[name] for name in NAMES}
    for name, value in arrays.items():
        if hasattr(value, "detach"):
            arrays[name] = value.detach().cpu().numpy()
    for name in ("sh0", "shN"):
        shape = np.shape(arrays[name])
        if len(shape) != 3 or shape[2] != 3 or (name == "sh0" and shape[1] != 1):
            wanted = "[N, 1, 3]" if name == "sh0" else "[N, K - 1, 3]"
            raise BadArgumentError(f"{name}: expected {wanted}, found {list(shape)}")
    if len(arrays["sh0"]) != len(arrays["shN"]):
        raise BadArgumentError(f"shN: {len(arrays['shN'])} rows, but sh0 has {len(arrays['sh0'])}")
    sh = np.concatenate([arrays["sh0"], arrays["shN"]], axis=1)
    return Cloud(arrays["means"], arrays["scales"], arrays["quats"], arrays["opacities"], sh)


def to_gsplat(cloud: Cloud, arrays: Literal["torch", "numpy"]) -> dict[str, Any]:
    params: dict[str, Any] = {
        "means": cloud.means,
        "scales": cloud.log_scales,
        "quats": cloud.quats,
        "opacities": cloud.opacity_logits,
        "sh0": cloud.sh[:, :1],
        "shN": cloud.sh[:, 1:],
    }
    if arrays == "numpy":
        return params
    if arrays != "torch":
        raise BadArgumentError(f"arrays: {arrays!r} is neither 'torch' nor 'numpy'")
    import torch

    return {name: torch.from_numpy(values) for name, values in params.items()}
