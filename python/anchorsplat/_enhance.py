"""Enhancing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from . import _core
from ._cameras import CamerasLike, Color, camera_words
from ._cloud import Cloud, RenderMode
from ._files import PathLike
from ._report import Report
from ._run import DeviceLike, ProgressLike, run
from ._words import natural, words_of


def methods() -> dict[str, str]:
    """Ways to enhance, for ``enhance(method=…)``, with a line about each."""
    return dict(_core.enhance_methods())


def enhance(
    cloud: Cloud,
    *,
    method: str = "auto",
    quality: Literal["fast", "good", "best"] | None = None,
    upscale: float = 4,
    max_gaussians: int = 0,
    most_gaussians: int = 0,
    region: Sequence[float] | None = None,
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
    prune_opacity: float = 0,
    block_gaussians: int = 200_000,
    images: PathLike | None = None,
    enlarge_with: PathLike | None = None,
    hold_out: int | None = None,
    downscale: int = 1,
    steps: int | None = None,
    seconds: float | None = None,
    k: int | None = None,
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
    checkpoint_every: int = 0,
    resume: bool = False,
    seed: int = 0,
    device: DeviceLike = "cpu",
    max_gpu_memory: int | str | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> tuple[Cloud, Report]:
    """Returns a splat that holds up when seen closer, and a :class:`Report`. `cloud` is not changed.

    method: "auto" (the best for what is given), one of :func:`methods`, or two such as "model+refine".
    quality: how much time to spend, instead of a method: "fast", about a second; "good", several; "best", minutes.
    upscale: zoom to prepare for, at least 1.
    max_gaussians: budget for the result, spent where the closer view shows it; 0: no limit. most_gaussians: its old name.
    region: enhance only this part, a box (x0, y0, z0, x1, y1, z1) or a sphere (x, y, z, radius) in world units. The rest
        stays bit-identical.

    pixel_size: world size of a training pixel, or "auto": from the cameras, the pictures or the splat.
    mode: rasterization in training; default: the splat's tag, else estimated.
    cameras: training cameras, for the exact pixel size of every Gaussian.
    train_width: image width in training, if smaller than in `cameras`.
    camera_rule: which view of a Gaussian sets its pixel size.
    filter_strength: share of the absorbed 0.3 px² to give back; default: 1 − (1 − 1/upscale²)/3.6.
    background: r, g, b from 0 to 1 of the training views; default: from the camera file, else the splat, else black.
    clean: first remove background-coloured Gaussians that no training view would miss.

    model: weights of a network, .pth or .safetensors; default: the built-in one.
    copies: most Gaussians that a compact network makes of each, or "auto". merge_cost: most error per merged Gaussian with "auto".
    prune_opacity: drop network output fainter than this.
    block_gaussians: enhance larger splats in overlapping blocks of this size.
    precision: arithmetic of the network.
    compat, normalisation, attention_rounding, curve_depth, shuffles: options of the published network (docs/network.md).

    enlarge_with: for the method "detail": a network that enlarges pictures, as for :func:`upscale`. The detail it adds is invented.

    Refinement: images: project with the training pictures, full-size if possible. hold_out: hold out every Nth view (None: 8, or 0 if the splat was
    fitted to all). downscale: average N × N pixels. steps or seconds: how long to run. k: Gaussians to split each into first.
    poses, between: views to use without pictures. half_from, all_from: fractions of the run after which half and all of the
    rays are rendered. rate, rate_decay: factor on the learning rates of ``fit``, and on that by the end. ssim_weight: weight
    of SSIM in the loss. exposure, robust, align: for pictures that differ in brightness, show passers-by, or have inexact poses.

    checkpoint: file for the state of an interrupted refinement (Ctrl-C writes it, then raises KeyboardInterrupt) or of a compact
        network. checkpoint_every: also write it every so many steps. resume: continue from it.

    device: rasterize on "cpu", "gpu", "auto" (a hardware GPU, else the CPU) or an adapter by number.
        max_gpu_memory: most GPU memory to use, bytes or "4G"; default: 2 GiB (docs/gpu.md).

    seed: random seed. threads: CPU threads; 0: all. The result does not depend on them.

    Messages go to the logger "anchorsplat", warnings to SplatWarning. Raises BadArgumentError: keywords out of range or without
    effect, or a method that cannot run; BadFileError: no usable Gaussian, or a bad file among the keywords; NotFoundError; IoError.
    """
    words = words_of(enhance, locals(), besides=("cameras",))
    given = camera_words(cameras, words)
    with run(
        threads, progress, patient=checkpoint is not None, device=device, max_gpu_memory=max_gpu_memory
    ) as how:
        parts, report = _core.enhance(cloud, words, given, natural("seed", seed), how)
    return Cloud._of(parts), Report._of(report)


def refine(
    cloud: Cloud,
    images: PathLike | None = None,
    *,
    upscale: float = 4,
    max_gaussians: int = 0,
    most_gaussians: int = 0,
    region: Sequence[float] | None = None,
    pixel_size: float | Literal["auto"] = "auto",
    mode: RenderMode | None = None,
    cameras: CamerasLike | None = None,
    train_width: int | None = None,
    camera_rule: Literal["auto", "smallest", "median"] = "auto",
    filter_strength: float | None = None,
    background: Color | None = None,
    hold_out: int | None = None,
    downscale: int = 1,
    steps: int | None = None,
    seconds: float | None = None,
    k: int | None = None,
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
    checkpoint_every: int = 0,
    resume: bool = False,
    seed: int = 0,
    device: DeviceLike = "cpu",
    max_gpu_memory: int | str | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> tuple[Cloud, Report]:
    """Optimises a splat for a closer view, against its training pictures or, without them, its own low-resolution renders. The
    same as ``enhance(cloud, method="refine", …)``, with its keywords.

    images: project with the training pictures, as for ``fit``.
    """
    given = {name: value for name, value in locals().items() if name != "cloud"}
    return enhance(cloud, method="refine", **given)
