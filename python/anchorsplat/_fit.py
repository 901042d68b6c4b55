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

    steps: of the optimisation; all schedules follow.
    max_gaussians: growth stops there, and a start with more is cut to it; 0: no bound. Otherwise none, a million with mcmc.
    strategy: who comes and goes: Kerbl et al.; the same by absolute gradients; a number of Gaussians that move.
    mip_filter: smooths every Gaussian by the pixel of the closest camera, as Mip-Splatting does; implies mode="mip".
    exposure: pictures differ in brightness and tint; each has a gain and a bias per channel of its own.
    hold_out: every Nth view, by name, is not trained on; 0: all are.
    downscale: N × N pixels of the pictures become one, their mean.
    init: first Gaussians: the project's points, random where many cameras look, random in gsplat's cube.
    init_splat: a Cloud or a file: first Gaussians at the centres of this splat.
    init_points: how many first Gaussians; otherwise all points, 100,000 random ones.
    init_extent: of init="random": half a side of the cube, in scene scales; 0.3 as INRIA's around one object.
    shell: Gaussians on a sphere far beyond cameras and points, for what is seen there; 0: none. "auto": some where the
        project's points leave much of the pictures open.
    background: r, g, b from 0 to 1; otherwise what the project says, else black.
    sh_degree: highest degree of spherical harmonics, 0 to 3.
    ssim_weight: w of the loss (1 − w)·L1 + w·(1 − SSIM).
    mode: of the fit, and so of the splat.
    pixel, upscale: "area" takes a pixel for the mean over its area, for splats that will be seen `upscale` times closer.
    profile: extent of a Gaussian, as gsplat 1.0 to 1.4 or as 1.5 has it.
    checkpoint: file for the state when the fit ends before its end (Ctrl-C: it is written, then KeyboardInterrupt); without
        one nothing is kept. checkpoint_every: also every so many steps. resume: goes on from it where it is there.
    refine_start, refine_stop, refine_every, reset_every, sh_degree_interval: steps of the schedule, otherwise gsplat's, scaled.
    opacity_reset, grow_grad2d, grow_scale3d, prune_opa, prune_scale3d, revised_opacity: densification, as gsplat calls it.
    min_opacity, noise_lr: of mcmc.
    opacity_reg, scale_reg: weights of the mean opacity and the mean size in the loss.
    rate_means, rate_means_decay, rate_scales, rate_quats, rate_opacities, rate_sh0, rate_sh_rest: learning rates.
    device: what rasterizes: "cpu"; "gpu"; "auto", a real GPU where there is one, else the CPU; or the number of an adapter.
        max_gpu_memory: of a GPU's memory at most, bytes or "4G"; otherwise 2 GiB (docs/gpu.md).

    Raises NotFoundError, IoError, BadFileError; BadArgumentError: keywords out of range, at odds or without effect.
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
