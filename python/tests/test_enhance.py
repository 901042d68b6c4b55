from __future__ import annotations

import json

import pytest
from conftest import same

import anchorsplat


def without_seconds(report):
    rest = {name: value for name, value in report.items() if not name.startswith("seconds")}
    return {name: without_seconds(value) if isinstance(value, dict) else value for name, value in rest.items()}


@pytest.mark.parametrize("options", [{}, {"method": "filter", "upscale": 2}, {"copies": 2, "max_gaussians": 3000}])
def test_the_result_is_the_programs(cloud, program, tmp_path, options):
    anchorsplat.write(tmp_path / "in.ply", cloud)
    words = [w for name, value in options.items() for w in (f"--{name.replace('_', '-')}", value)]
    told = json.loads(
        program("enhance", tmp_path / "in.ply", "-o", tmp_path / "out.ply", "--json", *words).stdout
    )[0]
    before = cloud.copy()
    enhanced, report = anchorsplat.enhance(cloud, **options)
    assert same(enhanced, anchorsplat.read(tmp_path / "out.ply"))
    assert same(cloud, before), "what is given stays as it is"
    del told["input"], told["output"]
    assert without_seconds(report) == without_seconds(told)


def test_cameras_say_the_pixel_size(cloud):
    cameras = anchorsplat.Cameras.orbit(cloud, 8, size=(200, 200))
    _, report = anchorsplat.enhance(cloud, method="filter", cameras=cameras, train_width=180)
    assert report["pixel_size"]["source"] == "cameras" and report["train_width"] == 180
    assert report["gaussians"] == {"in": 2500, "dropped": 0, "out": 2500}
    assert len(report) == len(dict(report)) and "method" in report


def test_refusals_are_the_command_lines(cloud, biplane, program, tmp_path):
    for options in (
        {"upscale": 0.5},
        {"method": "none"},
        {"k": 3, "method": "filter"},
        {"k": 100},
        {"quality": "perfect"},
        {"pixel_size": "large"},
        {"train_width": 100},
        {"steps": 5, "seconds": 3},
        {"shuffles": "1,2"},
        {"rate": float("inf")},
        {"images": ""},
    ):
        with pytest.raises(anchorsplat.BadArgumentError) as raised:
            anchorsplat.enhance(cloud, **options)
        assert isinstance(raised.value, ValueError)
        words = [w for name, value in options.items() for w in (f"--{name.replace('_', '-')}", value)]
        said = program("enhance", biplane, "-o", tmp_path / "x.ply", *words, code=2).stderr
        assert said.removesuffix(" (--help shows how)\n").removesuffix("\n").endswith(f"error: {raised.value}"), said
    with pytest.raises(anchorsplat.BadArgumentError, match="clean: must be True or False"):
        anchorsplat.enhance(cloud, clean=2)
    with pytest.raises(TypeError):
        anchorsplat.enhance(cloud, sharpness=2)
    with pytest.raises(anchorsplat.NotFoundError):
        anchorsplat.enhance(cloud, cameras=tmp_path / "none.json")


def test_methods_are_listed():
    assert {"filter", "model", "refine"} <= set(anchorsplat.methods())



def test_a_network_keeps_what_it_has_made(cloud, tmp_path):
    whole, _ = anchorsplat.enhance(cloud, method="model")
    state = tmp_path / "state"
    again, report = anchorsplat.enhance(cloud, method="model", checkpoint=state, resume=True)
    assert same(again, whole) and report["model"]["blocks_resumed"] == 0
    assert not state.exists()  # the result is there
    state.write_bytes(b"my notes")
    with pytest.raises(anchorsplat.ExistsError, match="is not a checkpoint"):
        anchorsplat.enhance(cloud, method="model", checkpoint=state)
    with pytest.raises(anchorsplat.BadFileError, match="is not a checkpoint"):
        anchorsplat.enhance(cloud, method="model", checkpoint=state, resume=True)
    assert state.read_bytes() == b"my notes"
