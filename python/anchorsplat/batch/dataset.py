"""`anchorsplat batch dataset`: the objects of `anchorsplat dataset build`, each a task."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from .engine import engine
from .enhance import How
from .process import ProcessJob, SharedFolder, ask, run_processes, shared_folder
from .report import BatchReport

_DONE_WITH = (".job", ".log", ".lock")


def build(meshes: Sequence[str], out: str, options: Sequence[str], how: How, *, overwrite: bool = False,
          retry: bool = False, timeout: float = 14400, memory: int = 2 << 30) -> BatchReport:  # fmt: skip
    """Results are in the data set's manifest.jsonl and failures.jsonl. Raises Stopped when interrupted; the same command
    continues."""
    begin = time.monotonic()
    how.check()
    target = shared_folder(out)
    command = ["dataset", "build", *map(str, meshes), "-o", target, *options, "--plan", "--json"]
    again = [*(["--overwrite"] if overwrite else []), *(["--retry"] if retry else [])]
    plan = ask([*command, *again])
    wanted = plan["wanted"]
    failures: list[dict[str, Any]] = []

    def done(job: ProcessJob, row: dict[str, Any]) -> None:
        name = next(o for o in wanted if o["name"] == job.name)
        if row["state"] == "failed":
            failures.append({**row, "output": job.name, "input": name["source"]})
            _add_failure(target, name, row["error"]["message"])
        else:
            for ending in _DONE_WITH:
                with contextlib.suppress(OSError):
                    Path(_building(target, job.name) + ending).unlink()

    try:
        if wanted:
            with SharedFolder(target) as shared:

                def stages() -> Iterator[list[ProcessJob]]:
                    yield [_job(o, shared, how, timeout) for o in wanted if not o["base"]]
                    missing = {f["output"] for f in failures}
                    derived = [o for o in wanted if o["base"]]
                    for o in derived:
                        if o["base"] in missing:
                            _add_failure(target, o, f"is made from {o['base']}, which is missing", stage="base")
                            failures.append({"output": o["name"], "input": o["source"], "error": {"code": "not_found"}})
                    yield [_job(o, shared, how, timeout) for o in derived if o["base"] not in missing]

                run_processes(stages, len(wanted), how, done, what="data set", memory=memory)
    finally:
        after = ask(command)  # brings the data set's lists up to date
    made = len(wanted) - len(after["wanted"]) - len(failures)
    return BatchReport(plan["objects"], made, after["failed"], plan["there_already"],
                       round(time.monotonic() - begin, 3), f"{target}/manifest.jsonl", failures)  # fmt: skip


def _building(dataset: str, name: str) -> str:
    return f"{dataset}/.building/{name}"


def _job(wanted: dict[str, str], shared: SharedFolder, how: How, timeout: float) -> ProcessJob:
    arguments = ("dataset", "object", wanted["job"], "-o", shared.path, "--threads", str(how.threads), "--quiet")
    log = _building(shared.path, wanted["name"]) + ".log"
    return ProcessJob(wanted["name"], arguments, engine(), shared.path, shared.token, timeout, log)


def _add_failure(dataset: str, wanted: dict[str, str], message: str, stage: str = "") -> None:
    """Adds a line to failures.jsonl of `dataset build`."""
    if not stage:
        try:
            stage = Path(_building(dataset, wanted["name"]), "stage").read_text()[:100]
        except OSError:
            stage = "mesh"
    row = {"name": wanted["name"], "source": wanted["source"], "stage": stage, "message": message}
    with open(f"{dataset}/failures.jsonl", "a", encoding="utf-8", errors="surrogateescape") as file:
        file.write(json.dumps(row, ensure_ascii=False) + "\n")
