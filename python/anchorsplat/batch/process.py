"""Tasks on folders: a command of the program each, on files that every machine finds under the same path."""

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
    folder: str  # that all machines share
    token: str  # of a file in it, which shows that they do
    timeout: float = 0  # seconds; 0: any
    log: str | None = None


def run_process(job: ProcessJob) -> dict[str, Any]:
    """A row: state "done", or "failed" with its error."""
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
    """The last thing that a program said."""
    try:
        lines = [line.strip() for line in log.read_text("utf-8", "replace").splitlines() if line.strip()]
    except OSError:
        return []
    return [lines[-1].removeprefix("error: ")] if lines else []


def shared_folder(path: str) -> str:
    """Absolute. Errors: BadArgumentError: not a path."""
    if not storage.is_local(path):
        raise BadArgumentError(f"{path}: has to be a folder that all machines share, not a URL")
    return storage.absolute(path)


def ask(arguments: Sequence[str]) -> dict[str, Any]:
    """What the program answers in JSON. Errors: its own, by its code."""
    ended = run(list(arguments))
    ended.raise_for_code()
    if not isinstance(ended.document, dict):
        raise BadFileError("the program's answer is no JSON")
    return ended.document


class SharedFolder:
    """A folder of results, marked for as long as a batch works there, so that a worker can tell whether it sees the same.

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
            for left in self._state.glob("token-*"):  # of a batch that was killed
                left.unlink()
            (self._state / self.token).touch()
        except BlockingIOError:
            self._lock.close()
            raise ExistsError(f"{self.path}: another batch is at work here") from None
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
    """Runs lists of jobs one after the other, as the generator `stages` gives them: each list when the one before it has
    ended. Jobs of the same list run side by side, and those that failed are said."""
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
