"""Runs calls of the engine: threads, device, progress, messages."""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from typing import Any, Literal, NamedTuple, Union

from . import _core
from ._errors import SplatWarning
from ._gpu import tell_library
from ._words import option_words, whole_number

LOGGER = logging.getLogger("anchorsplat")
_HERE = os.path.dirname(__file__) + os.sep


class Progress(NamedTuple):
    """Progress of a task. The tasks of a call run one after the other."""

    task: str  #: "fit"
    done: int  #: steps
    total: int  #: 0: not known
    note: str  #: "27.31 dB, 84,120 Gaussians"
    ended: bool


#: ``True``: a tqdm bar. A class such as ``tqdm.tqdm``: one bar per task. A bar: the same one for all tasks. A function: called with
#: a :class:`Progress`. ``None``, ``False``: nothing.
ProgressLike = Union[None, bool, Callable[[Progress], object], Any]

#: Device that rasterizes (docs/gpu.md): "cpu"; "gpu", the first usable one; "auto", a hardware GPU, else the CPU; or the number of
#: an adapter in ``anchorsplat doctor``.
DeviceLike = Union[Literal["cpu", "gpu", "auto"], int]


def warn(sentence: str) -> None:
    """Warns at the line of the user's code that called this package."""
    level, frame = 1, sys._getframe(0)
    while frame is not None and frame.f_code.co_filename.startswith(_HERE):
        level, frame = level + 1, frame.f_back  # type: ignore[assignment]
    warnings.warn(sentence, SplatWarning, stacklevel=level)


class _Bars:
    """Shows progress in a tqdm-like bar."""

    def __init__(self, kind: Any) -> None:
        self._make = kind if isinstance(kind, type) else None
        self._bar: Any = None if self._make else kind
        self._task: str | None = None

    def __call__(self, progress: Progress) -> None:
        if self._task is None:
            self._task = progress.task
            if self._make:
                self._bar = self._make(total=progress.total or None, desc=progress.task)
            else:
                if hasattr(self._bar, "reset"):
                    self._bar.reset(total=progress.total or None)
                if hasattr(self._bar, "set_description_str"):
                    self._bar.set_description_str(progress.task)
        if progress.note and hasattr(self._bar, "set_postfix_str"):
            self._bar.set_postfix_str(progress.note, refresh=False)
        self._bar.update(progress.done - self._bar.n)
        if progress.ended:
            self.close()

    def close(self) -> None:
        if self._make and self._bar is not None:
            self._bar.close()
            self._bar = None
        self._task = None


def shower(progress: ProgressLike) -> Callable[[Progress], object] | None:
    if progress is None or progress is False:
        return None
    if progress is True:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            raise ImportError("progress=True needs tqdm: pip install tqdm") from None
        return _Bars(tqdm)
    if hasattr(progress, "update"):
        return _Bars(progress)
    if callable(progress):
        return progress
    raise TypeError("progress: expected True, a tqdm bar or a function, found " + type(progress).__name__)


@contextlib.contextmanager
def run(
    threads: int = 0,
    progress: ProgressLike = None,
    *,
    patient: bool = False,
    device: DeviceLike = "cpu",
    max_gpu_memory: int | str | None = None,
) -> Iterator[_core.RunArguments]:
    """Arguments of one call of the engine. Messages go to the logger "anchorsplat", warnings to ``warnings``."""
    show = shower(progress)
    words = option_words("device", device)
    if max_gpu_memory is not None:
        words += option_words("max_gpu_memory", max_gpu_memory)
    if device != "cpu":
        tell_library()

    def tell(events: list[tuple[Any, ...]]) -> None:
        for event in events:
            if event[0] == "task":
                if show is not None:
                    show(Progress(*event[1:]))
            elif event[0] == "info":
                LOGGER.info("%s", event[1])
            else:
                warn(event[1])

    try:
        yield _core.RunArguments(whole_number("threads", threads), tell, patient, words)
    finally:
        if isinstance(show, _Bars):
            show.close()
