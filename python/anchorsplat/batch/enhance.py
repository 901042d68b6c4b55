"""`anchorsplat batch enhance` and `batch refine`, in the driver."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import shutil
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import fsspec

from .._errors import BadArgumentError, Error, ExistsError, NotFoundError
from . import cluster, storage
from .inputs import Input, expand
from .manifest import Manifest
from .progress import Counts, Progress, Show
from .report import BatchReport, report_of
from .scheduler import Stopped, run_tasks, signals_interrupt
from .settings import Settings, files_of, settings_of
from .task import SplatJob, enhance_one, failed

STATE_FOLDER = ".batch"  # in the folder of results, while a batch runs
_CLAIMED_AHEAD = 500  # names per line of the manifest
_SHOWN_FAILURES = 20


@dataclasses.dataclass(frozen=True)
class How:
    """Settings of a batch, whatever it makes."""

    ray: str | None = None
    workers: int | None = None
    threads: int = 1
    in_flight: int | None = None
    retries: int = 3
    quiet: bool = False
    show: Show | None = None

    def check(self) -> None:
        for name, value, least in (("workers", self.workers, 1), ("threads", self.threads, 1),
                                   ("in-flight", self.in_flight, 1), ("retries", self.retries, 0)):  # fmt: skip
            if value is not None and value < least:
                raise BadArgumentError(f"--{name} {value}: must be at least {least}")
        if self.ray is not None and self.workers is not None:
            raise BadArgumentError("--workers has no effect with --ray, where the cluster sets the number of workers")

    @property
    def cpus(self) -> int:
        return (self.workers or max(1, cluster.cores() // self.threads)) * self.threads


class SplatBatch:
    """One run over many splats: jobs, their results and the manifest."""

    def __init__(self, target: str, manifest: str | None, settings: Settings, how: How) -> None:
        self.target = storage.absolute(target)
        self.local = storage.is_local(self.target)
        self.settings, self.how = settings, how
        self.manifest_uri = storage.absolute(
            manifest or storage.join(self.target, "manifest.jsonl" if self.local else "manifest")
        )
        self.counts = Counts()
        self.failures: list[dict[str, Any]] = []
        self.gaussians = [0, 0]
        self.start_seconds = 0.0
        self.manifest = Manifest(self.manifest_uri)
        self.progress = Progress("batch", self.counts, quiet=how.quiet, show=how.show)

    def plan(self, inputs: Sequence[Input], *, overwrite: bool, verify: bool) -> list[SplatJob]:
        """Jobs for missing or changed results. Raises ExistsError if results would replace files that no batch made."""
        self.counts.total = len(inputs)
        sizes = storage.sizes_below(self.target, [item.name for item in inputs])
        foreign = [i.name for i in inputs if i.name in sizes and i.name not in self.manifest.known and not overwrite]
        if foreign:
            more = f" and {len(foreign) - 1:,} more" if len(foreign) > 1 else ""
            where = storage.join(self.target, foreign[0])
            raise ExistsError(f"{where}{more}: exists, but was not made by a batch with this manifest; -w replaces")
        jobs = []
        for item in inputs:
            if self.local and storage.join(self.target, item.name) == item.uri:
                raise BadArgumentError(f"{item.uri}: its result would replace it; pass another --out or --format")
            if not item.there:
                self._fail(item, {"code": "not_found", "message": f"{item.uri}: no such file"})
                continue
            try:
                files, fingerprint = files_of(self.settings, item)
            except NotFoundError as error:
                self._fail(item, {"code": "not_found", "message": f"{item.uri}: {error}"})
                continue
            known = self.manifest.known.get(item.name)
            if known is None or overwrite or known.state != "done" or known.fingerprint != fingerprint:
                stands = None
            else:
                stands = known if sizes.get(item.name) == known.output_size else None
            if stands and item.identity and item.identity == stands.identity and not verify:
                self.counts.skipped += 1
                continue
            jobs.append(
                SplatJob(
                    output=item.name,
                    input=item.uri,
                    target=self.target,
                    arguments=self.settings.plain,
                    files=tuple(files),
                    engine=self.settings.engine,
                    threads=self.how.threads,
                    memory=self.settings.memory(item, self.how.threads),
                    identity=item.identity,
                    fingerprint=fingerprint,
                    work=self._state("work") if self.local else None,
                    checkpoint=self._checkpoint(item, fingerprint) if self.settings.resumes else None,
                    known_sha256=stands.sha256 if stands else "",
                    known_output_sha256=stands.output_sha256 if stands else "",
                    verify=verify,
                )
            )
        return jobs

    def run(self, ray: Any, jobs: list[SplatJob]) -> None:
        """Errors: Stopped; IoError: the cluster or the manifest is lost."""
        largest = cluster.cpus_of_largest_machine(ray)
        if self.how.threads > largest:
            raise BadArgumentError(f"--threads {self.how.threads}: no machine here has more than {largest} cores")
        most_memory = cluster.memory_of_largest_machine(ray)
        task = ray.remote(enhance_one)
        tasks: dict[int, Any] = {}

        def submit(job: SplatJob) -> Any:
            memory = min(job.memory, most_memory)
            if memory not in tasks:
                tasks[memory] = task.options(
                    num_cpus=self.how.threads,
                    memory=memory,
                    max_retries=self.how.retries,
                    retry_exceptions=[storage.TransientError],
                    name="anchorsplat enhance",
                )
            if storage.in_driver_only(job.input):
                with fsspec.open(job.input, "rb") as file:
                    job = dataclasses.replace(job, content=file.read())
            return tasks[memory].remote(job)

        def in_flight() -> int:
            return self.how.in_flight or 2 * max(1, cluster.slots(ray, self.how.threads))

        if self.local:
            shutil.rmtree(self._state("work"), ignore_errors=True)  # left by a killed batch
        try:
            run_tasks(ray, self._claimed(jobs), submit, self._ended, in_flight)
        finally:
            self.progress.close()
            if self.local:
                shutil.rmtree(self._state("work"), ignore_errors=True)
                with contextlib.suppress(OSError):  # checkpoints stay for the next run
                    Path(self._state("checkpoints")).rmdir()
                with contextlib.suppress(OSError):
                    Path(self._state("")).rmdir()

    def report(self, seconds: float) -> BatchReport:
        report = report_of(self.counts, seconds, self.manifest_uri, self.failures)
        report.start_seconds = round(self.start_seconds, 3)
        report.gaussians_in, report.gaussians_out = self.gaussians
        return report

    def _state(self, name: str) -> str:
        return storage.join(storage.join(self.target, STATE_FOLDER), name)

    def _checkpoint(self, item: Input, fingerprint: str) -> str:
        named = hashlib.sha256(f"{item.name}\n{item.identity}\n{fingerprint}".encode()).hexdigest()[:32]
        return storage.join(self._state("checkpoints"), named)

    def _claimed(self, jobs: list[SplatJob]) -> Iterator[SplatJob]:
        for begin in range(0, len(jobs), _CLAIMED_AHEAD):
            chunk = jobs[begin : begin + _CLAIMED_AHEAD]
            self.manifest.claim([job.output for job in chunk])
            yield from chunk

    def _ended(self, job: SplatJob, row: dict[str, Any]) -> None:
        for name, content in row.pop("contents", {}).items():
            fs, path = storage.open_place(storage.join(self.target, name))
            fs.pipe_file(path, content)
        if row.get("unchanged"):
            self.manifest.same(job.output, job.identity)
            self.counts.skipped += 1
        else:
            here = self.settings.engine
            row = {
                **job.base_row(),
                **row,
                "options": self.settings.told(),
                "threads": job.threads,
                "engine": here.version,
                "program": here.digest,
            }
            self._record(row)
        self.progress.step()

    def _fail(self, item: Input, error: dict[str, str]) -> None:
        row = {"output": item.name, "input": item.uri, **failed(error["code"], error["message"]), "time": time.time()}
        self._record(row)

    def _record(self, row: dict[str, Any]) -> None:
        self.manifest.record(row)
        if row["state"] == "done":
            self.counts.done += 1
            gaussians = row.get("gaussians") or {}
            self.gaussians[0] += int(gaussians.get("in", 0))
            self.gaussians[1] += int(gaussians.get("out", 0))
            return
        self.counts.failed += 1
        self.failures.append(row)
        if self.counts.failed <= _SHOWN_FAILURES:
            said = row["error"]["message"]
            self.progress.message(f"error: {said}" if row["input"] in said else f"error: {row['input']}: {said}")
        if self.counts.failed == _SHOWN_FAILURES:
            self.progress.message(f"more failures are only in {self.manifest_uri}")


def run_splats(
    words: Iterable[str],
    out: str,
    given: dict[str, Any],
    how: How,
    *,
    lists: Iterable[str] = (),
    root: str | None = None,
    format: str | None = None,
    manifest: str | None = None,
    overwrite: bool = False,
    verify: bool = False,
    stopped: Callable[[BatchReport], None] | None = None,
) -> BatchReport:
    """Runs a whole batch. After an interruption, passes the report to `stopped` and raises."""
    begin = time.monotonic()
    how.check()
    inputs = expand(words, lists, root=root, format=format)
    settings = settings_of(given, format, local_target=storage.is_local(out))
    batch = SplatBatch(out, manifest, settings, how)
    try:
        jobs = batch.plan(inputs, overwrite=overwrite, verify=verify)
        if jobs:
            asked = time.monotonic()
            with cluster.connected(how.ray, how.cpus) as ray, signals_interrupt():
                batch.start_seconds = time.monotonic() - asked
                batch.run(ray, jobs)
    except Stopped:
        batch.manifest.close()
        if stopped:
            stopped(batch.report(time.monotonic() - begin))
        raise
    except BaseException as error:
        with contextlib.suppress(Error):
            batch.manifest.close()
        raise error
    batch.manifest.close()
    return batch.report(time.monotonic() - begin)
