"""Keeps a bounded number of Ray tasks running and reports each result."""

from __future__ import annotations

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from .._errors import IoError
from .task import failed

_LOOK = 1.0  # longest wait, seconds
_COUNT_MACHINES = 5.0  # seconds between checks of the cluster size
_TO_STOP = 40.0  # seconds for tasks to stop cleanly


class Stopped(KeyboardInterrupt):
    """Ctrl-C, SIGTERM or SIGHUP. Tasks were stopped; finished results are in the manifest."""


@contextlib.contextmanager
def signals_interrupt() -> Iterator[None]:
    """Treats SIGTERM and SIGHUP as Ctrl-C."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = {}
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # nohup
            before[number] = signal.signal(number, interrupt)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)


def run_tasks(
    ray: Any,
    jobs: Iterable[Any],
    submit: Callable[[Any], Any],
    ended: Callable[[Any, dict[str, Any]], None],
    in_flight: Callable[[], int],
) -> None:
    """Submits jobs while fewer than in_flight() are running, and calls `ended(job, row)` when one ends.

    A task whose worker died more often than Ray was told to try again ends as a failed row. Raises Stopped when
    interrupted: tasks under way get a KeyboardInterrupt, and those that end nevertheless have their row. IoError: the
    cluster is lost.
    """
    waiting = iter(jobs)
    running: dict[Any, Any] = {}
    exhausted = False
    limit, counted = in_flight(), time.monotonic()
    try:
        while True:
            if time.monotonic() - counted > _COUNT_MACHINES:
                limit, counted = in_flight(), time.monotonic()
            while not exhausted and len(running) < limit:
                job = next(waiting, None)
                if job is None:
                    exhausted = True
                    break
                running[submit(job)] = job
            if not running:
                return
            _collect(ray, running, ended, _LOOK)
    except KeyboardInterrupt:
        with contextlib.suppress(KeyboardInterrupt):  # a second one stops at once
            for ref in running:
                ray.cancel(ref, force=False)
            until = time.monotonic() + _TO_STOP
            while running and time.monotonic() < until:
                _collect(ray, running, ended, _LOOK)
        for ref in running:
            with contextlib.suppress(Exception):
                ray.cancel(ref, force=True)
        raise Stopped from None


def _collect(ray: Any, running: dict[Any, Any], ended: Callable[[Any, dict[str, Any]], None], seconds: float) -> None:
    refs = list(running)
    ready, _ = ray.wait(refs, num_returns=1, timeout=seconds)
    if ready and len(refs) > 1:
        ready, _ = ray.wait(refs, num_returns=len(refs), timeout=0)
    for ref in ready:
        job = running[ref]
        row = _row_of(ray, ref)
        if row is not None:
            ended(job, row)
        del running[ref]


def _row_of(ray: Any, ref: Any) -> dict[str, Any] | None:
    """None: it was cancelled."""
    errors = ray.exceptions
    try:
        row: dict[str, Any] = ray.get(ref)
        return row
    except errors.TaskCancelledError:
        return None
    except errors.OutOfMemoryError:
        return failed("out_of_memory", "the machine ran out of memory, and Ray ended the task; fewer --workers may do")
    except (errors.WorkerCrashedError, errors.NodeDiedError, errors.LocalRayletDiedError) as error:
        return failed("worker_died", f"every worker that tried it died: {str(error).splitlines()[0]}")
    except errors.RayTaskError as error:
        cause = error.cause if error.cause is not None else error
        if isinstance(cause, KeyboardInterrupt):
            return None
        return failed(getattr(cause, "code", "io"), str(cause))
    except errors.RayError as error:
        raise IoError(f"the Ray cluster is lost: {str(error).splitlines()[0]}") from error
