"""Edits of splats."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Generic, Literal, NamedTuple, TypeVar

from . import _core
from ._errors import BadArgumentError
from ._report import Report
from ._run import ProgressLike, run

if TYPE_CHECKING:
    from ._cloud import Cloud

_Made = TypeVar("_Made")  # result of an edit
Comparison = Literal["lt", "lte", "gt", "gte", "eq", "neq"]


class _Step(NamedTuple):
    first: int  # first cloud that it applies to
    clouds: int  # number of clouds that it applies to
    name: str  # "--translate"
    text: str  # "1,0,0"
    axes: str


def _numbers(name: str, values: Any, what: str, count: int) -> str:
    """"1,2.5,0", with all digits. Raises BadArgumentError."""
    try:
        numbers = [] if isinstance(values, (str, bytes, dict)) else [float(value) for value in values]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise BadArgumentError(f"{name}: expected {what}, found {values!r}")
    return ",".join(repr(number).removesuffix(".0") for number in numbers)


def _number(name: str, value: Any) -> str:
    try:
        return _numbers(name, (value,), "", 1)
    except BadArgumentError:
        raise BadArgumentError(f"{name}: expected a finite number, found {value!r}") from None


def _box(values: Any) -> str:
    try:
        corners = [part for value in values for part in (value if hasattr(value, "__len__") else (value,))]
    except TypeError:
        corners = []
    bounds = [-math.inf] * 3 + [math.inf] * 3
    texts = []
    for value, none in zip(corners, bounds):
        texts.append("-" if value is None or value == none else _number("box", value))
    if len(corners) != 6:
        raise BadArgumentError(f"box: expected x0, y0, z0, x1, y1, z1, found {values!r}")
    return ",".join(texts)


class Edits(Generic[_Made]):
    """Edits of a :class:`Cloud`, which return a new Cloud, and of an :class:`Edit`, which return a longer chain.

    Numbers use the axes of the arrays, RDF (x right, y down, z forward), unless `axes` gives other letters for x, y and z.
    ``axes="LUF"`` is the default of the command line and of splat-transform. More in docs/edit.md.
    """

    __slots__ = ()

    def _edited(self, name: str, text: str, axes: str | None) -> _Made:
        raise NotImplementedError

    def translate(self, by: Sequence[float], *, axes: str | None = None) -> _Made:
        """Moves the splat by (x, y, z)."""
        return self._edited("--translate", _numbers("translate", by, "x, y, z", 3), axes)

    def rotate(self, degrees: Sequence[float], *, axes: str | None = None) -> _Made:
        """Rotates the splat about the world's origin: degrees about the fixed x axis, then y, then z. Harmonics rotate with it."""
        return self._edited("--rotate", _numbers("rotate", degrees, "degrees about x, y, z", 3), axes)

    def scale(self, factor: float) -> _Made:
        """Scales positions and lengths about the world's origin."""
        return self._edited("--scale", _number("scale", factor), None)

    def mirror(self, axis: Literal["x", "y", "z"], *, axes: str | None = None) -> _Made:
        """Mirrors the splat along an axis, at the plane through the origin."""
        return self._edited("--mirror", str(axis), axes)

    def turn_up(self, direction: str | Sequence[float], *, axes: str | None = None) -> _Made:
        """Rotates the splat the shortest way so that a direction (x, y, z), or an axis such as "-z", becomes up (−y of the arrays),
        and records it in a comment. ``--up`` on the command line."""
        text = direction if isinstance(direction, str) else _numbers("turn_up", direction, "x, y, z or an axis", 3)
        return self._edited("--up", text, axes)

    def move_origin(self, point: Sequence[float], *, axes: str | None = None) -> _Made:
        """Moves the splat so that a point becomes 0, 0, 0. ``--origin`` on the command line."""
        return self._edited("--origin", _numbers("move_origin", point, "x, y, z", 3), axes)

    def crop(
        self,
        *,
        box: Sequence[float | None] | Sequence[Sequence[float]] | None = None,
        sphere: Sequence[float] | None = None,
        axes: str | None = None,
    ) -> _Made:
        """Keeps Gaussians in a box (x0, y0, z0, x1, y1, z1) or in a sphere (x, y, z, radius). The box starts with its lower corner;
        None or infinity means no bound."""
        if (box is None) == (sphere is None):
            raise BadArgumentError("crop: expected either a box or a sphere")
        if box is not None:
            return self._edited("--filter-box", _box(box), axes)
        return self._edited("--filter-sphere", _numbers("sphere", sphere, "x, y, z, radius", 4), axes)

    def remove_box(self, box: Sequence[float | None] | Sequence[Sequence[float]], *, axes: str | None = None) -> _Made:
        """Drops Gaussians in a box, given as for :meth:`crop`."""
        return self._edited("--remove-box", _box(box), axes)

    def filter_nan(self) -> _Made:
        """Drops Gaussians with NaN or infinite values, or a zero quaternion."""
        return self._edited("--filter-nan", "", None)

    def filter_value(self, property: str, comparison: Comparison, value: float, *, axes: str | None = None) -> _Made:
        """Keeps Gaussians for which ``property comparison value`` holds. Properties are named as in a PLY: x, opacity (0 to 1),
        scale_0 (a length), f_dc_0 (a colour, 0 to 1), rot_0, f_rest_0. With _raw appended, the stored value is compared."""
        return self._edited("--filter-value", f"{property},{comparison},{_number('filter_value', value)}", axes)

    def filter_harmonics(self, degree: int) -> _Made:
        """Drops harmonics above a degree, 0 to 3."""
        return self._edited("--filter-harmonics", str(degree), None)

    def filter_floaters(self, factor: float = 1) -> _Made:
        """Drops isolated Gaussians (floaters). A factor above 1 drops fewer, below 1 more."""
        text = _number("filter_floaters", factor)
        return self._edited("--filter-floaters", "" if text == "1" else text, None)


class Edit(Edits["Edit"]):
    """A chain of edits of one splat, or of several to merge. :func:`edit` starts it, each method returns a longer chain, and
    :meth:`apply` runs it with a single copy and a single rounding.

    Methods raise BadArgumentError at once for invalid numbers.
    """

    __slots__ = ("_axes", "_clouds", "_steps")

    def __init__(self, clouds: Sequence[Cloud], axes: str, steps: Sequence[_Step] = ()) -> None:
        self._clouds = tuple(clouds)
        self._axes = axes
        self._steps = tuple(steps)

    def _edited(self, name: str, text: str, axes: str | None) -> Edit:
        step = _Step(0, len(self._clouds), name, text, self._axes if axes is None else str(axes))
        _core.check_edit(step.name, step.text, step.axes)
        return Edit(self._clouds, self._axes, (*self._steps, step))

    def merge(self, *others: Cloud | Edit) -> Edit:
        """Appends the Gaussians of others. The edits of an :class:`Edit` among them apply to its own Gaussians only; later edits apply
        to all."""
        clouds, steps = list(self._clouds), list(self._steps)
        for other in others:
            if isinstance(other, Edit):
                steps += [step._replace(first=step.first + len(clouds)) for step in other._steps]
                clouds += other._clouds
            else:
                _check_is_cloud(other)
                clouds.append(other)
        return Edit(clouds, self._axes, steps)

    def apply(self, *, threads: int = 0, progress: ProgressLike = None) -> tuple[Cloud, Report]:
        """Runs all edits. The splats given are not changed.

        Returns the result, which may have no Gaussians, and a :class:`Report`, whose ``report["actions"]`` counts the Gaussians
        that each edit removed and left. threads: CPU threads, 0: all; the result does not depend on them. Raises
        BadArgumentError for a property that a splat does not have.
        """
        from ._cloud import Cloud

        with run(threads, progress) as how:
            parts, report = _core.edit(list(self._clouds), list(self._steps), how)
        return Cloud._of(parts), Report._of(report)

    def __repr__(self) -> str:
        gaussians = sum(map(len, self._clouds))
        return f"<anchorsplat.Edit: {len(self._steps)} edits of {gaussians:,} Gaussians>"


def _check_is_cloud(thing: object) -> None:
    from ._cloud import Cloud

    if not isinstance(thing, Cloud):
        raise TypeError(f"expected an anchorsplat.Cloud, found {type(thing).__name__}")


def edit(*clouds: Cloud, axes: str = "RDF") -> Edit:
    """Starts a chain of edits of a splat, or of several to merge.

        small, report = anchorsplat.edit(cloud).rotate((0, 90, 0)).scale(0.5).crop(sphere=(0, 0, 0, 3)).apply()

    axes: axes of the numbers in edits, for x, y and z one of Right or Left, Up or Down, Front or Back: "RDF" as in the arrays,
    "LUF" as on the command line.

    Raises BadArgumentError: no splat, or invalid axes.
    """
    if not clouds:
        raise BadArgumentError("edit: expected a splat, or several to merge")
    for cloud in clouds:
        _check_is_cloud(cloud)
    _core.check_edit("--mirror", "x", str(axes))  # raises for invalid axes
    return Edit(clouds, axes)
