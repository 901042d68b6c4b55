"""Takes works from the store, runs them and notifies watchers. One thread per job waits for its process."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import shutil
import signal
import sqlite3
import threading
import weakref
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from . import store as states
from .engine import Engine
from .metrics import Metrics
from .options import KINDS
from .process import Outcome
from .runner import LocalRunner, Runner, Task, leave_result
from .settings import Settings
from .store import Store
from .words import report_of

log = logging.getLogger("anchorsplat.serve")
_SWEEP_SECONDS = 60
_MOST_ATTEMPTS = 2


class Busy(Exception):
    """The queue is full. `seconds`: when to retry."""

    def __init__(self, seconds: int):
        super().__init__(f"too many jobs wait already; try again in {seconds} s")
        self.seconds = seconds


class Refused(Exception):
    """The program refused or failed, with code and message."""

    def __init__(self, code: str, message: str):
        super().__init__(message)
        self.code = code


class _Changes:
    """Wakes all waiters on every change. Call next() before reading the state, so that no change is missed."""

    def __init__(self) -> None:
        self._event = asyncio.Event()

    def tell(self) -> None:
        self._event.set()
        self._event = asyncio.Event()

    def next(self) -> asyncio.Event:
        return self._event


class _Source:
    """An input for the program, passed on standard input, so that no files named in it are read. Only formats that cannot be
    recognised by content are passed by name; they name no files."""

    def __init__(self, path: Path, hint: str):
        self.word = f"input{hint}" if hint else "-"
        self.stdin = None if hint else path
        self.links = {self.word: path} if hint else {}


class Scheduler:
    def __init__(self, store: Store, engine: Engine, runner: Runner, settings: Settings, metrics: Metrics):
        self.store, self.engine, self.settings, self.metrics = store, engine, settings, metrics
        self.progress: dict[str, dict] = {}  # of running works, by key
        self.uploading = 0
        self._runner = runner
        self._small = LocalRunner(engine.program)  # for checks, conversions of results, pages
        self._small_waiting = 0
        self._deriving: dict[tuple[str, str], asyncio.Task] = {}
        self._ends: dict[str, threading.Event] = {}  # by key, to stop a work
        self._closing = threading.Event()
        self._changes: weakref.WeakValueDictionary[str, _Changes] = weakref.WeakValueDictionary()
        self._seconds = 5.0  # recent duration of a job
        self._jobs = ThreadPoolExecutor(settings.workers, thread_name_prefix="job")
        self._checks = ThreadPoolExecutor(max(2, min(8, os.cpu_count() or 1)), thread_name_prefix="check")
        self._tasks: list[asyncio.Task] = []

    async def start(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._work_there = asyncio.Semaphore(self.store.count(states.QUEUED))
        self._tasks = [asyncio.create_task(self._worker()) for _ in range(self.settings.workers)]
        self._tasks.append(asyncio.create_task(self._sweeper()))

    @property
    def stopping(self) -> bool:
        return self._closing.is_set()

    def begin_to_stop(self) -> None:
        """Notifies watchers, so that connections end."""
        self._closing.set()
        self._tell_queue()

    async def stop(self) -> None:
        """Stops running jobs cleanly and queues them again; drops unfinished derived files."""
        self.begin_to_stop()
        for task in self._tasks:
            if task is not self._tasks[-1]:
                self._work_there.release()  # wakes threads that wait for work
        self._tasks[-1].cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await asyncio.gather(*self._deriving.values(), return_exceptions=True)
        self._jobs.shutdown()
        self._checks.shutdown()
        self._runner.close()

    # Requests

    def admit(self) -> None:
        """Raises Busy if there are too many uploads."""
        waiting = self.store.count(states.QUEUED) + self.uploading
        if waiting >= self.settings.queue:
            raise Busy(max(1, min(600, round(self._seconds * waiting / self.settings.workers))))

    async def check(self, upload: Path, hint: str, name: str) -> dict:
        """Facts of an upload: {"format", "gaussians", "bytes", "sh_degree"}. Raises Refused if it is not a splat."""
        folder = upload.with_name(upload.name + ".check")
        source = _Source(upload, hint)
        task = Task(self.engine.check(source.word, hint), self.engine.limits(), folder, source.stdin, source.links)
        try:
            outcome = await self._run_small(task)
        finally:
            await asyncio.to_thread(shutil.rmtree, folder, True)
        if not outcome.done:
            raise Refused(*self.engine.explain(outcome, name))
        row = outcome.document[0]
        return {
            "format": row["formats"][0],
            "gaussians": row["gaussians"]["in"],
            "bytes": row["bytes"]["in"],
            "sh_degree": row["sh_degree"]["in"],
        }

    def submitted(self, key: str) -> None:
        self._work_there.release()
        self._tell(key)

    def cancel(self, job: sqlite3.Row) -> None:
        key = job["key"]
        if self.store.cancel_job(job["id"], key):
            work = self.store.work(key)
            if work is None:
                return
            if work["state"] == states.RUNNING and key in self._ends:
                self._ends[key].set()
            elif work["state"] == states.QUEUED:
                self.store.fail(key, states.CANCELLED, "cancelled", "The job was cancelled.")
                self._tell_queue()
        self._tell(key)

    def changes(self, key: str) -> _Changes:
        """Keep a reference: only referenced ones are notified."""
        return self._changes.setdefault(key, _Changes())

    async def derived(self, key: str, name: str, task: Callable[[Path], Task]) -> Path:
        """A file derived from a result on first request: another format, the page. Raises Busy, Refused."""
        path = self.store.result_folder(key) / name
        self.store.touch(key)
        if path.exists():
            return path
        if (key, name) not in self._deriving:
            if self._small_waiting >= self.settings.queue:
                raise Busy(1 + self._small_waiting // 4)
            deriving = asyncio.create_task(self._derive(key, name, task(self.store.work_folder(f"{key}.{name}"))))
            self._deriving[key, name] = deriving
            deriving.add_done_callback(lambda task: self._derived(key, name, task))
        # A client that leaves does not cancel it for others.
        return await asyncio.shield(self._deriving[key, name])

    def _derived(self, key: str, name: str, task: asyncio.Task) -> None:
        self._deriving.pop((key, name), None)
        if not task.cancelled():
            task.exception()  # all clients may have left

    async def other_format(self, key: str, to: str) -> Path:
        """Converts the PLY of a result."""
        source = self.store.result_folder(key) / "result.ply"
        name = "result.gltf.zip" if to == "gltf" else f"result.{to}"
        return await self.derived(
            key, name, lambda folder: Task(self.engine.derive("-", to), self.engine.limits(), folder, source, {})
        )

    async def page(self, work: sqlite3.Row, result: str, title: str) -> Path:
        """Makes the before/after page."""
        before = _Source(self.store.input_path(work["input"]), Path(work["input"]).suffix)
        after = f"after{result.removeprefix('result')}"
        links = before.links | {after: self.store.result_folder(work["key"]) / result}
        words = self.engine.page(after, before.word, title)
        return await self.derived(
            work["key"], "view.html", lambda folder: Task(words, self.engine.limits(), folder, before.stdin, links)
        )

    # Work

    async def _derive(self, key: str, name: str, task: Task) -> Path:
        try:
            outcome = await self._run_small(task)
            if not outcome.done:
                raise Refused(*self.engine.explain(outcome))
            await asyncio.to_thread(_complete, task)
            path = self.store.result_folder(key) / name
            os.replace(task.folder / name, path)
            self.store.measure(key)
            return path
        finally:
            await asyncio.to_thread(shutil.rmtree, task.folder, True)

    async def _run_small(self, task: Task) -> Outcome:
        self._small_waiting += 1
        try:
            run = self._small.run
            return await self._loop.run_in_executor(self._checks, run, task, lambda event: None, self._closing.is_set)
        finally:
            self._small_waiting -= 1

    async def _worker(self) -> None:
        while True:
            await self._work_there.acquire()
            if self._closing.is_set():
                return
            work = None
            try:
                work = self.store.next_work()
                if work is not None:
                    await self._run(work)
            except Exception:
                log.exception("a job could not be finished")
                if work is not None:
                    self._give_up(work["key"])

    async def _run(self, work: sqlite3.Row) -> None:
        key = work["key"]
        end = self._ends[key] = threading.Event()
        self._tell_queue()
        self._tell(key)
        task = self._task(work)

        def on_progress(event: dict) -> None:
            self._loop.call_soon_threadsafe(self._progressed, key, event)

        try:
            outcome = await self._loop.run_in_executor(
                self._jobs, self._runner.run, task, on_progress, lambda: end.is_set() or self._closing.is_set()
            )
            if outcome.done:
                await asyncio.to_thread(_complete, task)
            self._ended(work, outcome, cancelled=end.is_set())
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise
            self.make_room()
            self.store.fail(key, states.FAILED, "disk_full", "The disk of this service is full.")
        finally:
            self._ends.pop(key, None)
            self.progress.pop(key, None)
            self._tell(key)

    def _task(self, work: sqlite3.Row) -> Task:
        hint = Path(work["input"]).suffix
        source = _Source(self.store.input_path(work["input"]), hint)
        options = KINDS[work["kind"]].model_validate_json(work["options"])
        cameras = {"cameras.json": self.store.input_path(work["cameras"])} if work["cameras"] else {}
        words = self.engine.job(work["kind"], options, source.word, hint, bool(cameras))
        folder = self.store.work_folder(work["key"])
        return Task(words, self.engine.limits(), folder, source.stdin, source.links | cameras)

    def _ended(self, work: sqlite3.Row, outcome: Outcome, cancelled: bool) -> None:
        key, kind = work["key"], work["kind"]
        state = states.DONE
        if outcome.done:
            self.store.finish(key, report_of(kind, outcome.document, outcome.messages, outcome.seconds))
            self._seconds += 0.2 * (outcome.seconds - self._seconds)
            if self.store.stored_bytes() > self.settings.keep_bytes:
                self.sweep()
        elif cancelled and self.store.is_wanted(key):  # requested again while it was being stopped
            self.store.requeue(key)
            self._work_there.release()
            return
        elif cancelled:
            state = states.CANCELLED
            self.store.fail(key, state, "cancelled", "The job was cancelled.")
        elif outcome.why == "stopped":
            self.store.requeue(key)
            return
        elif outcome.code == -signal.SIGKILL and outcome.why is None and work["attempts"] < _MOST_ATTEMPTS:
            log.warning("job %s: its process was killed; it is tried again", key[:12])
            self.store.requeue(key, again=True)
            self._work_there.release()
            return
        else:
            state = states.FAILED
            code, sentence = self.engine.explain(outcome)
            if code == "disk_full":
                self.make_room()
            if code == "killed":
                sentence += f" It was tried {_MOST_ATTEMPTS} times."
            self.store.fail(key, state, code, sentence)
        self.metrics.job_ended(kind, state, outcome)

    def _give_up(self, key: str) -> None:
        """Records an internal error. If that fails too, the next start retries the work."""
        try:
            self.store.fail(key, states.FAILED, "failed", "The service could not finish this job; its log says why.")
        except sqlite3.Error:
            log.exception("and it could not be noted")
        self._tell(key)

    # Cleaning up

    def sweep(self) -> None:
        deriving = {key for key, _ in self._deriving}
        gone = self.store.sweep(self.settings.keep_days, self.settings.keep_bytes, lambda key: key in deriving)
        if gone:
            log.info("%d old results were deleted", gone)

    def make_room(self) -> None:
        """Deletes a quarter of what is kept: the disk is full before --keep-bytes is reached."""
        try:
            self.store.sweep(self.settings.keep_days, self.store.stored_bytes() * 3 // 4)
        except (sqlite3.Error, OSError):
            log.exception("no room could be made")

    async def _sweeper(self) -> None:
        while True:
            try:
                self.sweep()
            except (sqlite3.Error, OSError):
                log.exception("old results could not be deleted")
            await asyncio.sleep(_SWEEP_SECONDS)

    def _progressed(self, key: str, event: dict) -> None:
        if key in self._ends:
            self.progress[key] = {name: event.get(name) for name in ("task", "done", "total")}
            self._tell(key)

    def _tell(self, key: str) -> None:
        if (changes := self._changes.get(key)) is not None:
            changes.tell()

    def _tell_queue(self) -> None:
        for changes in list(self._changes.values()):
            changes.tell()


def _complete(task: Task) -> None:
    """Packs several files into one, so that a result is always one file."""
    leave_result(task)
    views = task.folder / "views"
    if views.is_dir():
        _zip(task.folder / "views.zip", sorted(views.iterdir()))
        shutil.rmtree(views)
    gltf = task.folder / "result.gltf"
    if gltf.exists():
        files = sorted(task.folder.glob("result.*"))
        _zip(task.folder / "result.gltf.zip", files)
        for path in files:
            path.unlink()


def _zip(path: Path, files: list[Path]) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for file in files:
            archive.write(file, file.name)
