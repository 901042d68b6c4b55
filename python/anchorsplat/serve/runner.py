"""Where jobs run: in processes of this machine, or of a Ray cluster's (ray_runner.py)."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from .process import Limits, Outcome, run

#: Left by a job that was stopped in order, for the next attempt to go on from.
STATE = "state"


@dataclass(frozen=True)
class Task:
    words: list[str]  # for the program, after its name
    limits: Limits
    folder: Path  # to run in; files of a result are left here
    stdin: Path | None
    links: dict[str, Path]  # further inputs, by their names in the folder


class Runner(Protocol):
    def run(self, task: Task, on_progress: Callable[[dict], None], stopped: Callable[[], bool]) -> Outcome:
        """Blocks until it is over, in a thread that lives at least as long."""

    def close(self) -> None: ...


class LocalRunner:
    def __init__(self, program: Path):
        self._program = program

    def run(self, task: Task, on_progress: Callable[[dict], None], stopped: Callable[[], bool]) -> Outcome:
        return run_in_folder(self._program, task, on_progress, stopped)

    def close(self) -> None:
        pass


def run_in_folder(program: Path, task: Task, on_progress, stopped) -> Outcome:
    clear(task.folder)
    for name, path in task.links.items():
        os.link(path, task.folder / name)
    return run(
        [str(program), *task.words],
        folder=task.folder,
        limits=task.limits,
        stdin=task.stdin,
        on_progress=on_progress,
        stopped=stopped,
    )


def clear(folder: Path) -> None:
    """Makes the folder, or empties it of all but the state to go on from."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    for path in folder.iterdir():
        if path.is_dir():
            shutil.rmtree(path)
        elif path.name != STATE:
            path.unlink()


def leave_result(task: Task) -> None:
    """Takes away what was there for the job only."""
    for name in (*task.links, STATE):
        (task.folder / name).unlink(missing_ok=True)
