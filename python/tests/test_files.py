from __future__ import annotations

import io
import os

import numpy as np
import pytest
from conftest import same

import anchorsplat


def test_paths_bytes_and_file_objects(cloud, tmp_path):
    path = tmp_path / "scan.spz"
    with pytest.warns(anchorsplat.SplatWarning):
        anchorsplat.write(path, cloud)
    data = path.read_bytes()
    with pytest.warns(anchorsplat.SplatWarning):
        assert anchorsplat.to_bytes(cloud, ".spz") == data
    stream = io.BytesIO()
    with pytest.warns(anchorsplat.SplatWarning):
        anchorsplat.write(stream, cloud, format="spz")
    assert stream.getvalue() == data
    by_path = anchorsplat.read(str(path))
    with path.open("rb") as file:
        others = [anchorsplat.read(s) for s in (data, bytearray(data), memoryview(data), io.BytesIO(data), file)]
    assert all(same(other, by_path) for other in others)


def test_an_open_file_has_a_name(cloud, tmp_path):
    path = tmp_path / "scan.splat"
    with pytest.warns(anchorsplat.SplatWarning):
        anchorsplat.write(path, cloud)
    with path.open("rb") as file:
        assert same(anchorsplat.read(file), anchorsplat.read(path))


def test_a_name_may_be_any_bytes(cloud, tmp_path):
    name = os.fsencode(tmp_path) + b"/\xff.ply"
    anchorsplat.write(os.fsdecode(name), cloud)
    assert len(anchorsplat.read(os.fsdecode(name))) == len(cloud)


def test_an_existing_file_stays_unless_told_otherwise(cloud, tmp_path):
    path = tmp_path / "scan.ply"
    path.write_text("mine")
    with pytest.raises(anchorsplat.ExistsError, match="scan.ply: exists") as raised:
        anchorsplat.write(path, cloud)
    assert isinstance(raised.value, FileExistsError) and path.read_text() == "mine"
    anchorsplat.write(path, cloud, overwrite=True)
    assert same(anchorsplat.read(path), cloud)
    assert os.listdir(tmp_path) == ["scan.ply"]


def test_errors_are_one_family_with_the_programs_messages(biplane, program, tmp_path):
    cut = tmp_path / "cut.ply"
    cut.write_bytes(biplane.read_bytes()[:5000])
    cases = [
        (tmp_path / "none.ply", anchorsplat.NotFoundError, FileNotFoundError, 3),
        (cut, anchorsplat.BadFileError, ValueError, 4),
    ]
    for path, kind, base, code in cases:
        with pytest.raises(kind) as raised:
            anchorsplat.read(path)
        assert isinstance(raised.value, base) and isinstance(raised.value, anchorsplat.Error)
        assert program("info", path, code=code).stderr == f"error: {raised.value}\n"
    with pytest.raises(anchorsplat.BadArgumentError, match="is not a splat format"):
        anchorsplat.read(b"", format="doc")
    with pytest.raises(anchorsplat.BadFileError):
        anchorsplat.read(b"ply\nnot really")
    with pytest.raises(anchorsplat.NotFoundError):
        anchorsplat.write(tmp_path / "no" / "folder.ply", anchorsplat.read(biplane))
    with pytest.raises(TypeError):
        anchorsplat.read(3)  # type: ignore[arg-type]


def test_values_that_are_no_numbers_come_through(cloud, tmp_path):
    cloud.means[3] = np.nan
    cloud.log_scales[4] = -np.inf
    anchorsplat.write(tmp_path / "odd.ply", cloud)
    back = anchorsplat.read(tmp_path / "odd.ply")
    assert np.isnan(back.means[3]).all() and np.isneginf(back.log_scales[4]).all()
    with pytest.warns(anchorsplat.SplatWarning, match="dropped 1 of"):
        assert len(anchorsplat.enhance(back, method="filter", pixel_size=0.005)[0]) == len(cloud) - 1


@pytest.mark.filterwarnings("ignore:.*cannot store the up direction")
def test_formats_convert_and_info_are_the_programs(biplane, program, tmp_path):
    import json

    names = [f.name for f in anchorsplat.formats() if f.is_written]
    assert "SPZ" in names and "PLY" in names
    told = json.loads(program("info", biplane, "--json").stdout)
    assert anchorsplat.info(biplane) == told
    in_memory = anchorsplat.info(anchorsplat.read(biplane))
    assert in_memory["file"] is None and in_memory["counts"] == told["counts"]
    report = anchorsplat.convert(biplane, tmp_path / "a.spz", max_gaussians=500, report=True, report_views=2)
    again = program(
        "convert", biplane, tmp_path / "b.spz", "--max-gaussians", 500, "--report", "--report-views", 2, "--json"
    )
    (row,) = json.loads(again.stdout)
    for name in ("formats", "gaussians", "bytes", "error", "psnr"):
        assert report[name] == row[name]
    assert (tmp_path / "a.spz").read_bytes() == (tmp_path / "b.spz").read_bytes()
    with pytest.raises(anchorsplat.BadArgumentError, match="--spz-version has no effect here"):
        anchorsplat.convert(biplane, tmp_path / "c.ply", spz_version=3)


def test_networks_are_told_about(sources):
    weights = next((sources / "models").glob("*.safetensors"))
    found = anchorsplat.info(weights)
    assert found["kind"] == "model" and found["parameters"] > 1000


class TakesParts(io.RawIOBase):
    """A file without a buffer, on a disk that is full after so many bytes."""

    def __init__(self, room: int) -> None:
        self.taken = b""
        self._room = room

    def writable(self) -> bool:
        return True

    def write(self, data: object) -> int:
        part = bytes(data)[: min(1000, self._room - len(self.taken))]
        self.taken += part
        return len(part)


def test_files_without_a_buffer_get_all_of_it(cloud):
    whole = anchorsplat.to_bytes(cloud, "ply")
    file = TakesParts(len(whole))
    anchorsplat.write(file, cloud, format="ply")
    assert file.taken == whole
    with pytest.raises(anchorsplat.IoError, match="only 5,000 of"):
        anchorsplat.write(TakesParts(5000), cloud, format="ply")


def test_a_name_ends_at_no_nul(cloud, tmp_path):
    for call in (anchorsplat.read, anchorsplat.info, anchorsplat.Cameras, lambda path: anchorsplat.write(path, cloud)):
        with pytest.raises(anchorsplat.BadArgumentError, match="NUL"):
            call(f"{tmp_path}/scan.ply\0.spz")
    assert os.listdir(tmp_path) == []
