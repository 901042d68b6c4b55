"""Measures of similarity between pictures and splats."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal, Union, cast

import numpy as np
import numpy.typing as npt

from . import _core
from ._cameras import Cameras, CamerasLike, Color, camera_words
from ._cloud import Cloud, RenderMode
from ._errors import BadArgumentError
from ._files import PathLike
from ._report import Report
from ._run import DeviceLike, ProgressLike, run
from ._words import path_bytes, words_of

#: A splat, pictures [V,H,W,C] or [H,W,C], or the path of a splat, a picture or a folder of pictures.
Comparable = Union[Cloud, PathLike, "npt.ArrayLike"]


def _pictures(name: str, values: Any) -> npt.NDArray[np.float32]:
    """[V,H,W,C] of float32; bytes become 0 to 1."""
    if hasattr(values, "detach"):
        values = values.detach().cpu()
    array = np.asarray(values)
    if array.dtype.kind not in "fiu" or array.ndim not in (3, 4) or array.shape[-1] not in (1, 3, 4):
        raise BadArgumentError(
            f"{name}: expected pictures [V, H, W, C] or [H, W, C] with 1, 3 or 4 channels, found {array.dtype} "
            f"{list(array.shape)}"
        )
    if array.dtype == np.uint8:
        array = array.astype(np.float32) / np.float32(255)
    elif array.dtype.kind in "iu" and array.size > 0 and array.max() > 1:
        raise BadArgumentError(f"{name}: {array.dtype} with values up to {array.max()}: pass uint8, or floats from 0 to 1")
    array = np.ascontiguousarray(array, dtype=np.float32)
    return array if array.ndim == 4 else array[None]


def _measure(a: npt.ArrayLike, b: npt.ArrayLike, ssim: bool, threads: int) -> Any:
    left, right = _pictures("a", a), _pictures("b", b)
    if left.shape != right.shape:
        raise BadArgumentError(f"pictures of different shapes: {list(left.shape)} and {list(right.shape)}")
    with run(threads) as how:
        values = _core.measure(left, right, ssim, how)
    return np.array(values) if np.ndim(a) == 4 else values[0]


def psnr(a: npt.ArrayLike, b: npt.ArrayLike, *, threads: int = 0) -> Any:
    """Peak signal-to-noise ratio in dB: a float for two pictures [H,W,C], an array [V] for two stacks of pictures [V,H,W,C].

    Uses the first three channels; the peak is 1 (255 for uint8). Infinite for equal pictures. Values are not clipped: clip
    renders first. Raises BadArgumentError if the shapes differ.
    """
    return _measure(a, b, False, threads)


def ssim(a: npt.ArrayLike, b: npt.ArrayLike, *, threads: int = 0) -> Any:
    """Mean structural similarity (Wang et al. 2004, 11×11 Gaussian window); arguments as for :func:`psnr`."""
    return _measure(a, b, True, threads)


def sheet(pictures: Mapping[str, npt.ArrayLike], *, threads: int = 0) -> npt.NDArray[np.float32]:
    """A side-by-side picture [H,W,3]: a column per picture [H,W,C] with its name, the part where they differ most, enlarged, and
    the difference to the last one. Raises BadArgumentError: no pictures, or different sizes."""
    arrays = [_pictures(name, picture)[:1] for name, picture in pictures.items()]
    with run(threads) as how:
        made = cast("npt.NDArray[np.float32]", _core.sheet(list(pictures), arrays, how))
    return made


def _side(name: str, of: Any) -> Any:
    if of is None or isinstance(of, Cloud):
        return of
    if isinstance(of, (str, os.PathLike)):
        return path_bytes(of)
    return _pictures(name, of)


def compare(
    a: Comparable,
    b: Comparable,
    *,
    truth: Comparable | None = None,
    color_correct: bool = False,
    cameras: CamerasLike | None = None,
    orbit: int | None = None,
    radius: float | None = None,
    target: Sequence[float] | None = None,
    fov: float = 45,
    up: str | Sequence[float] | None = None,
    view: str | None = None,
    size: tuple[int, int] | None = None,
    background: Color | None = None,
    near: float | None = None,
    far: float | None = None,
    mode: RenderMode | None = None,
    profile: Literal["gsplat14", "gsplat15"] = "gsplat14",
    device: DeviceLike = "cpu",
    max_gpu_memory: int | str | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> Report:
    """PSNR and SSIM of two splats, folders of pictures or arrays of them, view by view.

    `a` is compared with `b`, or both with `truth`. Each is a Cloud, pictures [V,H,W,3] in the order of the cameras, or a path.
    Without ground truth the numbers say how alike the two are, not which is better. Splats are rendered from `cameras` or
    `orbit` views, with the options of :func:`render`. Pictures match by name: of the file, of the camera, or "000", "001", ….

    color_correct: also measure after the affine colour map of each view that brings it closest to the reference.
    device: rasterize on "cpu", "gpu", "auto" (a hardware GPU, else the CPU) or an adapter by number.
        max_gpu_memory: most GPU memory to use, bytes or "4G"; default: 2 GiB (docs/gpu.md).

    Returns ``{"mean": {"psnr", "ssim"}, "views": […]}``, with `truth` one each under "a" and "b"; an infinite PSNR is None.
    Raises as ``read``; BadArgumentError: views that do not match, sizes that differ.
    """
    words = words_of(compare, locals(), besides=("truth", "cameras"))
    sides = [_side(name, of) for name, of in (("a", a), ("b", b), ("truth", truth))]
    arrays = [side for side in sides if isinstance(side, np.ndarray)]
    names: list[str] = []
    if arrays:
        if cameras is not None and not isinstance(cameras, Cameras):
            cameras = Cameras(cameras)
        count = len(arrays[0])
        names = cameras.names if isinstance(cameras, Cameras) else [f"{v:03d}" for v in range(count)]
        for array in arrays:
            if len(array) != len(names):
                raise BadArgumentError(f"{len(array)} pictures, but {len(names)} views")
    given = camera_words(cameras, words)
    with run(threads, progress, device=device, max_gpu_memory=max_gpu_memory) as how:
        return Report._of(_core.compare(sides[0], sides[1], sides[2], names, words, given, how))
