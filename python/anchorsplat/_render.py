"""Pictures of a splat."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, cast

import numpy as np

from . import _core
from ._cameras import CamerasLike, Color, camera_words
from ._cloud import Cloud, RenderMode
from ._run import DeviceLike, ProgressLike, run
from ._words import words_of

if TYPE_CHECKING:
    import numpy.typing as npt

Size = tuple[int, int]


def render(
    cloud: Cloud,
    cameras: CamerasLike | None = None,
    *,
    orbit: int | None = None,
    radius: float | None = None,
    target: Sequence[float] | None = None,
    fov: float = 45,
    up: str | Sequence[float] | None = None,
    view: str | None = None,
    size: Size | None = None,
    background: Color | None = None,
    near: float | None = None,
    far: float | None = None,
    mode: RenderMode | None = None,
    profile: Literal["gsplat14", "gsplat15"] = "gsplat14",
    transparent: bool = False,
    device: DeviceLike = "cpu",
    max_gpu_memory: int | str | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> npt.NDArray[np.float32]:
    """Renders a splat with the 3DGS rasterizer: float32 [V,H,W,3], RGB as in a PNG of it (no conversion of colour space), not
    clamped above 1. The same bits for any number of threads on one device.

    `cameras`: :class:`Cameras`, or a file or folder with them. Without: `orbit` views around the splat, at
    `radius` (world units) from `target` (x, y, z), with `fov` (horizontal, degrees) and `up` (x, y, z or an axis). With both,
    the cameras only give the up direction and the background.

    view: only the view with this name.
    size: width and height in pixels; must keep the aspect ratio of the cameras.
    background: r, g, b from 0 to 1; default: from the camera file, else black.
    near, far: near and far plane, world units.
    mode: rasterization; default: the splat's tag, else classic.
    profile: cut-off of a Gaussian, as in gsplat 1.0 to 1.4 or as in 1.5.
    transparent: [V,H,W,4] with coverage as the fourth channel and colours not premultiplied, without a background.
    device: rasterize on "cpu", "gpu", "auto" (a hardware GPU, else the CPU) or an adapter by number.
        max_gpu_memory: most GPU memory to use, bytes or "4G"; default: 2 GiB (docs/gpu.md).

    Gaussians with values that are not finite are not drawn. A SplatWarning says why a picture is empty. Raises
    BadArgumentError: settings out of range, cameras of different sizes; NotFoundError: no such device; IoError: not enough
    memory.
    """
    words = words_of(render, locals(), besides=("transparent",))
    given = camera_words(cameras, words)
    with run(threads, progress, device=device, max_gpu_memory=max_gpu_memory) as how:
        return cast("npt.NDArray[np.float32]", _core.render(cloud, words, transparent, given, how))
