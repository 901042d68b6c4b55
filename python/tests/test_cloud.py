from __future__ import annotations

import gc
import pickle

import numpy as np
import pytest
from conftest import same

import anchorsplat
from anchorsplat import Cloud


def arrays(count: int = 4, coefficients: int = 4) -> dict[str, np.ndarray]:
    random = np.random.default_rng(0)
    shapes = {
        "means": (count, 3),
        "log_scales": (count, 3),
        "quats": (count, 4),
        "opacity_logits": (count,),
        "sh": (count, coefficients, 3),
    }
    return {name: random.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}


def test_columns_are_views_that_outlive_the_cloud(biplane):
    cloud = anchorsplat.read(biplane)
    assert len(cloud) == 20_000 and cloud.sh_degree == 3 and cloud.sh.shape == (20_000, 16, 3)
    means, sh = cloud.means, cloud.sh
    assert means is cloud.means and not means.flags.owndata and means.dtype == np.float32
    before = means.copy(), sh.copy()
    del cloud
    gc.collect()
    anchorsplat.read(biplane)  # would take the memory, were it free
    assert np.array_equal(means, before[0]) and np.array_equal(sh, before[1])


def test_values_are_changed_in_place(cloud):
    cloud.means[0] = [1, 2, 3]
    assert anchorsplat.read(anchorsplat.to_bytes(cloud, "ply")).means[0].tolist() == [1, 2, 3]


def test_dlpack_shares_memory(cloud):
    shared = np.from_dlpack(cloud.means)
    assert np.shares_memory(shared, cloud.means)


def test_own_arrays_are_borrowed_where_their_layout_allows():
    mine = arrays()
    cloud = Cloud.from_arrays(**mine)
    for name, array in mine.items():
        assert getattr(cloud, name) is array
    assert cloud.sh_degree == 1 and cloud.render_mode is None
    turned = {**mine, "means": np.asfortranarray(mine["means"]), "quats": mine["quats"].astype(np.float64)}
    copied = Cloud(**turned, render_mode="mip", comments=["a"])
    assert np.array_equal(copied.means, mine["means"]) and copied.means.flags.c_contiguous
    assert copied.quats.dtype == np.float32 and copied.render_mode == "mip" and copied.comments == ("a",)
    read_only = mine["sh"].copy()
    read_only.flags.writeable = False
    fixed = Cloud(**{**mine, "sh": read_only})
    assert fixed.sh is read_only and same(anchorsplat.read(anchorsplat.to_bytes(fixed, "ply")), cloud)
    assert len(Cloud(**{**mine, "opacity_logits": mine["opacity_logits"][:, None]})) == 4


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"means": np.zeros((4, 2))}, r"means: expected an array \[N, 3\], found \[4, 2\]"),
        ({"quats": np.zeros((5, 4))}, "quats: 5 rows, but means has 4"),
        ({"sh": np.zeros((4, 5, 3))}, "sh: 5 coefficients"),
        ({"sh": np.zeros((4, 12))}, r"sh: expected an array \[N, N, 3\], found \[4, 12\]"),
        ({"log_scales": np.array(["a"])}, "log_scales: expected numbers"),
        ({"render_mode": "bright"}, "render_mode: 'bright' is not classic"),
    ],
)
def test_what_does_not_fit_is_said(change, message):
    with pytest.raises(anchorsplat.BadArgumentError, match=message):
        Cloud(**{**arrays(), **change})


def test_no_gaussians_at_all():
    empty = Cloud(**arrays(0))
    assert len(empty) == 0 and "0 Gaussians" in repr(empty)
    with pytest.raises(anchorsplat.BadArgumentError):
        anchorsplat.to_bytes(empty, "ply")
    with pytest.raises(anchorsplat.Error):
        anchorsplat.enhance(empty)


def test_rows_copies_and_pickles(cloud):
    assert np.shares_memory(cloud[10:20].means, cloud.means)
    mask = cloud.opacity_logits > 0
    assert len(cloud[mask]) == mask.sum() and len(cloud[-1]) == 1
    assert not np.shares_memory(cloud.copy().means, cloud.means)
    back = pickle.loads(pickle.dumps(cloud))
    assert same(back, cloud) and back.render_mode == cloud.render_mode and back.comments == cloud.comments


def test_gaussian_by_gaussian(cloud):
    few = cloud[:3]
    assert [len(one) for one in few] == [1, 1, 1] and same(list(few)[2], cloud[2:3])
    assert same(cloud[-1], cloud[len(cloud) - 1])
    for row in (3, -4, 10**9):
        with pytest.raises(IndexError):
            few[row]
    with pytest.raises(TypeError, match="five arrays"):
        np.asarray(few)


def test_bytes_are_no_paths(cloud):
    data = anchorsplat.to_bytes(cloud, "ply")
    for call in (lambda: anchorsplat.info(data), lambda: anchorsplat.convert(data, "x.spz")):
        with pytest.raises(anchorsplat.BadArgumentError, match="found bytes") as refused:
            call()
        assert len(str(refused.value)) < 200


def test_the_engine_checks_what_it_is_given(cloud):
    with pytest.raises(TypeError, match="expected an anchorsplat.Cloud"):
        anchorsplat.render("scan.ply")
    with pytest.raises(TypeError, match="expected an anchorsplat.Cloud"):
        anchorsplat.enhance(None)


def test_gsplats_parameters(cloud):
    params = cloud.to_gsplat("numpy")
    assert {name: values.shape for name, values in params.items()} == {
        "means": (2500, 3),
        "scales": (2500, 3),
        "quats": (2500, 4),
        "opacities": (2500,),
        "sh0": (2500, 1, 3),
        "shN": (2500, 15, 3),
    }
    assert np.shares_memory(params["shN"], cloud.sh)
    assert same(Cloud.from_gsplat(params), cloud)
    assert same(Cloud.from_gsplat({"step": 3, "splats": params}), cloud)
    with pytest.raises(anchorsplat.BadArgumentError, match="no sh0; gsplat's parameters are"):
        Cloud.from_gsplat({name: values for name, values in params.items() if name != "sh0"})
    with pytest.raises(anchorsplat.BadArgumentError, match=r"sh0: expected \[N, 1, 3\], found \[2500, 15, 3\]"):
        Cloud.from_gsplat({**params, "sh0": params["shN"]})


def test_notebooks_show_what_there_is_to_see(cloud):
    assert "<iframe" in cloud._repr_html_()
    assert "0 Gaussians" in cloud[:0]._repr_html_()
    many = cloud[np.zeros(500_001, np.int64)]
    assert "anchorsplat.view(cloud)" in many._repr_html_()
