"""Tasks that run one command each, on files with the same path on every machine."""

from __future__ import annotations

import fcntl
import os
import secrets
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .._errors import BadArgumentError, BadFileError, Error, ExistsError, IoError
from . import cluster, storage
from .engine import Ended, Engine, engine, run
from .enhance import STATE_FOLDER, How
from .progress import Counts, Progress
from .scheduler import run_tasks, signals_interrupt
from .task import failed


@dataclass(frozen=True)
class ProcessJob:
    """One command."""

    name: str  # in messages
    arguments: tuple[str, ...]
    engine: Engine
    folder: str  # shared by all machines
    token: str  # name of a file in it that proves it
    timeout: float = 0  # seconds; 0: none
    log: str | None = None


def run_process(job: ProcessJob) -> dict[str, Any]:
    """Runs the command. Returns a row: state "done", or "failed" with its error."""
    begin = time.time()
    row: dict[str, Any] = {"name": job.name, "worker": f"{socket.gethostname()}:{os.getpid()}"}
    if engine() != job.engine:
        row.update(failed("other_version", f"{socket.gethostname()} has another anchorsplat; install the same everywhere"))
    elif not (Path(job.folder) / STATE_FOLDER / job.token).exists():
        text = f"{job.folder} is not the same folder on {socket.gethostname()}; use one that all machines share"
        row.update(failed("not_shared", text))
    else:
        try:
            ended = run(list(job.arguments), timeout=job.timeout, log=Path(job.log) if job.log else None)
            row.update(_outcome(job, ended))
        except (Error, OSError) as error:
            row.update(failed("io", str(error)))
    row["seconds"] = round(time.time() - begin, 3)
    return row


def _outcome(job: ProcessJob, ended: Ended) -> dict[str, Any]:
    if not ended.code and not ended.signal:
        return {"state": "done"}
    if job.log and not ended.messages:
        ended.messages[:] = last_words(Path(job.log))
    return {"state": "failed", "error": ended.error()}


def last_words(log: Path) -> list[str]:
    """Last line of a program's output."""
    try:
        lines = [line.strip() for line in log.read_text("utf-8", "replace").splitlines() if line.strip()]
    except OSError:
        return []
    return [lines[-1].removeprefix("error: ")] if lines else []


def shared_folder(path: str) -> str:
    """Absolute path. Raises BadArgumentError if it is not a path."""
    if not storage.is_local(path):
        raise BadArgumentError(f"{path}: must be a folder shared by all machines, not a URL")
    return storage.absolute(path)


def ask(arguments: Sequence[str]) -> dict[str, Any]:
    """JSON output of the program. Raises its error, by exit code."""
    ended = run(list(arguments))
    ended.raise_for_code()
    if not isinstance(ended.document, dict):
        raise BadFileError("the program's output is not JSON")
    return ended.document


class SharedFolder:
    """A folder of results, marked during a batch so that a worker can check that it sees the same folder.

    Errors: ExistsError: another batch is at work there; IoError.
    """

    def __init__(self, path: str) -> None:
        self.path = path
        self.token = f"token-{secrets.token_hex(8)}"
        self._state = Path(path) / STATE_FOLDER

    def __enter__(self) -> SharedFolder:
        try:
            self._state.mkdir(parents=True, exist_ok=True)
            self._lock = open(self._state / "lock", "wb")
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            for left in self._state.glob("token-*"):  # left by a killed batch
                left.unlink()
            (self._state / self.token).touch()
        except BlockingIOError:
            self._lock.close()
            raise ExistsError(f"{self.path}: another batch is running here") from None
        except OSError as error:
            raise IoError(f"{self.path}: {error.strerror}") from error
        return self

    def __exit__(self, *_: object) -> None:
        (self._state / self.token).unlink(missing_ok=True)
        (self._state / "lock").unlink(missing_ok=True)
        self._lock.close()
        if not any(self._state.iterdir()):
            self._state.rmdir()


def run_processes(
    stages: Callable[[], Any],
    total: int,
    how: How,
    ended: Callable[[ProcessJob, dict[str, Any]], None],
    *,
    what: str,
    memory: int,
) -> Counts:
    """Runs the lists of jobs from the generator `stages` one after the other. Jobs of one list run in parallel. Failed jobs are
    reported."""
    counts = Counts(total)
    progress = Progress(what, counts, quiet=how.quiet, show=how.show)

    def take(job: ProcessJob, row: dict[str, Any]) -> None:
        row = {"name": job.name, **row}
        if row["state"] == "done":
            counts.done += 1
        else:
            counts.failed += 1
            progress.message(f"error: {job.name}: {row['error']['message']}")
        ended(job, row)
        progress.step()

    with cluster.connected(how.ray, how.cpus) as ray, signals_interrupt():
        task = ray.remote(run_process).options(
            num_cpus=how.threads,
            memory=min(memory, cluster.memory_of_largest_machine(ray)),
            max_retries=how.retries,
            name=f"anchorsplat {what}",
        )
        try:
            for jobs in stages():
                run_tasks(
                    ray, jobs, task.remote, take, lambda: how.in_flight or 2 * max(1, cluster.slots(ray, how.threads))
                )
        finally:
            progress.close()
    return counts
