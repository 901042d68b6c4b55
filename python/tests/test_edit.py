"""Edits in Python give what the command line gives, and copy once."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import same

import anchorsplat
from anchorsplat import BadArgumentError, Cloud


def test_each_edit_is_the_command_lines(cloud, program, tmp_path):
    anchorsplat.write(tmp_path / "in.ply", cloud)
    cases = {
        "--translate=1,-2.5,0.25": cloud.translate((1, -2.5, 0.25)),
        "--rotate=10,20,-35": cloud.rotate(np.array([10, 20, -35])),
        "--scale=1.7": cloud.scale(1.7),
        "--mirror=y": cloud.mirror("y"),
        "--up=-z": cloud.turn_up("-z"),
        "--up=0.1,0.2,0.3": cloud.turn_up((0.1, 0.2, 0.3)),
        "--origin=0.5,0,0": cloud.move_origin([0.5, 0, 0]),
        "--filter-box=-0.2,-,-,0.3,0.5,-": cloud.crop(box=(-0.2, None, -np.inf, 0.3, 0.5, np.inf)),
        "--remove-box=-0.2,-,-,0.3,0.5,-": cloud.remove_box((-0.2, None, -np.inf, 0.3, 0.5, np.inf)),
        "--filter-sphere=0,0.1,0,0.5": cloud.crop(sphere=(0, 0.1, 0, 0.5)),
        "--filter-nan": cloud.filter_nan(),
        "--filter-value=opacity,gt,0.5": cloud.filter_value("opacity", "gt", 0.5),
        "--filter-value=x,lte,0.1": cloud.filter_value("x", "lte", 0.1),
        "--filter-harmonics=1": cloud.filter_harmonics(1),
        "--filter-floaters": cloud.filter_floaters(),
        "--filter-floaters=0.8": cloud.filter_floaters(0.8),
    }
    for word, ours in cases.items():
        out = tmp_path / "out.ply"
        program("convert", tmp_path / "in.ply", "--action-axes=RDF", word, out, "-w", "-q")
        theirs = anchorsplat.read(out)
        assert same(ours, theirs), word
        assert ours.comments == theirs.comments and ours.origin == theirs.origin, word


def test_a_chain_is_done_in_its_order_and_leaves_the_splat_as_it_is(cloud, program, tmp_path):
    before = cloud.copy()
    chain = cloud.edit().rotate((0, 90, 0)).scale(0.5).crop(sphere=(0, 0, 0, 0.3)).filter_harmonics(0)
    assert repr(chain) == "<anchorsplat.Edit: 4 edits of 2,500 Gaussians>"
    small, report = chain.apply()
    assert same(cloud, before)
    anchorsplat.write(tmp_path / "in.ply", cloud)
    words = ["--action-axes=RDF", "--rotate=0,90,0", "--scale=0.5", "--filter-sphere=0,0,0,0.3", "--filter-harmonics=0"]
    program("convert", tmp_path / "in.ply", tmp_path / "out.ply", *words, "-q")
    assert same(small, anchorsplat.read(tmp_path / "out.ply"))
    assert report["gaussians"] == {"in": 2500, "out": len(small)} and report["sh_degree"] == {"in": 3, "out": 0}
    assert [step["action"].replace(" ", "=") for step in report["actions"]] == words[1:]
    assert report["actions"][2]["taken"] == 2500 - len(small) and report["actions"][2]["axes"] == "RDF"
    assert "axes" not in report["actions"][1]
    again, _ = chain.apply(threads=1)
    assert same(small, again)
    # One begins where the other is, and neither changes it.
    one, other = chain.scale(2), chain.scale(3)
    assert np.allclose(one.apply()[0].means, 2 * small.means) and np.allclose(other.apply()[0].means, 3 * small.means)


def test_axes(cloud):
    assert same(cloud.translate((1, 2, 3), axes="LUF"), cloud.translate((-1, -2, 3)))
    luf, report = anchorsplat.edit(cloud, axes="LUF").translate((1, 2, 3)).translate((0, 0, 1), axes="RFU").apply()
    assert [step["axes"] for step in report["actions"]] == ["LUF", "RFU"]
    assert same(luf, anchorsplat.edit(cloud).translate((-1, -2, 3)).translate((0, -1, 0)).apply()[0])
    with pytest.raises(BadArgumentError, match="not a set of axes"):
        cloud.translate((1, 2, 3), axes="XYZ")


def test_merging(cloud):
    small = cloud[:100].filter_harmonics(1)
    both = cloud.merge(small)
    assert len(both) == 2600 and both.sh_degree == 3
    assert same(both[:2500], cloud) and np.array_equal(both.sh[2500:, :4], small.sh) and not both.sh[2500:, 4:].any()
    chair = anchorsplat.edit(small).scale(0.5).translate((1, 0, 0))
    room, report = anchorsplat.edit(cloud).translate((0, 1, 0)).merge(chair, small).scale(2).apply()
    assert np.allclose(room.means[:2500], 2 * (cloud.means + [0, 1, 0]), atol=1e-5)
    assert np.allclose(room.means[2500:2600], small.means + [2, 0, 0], atol=1e-5)
    assert np.allclose(room.means[2600:], 2 * small.means, atol=1e-5)
    assert [step.get("input") for step in report["actions"]] == ["cloud 1", "cloud 2", "cloud 2", None]
    assert report["gaussians"] == {"in": 2700, "out": 2700}
    two, _ = anchorsplat.edit(cloud, small).apply()
    assert same(two, both)


def test_marks_and_modes_come_along(cloud):
    marked = Cloud(
        cloud.means, cloud.log_scales, cloud.quats, cloud.opacity_logits, cloud.sh,
        render_mode="mip", comments=["credit: somebody", "world up: 0 0 1"],
    )  # fmt: skip
    turned = marked.turn_up("z")
    assert turned.render_mode == "mip" and turned.comments[0] == "credit: somebody"
    assert turned.comments[1] == "world up: 0 -1 0"
    classic = marked.copy()
    classic.render_mode = "classic"
    with pytest.warns(anchorsplat.SplatWarning, match="different render modes"):
        assert marked.merge(classic).render_mode is None


def test_nothing_may_be_left(cloud):
    nothing, report = anchorsplat.edit(cloud).crop(sphere=(1e6, 0, 0, 1)).translate((1, 2, 3)).apply()
    assert len(nothing) == 0 and report["actions"][0]["taken"] == 2500
    assert len(nothing.scale(2)) == 0 and len(cloud.merge(nothing)) == 2500


@pytest.mark.parametrize(
    "call, says",
    [
        (lambda c: c.translate((1, 2)), "translate: expected x, y, z"),
        (lambda c: c.translate((1, 2, np.nan)), "translate: expected x, y, z"),
        (lambda c: c.translate(1), "translate: expected x, y, z"),
        (lambda c: c.translate("123"), "translate: expected x, y, z"),
        (lambda c: c.crop(box=(np.inf, 0, 0, 1, 1, 1)), "box: expected a finite number, found inf"),
        (lambda c: c.edit(axes="XYZ"), "not a set of axes"),
        (lambda c: c.rotate("abc"), "rotate: expected degrees"),
        (lambda c: c.scale(-1), "a factor above 0"),
        (lambda c: c.scale((1, 2, 3)), "scale: expected a finite number"),
        (lambda c: c.mirror("w"), "an axis"),
        (lambda c: c.turn_up((0, 0, 0)), "a direction"),
        (lambda c: c.crop(), "either a box or a sphere"),
        (lambda c: c.crop(box=(0, 0, 0, 1)), "box: expected x0"),
        (lambda c: c.crop(box=5), "box: expected x0"),
        (lambda c: c.crop(box=(1, 0, 0, 0, 1, 1)), "first corner must be the lower"),
        (lambda c: c.crop(sphere=(0, 0, 0, -1)), "radius above 0"),
        (lambda c: c.filter_value("opacity", "above", 1), "lt, lte, gt"),
        (lambda c: c.filter_value("label", "gt", 1), "the cloud: --filter-value label,gt,1: there is no property 'label'"),
        (lambda c: c.filter_harmonics(4), "a degree, 0 to 3"),
        (lambda c: c.filter_floaters(0), "one factor above 0"),
        (lambda c: anchorsplat.edit(), "expected a splat"),
    ],
)
def test_what_makes_no_sense_is_said(cloud, call, says):
    with pytest.raises(BadArgumentError, match=says):
        call(cloud)


def test_what_is_no_splat(cloud):
    for call in (lambda: cloud.merge(cloud.means), lambda: anchorsplat.edit("scan.ply"), lambda: cloud.merge(None)):
        with pytest.raises(TypeError, match="expected an anchorsplat.Cloud, found"):
            call()


def test_a_box_of_two_corners(cloud):
    corners = np.quantile(cloud.means, [0.2, 0.8], axis=0)
    inside = ((cloud.means >= corners[0]) & (cloud.means <= corners[1])).all(axis=1)
    assert same(cloud.crop(box=corners), cloud[inside])
