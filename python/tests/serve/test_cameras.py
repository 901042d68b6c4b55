"""Cameras of strangers: their numbers and nothing else."""

from __future__ import annotations

import json

import pytest
from anchorsplat.serve.cameras import BadCameras, plain_cameras

POSE = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]
FRAME = {"file_path": "../../etc/passwd", "transform_matrix": POSE}
LENS = {"w": 64, "h": 48, "fl_x": 60.0}
INRIA = {
    "id": 7,
    "img_name": "/etc/passwd",
    "width": 64,
    "height": 48,
    "fx": 60,
    "fy": 60,
    "position": [0, 0, 4],
    "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
}


def plain(cameras: object) -> object:
    return json.loads(plain_cameras(json.dumps(cameras).encode()))


def test_names_become_ours() -> None:
    for cameras in (LENS | {"frames": [FRAME, FRAME], "ply_file_path": "/etc/passwd"}, [INRIA]):
        text = plain_cameras(json.dumps(cameras).encode())
        assert b"passwd" not in text
        assert plain_cameras(text) == text
    assert [f["file_path"] for f in plain(LENS | {"frames": [FRAME, FRAME]})["frames"]] == ["000000", "000001"]
    assert plain([INRIA])[0]["fx"] == 60


@pytest.mark.parametrize(
    "cameras, says",
    [
        ({}, "expected a transforms.json"),
        ([], "0 views"),
        ("text", "expected a transforms.json"),
        ({"frames": []} | LENS, "0 views"),
        ({"frames": [1]} | LENS, "expected an object"),
        ({"frames": [FRAME]}, "pictures are not here"),
        ({"frames": [FRAME | {"transform_matrix": [[1]]}]} | LENS, "rows of 4 numbers"),
        ({"frames": [FRAME]} | LENS | {"fl_x": "60"}, "expected a number"),
        ({"frames": [FRAME]} | LENS | {"fl_x": True}, "expected a number"),
        ({"frames": [FRAME]} | LENS | {"fl_x": 10**400}, "expected a number"),
        ({"frames": [FRAME]} | LENS | {"camera_model": "EQUIRECTANGULAR"}, "unsupported lens"),
        ({"frames": [FRAME]} | LENS | {"distortion_params": [0, "x"]}, "expected a number"),
        ({"frames": [FRAME]} | LENS | {"distortion_params": 5}, "list of numbers"),
        ([INRIA | {"position": None}], "3 numbers"),
        ([INRIA | {"fx": None}], "expected a number"),
    ],
)
def test_what_is_no_camera(cameras: object, says: str) -> None:
    with pytest.raises(BadCameras, match=says):
        plain(cameras)


@pytest.mark.parametrize("text", [b"", b"\xff\xfe", b"{", b'{"frames": [NaN]}', b"[" * 100_000, b"1" * 10_000])
def test_what_is_no_json(text: bytes) -> None:
    with pytest.raises(BadCameras):
        plain_cameras(text)
