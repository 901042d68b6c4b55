from __future__ import annotations

import json
import pickle
import zlib

import numpy as np
import pytest

import anchorsplat
from anchorsplat import Cameras


def png(picture: np.ndarray) -> bytes:
    """An 8-bit PNG of [H,W,3] in 0 to 1."""
    rows = (picture.clip(0, 1) * 255).round().astype(np.uint8)
    data = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows), 1)

    def chunk(kind: bytes, content: bytes) -> bytes:
        return len(content).to_bytes(4, "big") + kind + content + zlib.crc32(kind + content).to_bytes(4, "big")

    height, width = picture.shape[:2]
    head = width.to_bytes(4, "big") + height.to_bytes(4, "big") + bytes([8, 2, 0, 0, 0])
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def project(folder, cloud, views=4, side=32, images=".") -> Cameras:
    """Pictures of a splat, as a project to fit to."""
    cameras = Cameras.orbit(cloud, views, size=(side, side))
    frames = []
    (folder / images).mkdir(exist_ok=True)
    poses, pictures = cameras.world_to_camera, anchorsplat.render(cloud, cameras)
    for name, picture, pose, k in zip(cameras.names, pictures, poses, cameras.intrinsics):
        (folder / images / f"{name}.png").write_bytes(png(picture))
        turned = np.linalg.inv(pose) @ np.diag([1.0, -1, -1, 1])
        frames.append(
            {"file_path": f"{images}/{name}.png", "transform_matrix": turned.tolist(), "fl_x": k[0, 0], "fl_y": k[1, 1]}
        )
    camera_file = {"w": side, "h": side, "cx": side / 2, "cy": side / 2, "frames": frames}
    (folder / "transforms.json").write_text(json.dumps(camera_file))
    return cameras


def test_pictures_are_the_programs(cloud, program, tmp_path):
    anchorsplat.write(tmp_path / "in.ply", cloud)
    program("render", tmp_path / "in.ply", "-o", tmp_path / "views", "--orbit", 2, "--size", "40x30", "--background", "1,0.5,0")
    pictures = anchorsplat.render(cloud, orbit=2, size=(40, 30), background=(1, 0.5, 0))
    assert pictures.shape == (2, 30, 40, 3) and pictures.dtype == np.float32
    written = anchorsplat.compare(tmp_path / "views", pictures)
    assert [view["name"] for view in written["views"]] == ["000", "001"]
    assert written["mean"]["psnr"] > 58, "but for 8 bits"


def test_transparent_pictures_are_not_premultiplied(cloud):
    cameras = Cameras.orbit(cloud, 1, size=(32, 32))
    solid = anchorsplat.render(cloud, cameras, background=(1, 0, 0))
    clear = anchorsplat.render(cloud, cameras, transparent=True)
    assert clear.shape == (1, 32, 32, 4)
    red = np.array([1, 0, 0], np.float32)
    assert np.abs(clear[..., :3] * clear[..., 3:] + red * (1 - clear[..., 3:]) - solid).max() < 1e-5


def test_cameras_of_arrays_and_files(cloud, tmp_path):
    made = project(tmp_path, cloud)
    assert len(made) == 4 and made.sizes == [(32, 32)] * 4 and made.names == ["000", "001", "002", "003"]
    again = Cameras.from_arrays(made.world_to_camera, made.intrinsics, 32, 32)
    read = Cameras(tmp_path)
    for cameras in (again, pickle.loads(pickle.dumps(made)), made[:], read):
        assert np.allclose(cameras.world_to_camera, made.world_to_camera, atol=1e-9)
        assert np.allclose(cameras.intrinsics, made.intrinsics)
    everything = anchorsplat.render(cloud, made)
    assert np.array_equal(anchorsplat.render(cloud, again), everything)
    assert np.array_equal(anchorsplat.render(cloud, made[1]), everything[1:2])
    assert np.array_equal(anchorsplat.render(cloud, list(made)[3]), everything[3:])
    assert np.array_equal(anchorsplat.render(cloud, made[[2, 0]]), everything[[2, 0]])
    assert np.abs(anchorsplat.render(cloud, tmp_path, view="002") - everything[2:3]).max() < 1e-4
    with pytest.raises(IndexError):
        made[4]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"world_to_camera": np.zeros((2, 3))}, r"world_to_camera: expected an array \[V, 4, 4\], found \[1, 2, 3\]"),
        ({"world_to_camera": 2 * np.eye(4)[None]}, "the upper 3 x 3 of camera 0 is not a rotation"),
        ({"world_to_camera": np.full((1, 4, 4), np.nan)}, "not finite"),
        ({"intrinsics": np.eye(4)}, r"intrinsics: expected an array \[1, 3, 3\], found \[4, 4\]"),
        ({"width": 0}, "a picture of 0 x 4 pixels"),
        ({"names": ["a", "b"]}, "names: 2 for 1 cameras"),
        ({"background": (2, 0, 0)}, "background: expected r, g, b"),
    ],
)
def test_cameras_that_are_none(change, message):
    good = {"world_to_camera": np.eye(4)[None], "intrinsics": np.eye(3), "width": 4, "height": 4}
    Cameras.from_arrays(**good)
    with pytest.raises(anchorsplat.BadArgumentError, match=message):
        Cameras.from_arrays(**{**good, **change})


def test_views_that_cannot_be_one_array(cloud):
    one = Cameras.orbit(cloud, 2, size=(32, 32))
    mixed = Cameras.from_arrays(one.world_to_camera, one.intrinsics, [32, 32], [32, 24])
    with pytest.raises(anchorsplat.BadArgumentError, match="have different sizes and cannot be one array"):
        anchorsplat.render(cloud, mixed)
    away = Cameras.from_arrays(np.diag([-1.0, 1, -1, 1])[None] @ one.world_to_camera, one.intrinsics, 32, 32)
    with pytest.warns(anchorsplat.SplatWarning):
        assert anchorsplat.render(cloud, away).max() == 0


def test_metrics(cloud):
    random = np.random.default_rng(1)
    a, b = random.random((2, 20, 24, 3), np.float32), random.random((2, 20, 24, 3), np.float32)
    by_hand = -10 * np.log10(((a - b) ** 2).mean(axis=(1, 2, 3)))
    assert np.allclose(anchorsplat.psnr(a, b), by_hand, atol=1e-4)
    assert anchorsplat.psnr(a[0], b[0]) == anchorsplat.psnr(a, b)[0]
    assert anchorsplat.psnr(a[0], a[0]) == np.inf and anchorsplat.ssim(a[0], a[0]) == pytest.approx(1)
    bytes_of_a = (a * 255).astype(np.uint8)
    assert anchorsplat.psnr(bytes_of_a, bytes_of_a.astype(np.float32) / 255).min() > 100
    with pytest.raises(anchorsplat.BadArgumentError, match="different shapes"):
        anchorsplat.psnr(a, b[:, 1:])
    with pytest.raises(anchorsplat.BadArgumentError, match="expected pictures"):
        anchorsplat.ssim(a[0, 0], b[0, 0])
    with pytest.raises(anchorsplat.BadArgumentError, match="pass uint8, or floats"):
        anchorsplat.psnr(bytes_of_a.astype(np.uint16), a)
    assert anchorsplat.sheet({"a": a[0], "b": b[0]}).shape[2] == 3


def test_comparisons(cloud, tmp_path):
    cameras = project(tmp_path, cloud)
    pictures = anchorsplat.render(cloud, cameras)
    worse = cloud[::2]
    one = anchorsplat.compare(worse, cloud, cameras=cameras)
    assert one["mean"]["psnr"] == pytest.approx(
        anchorsplat.psnr(anchorsplat.render(worse, cameras).clip(0, 1), pictures.clip(0, 1)).mean(), abs=1e-4
    )
    both = anchorsplat.compare(worse, cloud, truth=pictures, cameras=cameras, color_correct=True)
    assert both["b"]["mean"]["psnr"] is None and both["a"]["mean"]["cc_psnr"] >= both["a"]["mean"]["psnr"]
    files = anchorsplat.compare(worse, tmp_path, cameras=tmp_path)
    assert files["mean"]["psnr"] == pytest.approx(one["mean"]["psnr"], abs=0.2)
    with pytest.raises(anchorsplat.BadArgumentError, match="needs views: pass --cameras FILE or --orbit N"):
        anchorsplat.compare(worse, cloud)
    with pytest.raises(anchorsplat.BadArgumentError, match="4 pictures, but 2 views"):
        anchorsplat.compare(worse, pictures, cameras=cameras[:2])
    with pytest.raises(anchorsplat.BadArgumentError, match="--orbit has no effect on pictures"):
        anchorsplat.compare(pictures, pictures, orbit=3)


def test_a_fit_comes_closer(cloud, tmp_path):
    project(tmp_path, cloud, views=6)
    fitted, report = anchorsplat.fit(tmp_path, steps=40, init_points=300, hold_out=0, sh_degree=0, seed=1)
    assert report["steps"] == 40 and len(fitted) == report["gaussians"]["out"] and fitted.sh_degree == 0
    started, report = anchorsplat.fit(tmp_path, steps=1, init_splat=cloud, hold_out=0)
    assert report["initial_points"] == "splat" and report["gaussians"]["in"] == len(cloud)
    with pytest.warns(anchorsplat.SplatWarning, match="their training pixel"):
        _, report = anchorsplat.refine(cloud, tmp_path, steps=3, k=1, hold_out=0)
    assert report["refine"]["steps"] == 3
    with pytest.raises(anchorsplat.BadArgumentError, match="--resume has no effect here"):
        anchorsplat.fit(tmp_path, resume=True)
    with pytest.raises(anchorsplat.BadArgumentError, match="--noise-lr has no effect here"):
        anchorsplat.fit(tmp_path, noise_lr=3)


def test_pages(cloud, tmp_path):
    page = anchorsplat.view(cloud, cloud[:100], cameras=Cameras.orbit(cloud, 3, size=(32, 32)), title="<two>")
    assert page.html.startswith("<!") and "&lt;two&gt;" in page.html and "<two>" not in page.html
    page.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_bytes() == bytes(page)
    with pytest.raises(anchorsplat.ExistsError):
        page.save(tmp_path / "page.html")
    inline = cloud[:50]._repr_html_()
    assert inline.startswith("<iframe srcdoc=") and 'sandbox="allow-scripts' in inline
    assert inline.count('"') == 6, "what is quoted holds no quotes"
