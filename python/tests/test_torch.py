"""The rasterizer in PyTorch. Without torch there is nothing to test: `make test LEAN=1` does without."""

from __future__ import annotations

import os

import numpy as np
import pytest

import anchorsplat

if os.environ.get("ANCHORSPLAT_TEST_TORCH") != "0":
    import torch

    from anchorsplat.torch import rasterize
else:
    pytest.skip("a build without LibTorch", allow_module_level=True)

NAMES = ("means", "log_scales", "quats", "opacity_logits", "sh")


@pytest.fixture
def few(cloud):
    return cloud[:60].copy()


@pytest.fixture
def cameras(few):
    return anchorsplat.Cameras.orbit(few, 2, size=(24, 20))


def tensors(cloud, dtype=None):
    return [torch.from_dlpack(getattr(cloud, name)).clone().requires_grad_() for name in NAMES]


def loss_of(colors, alphas):
    weights = torch.linspace(0.5, 1.5, colors.numel()).reshape(colors.shape)
    return (colors * weights).double().sum() + 0.3 * alphas.double().square().sum()


def test_tensors_share_the_clouds_memory(few):
    assert torch.from_dlpack(few.means).data_ptr() == few.means.__array_interface__["data"][0]
    params = few.to_gsplat()
    assert params["shN"].data_ptr() == few.sh[:, 1:].__array_interface__["data"][0]
    parameters = torch.nn.ParameterDict({name: torch.nn.Parameter(t.clone()) for name, t in params.items()})
    back = anchorsplat.Cloud.from_gsplat(parameters)
    assert all(np.array_equal(getattr(back, name), getattr(few, name)) for name in NAMES)
    borrowed = anchorsplat.Cloud(*[t.detach() for t in tensors(few)])
    assert np.array_equal(borrowed.means, few.means)


def test_pictures_are_those_of_render(few, cameras):
    for mode in ("classic", "antialiased", "mip"):
        colors, alphas = rasterize(*tensors(few), cameras, background=[0.1, 0.2, 0.3], mode=mode)
        few.render_mode = mode
        assert np.array_equal(colors.detach().numpy(), anchorsplat.render(few, cameras, background=(0.1, 0.2, 0.3), near=0.01))
        assert alphas.shape == (2, 20, 24, 1)


def test_gradients_are_the_engines(few, cameras):
    """The same bits as the C++ entry point has for the same gradients of the pictures, for any number of threads."""
    from anchorsplat import _core
    from anchorsplat._run import run

    background = torch.tensor([0.1, 0.2, 0.3], requires_grad=True)
    values = tensors(few)
    colors, alphas = rasterize(*values, cameras, background=background)
    colors.retain_grad()
    alphas.retain_grad()
    loss_of(colors, alphas).backward()
    views = _core.DifferentiableViews(few, cameras._set, "classic", (0.1, 0.2, 0.3), 3, 0.01, 1e10, "gsplat14")
    with run(1) as how:
        views.forward(how)
        *gradients, of_background = views.backward(colors.grad.numpy(), alphas.grad.numpy(), how)
    for name, tensor, gradient in zip(NAMES, values, gradients):
        assert gradient.any() and np.array_equal(tensor.grad.numpy(), gradient), name
    assert background.grad.tolist() == torch.tensor(of_background).tolist()


def test_gradients_match_finite_differences(few, cameras):
    """Along random directions, where nothing crosses a cut-off: of values that colours depend on smoothly."""
    few.opacity_logits[:] = np.clip(few.opacity_logits, -2, 1)
    few.sh[:, 0] = np.abs(few.sh[:, 0]) + 1  # no colour is clamped at 0
    values = tensors(few)
    background = torch.tensor([0.1, 0.2, 0.3], requires_grad=True)
    loss_of(*rasterize(*values, cameras, background=background)).backward()
    random = torch.Generator().manual_seed(0)
    for k, step in ((3, 1e-3), (4, 1e-2)):
        direction = torch.randn(values[k].shape, generator=random)
        ends = []
        for sign in (1, -1):
            moved = [v.detach() + (sign * step * direction if i == k else 0) for i, v in enumerate(values)]
            with torch.no_grad():
                ends.append(loss_of(*rasterize(*moved, cameras, background=background)).item())
        slope = (ends[0] - ends[1]) / (2 * step)
        expected = (values[k].grad * direction).sum()
        assert slope == pytest.approx(expected.item(), rel=0.05, abs=0.02), NAMES[k]


def test_an_optimizer_comes_closer(few, cameras):
    target, _ = rasterize(*tensors(few), cameras)
    values = tensors(few)
    with torch.no_grad():
        values[4] += 0.3
    optimizer = torch.optim.Adam(values, lr=0.02)
    losses = []
    for _ in range(15):
        optimizer.zero_grad()
        loss = (rasterize(*values, cameras)[0] - target.detach()).square().mean()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[-1] < 0.5 * losses[0]


def test_what_cannot_be_differentiated_is_refused(few, cameras):
    values = tensors(few)
    with pytest.raises(anchorsplat.BadArgumentError, match="means: expected a float32 tensor on the CPU"):
        rasterize(values[0].double(), *values[1:], cameras)
    with pytest.raises(anchorsplat.BadArgumentError, match="quats: 59 rows"):
        rasterize(*values[:2], values[2][:59], *values[3:], cameras)
    with pytest.raises(anchorsplat.BadArgumentError, match="background"):
        rasterize(*values, cameras, background=[1, 2])
    for because, how in {
        "background: not finite": {"background": [0, float("nan"), 1]},
        "profile: 'foo' is not": {"profile": "foo"},
        "sh_degree: 9 is not 0 to 3": {"sh_degree": 9},
    }.items():
        with pytest.raises(anchorsplat.BadArgumentError, match=because):
            rasterize(*values, cameras, **how)
    with pytest.raises(anchorsplat.BadArgumentError, match=r"opacity_logits: expected \[N\], found \[60, 1\]"):
        rasterize(*values[:3], values[3][:, None], values[4], cameras)
    with pytest.raises(anchorsplat.BadArgumentError, match=r"Cameras\('capture'\)"):
        rasterize(*values, "capture")
    colors, _ = rasterize(*values, cameras)
    with torch.no_grad():
        values[0] += 1
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        colors.sum().backward()
    values = tensors(few)
    colors, _ = rasterize(*values, cameras)
    colors.sum().backward(retain_graph=True)
    once = values[0].grad.clone()
    colors.sum().backward()
    assert torch.equal(values[0].grad, 2 * once)


def test_a_splatfacto_checkpoint_is_read(few, tmp_path):
    params = few.to_gsplat()
    state = {
        "means": params["means"],
        "scales": params["scales"],
        "quats": params["quats"],
        "features_dc": params["sh0"][:, 0],
        "features_rest": params["shN"],
        "opacities": params["opacities"][:, None],
    }
    pipeline = {f"_model.gauss_params.{name}": tensor.clone() for name, tensor in state.items()}
    checkpoint = {
        "step": 29999,
        "pipeline": {**pipeline, "_model.camera_optimizer.pose_adjustment": torch.zeros(2, 6)},
        "optimizers": {"means": torch.optim.Adam([torch.nn.Parameter(state["means"].clone())]).state_dict()},
        "schedulers": {},
        "scalers": {"scale": 65536.0, "growth_factor": 2.0},
    }
    torch.save(checkpoint, tmp_path / "step-000029999.ckpt")
    read = anchorsplat.read(tmp_path / "step-000029999.ckpt")
    assert all(np.array_equal(getattr(read, name), getattr(few, name)) for name in NAMES)
    torch.save({"step": 1, "splats": params}, tmp_path / "ckpt_1_rank0.pt")
    read = anchorsplat.read(tmp_path / "ckpt_1_rank0.pt")
    assert all(np.array_equal(getattr(read, name), getattr(few, name)) for name in NAMES)
