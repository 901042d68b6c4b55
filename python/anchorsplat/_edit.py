"""Edits: what may be done to splats, one after the other."""

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

_Made = TypeVar("_Made")  # of an edit
Comparison = Literal["lt", "lte", "gt", "gte", "eq", "neq"]


class _Step(NamedTuple):
    first: int  # the first cloud that it is done to
    clouds: int  # and how many
    name: str  # "--translate"
    text: str  # "1,0,0"
    axes: str


def _numbers(name: str, values: Any, what: str, count: int) -> str:
    """"1,2.5,0": every digit of them. Raises BadArgumentError."""
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
    """The edits of a :class:`Cloud`, each of which gives a new one, and of an :class:`Edit`, which gathers them.

    Numbers are along the axes of the arrays, RDF (x right, y down, z forward), unless `axes` says others: three letters for
    x, y and z. With ``axes="LUF"`` they are those of the command line and of splat-transform. docs/edit.md tells more.
    """

    __slots__ = ()

    def _edited(self, name: str, text: str, axes: str | None) -> _Made:
        raise NotImplementedError

    def translate(self, by: Sequence[float], *, axes: str | None = None) -> _Made:
        """Moves it by (x, y, z)."""
        return self._edited("--translate", _numbers("translate", by, "x, y, z", 3), axes)

    def rotate(self, degrees: Sequence[float], *, axes: str | None = None) -> _Made:
        """Turns it about the world's origin: by degrees about x first, then y, then z, all of which stand still. Harmonics turn
        with it."""
        return self._edited("--rotate", _numbers("rotate", degrees, "degrees about x, y, z", 3), axes)

    def scale(self, factor: float) -> _Made:
        """Scales it about the world's origin, positions and lengths."""
        return self._edited("--scale", _number("scale", factor), None)

    def mirror(self, axis: Literal["x", "y", "z"], *, axes: str | None = None) -> _Made:
        """Mirrors it along an axis; the plane through the origin stays."""
        return self._edited("--mirror", str(axis), axes)

    def turn_up(self, direction: str | Sequence[float], *, axes: str | None = None) -> _Made:
        """Turns it the shortest way so that a direction (x, y, z), or an axis as "-z", becomes up, and says so in a comment. Up is
        −y of the arrays. The command line's ``--up``."""
        text = direction if isinstance(direction, str) else _numbers("turn_up", direction, "x, y, z or an axis", 3)
        return self._edited("--up", text, axes)

    def move_origin(self, point: Sequence[float], *, axes: str | None = None) -> _Made:
        """Moves it so that a point becomes 0, 0, 0. The command line's ``--origin``."""
        return self._edited("--origin", _numbers("move_origin", point, "x, y, z", 3), axes)

    def crop(
        self,
        *,
        box: Sequence[float | None] | Sequence[Sequence[float]] | None = None,
        sphere: Sequence[float] | None = None,
        axes: str | None = None,
    ) -> _Made:
        """Keeps what lies in a box, (x0, y0, z0, x1, y1, z1) with the lower corner first, where None or infinity is no border; or
        what lies in a sphere (x, y, z, radius)."""
        if (box is None) == (sphere is None):
            raise BadArgumentError("crop: expected either a box or a sphere")
        if box is not None:
            return self._edited("--filter-box", _box(box), axes)
        return self._edited("--filter-sphere", _numbers("sphere", sphere, "x, y, z, radius", 4), axes)

    def remove_box(self, box: Sequence[float | None] | Sequence[Sequence[float]], *, axes: str | None = None) -> _Made:
        """Drops what lies in a box, which is said as for :meth:`crop`."""
        return self._edited("--remove-box", _box(box), axes)

    def filter_nan(self) -> _Made:
        """Drops Gaussians with a value that is no number or infinite, or a quaternion of zero."""
        return self._edited("--filter-nan", "", None)

    def filter_value(self, property: str, comparison: Comparison, value: float, *, axes: str | None = None) -> _Made:
        """Keeps Gaussians of which ``property comparison value`` holds, by the names of a PLY: x, opacity (0 to 1), scale_0 (a
        length), f_dc_0 (a colour, 0 to 1), rot_0, f_rest_0; with _raw behind the name the value is the stored one."""
        return self._edited("--filter-value", f"{property},{comparison},{_number('filter_value', value)}", axes)

    def filter_harmonics(self, degree: int) -> _Made:
        """Drops harmonics above a degree, 0 to 3."""
        return self._edited("--filter-harmonics", str(degree), None)

    def filter_floaters(self, factor: float = 1) -> _Made:
        """Drops Gaussians that hang in the air. A factor above 1 finds fewer, one below 1 more of them."""
        text = _number("filter_floaters", factor)
        return self._edited("--filter-floaters", "" if text == "1" else text, None)


class Edit(Edits["Edit"]):
    """Edits to come, of one splat or of several that become one: :func:`edit` begins it, every method gives a longer one, and
    :meth:`apply` does all of it with a single copy. Nothing is done before; each value is rounded once.

    Raises BadArgumentError at once for numbers that make no sense.
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
        """Puts the Gaussians of others behind these. An :class:`Edit` among them is done to its own ones only; what follows here
        is done to all."""
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
        """Does them all. The splats stay as they are.

        Returns the result, which may have no Gaussians, and a :class:`Report`: ``report["actions"]`` says of each what it has
        taken away and what was left. threads: at most; 0: all of the machine; the result does not depend on it. Raises
        BadArgumentError for a property that a splat has not.
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
    """Begins edits of a splat, or of several that become one.

        small, report = anchorsplat.edit(cloud).rotate((0, 90, 0)).scale(0.5).crop(sphere=(0, 0, 0, 3)).apply()

    axes: those along which the numbers of the edits are, for x, y and z each Right or Left, Up or Down, Front or Back: "RDF",
    those of the arrays; "LUF", those of the command line.

    Raises BadArgumentError: no splat, axes that are none.
    """
    if not clouds:
        raise BadArgumentError("edit: expected a splat, or several that become one")
    for cloud in clouds:
        _check_is_cloud(cloud)
    _core.check_edit("--mirror", "x", str(axes))  # says what is wrong with axes
    return Edit(clouds, axes)
