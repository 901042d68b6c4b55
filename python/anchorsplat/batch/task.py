"""What a worker does with one splat, independent of Ray."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import socket
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .._errors import Error, IoError
from . import storage
from .engine import Ended, Engine, engine, run


@dataclass(frozen=True)
class SplatJob:
    """One splat, with all that a worker needs."""

    output: str  # name of the result
    input: str  # address
    target: str  # address of the folder of results
    arguments: tuple[str, ...]  # of `enhance`, without files
    files: tuple[tuple[str, str, str], ...]  # option, address, identity of files of options
    engine: Engine
    threads: int
    memory: int  # expected bytes
    identity: str
    fingerprint: str
    work: str | None = None  # folder beside the results for unfinished files; None: one of this machine
    checkpoint: str | None = None  # state of an interrupted refinement
    known_sha256: str = ""  # of the input of the existing result, if made with the same options
    known_output_sha256: str = ""
    verify: bool = False  # also read the existing result
    content: bytes | None = field(default=None, repr=False)  # of an input in memory of the driver

    def base_row(self) -> dict[str, Any]:
        return {"output": self.output, "input": self.input, "identity": self.identity, "fingerprint": self.fingerprint}


class ProgramKilledError(storage.TransientError):
    """The program was killed, for example by a system short of memory."""

    code = "killed"


# A task may use this much more than expected before the system refuses memory.
_MEMORY_SLACK = 4
_LEAST_MEMORY = 2 << 30


def enhance_one(job: SplatJob) -> dict[str, Any]:
    """Fetches the input, runs the program and stores the result. Always returns a row of the manifest.

    Raises only TransientError, when storage failed in a way that may pass or the program was killed.
    """
    begin = time.time()
    row = {**job.base_row(), "worker": f"{socket.gethostname()}:{os.getpid()}"}
    try:
        row.update(_enhance(job))
    except (Error, OSError) as error:
        row.update(failed("io" if type(error) in (IoError, OSError) else _code(error), str(error)))
    row["seconds"] = round(time.time() - begin, 4)
    row["time"] = round(time.time(), 3)
    return row


def failed(code: str, message: str) -> dict[str, Any]:
    return {"state": "failed", "error": {"code": code, "message": message}}


def _code(error: BaseException) -> str:
    from .engine import CODES

    return next((name for name, kind in CODES.values() if isinstance(error, kind)), "io")


def _enhance(job: SplatJob) -> dict[str, Any]:
    if engine() != job.engine:
        here = engine()
        return failed(
            "other_version",
            f"this machine has anchorsplat {here.version} ({here.digest}), the batch was begun by "
            f"{job.engine.version} ({job.engine.digest}); install the same package everywhere",
        )
    with _work_folder(job.work) as folder, ThreadPoolExecutor(1) as beside:
        source = _input(job, folder)
        if source.is_fifo() or source.is_socket() or source.is_char_device():  # may never end
            return failed("io", f"{job.input}: is no file that can be read twice")
        size = source.stat().st_size
        hashing = beside.submit(storage.sha256, source)  # in parallel with the program
        if job.known_sha256 and job.known_sha256 == hashing.result() and _result_stands(job, folder):
            return {"state": "done", "unchanged": True, "size": size, "sha256": job.known_sha256}
        result = folder / "result" / Path(job.output).name
        result.parent.mkdir()
        ended = run(_arguments(job, source, result), memory_limit=max(_LEAST_MEMORY, _MEMORY_SLACK * job.memory))
        named = [m.replace(str(source), job.input).replace(str(result), job.output) for m in ended.messages]
        told = {"size": size, "sha256": hashing.result(), "engine_seconds": round(ended.seconds, 4), "messages": named}
        if ended.code or ended.signal:
            error = ended.error()
            if ended.signal == signal.SIGKILL:
                raise ProgramKilledError(f"the program was killed in every attempt: {error['message']}")
            error["message"] = error["message"].replace(str(source), job.input).replace(str(result), job.output)
            return {**told, "state": "failed", "error": error}
        if storage.is_local(job.input) and _identity(job.input) != job.identity:
            return {**told, **failed("changed", f"{job.input}: changed while it was being read; run the batch again")}
        told.update(_report(ended))
        told.update(_put(job, result))
        return {**told, "state": "done"}


def _identity(uri: str) -> str:
    info = storage.stat(uri)
    return storage.identity(info) if info else ""


def _input(job: SplatJob, folder: Path) -> Path:
    """The input as a local file."""
    if job.content is None and storage.is_local(job.input):
        path = Path(job.input)
    else:
        path = folder / "input" / job.input.partition("?")[0].rpartition("/")[2]
        path.parent.mkdir()
        if job.content is not None:
            path.write_bytes(job.content)
        else:
            storage.fetch(job.input, path)
    return path


def _result_stands(job: SplatJob, folder: Path) -> bool:
    if not job.verify:
        return True
    copy = folder / "there"
    if storage.is_local(job.target):
        copy = Path(storage.join(job.target, job.output))
    else:
        storage.fetch(storage.join(job.target, job.output), copy)
    return storage.sha256(copy) == job.known_output_sha256


def _arguments(job: SplatJob, source: Path, result: Path) -> list[str]:
    arguments = ["enhance", str(source), "-o", str(result), "--json", "--threads", str(job.threads), *job.arguments]
    for option, uri, identity in job.files:
        arguments += [option, str(_cached(uri, identity))]
    if job.checkpoint:
        Path(job.checkpoint).parent.mkdir(parents=True, exist_ok=True)
        arguments += ["--checkpoint", job.checkpoint, "--resume"]
    return arguments


def _report(ended: Ended) -> dict[str, Any]:
    """The part of the program's --json for the manifest."""
    document = ended.document
    if isinstance(document, list):
        document = document[0] if document else {}
    if not isinstance(document, dict):
        return {}
    return {name: document[name] for name in ("method", "gaussians", "pixel_size", "upscale") if name in document}


def _put(job: SplatJob, result: Path) -> dict[str, Any]:
    """Moves the program's output to its place, the result itself last."""
    sha256, size = storage.sha256(result), result.stat().st_size
    told: dict[str, Any] = {"output_size": size, "output_sha256": sha256}
    beside = sorted(path for path in result.parent.iterdir() if path != result)
    folder = job.output.rpartition("/")[0]
    if beside:
        told["beside"] = [f"{folder}/{path.name}" if folder else path.name for path in beside]
    if storage.in_driver_only(job.target):
        told["contents"] = {
            (f"{folder}/{path.name}" if folder else path.name): path.read_bytes() for path in [*beside, result]
        }
        return told
    for path in [*beside, result]:
        name = f"{folder}/{path.name}" if folder else path.name
        storage.put(path, storage.join(job.target, name))
    return told


# Folders of this worker process. The next process removes those of ended processes.


@contextlib.contextmanager
def _work_folder(beside_results: str | None) -> Iterator[Path]:
    """A folder for one task, removed afterwards. On the file system of local results, so that they only need renaming."""
    root = Path(beside_results) / _me() if beside_results else _scratch()
    root.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(dir=root))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _me() -> str:
    return f"{socket.gethostname()}-{os.getpid()}"


_scratch_folder: Path | None = None


def _scratch() -> Path:
    """This process's own local folder, in TMPDIR."""
    global _scratch_folder
    if _scratch_folder is None:
        root = Path(tempfile.gettempdir()) / f"anchorsplat-batch-{os.getuid()}"
        root.mkdir(mode=0o700, exist_ok=True)
        state = root.lstat()
        if state.st_uid != os.getuid() or root.is_symlink():
            raise IoError(f"{root}: belongs to another user; set TMPDIR")
        for left in root.iterdir():
            if left.name.isdigit() and not Path(f"/proc/{left.name}").exists():
                shutil.rmtree(left, ignore_errors=True)
        _scratch_folder = root / str(os.getpid())
        _scratch_folder.mkdir(exist_ok=True)
    return _scratch_folder


_KEPT_FILES = 4
_kept: dict[tuple[str, str], Path] = {}


def _cached(uri: str, identity: str) -> Path:
    """Local copy of a file or folder of an option. Weights are fetched once, not for every splat."""
    if storage.is_local(uri):
        return Path(uri)
    key = (uri, identity)
    if key not in _kept:
        while len(_kept) >= _KEPT_FILES:
            shutil.rmtree(_kept.pop(next(iter(_kept))).parent, ignore_errors=True)
        folder = Path(tempfile.mkdtemp(prefix="kept-", dir=_scratch()))
        path = folder / uri.rpartition("/")[2]
        try:
            storage.fetch(uri, path)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        _kept[key] = path
    return _kept[key]
