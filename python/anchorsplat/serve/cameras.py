"""Training cameras from a client, reduced to numbers: paths in them are never used.

transforms.json (NeRF, nerfstudio) and INRIA's cameras.json. A COLMAP model is a folder of files and is not taken.
"""

from __future__ import annotations

import json
from typing import Any

MOST_BYTES = 4 * 2**20  # thousands of views; held in memory
_MOST_VIEWS = 50_000
_NUMBERS = (
    "w",
    "h",
    "fl_x",
    "fl_y",
    "cx",
    "cy",
    "camera_angle_x",
    "camera_angle_y",
    "k1",
    "k2",
    "k3",
    "k4",
    "k5",
    "k6",
    "p1",
    "p2",
)
_MODELS = ("PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE")


class BadCameras(Exception):
    """Invalid cameras; the text says why."""


def plain_cameras(data: bytes) -> bytes:
    """The cameras as canonical JSON with generated names. Raises BadCameras."""
    try:
        root = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise BadCameras(f"cameras: not JSON ({error}); expected a transforms.json or a cameras.json") from None
    if isinstance(root, dict) and isinstance(root.get("frames"), list):
        plain: dict[str, Any] | list[dict[str, Any]] = _transforms(root)
    elif isinstance(root, list):
        plain = [_inria(index, entry) for index, entry in enumerate(_views(root))]
    else:
        raise BadCameras("cameras: expected a transforms.json with frames, or INRIA's cameras.json")
    return json.dumps(plain, sort_keys=True).encode()


def _views(entries: list) -> list:
    if not 1 <= len(entries) <= _MOST_VIEWS:
        raise BadCameras(f"cameras: {len(entries):,} views, expected 1 to {_MOST_VIEWS:,}")
    return entries


def _number(value: object, where: str) -> float | int:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e30:  # rejects NaN, too
        raise BadCameras(f"cameras: {where}: expected a number")
    return value


def _list(value: object, where: str) -> list:
    if not isinstance(value, list):
        raise BadCameras(f"cameras: {where}: expected a list of numbers")
    return value


def _matrix(rows: object, heights: tuple[int, ...], width: int, where: str) -> list:
    if (
        not isinstance(rows, list)
        or len(rows) not in heights
        or any(not isinstance(r, list) or len(r) != width for r in rows)
    ):
        raise BadCameras(f"cameras: {where}: expected {heights[0]} rows of {width} numbers")
    return [[_number(value, where) for value in row] for row in rows]


def _lens(level: dict, where: str) -> dict:
    out = {key: _number(level[key], f"{where}, {key}") for key in _NUMBERS if key in level}
    model = level.get("camera_model")
    if model is not None:
        if model not in _MODELS:
            raise BadCameras(f"cameras: {where}: unsupported lens; undistort the pictures first")
        out["camera_model"] = model
    if level.get("is_fisheye") is True:
        out["is_fisheye"] = True
    if level.get("distortion_params") is not None:
        values = _list(level["distortion_params"], where)
        numbers: dict[str, Any] = out
        numbers["distortion_params"] = [_number(value, f"{where}, distortion_params") for value in values]
    return out


def _transforms(root: dict) -> dict:
    out: dict = _lens(root, "the file")
    if isinstance(root.get("background"), list) and len(root["background"]) == 3:
        out["background"] = [_number(value, "background") for value in root["background"]]
    frames = []
    for index, frame in enumerate(_views(root["frames"])):
        where = f"frame {index}"
        if not isinstance(frame, dict):
            raise BadCameras(f"cameras: {where}: expected an object")
        plain = _lens(frame, where)
        if not all(side in plain or side in out for side in ("w", "h")):
            raise BadCameras(
                f'cameras: {where}: neither "w" and "h" here nor for the whole file; pictures are not here to take them from'
            )
        plain["file_path"] = f"{index:06}"
        plain["transform_matrix"] = _matrix(frame.get("transform_matrix"), (4, 3), 4, f"{where}, transform_matrix")
        frames.append(plain)
    return out | {"frames": frames}


def _inria(index: int, entry: object) -> dict:
    where = f"camera {index}"
    if not isinstance(entry, dict):
        raise BadCameras(f"cameras: {where}: expected an object")
    out: dict[str, Any] = {key: _number(entry.get(key), f"{where}, {key}") for key in ("width", "height", "fx", "fy")}
    out["position"] = _matrix([entry.get("position")], (1,), 3, f"{where}, position")[0]
    out["rotation"] = _matrix(entry.get("rotation"), (3,), 3, f"{where}, rotation")
    return out | {"id": index, "img_name": f"{index:06}"}
