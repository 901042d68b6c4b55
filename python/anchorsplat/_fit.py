"""Splats from pictures."""

from __future__ import annotations

from typing import Literal

from . import _core
from ._cameras import Color
from ._cloud import Cloud, RenderMode
from ._files import PathLike
from ._report import Report
from ._run import DeviceLike, ProgressLike, run
from ._words import natural, path_bytes, words_of


def fit(
    project: PathLike,
    *,
    steps: int = 15_000,
    max_gaussians: int | None = None,
    strategy: Literal["default", "absgrad", "mcmc"] = "default",
    mip_filter: bool = False,
    exposure: bool = False,
    hold_out: int = 8,
    downscale: int = 1,
    init: Literal["auto", "points", "view", "random"] = "auto",
    init_splat: Cloud | PathLike | None = None,
    init_points: int | None = None,
    init_extent: float = 3,
    shell: int | Literal["auto"] = "auto",
    background: Color | None = None,
    sh_degree: int = 3,
    ssim_weight: float = 0.2,
    mode: RenderMode = "classic",
    pixel: Literal["point", "area"] = "point",
    upscale: float = 4,
    profile: Literal["gsplat14", "gsplat15"] = "gsplat14",
    checkpoint: PathLike | None = None,
    checkpoint_every: int = 0,
    resume: bool = False,
    refine_start: int | None = None,
    refine_stop: int | None = None,
    refine_every: int | None = None,
    reset_every: int | None = None,
    sh_degree_interval: int | None = None,
    opacity_reset: Literal["positive", "from-zero", "never"] = "positive",
    grow_grad2d: float | None = None,
    grow_scale3d: float = 0.01,
    prune_opa: float = 0.005,
    prune_scale3d: float = 0.1,
    revised_opacity: bool = False,
    min_opacity: float = 0.005,
    noise_lr: float = 500_000,
    opacity_reg: float | None = None,
    scale_reg: float | None = None,
    rate_means: float = 0.00016,
    rate_means_decay: float = 0.01,
    rate_scales: float = 0.005,
    rate_quats: float = 0.001,
    rate_opacities: float = 0.05,
    rate_sh0: float = 0.0025,
    rate_sh_rest: float = 0.000125,
    seed: int = 0,
    device: DeviceLike = "cpu",
    max_gpu_memory: int | str | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> tuple[Cloud, Report]:
    """Optimises a splat from the pictures of a project (standard 3DGS): a COLMAP project, a folder with a transforms.json, a
    NeRF-synthetic scene.

    steps: optimisation steps; all schedules scale with them.
    max_gaussians: most Gaussians; 0: no limit. Default: 0, with mcmc a million.
    strategy: densification: "default", Kerbl et al.; "absgrad", by absolute gradients; "mcmc", relocation of a fixed number.
    mip_filter: smooth every Gaussian by the pixel of its closest camera, as Mip-Splatting does; implies mode="mip".
    exposure: fit a gain and a bias per channel and picture.
    hold_out: hold out every Nth view, by name; 0: none.
    downscale: average N × N pixels of the pictures.
    init: where the first Gaussians are: "points" of the project, "view" (random, where many cameras look) or "random".
    init_splat: a Cloud or a file: start with Gaussians at the centres of this splat.
    init_points: number of first Gaussians; default: all points, or 100,000 random ones.
    init_extent: with init="random": half the side of the cube, in scene scales; INRIA uses 0.3 for single objects.
    shell: Gaussians on a far sphere, for sky and distant background; 0: none. "auto": some if the project's points leave much of
        the pictures empty.
    background: r, g, b from 0 to 1; default: from the project, else black.
    sh_degree: highest degree of spherical harmonics, 0 to 3.
    ssim_weight: w of the loss (1 − w)·L1 + w·(1 − SSIM).
    mode: rasterization of the fit.
    pixel, upscale: "area" fits the mean over each pixel, for splats to be seen `upscale` times closer.
    profile: cut-off of a Gaussian, as in gsplat 1.0 to 1.4 or as in 1.5.
    checkpoint: file for the state of an interrupted fit (Ctrl-C writes it, then raises KeyboardInterrupt). checkpoint_every: also
        write it every so many steps. resume: continue from it.
    refine_start, refine_stop, refine_every, reset_every, sh_degree_interval: steps of the schedule; default: gsplat's, scaled.
    opacity_reset, grow_grad2d, grow_scale3d, prune_opa, prune_scale3d, revised_opacity: densification, named as in gsplat.
    min_opacity, noise_lr: for mcmc.
    opacity_reg, scale_reg: weights of the mean opacity and the mean size in the loss.
    rate_means, rate_means_decay, rate_scales, rate_quats, rate_opacities, rate_sh0, rate_sh_rest: learning rates.
    device: rasterize on "cpu", "gpu", "auto" (a hardware GPU, else the CPU) or an adapter by number.
        max_gpu_memory: most GPU memory to use, bytes or "4G"; default: 2 GiB (docs/gpu.md).

    Raises NotFoundError, IoError, BadFileError; BadArgumentError: keywords out of range, in conflict or without effect.
    """
    words = words_of(fit, locals(), besides=("init_splat",))
    start = None
    if isinstance(init_splat, Cloud):
        start = init_splat
        words.append(b"--init-splat=splat in memory")
    elif init_splat is not None:
        words.append(b"--init-splat=" + path_bytes(init_splat))
    with run(
        threads, progress, patient=checkpoint is not None, device=device, max_gpu_memory=max_gpu_memory
    ) as how:
        parts, report = _core.fit(path_bytes(project), words, start, natural("seed", seed), how)
    return Cloud._of(parts), Report._of(report)
