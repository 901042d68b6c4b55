"""Cameras."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Union, cast

import numpy as np

from . import _core
from ._errors import BadArgumentError
from ._run import run
from ._words import path_bytes, whole_number, words_of

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._cloud import Cloud

Color = Sequence[float]


def _numbers(name: str, values: Any) -> npt.NDArray[np.float64]:
    if hasattr(values, "detach"):
        values = values.detach().cpu()
    array = np.array(values, dtype=np.float64)
    if not np.isfinite(array).all():
        raise BadArgumentError(f"{name}: some values are not finite")
    return array


class Cameras:
    """V pinhole cameras in OpenCV axes (x right, y down, z forward); immutable. If the file has lens distortion, they are the
    pinholes of the undistorted pictures (docs/fit.md).

    Pixel (0,0) covers [0,1)², its centre is at 0.5. ``cameras[3]`` and ``cameras[::8]`` are Cameras, too.
    """

    __slots__ = ("_set",)

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Reads cameras, in their order, from a transforms.json, an INRIA cameras.json, a poses_bounds.npy, a COLMAP model, a
        Metashape, OpenSfM or Bundler file, or a folder with one of these. Raises NotFoundError, IoError, BadFileError;
        BadArgumentError: a folder with several."""
        with run() as how:
            self._set = _core.read_cameras(path_bytes(path), how)

    @classmethod
    def _of(cls, cameras: _core.CameraSet) -> Cameras:
        new = cls.__new__(cls)
        new._set = cameras
        return new

    @classmethod
    def from_arrays(
        cls,
        world_to_camera: npt.ArrayLike,
        intrinsics: npt.ArrayLike,
        width: int | Sequence[int],
        height: int | Sequence[int],
        *,
        names: Sequence[str] | None = None,
        background: Color | None = None,
    ) -> Cameras:
        """Cameras from arrays, as in gsplat.

        `world_to_camera`: [V,4,4] or [V,3,4], OpenCV axes, world units (gsplat's viewmats); `intrinsics`: [V,3,3] or [3,3] in
        pixels (gsplat's Ks); `width` and `height` in pixels, one number or one per camera; `names`: default "000", "001", …;
        `background` of the pictures: r, g, b from 0 to 1.

        Raises BadArgumentError: wrong shapes, a matrix that is not a rotation, sizes below 1.
        """
        poses = _numbers("world_to_camera", world_to_camera)
        if poses.ndim == 2:
            poses = poses[None]
        if poses.ndim != 3 or poses.shape[1:] not in ((4, 4), (3, 4)):
            raise BadArgumentError(f"world_to_camera: expected an array [V, 4, 4], found {list(poses.shape)}")
        count = len(poses)
        full = np.tile(np.eye(4), (count, 1, 1))
        full[:, :3] = poses[:, :3]
        turned = full[:, :3, :3]
        skew = np.abs(turned @ turned.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2)) > 1e-3
        wrong = np.flatnonzero(skew | (np.linalg.det(turned) < 0))
        if len(wrong):
            raise BadArgumentError(f"world_to_camera: the upper 3 x 3 of camera {wrong[0]} is not a rotation")
        matrices = _numbers("intrinsics", intrinsics)
        if matrices.shape == (3, 3):
            matrices = np.tile(matrices, (count, 1, 1))
        if matrices.shape != (count, 3, 3):
            raise BadArgumentError(f"intrinsics: expected an array [{count}, 3, 3], found {list(matrices.shape)}")
        pinholes = np.ascontiguousarray(
            np.stack([matrices[:, 0, 0], matrices[:, 1, 1], matrices[:, 0, 2], matrices[:, 1, 2]], axis=1)
        )
        sides = [np.broadcast_to(np.asarray(side), (count,)) for side in (width, height)]
        sizes = [(int(w), int(h)) for w, h in zip(*sides)]
        for number, (w, h) in enumerate(sizes):
            if w < 1 or h < 1 or not (pinholes[number, :2] > 0).all():
                raise BadArgumentError(f"camera {number}: a picture of {w} x {h} pixels or a focal length of 0 or less")
        if names is None:
            names = [f"{number:03d}" for number in range(count)]
        if len(names) != count:
            raise BadArgumentError(f"names: {len(names)} for {count} cameras")
        color = None if background is None else [float(c) for c in background]
        if color is not None and (len(color) != 3 or not all(0 <= c <= 1 for c in color)):
            raise BadArgumentError("background: expected r, g, b from 0 to 1")
        return cls._of(_core.cameras_of(list(names), sizes, pinholes, np.ascontiguousarray(full), color))

    @classmethod
    def orbit(
        cls,
        cloud: Cloud,
        count: int,
        *,
        size: tuple[int, int] = (1024, 1024),
        fov: float = 45,
        radius: float | None = None,
        target: Sequence[float] | None = None,
        up: str | Sequence[float] | None = None,
    ) -> Cameras:
        """`count` cameras on a sphere around a splat. Up is that of its comments, else −y.

        `size`: width and height in pixels; `fov`: horizontal field of view, degrees; `radius`: distance, world units (default:
        the splat fills the picture); `target`: x, y, z to look at; `up`: x, y, z or an axis such as "-z".
        """
        words = words_of(cls.orbit.__func__, locals())  # type: ignore[attr-defined]
        if isinstance(size, (str, bytes)) or not hasattr(size, "__len__") or len(size) != 2:
            raise TypeError(f"size: expected (width, height), found {size!r}")
        size = whole_number("size", size[0]), whole_number("size", size[1])
        count = whole_number("count", count)
        size_word = os.fsencode(f"--size={size[0]}x{size[1]}")
        words = [word for word in words if not word.startswith(b"--size=")] + [size_word]
        with run() as how:
            return cls._of(_core.views(cloud, [*words, b"--orbit=%d" % count], None, how))

    @property
    def names(self) -> list[str]:
        """Names of the views."""
        return list(self._set.names())

    @property
    def sizes(self) -> list[tuple[int, int]]:
        """Width and height of each, pixels."""
        return list(self._set.sizes())

    @property
    def intrinsics(self) -> npt.NDArray[np.float64]:
        """[V,3,3] pixels, a copy."""
        return cast("npt.NDArray[np.float64]", self._set.intrinsics())

    @property
    def world_to_camera(self) -> npt.NDArray[np.float64]:
        """[V,4,4] p_camera = M·p_world, a copy."""
        return cast("npt.NDArray[np.float64]", self._set.poses())

    @property
    def background(self) -> tuple[float, float, float] | None:
        """Background of the pictures, r, g, b from 0 to 1; None if the file does not give it."""
        background = self._set.background()
        return None if background is None else (background[0], background[1], background[2])

    def __len__(self) -> int:
        return len(self._set)

    def __getitem__(self, rows: int | slice | Sequence[int]) -> Cameras:
        numbers = np.arange(len(self))[rows]
        return Cameras._of(self._set.chosen([int(n) for n in np.atleast_1d(numbers)]))

    def __iter__(self) -> Iterator[Cameras]:
        return (self[number] for number in range(len(self)))

    def __reduce__(self) -> tuple[Any, ...]:
        sizes = self.sizes
        arguments = (self.world_to_camera, self.intrinsics, [w for w, _ in sizes], [h for _, h in sizes])
        return (_unpickled, (*arguments, self.names, self.background))

    def __repr__(self) -> str:
        sizes = sorted({f"{w}x{h}" for w, h in self.sizes})
        return f"<anchorsplat.Cameras: {len(self)} of {', '.join(sizes[:3])}{', …' if len(sizes) > 3 else ''} pixels>"


def _unpickled(poses: Any, intrinsics: Any, width: Any, height: Any, names: Any, background: Any) -> Cameras:
    if len(names) == 0:
        return Cameras._of(_core.cameras_of([], [], np.zeros((0, 4)), np.zeros((0, 4, 4)), background))
    return Cameras.from_arrays(poses, intrinsics, width, height, names=names, background=background)


#: Cameras, or a file or folder with cameras.
CamerasLike = Union[Cameras, str, "os.PathLike[str]"]


def camera_words(cameras: CamerasLike | None, words: list[bytes]) -> _core.CameraSet | None:
    """Adds the --cameras option; returns cameras that are in memory."""
    if cameras is None:
        return None
    if isinstance(cameras, Cameras):
        words.append(b"--cameras=cameras in memory")
        return cameras._set
    words.append(b"--cameras=" + path_bytes(cameras))
    return None
