"""Progress of a batch: one updated line on a terminal, an occasional line in a log."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from collections.abc import Callable
from typing import TextIO

from .._run import Progress as Told

Show = Callable[[Told], object]

_ON_TERMINAL = 0.2  # seconds between updates of the line
_IN_LOG = 15.0


@dataclass
class Counts:
    """Counts of the inputs of one run."""

    total: int = 0
    done: int = 0
    failed: int = 0
    skipped: int = 0  # already up to date

    @property
    def left(self) -> int:
        return self.total - self.done - self.failed - self.skipped


def duration(seconds: float) -> str:
    whole = int(seconds + 0.5)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


class Progress:
    def __init__(self, what: str, counts: Counts, *, quiet: bool = False, stream: TextIO | None = None, show: Show | None = None):
        """`show` replaces writing to the stream."""
        self._what, self._counts, self._quiet, self._show_to = what, counts, quiet, show
        self._stream = stream or sys.stderr
        self._terminal = self._stream.isatty()
        self._begin = self._said = time.monotonic()
        self._shown = ""

    def line(self) -> str:
        c = self._counts
        worked = c.done + c.failed
        seconds = time.monotonic() - self._begin
        parts = [f"{self._what}: {worked + c.skipped:,} of {c.total:,}"]
        told = [f"{n:,} {word}" for n, word in ((c.failed, "failed"), (c.skipped, "there already")) if n]
        if told:
            parts.append(f"({', '.join(told)})")
        text = " ".join(parts)
        if worked and seconds > 0:
            rate = worked / seconds
            text += f", {rate:.1f}/s" if rate >= 1 else f", one in {1 / rate:.0f} s"
            if c.left:
                text += f", {duration(c.left / rate)} to go"
        return text

    def step(self) -> None:
        if self._show_to is not None:
            self._show_to(self._state(ended=False))
            return
        now = time.monotonic()
        if self._quiet or now - self._said < (_ON_TERMINAL if self._terminal else _IN_LOG):
            return
        self._said = now
        self._show(self.line())

    def _state(self, ended: bool) -> Told:
        c = self._counts
        return Told(self._what, c.total - c.left, c.total, f"{c.failed:,} failed" if c.failed else "", ended)

    def message(self, text: str) -> None:
        """Prints a permanent line."""
        if self._terminal and self._shown and not self._quiet:
            self._stream.write("\r\x1b[K")
            self._shown = ""
        self._stream.write(printable(text) + "\n")
        self._stream.flush()

    def close(self) -> None:
        if self._show_to is not None:
            self._show_to(self._state(ended=True))
        elif not self._quiet and self._terminal and self._shown:
            self._stream.write("\r\x1b[K")
            self._stream.flush()

    def _show(self, text: str) -> None:
        self._stream.write("\r\x1b[K" + text if self._terminal else text + "\n")
        self._stream.flush()
        self._shown = text


def printable(text: str) -> str:
    """Text with terminal controls escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape", "backslashreplace").decode() for c in text)
