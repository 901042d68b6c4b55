"""Runs the native program for batches, in a process per splat, so that a bad file cannot crash a worker."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import json
import os
import resource
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .._errors import BadArgumentError, BadFileError, Error, ExistsError, IoError, NotFoundError

#: Exit codes of the program (docs/cli.md): name in rows, exception of this package.
CODES = {
    2: ("bad_argument", BadArgumentError),
    3: ("not_found", NotFoundError),
    4: ("bad_file", BadFileError),
    5: ("exists", ExistsError),
    6: ("io", IoError),
}
INTERRUPTED = 130

_WAIT_TO_STOP = 30.0  # seconds; a refinement first writes its checkpoint
_LOOK_UP = 0.25  # seconds; a blocking system call would not notice Ray's cancellation
_KEPT_MESSAGES = 16_000  # most characters of stderr in a row
_PR_SET_PDEATHSIG = 1
_libc = ctypes.CDLL(None, use_errno=True)


def program() -> Path:
    """Path of the native program of this package, or of ANCHORSPLAT_PROGRAM."""
    named = os.environ.get("ANCHORSPLAT_PROGRAM")
    path = Path(named) if named else Path(os.path.abspath(__file__)).parent.parent / "_bin" / "anchorsplat"
    if not os.access(path, os.X_OK):
        why = "ANCHORSPLAT_PROGRAM names it" if named else "install the package again"
        raise NotFoundError(f"{path}: the program of this package is missing; {why}")
    return path


@dataclass(frozen=True)
class Engine:
    """Identity of the program: version and hash of its bytes, which include the built-in network."""

    version: str
    digest: str


@functools.cache
def engine() -> Engine:
    path = program()
    version = subprocess.run([path, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]
    with open(path, "rb") as file:
        return Engine(version, hashlib.file_digest(file, "sha256").hexdigest()[:16])


@dataclass(frozen=True)
class Ended:
    """How a process of the program ended. `signal` killed it; `document` is its --json output, or None."""

    code: int
    signal: int
    seconds: float
    document: object
    messages: list[str]

    def error(self) -> dict[str, str]:
        """Error code and message for a row."""
        if self.signal:
            said = "; it said: " + " / ".join(self.messages[-3:]) if self.messages else ""
            name = signal.strsignal(self.signal)
            return {"code": "crash", "message": f"the program was ended by signal {self.signal} ({name}){said}"}
        document = self.document
        if isinstance(document, list) and document and isinstance(document[0], dict):
            document = {"error": document[0].get("failure")}
        told = document.get("error") if isinstance(document, dict) else None
        if isinstance(told, dict) and "message" in told:
            return {"code": str(told.get("code", "io")), "message": str(told["message"])}
        name = CODES.get(self.code, ("io", Error))[0]
        return {"code": name, "message": " / ".join(self.messages[-3:]) or f"the program ended with code {self.code}"}

    def raise_for_code(self) -> None:
        if self.code in CODES:
            raise CODES[self.code][1](self.error()["message"])
        if self.code or self.signal:
            raise Error(self.error()["message"])


@functools.cache
def _dying_with_parent() -> list[str]:
    """Prefix for commands that avoids a fork of this process, which takes 9 ms in a Ray worker."""
    helper = shutil.which("setpriv")  # of util-linux
    return [helper, "--pdeathsig", "KILL", "--"] if helper else []


def _die_with_parent(parent: int) -> None:
    _libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def run(arguments: list[str], *, memory_limit: int = 0, timeout: float = 0, log: Path | None = None) -> Ended:
    """Runs the program. It ends with this process, however that ends; on KeyboardInterrupt it first stops cleanly.

    `memory_limit`: bytes that it may allocate, 0: any. `timeout`: seconds, 0: any. `log`: takes its stdout and stderr.
    """
    begin = time.perf_counter()
    with contextlib.ExitStack() as opened:
        process = subprocess.Popen(
            [*_dying_with_parent(), str(program()), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=opened.enter_context(open(log, "wb")) if log else subprocess.PIPE,
            stderr=subprocess.STDOUT if log else subprocess.PIPE,
            preexec_fn=None if _dying_with_parent() else functools.partial(_die_with_parent, os.getpid()),
        )
    try:
        if memory_limit:
            resource.prlimit(process.pid, resource.RLIMIT_DATA, (memory_limit, memory_limit))
        while True:
            try:
                out, err = process.communicate(timeout=_LOOK_UP)
                break
            except subprocess.TimeoutExpired:
                if timeout and time.perf_counter() - begin > timeout:
                    _stop(process)
                    return Ended(6, 0, time.perf_counter() - begin, None, [f"took longer than {timeout:g} seconds"])
    except BaseException:
        _stop(process)
        raise
    text = (err or b"").decode("utf-8", "replace")[-_KEPT_MESSAGES:]
    try:
        document = json.loads(out) if out else None
    except ValueError:
        document = None
    code = process.returncode
    return Ended(max(code, 0), max(-code, 0), time.perf_counter() - begin, document, text.splitlines())


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.communicate(timeout=_WAIT_TO_STOP)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()


@dataclass(frozen=True)
class Option:
    """An option of a verb, as declared by the program."""

    name: str  # "--pixel-size"
    short: str  # "-w" or ""
    kind: str  # "FILE", "INT", "FLOAT"; "": a flag
    several: bool  # takes more than one value


@functools.cache
def _verbs() -> dict[str, Any]:
    return json.loads(subprocess.run([program(), "manual", "json"], capture_output=True, text=True, check=True).stdout)


@functools.cache
def options(*verb: str) -> dict[str, Option]:
    """Options of `anchorsplat VERB` from `anchorsplat manual json`, by each of their long names."""
    declared = _verbs()[verb[0]]
    for word in verb[1:]:
        declared = declared["verbs"][word]
    found = {}
    for option in declared["options"]:
        short = next((name for name in option["names"] if not name.startswith("--")), "")
        for name in option["names"]:
            if name.startswith("--"):
                found[name] = Option(name, short, option["value"], option["many"])
    return found
