"""`anchorsplat batch eval`: the pairs of object and method of `anchorsplat eval`, each a task."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .engine import engine, program
from .enhance import STATE_FOLDER, How
from .process import ProcessJob, SharedFolder, ask, run_processes, shared_folder
from .report import BatchReport


def evaluate(benchmark: str, out: str, options: Sequence[str], how: How, *, overwrite: bool = False, json: bool = False,
             memory: int = 2 << 30, tables: Any = None) -> tuple[BatchReport, int]:  # fmt: skip
    """Measures, then lets `anchorsplat eval` write and print the tables, to the file object `tables` or to stdout. The second
    result is its exit code. Raises Stopped when interrupted; the same command continues."""
    begin = time.monotonic()
    how.check()
    source, target = shared_folder(benchmark), shared_folder(out)
    plan = ask(["eval", source, "-o", target, *options, "--plan", "--json"])
    narrowed = [word for word in options if word.partition("=")[0] not in ("--methods", "--objects", "--choose-f")]
    failures: list[dict[str, Any]] = []
    places: dict[str, tuple[Path, Path]] = {}

    def done(job: ProcessJob, row: dict[str, Any]) -> None:
        part, results = places[job.name]
        if row["state"] == "failed":
            failures.append({**row, "output": job.name, "input": source})
        else:
            for made in sorted((part / "objects" / results.name).iterdir(), key=lambda path: path.suffix == ".json"):
                _move(made, results / made.name)
            shutil.rmtree(part)

    with SharedFolder(target) as shared:
        jobs = []
        for name in plan["objects"]:
            results = Path(target) / "objects" / name
            results.mkdir(parents=True, exist_ok=True)
            for method in plan["methods"]:
                part = Path(target) / STATE_FOLDER / f"{name}--{method['file']}"
                _begin_with(part / "objects" / name, results, method["file"])
                label = f"{name}, {method['file']}"
                places[label] = (part, results)
                arguments = ["eval", source, "-o", str(part), *narrowed, f"--methods={method['word']}", f"--objects={name}",
                             "--json", "--threads", str(how.threads), *(["-w"] if overwrite else [])]  # fmt: skip
                jobs.append(ProcessJob(label, tuple(arguments), engine(), target, shared.token))
        counts = run_processes(lambda: iter([jobs]), len(jobs), how, done, what="eval", memory=memory)
    # Only failed pairs are missing now. They are retried once, so that the tables give the reason.
    last = subprocess.run(
        [program(), "eval", source, "-o", target, *options, *(["--json"] if json else [])],
        stdout=tables, stderr=None if failures or not how.quiet else subprocess.DEVNULL,
    )  # fmt: skip
    seconds = round(time.monotonic() - begin, 3)
    return BatchReport(counts.total, counts.done, counts.failed, 0, seconds, f"{target}/results.json", failures), last.returncode


def _begin_with(part: Path, results: Path, method: str) -> None:
    """Copies files of this pair from an earlier run: finished results are kept, fits resume."""
    part.mkdir(parents=True, exist_ok=True)
    for there in results.iterdir():
        mine = there.name == "truth.png" or there.name == method or there.name.startswith(f"{method}.")
        if not mine or (part / there.name).exists():
            continue
        if there.is_dir():
            shutil.copytree(there, part / there.name)
        else:
            shutil.copy2(there, part / there.name)


def _move(made: Path, to: Path) -> None:
    if made.is_dir() and to.is_dir():
        shutil.rmtree(to)
    os.replace(made, to)
