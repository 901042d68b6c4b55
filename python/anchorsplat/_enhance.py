"""Enhancing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from . import _core
from ._cameras import CamerasLike, Color, camera_words
from ._cloud import Cloud, RenderMode
from ._files import PathLike
from ._report import Report
from ._run import ProgressLike, run
from ._words import words_of


def methods() -> dict[str, str]:
    """Ways to enhance, for ``enhance(method=…)``, with a line about each."""
    return dict(_core.enhance_methods())


def enhance(
    cloud: Cloud,
    *,
    method: str = "auto",
    quality: Literal["fast", "good", "best"] | None = None,
    upscale: float = 4,
    pixel_size: float | Literal["auto"] = "auto",
    mode: RenderMode | None = None,
    cameras: CamerasLike | None = None,
    train_width: int | None = None,
    camera_rule: Literal["auto", "smallest", "median"] = "auto",
    filter_strength: float | None = None,
    clean: bool = False,
    background: Color | None = None,
    model: PathLike | None = None,
    compat: Literal["upstream"] | None = None,
    normalisation: Literal["auto", "centered", "bbox", "unit"] = "auto",
    precision: Literal["fp32", "bf16"] = "fp32",
    attention_rounding: Literal["none", "fp16", "bf16"] = "none",
    curve_depth: Literal["v1.5", "v1.6"] = "v1.5",
    shuffles: str | int = "identity",
    copies: int | Literal["auto"] = "auto",
    merge_cost: float | None = None,
    max_gaussians: int = 0,
    prune_opacity: float = 0,
    block_gaussians: int = 300_000,
    images: PathLike | None = None,
    hold_out: int = 8,
    steps: int | None = None,
    seconds: float | None = None,
    k: int | None = None,
    most_gaussians: int = 0,
    poses: int = 128,
    between: int = 1,
    half_from: float = 0.3,
    all_from: float = 0.7,
    rate: float | None = None,
    rate_decay: float = 0.1,
    ssim_weight: float = 0.2,
    exposure: bool = False,
    robust: bool = False,
    align: bool = False,
    checkpoint: PathLike | None = None,
    resume: bool = False,
    seed: int = 0,
    threads: int = 0,
    progress: ProgressLike = None,
) -> tuple[Cloud, Report]:
    """Makes a splat that was trained on small pictures hold up when it is seen closer.

    Keywords are the options of ``anchorsplat enhance``, whose ``--help`` says more about each. `cloud` stays as it is.
    """
    words = words_of(enhance, locals(), besides=("cameras",))
    given = camera_words(cameras, words)
    with run(threads, progress, patient=checkpoint is not None) as how:
        parts, report = _core.enhance(cloud, words, given, seed, how)
    return Cloud._of(parts), Report._of(report)
