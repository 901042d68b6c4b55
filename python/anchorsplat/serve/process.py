"""Runs the program of a job in a process with limits, here and on Ray."""

from __future__ import annotations

import json
import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

_LAUNCH = Path(__file__).with_name("launch.py")
_MOST_OUTPUT = 8 * 2**20  # most bytes kept of stdout
_MOST_MESSAGES = 200
_LONGEST_LINE = 64 * 1024
_LOOK_SECONDS = 0.1  # between checks of the clock and of `stopped`
_STOP_SECONDS = 5.0  # for a program to stop cleanly


@dataclass(frozen=True)
class Limits:
    seconds: float
    memory: int  # bytes of address space
    cpu_seconds: int
    file_bytes: int  # largest file that it writes


@dataclass
class Outcome:
    """How it ended. `code` is the exit code, negative for a signal; `why` is 'timeout' or 'stopped' if we ended it."""

    code: int
    why: str | None = None
    document: Any = None  # its JSON output
    messages: list[tuple[str, str]] = field(default_factory=list)  # (level, text)
    seconds: float = 0.0
    peak_bytes: int = 0  # resident

    @property
    def done(self) -> bool:
        return self.code == 0 and self.why is None

    @property
    def error(self) -> str:
        """The program's error message; empty if there is none."""
        return next((text for level, text in reversed(self.messages) if level == "error"), "")


class _Events:
    """Parses stderr of --progress json line by line. Other lines are kept as messages."""

    def __init__(self, on_progress: Callable[[dict], None]):
        self.messages: list[tuple[str, str]] = []
        self._on_progress = on_progress
        self._rest = b""

    def feed(self, data: bytes) -> None:
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._rest = self._rest[:_LONGEST_LINE]
        for line in lines:
            self._line(line)

    def end(self) -> None:
        self._line(self._rest)

    def _line(self, line: bytes) -> None:
        text = line.decode("utf-8", "replace").strip()
        if not text:
            return
        try:
            event = json.loads(text)
        except ValueError:
            event = None
        if isinstance(event, dict) and "task" in event:
            self._on_progress(event)
        elif len(self.messages) < _MOST_MESSAGES:
            known = isinstance(event, dict) and isinstance(event.get("message"), str)
            self.messages.append((str(event.get("level")), event["message"]) if known else ("info", text))


def _document(output: bytes) -> Any:
    try:
        return json.loads(output)
    except ValueError:
        return None


def run(
    words: list[str],
    *,
    folder: Path,
    limits: Limits,
    stdin: Path | None = None,
    on_progress: Callable[[dict], None] = lambda event: None,
    stopped: Callable[[], bool] = lambda: False,
) -> Outcome:
    """Runs `words` in `folder`. Returns when the process has ended, however it ended.

    Asked to stop it gets SIGTERM, and SIGKILL some seconds later; out of time, SIGKILL. It dies with this process.
    """
    begin = time.monotonic()
    limit_words = [str(os.getpid()), str(limits.memory), str(limits.cpu_seconds), str(limits.file_bytes)]
    with open(stdin if stdin is not None else os.devnull, "rb") as source:
        process = subprocess.Popen(
            [sys.executable, "-I", "-S", str(_LAUNCH), *limit_words, *words],
            cwd=folder,
            stdin=source,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            # Without the service's environment, which may contain a token.
            env={"PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", "HOME": "/nonexistent", "TMPDIR": str(folder)},
            start_new_session=True,
        )
    try:
        return _follow(process, begin, limits, on_progress, stopped)
    except BaseException:  # the caller is stopped, so stop the process
        if process.returncode is None:
            _signal(process, signal.SIGKILL)
            _reap(process, float("inf"))
        raise


def _follow(process: subprocess.Popen, begin: float, limits: Limits, on_progress, stopped) -> Outcome:
    events = _Events(on_progress)
    output = bytearray()
    why = None
    kill_at = begin + limits.seconds
    assert process.stdout is not None and process.stderr is not None  # both are pipes
    with selectors.DefaultSelector() as selector, process.stdout, process.stderr:
        selector.register(process.stdout, selectors.EVENT_READ, "out")
        selector.register(process.stderr, selectors.EVENT_READ, "err")
        while selector.get_map():
            for key, _ in selector.select(_LOOK_SECONDS):
                data = os.read(key.fd, 65536)
                if not data:
                    selector.unregister(key.fileobj)
                elif key.data == "err":
                    events.feed(data)
                elif len(output) < _MOST_OUTPUT:
                    output += data
            now = time.monotonic()
            if why is None and stopped():
                why, kill_at = "stopped", min(kill_at, now + _STOP_SECONDS)
                _signal(process, signal.SIGTERM)
            if now >= kill_at:
                why = why or "timeout"
                _signal(process, signal.SIGKILL)
                kill_at = float("inf")
        # It may have closed its pipes but still run.
        code, usage = _reap(process, kill_at)
    events.end()
    return Outcome(
        code=code,
        why="timeout" if code == -signal.SIGXCPU else why,
        document=_document(bytes(output)),
        messages=events.messages,
        seconds=time.monotonic() - begin,
        peak_bytes=usage.ru_maxrss * 1024,
    )


def _signal(process: subprocess.Popen, number: int) -> None:
    """Signals its whole group. It is not reaped yet, so its id is still valid."""
    try:
        os.killpg(process.pid, number)
    except ProcessLookupError:
        pass


def _reap(process: subprocess.Popen, kill_at: float):
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            break
        if time.monotonic() >= kill_at:
            _signal(process, signal.SIGKILL)
            kill_at = float("inf")
        time.sleep(0.002)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage
