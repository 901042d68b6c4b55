"""Runs jobs in local processes, or on a Ray cluster (ray_runner.py)."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from .process import Limits, Outcome, run

#: State that a cleanly stopped job leaves for the next attempt to resume.
STATE = "state"


@dataclass(frozen=True)
class Task:
    words: list[str]  # arguments of the program
    limits: Limits
    folder: Path  # working folder, with the files of the result
    stdin: Path | None
    links: dict[str, Path]  # further inputs, by name in the folder


class Runner(Protocol):
    def run(self, task: Task, on_progress: Callable[[dict], None], stopped: Callable[[], bool]) -> Outcome:
        """Blocks until the job ends. The calling thread must live at least as long."""

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
    """Creates the folder, or empties it except for the state to resume."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    for path in folder.iterdir():
        if path.is_dir():
            shutil.rmtree(path)
        elif path.name != STATE:
            path.unlink()


def leave_result(task: Task) -> None:
    """Removes files that only the job needed."""
    for name in (*task.links, STATE):
        (task.folder / name).unlink(missing_ok=True)
