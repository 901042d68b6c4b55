"""Runs jobs as Ray tasks: the input goes to a free node, progress and result are streamed back.

Nodes need the same build of this package. A node that is lost is tried once more elsewhere, by Ray.
"""

from __future__ import annotations

import queue
import tempfile
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import ray

from .._cluster_address import look_for
from .process import Outcome
from .runner import STATE, Task, clear, run_in_folder

_MORE_MEMORY = 256 * 2**20  # of a job, in addition to its input
_MEMORY_PER_INPUT_BYTE = 16


def _job(
    task: Task, stdin: bytes | None, links: dict[str, bytes], state: bytes | None, fingerprint: str
) -> Iterator[object]:
    """Runs on a node. Yields progress, then the outcome with its files. Paths of `task` are those of the service."""
    from .engine import find_program, fingerprint_of

    program = find_program()
    here = fingerprint_of(program)
    if here != fingerprint:
        text = f"This Ray node has another build of anchorsplat ({here}) than the service ({fingerprint})."
        yield Outcome(code=1, messages=[("error", text)]), {}
        return
    with tempfile.TemporaryDirectory(prefix="anchorsplat-") as place:
        folder = Path(place, "job")
        folder.mkdir()
        local = replace(task, folder=folder, stdin=None, links={})
        if stdin is not None:
            whole = Path(place, "stdin")
            whole.write_bytes(stdin)
            local = replace(local, stdin=whole)
        for name, data in links.items():
            local.links[name] = Path(place, name)
            local.links[name].write_bytes(data)
        if state is not None:
            (folder / STATE).write_bytes(state)
        events: queue.SimpleQueue = queue.SimpleQueue()
        ended = threading.Event()

        def work() -> None:
            try:
                events.put(run_in_folder(program, local, events.put, ended.is_set))
            except BaseException as error:
                events.put(error)

        # The process ends with the thread that started it, so the thread must outlive it.
        thread = threading.Thread(target=work)
        thread.start()
        try:
            while isinstance(event := _next(events), dict):
                yield event
        finally:  # also when Ray cancels the task
            ended.set()
            thread.join()
        if isinstance(event, BaseException):
            raise event
        yield event, {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def _next(events: queue.SimpleQueue) -> object:
    """Interrupts waiting regularly, so that Ray can cancel the task."""
    while True:
        try:
            return events.get(timeout=0.1)
        except queue.Empty:
            pass


class RayRunner:
    def __init__(self, address: str, threads: int, fingerprint: str):
        look_for(address)
        where = {"address": "local", "include_dashboard": False} if address == "local" else {"address": address}
        try:
            ray.init(**where, log_to_driver=False)
        except (ConnectionError, RuntimeError, ValueError) as error:
            raise ConnectionError(f"no Ray cluster at {address}: {str(error).strip().splitlines()[0]}") from None
        self._fingerprint = fingerprint
        self._threads = threads
        self._remote = ray.remote(_job)

    def run(self, task: Task, on_progress: Callable[[dict], None], stopped: Callable[[], bool]) -> Outcome:
        state = task.folder / STATE
        stdin = task.stdin.read_bytes() if task.stdin else None
        links = {name: path.read_bytes() for name, path in task.links.items()}
        size = len(stdin or b"") + sum(map(len, links.values()))
        memory = min(task.limits.memory, _MORE_MEMORY + _MEMORY_PER_INPUT_BYTE * size)
        remote = self._remote.options(num_cpus=self._threads, memory=memory, max_retries=1, num_returns="streaming")
        events = remote.remote(task, stdin, links, state.read_bytes() if state.exists() else None, self._fingerprint)
        try:
            return self._follow(events, task, on_progress, stopped)
        except StopIteration:
            return Outcome(code=1, messages=[("error", "The Ray task ended without a result.")])
        except ray.exceptions.RayError as error:
            return Outcome(code=1, messages=[("error", f"Ray could not run the job: {str(error).splitlines()[0]}")])

    def _follow(self, events, task: Task, on_progress, stopped) -> Outcome:
        while True:
            ready, _ = ray.wait([events], timeout=0.2)
            if stopped():
                ray.cancel(events)
                return Outcome(code=-15, why="stopped")
            if not ready:
                continue
            event = ray.get(next(events))
            if isinstance(event, dict):
                on_progress(event)
                continue
            outcome, files = event
            clear(task.folder)
            for name, data in files.items():
                path = task.folder / name
                path.parent.mkdir(exist_ok=True)
                path.write_bytes(data)
            return outcome

    def close(self) -> None:
        ray.shutdown()
