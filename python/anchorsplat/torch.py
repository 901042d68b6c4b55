"""The rasterizer as a differentiable PyTorch function, on the CPU. Needs torch, which this package does not install."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import torch

from . import _core
from ._cameras import Cameras
from ._cloud import Cloud, RenderMode
from ._errors import BadArgumentError
from ._run import run

__all__ = ["rasterize"]


def _array(name: str, tensor: torch.Tensor) -> Any:
    if not isinstance(tensor, torch.Tensor) or tensor.dtype != torch.float32 or tensor.device.type != "cpu":
        raise BadArgumentError(f"{name}: expected a float32 tensor on the CPU")
    return tensor.detach().contiguous().numpy()


class _Rasterize(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        means: torch.Tensor,
        log_scales: torch.Tensor,
        quats: torch.Tensor,
        opacity_logits: torch.Tensor,
        sh: torch.Tensor,
        background: torch.Tensor,
        cameras: Cameras,
        options: dict[str, Any],
        threads: int,
    ) -> tuple[torch.Tensor, torch.Tensor]:
        # Lets autograd check that parameters are not changed in place before backward.
        ctx.save_for_backward(means, log_scales, quats, opacity_logits, sh)
        columns = [
            _array(name, tensor)
            for name, tensor in (
                ("means", means),
                ("log_scales", log_scales),
                ("quats", quats),
                ("opacity_logits", opacity_logits),
                ("sh", sh),
            )
        ]
        color = tuple(float(c) for c in background.detach())
        ctx.views = _core.DifferentiableViews(Cloud(*columns), cameras._set, background=color, **options)
        ctx.threads = threads
        with run(threads) as how:
            colors, alphas = ctx.views.forward(how)
        return torch.from_numpy(colors), torch.from_numpy(alphas)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, colors: torch.Tensor, alphas: torch.Tensor) -> tuple[Any, ...]:
        _ = ctx.saved_tensors  # raises if one was changed in place
        with run(ctx.threads) as how:
            *gradients, background = ctx.views.backward(_array("gradient", colors), _array("gradient", alphas), how)
        return (*(torch.from_numpy(g) for g in gradients), torch.tensor(background), None, None, None)


def rasterize(
    means: torch.Tensor,
    log_scales: torch.Tensor,
    quats: torch.Tensor,
    opacity_logits: torch.Tensor,
    sh: torch.Tensor,
    cameras: Cameras,
    *,
    background: torch.Tensor | Sequence[float] | None = None,
    mode: RenderMode = "classic",
    sh_degree: int = 3,
    near: float = 0.01,
    far: float = 1e10,
    profile: Literal["gsplat14", "gsplat15"] = "gsplat14",
    threads: int = 0,
) -> tuple[torch.Tensor, torch.Tensor]:
    """Renders N Gaussians through V cameras of one size, with gradients for all six tensors.

    means: [N,3] world units; log_scales: [N,3] ln(world units); quats: [N,4] wxyz, any norm; opacity_logits: [N];
    sh: [N,(degree+1)²,3] coefficient-major. All are values before activation, float32, on the CPU.
    background: [3] r, g, b; default: black.
    mode: rasterization, "classic", "antialiased" or "mip".
    sh_degree: highest degree in use.
    near, far: near and far plane, world units.

    Returns colours [V,H,W,3], including the background and not clamped above 1, and coverage [V,H,W,1]. The same bits for any
    number of threads, forward and backward. Gradients treat cut-offs and the depth order as constant. No second derivatives.
    Until backward is done, each view needs 8 bytes per pixel and Gaussian covering it.

    Raises BadArgumentError: another type, device or shape, cameras of different sizes.
    """
    if isinstance(background, torch.Tensor):
        behind = background
    else:
        behind = torch.zeros(3) if background is None else torch.tensor([float(c) for c in background])
    if not isinstance(cameras, Cameras):
        raise BadArgumentError(f"cameras: expected anchorsplat.Cameras (to read a file: Cameras({cameras!r})), found {type(cameras).__name__}")
    if profile not in ("gsplat14", "gsplat15"):
        raise BadArgumentError(f"profile: {profile!r} is not gsplat14 or gsplat15")
    if not 0 <= sh_degree <= 3:
        raise BadArgumentError(f"sh_degree: {sh_degree} is not 0 to 3")
    if isinstance(opacity_logits, torch.Tensor) and opacity_logits.dim() != 1:
        raise BadArgumentError(f"opacity_logits: expected [N], found {list(opacity_logits.shape)}")
    if not bool(torch.isfinite(behind.detach()).all()):
        raise BadArgumentError("background: not finite")
    if behind.shape != (3,):
        raise BadArgumentError(f"background: expected [3], found {list(behind.shape)}")
    options = {"mode": mode, "sh_degree": sh_degree, "near_plane": near, "far_plane": far, "profile": profile}
    colors, alphas = _Rasterize.apply(
        means, log_scales, quats, opacity_logits, sh, behind, cameras, options, threads
    )
    return colors, alphas
