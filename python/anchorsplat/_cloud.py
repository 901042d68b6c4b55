"""Gaussians in memory."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ._edit import Edit, Edits, edit
from ._errors import BadArgumentError, Error

if TYPE_CHECKING:
    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float32]

#: Rasterization: "classic" widens every Gaussian by 0.3 px² (Kerbl et al. 2023); "antialiased" also compensates its opacity, as
#: gsplat does; "mip" compensates for 0.1 px² (Mip-Splatting).
RenderMode = Literal["classic", "antialiased", "mip"]

_MOST_SHOWN = 500_000  # a notebook shows larger splats on request only; 3.5 MB

_MODES = (None, "classic", "antialiased", "mip")


def _column(name: str, values: Any, shape: tuple[int | None, ...]) -> FloatArray:
    if hasattr(values, "detach"):  # a PyTorch tensor
        values = values.detach().cpu()
    array = np.asarray(values)
    if array.dtype.kind not in "fiu":
        raise BadArgumentError(f"{name}: expected numbers, found {array.dtype}")
    array = np.ascontiguousarray(array, dtype=np.float32)
    if name == "opacity_logits" and array.ndim == 2 and array.shape[1] == 1:
        array = array[:, 0]
    fits = array.ndim == len(shape) and all(want in (None, has) for want, has in zip(shape, array.shape))
    if not fits:
        wanted = ", ".join("N" if side is None else str(side) for side in shape)
        raise BadArgumentError(f"{name}: expected an array [{wanted}], found {list(array.shape)}")
    return array


def _point(name: str, values: Sequence[float]) -> tuple[float, float, float]:
    point = tuple(float(value) for value in values)
    if len(point) != 3 or not np.isfinite(point).all():
        raise BadArgumentError(f"{name}: expected three finite numbers, found {values!r}")
    return point


class Cloud(Edits["Cloud"]):
    """A splat: N Gaussians in five NumPy arrays of float32. Row i of each array is Gaussian i.

    Values are those before activation, as stored in an INRIA PLY. You can change them in place; the number of Gaussians and the
    SH degree are fixed. Arrays returned by this package are views of the engine's buffers, without a copy. DLPack shares
    their memory: ``torch.from_dlpack(cloud.means)``.

    A Cloud made of your own arrays shares those that are float32, C-contiguous and in CPU memory, and copies the others. Do
    not change an array while a call uses it. Several calls may read it at the same time.

    Each edit, such as :meth:`translate` or :meth:`crop`, returns a new Cloud. :meth:`edit` chains several with a single copy.

    Raises BadArgumentError for arrays of the wrong shape or type.
    """

    __slots__ = (
        "_means",
        "_log_scales",
        "_quats",
        "_opacity_logits",
        "_sh",
        "_render_mode",
        "_comments",
        "_origin",
        "__weakref__",
    )

    def __init__(
        self,
        means: npt.ArrayLike,
        log_scales: npt.ArrayLike,
        quats: npt.ArrayLike,
        opacity_logits: npt.ArrayLike,
        sh: npt.ArrayLike,
        *,
        render_mode: RenderMode | None = None,
        comments: Sequence[str] = (),
        origin: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        self._means = _column("means", means, (None, 3))
        self._log_scales = _column("log_scales", log_scales, (None, 3))
        self._quats = _column("quats", quats, (None, 4))
        self._opacity_logits = _column("opacity_logits", opacity_logits, (None,))
        self._sh = _column("sh", sh, (None, None, 3))
        count = len(self._means)
        for name in ("log_scales", "quats", "opacity_logits", "sh"):
            rows = len(getattr(self, name))
            if rows != count:
                raise BadArgumentError(f"{name}: {rows} rows, but means has {count}")
        if self._sh.shape[1] not in (1, 4, 9, 16):
            raise BadArgumentError(
                f"sh: {self._sh.shape[1]} coefficients; expected 1, 4, 9 or 16 (degree 0 to 3)"
            )
        self.render_mode = render_mode
        self._comments = tuple(comments)
        self._origin = _point("origin", origin)

    @classmethod
    def from_arrays(
        cls,
        means: npt.ArrayLike,
        log_scales: npt.ArrayLike,
        quats: npt.ArrayLike,
        opacity_logits: npt.ArrayLike,
        sh: npt.ArrayLike,
        *,
        render_mode: RenderMode | None = None,
        comments: Sequence[str] = (),
        origin: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> Cloud:
        """A Cloud of your own arrays; the same as ``Cloud(...)``."""
        return cls(
            means, log_scales, quats, opacity_logits, sh, render_mode=render_mode, comments=comments, origin=origin
        )

    @classmethod
    def _of(cls, parts: tuple[Any, ...]) -> Cloud:
        """From the arrays that the engine returns, unchecked."""
        cloud = cls.__new__(cls)
        (_, cloud._means, cloud._log_scales, cloud._quats, cloud._opacity_logits, cloud._sh) = parts[:6]
        cloud._render_mode = parts[6]
        cloud._comments = tuple(parts[7])
        cloud._origin = tuple(parts[8])
        return cloud

    @property
    def means(self) -> FloatArray:
        """[N,3] centres in world units, relative to :attr:`origin`."""
        return self._means

    @property
    def log_scales(self) -> FloatArray:
        """[N,3] ln(world units), one per axis of the rotation. −inf is valid: flat."""
        return self._log_scales

    @property
    def quats(self) -> FloatArray:
        """[N,4] rotations, wxyz, of any norm."""
        return self._quats

    @property
    def opacity_logits(self) -> FloatArray:
        """[N] ln(o / (1 − o))."""
        return self._opacity_logits

    @property
    def sh(self) -> FloatArray:
        """[N,(sh_degree+1)²,3] spherical harmonics, coefficient-major, rgb fastest; ``sh[:, 0]`` is f_dc."""
        return self._sh

    @property
    def sh_degree(self) -> int:
        """0 to 3."""
        return {1: 0, 4: 1, 9: 2, 16: 3}[self._sh.shape[1]]

    @property
    def render_mode(self) -> RenderMode | None:
        """Rasterization that the splat was trained for; None if unknown. Can be set."""
        return self._render_mode

    @render_mode.setter
    def render_mode(self, mode: RenderMode | None) -> None:
        if mode not in _MODES:
            raise BadArgumentError(f"render_mode: {mode!r} is not classic, antialiased, mip or None")
        self._render_mode = mode

    @property
    def comments(self) -> tuple[str, ...]:
        """Comments of the file, and of what was done to the splat."""
        return self._comments

    @property
    def origin(self) -> tuple[float, float, float]:
        """World position that :attr:`means` are relative to: ``numpy.asarray(cloud.origin) + cloud.means`` in float64 gives world
        positions. Zero unless coordinates are too large for float32, as on maps. Cameras, regions and orbits are in world
        coordinates."""
        return self._origin

    @property
    def nbytes(self) -> int:
        """Size of the five arrays."""
        return sum(a.nbytes for a in (self._means, self._log_scales, self._quats, self._opacity_logits, self._sh))

    def __len__(self) -> int:
        return len(self._means)

    def __getitem__(self, rows: Any) -> Cloud:
        """Some of the Gaussians: a slice (a view), a mask or indices (copies)."""
        if isinstance(rows, (int, np.integer)):
            row = range(len(self))[int(rows)]  # or IndexError
            rows = slice(row, row + 1)
        return Cloud(
            self._means[rows],
            self._log_scales[rows],
            self._quats[rows],
            self._opacity_logits[rows],
            self._sh[rows],
            render_mode=self._render_mode,
            comments=self._comments,
            origin=self._origin,
        )

    def __iter__(self) -> Iterator[Cloud]:
        """One Cloud per Gaussian. Using the arrays is faster."""
        return (self[row] for row in range(len(self)))

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise TypeError("a Cloud is five arrays: cloud.means, log_scales, quats, opacity_logits and sh")

    def copy(self) -> Cloud:
        """A copy with its own arrays."""
        return Cloud(
            self._means.copy(),
            self._log_scales.copy(),
            self._quats.copy(),
            self._opacity_logits.copy(),
            self._sh.copy(),
            render_mode=self._render_mode,
            comments=self._comments,
            origin=self._origin,
        )

    def edit(self, *, axes: str = "RDF") -> Edit:
        """Starts a chain of edits with a single copy (:func:`anchorsplat.edit`)."""
        return edit(self, axes=axes)

    def merge(self, *others: Cloud | Edit) -> Cloud:
        """A new Cloud with these Gaussians followed by those of others, with the highest SH degree. docs/edit.md says what becomes
        of marks and render modes."""
        return self.edit().merge(*others).apply()[0]

    def _edited(self, name: str, text: str, axes: str | None) -> Cloud:
        return self.edit()._edited(name, text, axes).apply()[0]

    @classmethod
    def from_gsplat(cls, params: Mapping[str, Any]) -> Cloud:
        """A Cloud of gsplat's parameters, as in its trainer and checkpoints: tensors or arrays "means" [N,3], "scales" [N,3]
        (logarithms), "quats" [N,4] (wxyz), "opacities" [N] (logits), "sh0" [N,1,3] and "shN" [N,K−1,3], or a dictionary with
        them under "splats". Harmonics are copied; the others share memory if possible. Raises BadArgumentError."""
        from ._gsplat import from_gsplat

        return from_gsplat(params)

    def to_gsplat(self, arrays: Literal["torch", "numpy"] = "torch") -> dict[str, Any]:
        """The parameters of gsplat's trainer, with its names and layout (see :meth:`from_gsplat`), as tensors or NumPy arrays that
        share this Cloud's memory. "means" are relative to :attr:`origin`. To train, copy them:
        ``torch.nn.Parameter(t.clone())``."""
        from ._gsplat import to_gsplat

        return to_gsplat(self, arrays)

    def _repr_html_(self) -> str:
        from ._view import view

        if len(self) > _MOST_SHOWN:
            return f"<p>{html.escape(repr(self))}, too many to show automatically: call <code>anchorsplat.view(cloud)</code>.</p>"
        try:
            return view(self)._repr_html_()
        except Error as error:  # nothing of it can be shown
            return f"<p>{html.escape(repr(self))}: {html.escape(str(error))}</p>"

    def __repr__(self) -> str:
        mode = f", {self._render_mode}" if self._render_mode else ""
        return f"<anchorsplat.Cloud: {len(self):,} Gaussians of SH degree {self.sh_degree}{mode}>"
