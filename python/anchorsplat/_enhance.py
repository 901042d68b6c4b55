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
    """Makes a splat that was trained on small pictures hold up when it is seen closer. `cloud` stays as it is.

    method: "auto", the best that is ready; one of :func:`methods`; or two, "model+refine".
    quality: instead of a method, by the time there is: "fast", a second; "good", several; "best", minutes with `images`.
    upscale: how many times closer it will be seen, at least 1.
    max_gaussians: of the result at most, spent where the closer view shows it; 0: no bound. most_gaussians: its old name.
    region: only what lies in there is enhanced, the rest stays bit by bit: a box (x0, y0, z0, x1, y1, z1) or a sphere
        (x, y, z, radius) in the splat's unit.

    pixel_size: world size of a pixel of the training views, or "auto": from the cameras, the pictures or the splat.
    mode: how the splat was rasterized in training; otherwise as it says, else as it looks.
    cameras: the training cameras: exact pixel size for every Gaussian.
    train_width: pixels of the pictures in training where they were smaller than the cameras say.
    camera_rule: which of the views that hold a Gaussian says its pixel size.
    filter_strength: share of the absorbed 0.3 px² to give back; otherwise 1 − (1 − 1/upscale²)/3.6.
    background: r, g, b from 0 to 1, of the training views; otherwise what the camera file says, else the splat, else black.
    clean: first takes out Gaussians of that colour that no training view would miss.

    model: weights of a network, .pth or .safetensors; otherwise the one in the box.
    copies, merge_cost: Gaussians that a compact network makes of each, at most, or "auto"; what a merge may cost then.
    prune_opacity: fainter Gaussians are left out of a network's result.
    block_gaussians: larger splats are enhanced in overlapping blocks of this many.
    precision: of the network's arithmetic.
    compat, normalisation, attention_rounding, curve_depth, shuffles: of the published architecture (docs/network.md).

    enlarge_with: of the method "detail": a network that enlarges pictures, as of :func:`upscale`; what it adds is invented.

    Of refinement: images: the project with the pictures it was fitted to. hold_out: every Nth view is not trained on
    (None: 8, or 0 where the splat was fitted to all of them, as it looks). downscale: N × N pixels of the pictures become
    one. steps or seconds: how long. k: Gaussians that each becomes at first. poses, between: where to look from without
    pictures. half_from, all_from: parts of the run from which on more rays are rendered. rate, rate_decay: learning rates,
    as a part of those of ``fit``. ssim_weight: of the loss. exposure, robust, align: pictures that differ in brightness,
    show what is not in the scene, or whose poses are a little off.

    checkpoint, resume: file for the state of a refinement when it is stopped (Ctrl-C: it is written, then KeyboardInterrupt; every
        checkpoint_every steps, too), or for what a compact network has made so far, and going on from it.

    device: what rasterizes: "cpu"; "gpu"; "auto", a real GPU where there is one, else the CPU; or the number of an adapter.
        max_gpu_memory: of a GPU's memory at most, bytes or "4G"; otherwise 2 GiB (docs/gpu.md).

    seed: of everything random. threads: at most; 0: all of the machine; the result does not depend on it.

    Returns the splat and a :class:`Report`. What was assumed is told by the logger "anchorsplat" and by SplatWarning. Raises
    BadArgumentError: keywords out of range or without effect, a method that is not ready; BadFileError: no Gaussian is usable,
    and files that keywords name; NotFoundError; IoError.
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
    """Optimises a splat for a closer look, against the pictures it was fitted to or, without them, against itself:
    ``enhance(cloud, method="refine", …)``, whose keywords these are.

    images: project with the pictures, as of ``fit``.
    """
    given = {name: value for name, value in locals().items() if name != "cloud"}
    return enhance(cloud, method="refine", **given)
