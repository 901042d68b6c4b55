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
    """Draws a splat with the 3DGS rasterizer: float32 [V,H,W,3], red, green and blue as in a PNG of it (no conversion of
    colour space), not clamped above 1. The same bits for any number of threads on one device.

    `cameras`: :class:`Cameras`, or a file or folder with them. Otherwise views all around: `orbit` says how many, `radius`
    (world units), `target` (x, y, z), `fov` (horizontal, degrees) and `up` (x, y, z or an axis) from where. Of both, the
    cameras only say where up is, and the background.

    view: only the one of this name.
    size: width and height in pixels; of cameras their ratio has to stay.
    background: r, g, b from 0 to 1; otherwise what the camera file says, else black.
    near, far: world units in front of the camera where the picture begins and ends.
    mode: how it is rasterized; otherwise as the splat says, else classic.
    profile: extent of a Gaussian, as gsplat 1.0 to 1.4 or as 1.5 has it.
    transparent: [V,H,W,4] with coverage as the fourth channel and colours not premultiplied, without a background.
    device: what rasterizes: "cpu"; "gpu"; "auto", a real GPU where there is one, else the CPU; or the number of an adapter.
        max_gpu_memory: of a GPU's memory at most, bytes or "4G"; otherwise 2 GiB (docs/gpu.md).

    Gaussians with values that are not finite are not drawn. Where a picture shows nothing, a SplatWarning says why. Raises
    BadArgumentError: settings out of range, cameras of different sizes; NotFoundError: a
    device that is not there; IoError: not enough memory.
    """
    words = words_of(render, locals(), besides=("transparent",))
    given = camera_words(cameras, words)
    with run(threads, progress, device=device, max_gpu_memory=max_gpu_memory) as how:
        return cast("npt.NDArray[np.float32]", _core.render(cloud, words, transparent, given, how))
