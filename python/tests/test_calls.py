"""What all long calls have in common: threads, progress, messages, Ctrl-C."""

from __future__ import annotations

import logging
import os
import signal
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import same

import anchorsplat


def test_several_threads_at_once_give_the_same_bits(cloud):
    cameras = anchorsplat.Cameras.orbit(cloud, 3, size=(48, 40))
    calls = [
        lambda threads: anchorsplat.enhance(cloud, method="filter", pixel_size=0.005, threads=threads)[0].log_scales,
        lambda threads: anchorsplat.enhance(cloud, pixel_size=0.005, threads=threads)[0].means,
        lambda threads: anchorsplat.refine(cloud, pixel_size=0.005, steps=3, poses=4, threads=threads)[0].sh,
        lambda threads: anchorsplat.render(cloud, cameras, threads=threads),
        lambda threads: np.frombuffer(anchorsplat.to_bytes(cloud, "ply", threads=threads), np.uint8),
        lambda threads: anchorsplat.read(anchorsplat.to_bytes(cloud, "ply"), threads=threads).quats,
    ]
    alone = [call(0) for call in calls]
    jobs = [(k, threads) for threads in (1, 0) for k in range(len(calls))]
    begin = threading.Barrier(6)
    with ThreadPoolExecutor(6, initializer=begin.wait) as pool:
        together = list(pool.map(lambda job: calls[job[0]](job[1]), jobs))
    for (k, threads), result in zip(jobs, together):
        assert np.array_equal(result, alone[k]), (k, threads)


def test_the_interpreter_goes_on_meanwhile(cloud):
    """The call waits for what only another thread of Python's can do."""
    told, done = threading.Event(), threading.Event()

    def other() -> None:
        told.wait()
        done.set()

    thread = threading.Thread(target=other)
    thread.start()

    def progress(_: anchorsplat.Progress) -> None:
        told.set()
        assert done.wait(60)

    anchorsplat.render(cloud, orbit=2, size=(16, 16), progress=progress)
    thread.join()


def test_progress_as_a_function_and_as_bars(cloud):
    seen: list[anchorsplat.Progress] = []
    anchorsplat.render(cloud, orbit=5, size=(16, 16), progress=seen.append)
    assert seen[-1] == ("render", 5, 5, "", True)
    assert [p.done for p in seen] == sorted(p.done for p in seen)
    threads = {threading.get_ident()}
    anchorsplat.render(cloud, orbit=2, size=(16, 16), progress=lambda _: threads.add(threading.get_ident()))
    assert len(threads) == 1, "callbacks come in the calling thread"

    made = []

    class Bar:
        def __init__(self, total: int | None = None, desc: str | None = None) -> None:
            self.total, self.desc, self.n, self.closed = total, desc, 0, False
            made.append(self)

        def update(self, n: int) -> None:
            self.n += n

        def close(self) -> None:
            self.closed = True

    anchorsplat.render(cloud, orbit=4, size=(16, 16), progress=Bar)
    assert [(b.total, b.desc, b.n, b.closed) for b in made] == [(4, "render", 4, True)]
    mine = Bar(1)
    anchorsplat.render(cloud, orbit=4, size=(16, 16), progress=mine)
    assert mine.n == 4 and not mine.closed
    with pytest.raises(TypeError, match="progress: expected"):
        anchorsplat.render(cloud, orbit=4, size=(16, 16), progress=3)


@pytest.mark.filterwarnings("ignore:.*cannot store the up direction")
def test_messages_go_to_logging_and_warnings(cloud, caplog):
    caplog.set_level(logging.INFO, "anchorsplat")
    anchorsplat.enhance(cloud, method="filter")
    assert any("training pixel" in record.message for record in caplog.records)
    with pytest.warns(anchorsplat.SplatWarning, match="range of SPZ") as warned:
        anchorsplat.to_bytes(cloud, "spz")
    assert os.path.basename(warned[0].filename) == "test_calls.py"
    with warnings.catch_warnings():
        warnings.simplefilter("error", anchorsplat.SplatWarning)
        with pytest.raises(anchorsplat.SplatWarning):
            anchorsplat.to_bytes(cloud, "spz")


class Enough(Exception):
    pass


def test_what_a_callback_raises_ends_the_call(cloud):
    def enough(progress: anchorsplat.Progress) -> None:
        raise Enough(progress.task)

    with pytest.raises(Enough, match="render"):
        anchorsplat.render(cloud, orbit=100_000, size=(64, 64), progress=enough)
    with pytest.raises(Enough):
        anchorsplat.refine(cloud, pixel_size=0.005, steps=10**9, poses=4, progress=enough)


def test_ctrl_c_ends_every_long_call_and_leaves_nothing(cloud, tmp_path):
    """Each would take hours; the signal comes when it has begun."""

    def press(_: anchorsplat.Progress) -> None:
        signal.raise_signal(signal.SIGINT)

    for call in (
        lambda: anchorsplat.render(cloud, orbit=100_000, size=(64, 64), progress=press),
        lambda: anchorsplat.refine(cloud, pixel_size=0.005, steps=10**9, poses=4, progress=press),
        lambda: anchorsplat.enhance(cloud, quality="best", pixel_size=0.005, steps=10**9, progress=press),
        lambda: anchorsplat.compare(cloud, cloud, orbit=100_000, size=(64, 64), progress=press),
    ):
        with pytest.raises(KeyboardInterrupt):
            call()
    assert os.listdir(tmp_path) == []


# A thread is in the middle of a call that would take hours.
CALL_OF_HOURS = """
import threading, numpy as np, anchorsplat
one = np.zeros((1, 3), np.float32)
cloud = anchorsplat.Cloud(one, one - 2, np.ones((1, 4), np.float32), one[:, 0], one[:, None])
begun = threading.Event()
call = lambda: anchorsplat.render(cloud, orbit=100_000, size=(64, 64), progress=lambda _: begun.set())
threading.Thread(target=call, daemon=True).start()
begun.wait()
"""


def test_the_end_of_the_program_ends_calls_of_daemon_threads(python):
    done = python(CALL_OF_HOURS)
    assert done.returncode == 0 and done.stderr == ""


def test_ctrl_c_without_progress_ends_what_never_says_a_word(whole, tmp_path):
    """A signal that comes while a file is written: by a timer, at times that go on until one is written whole."""
    target = tmp_path / "big.ply"
    big = whole[np.tile(np.arange(len(whole)), 20)]

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        seconds = 0.001
        while not target.exists():
            signal.setitimer(signal.ITIMER_REAL, seconds)
            try:
                anchorsplat.write(target, big)
            except KeyboardInterrupt:
                assert set(os.listdir(tmp_path)) <= {"big.ply"}
            finally:
                signal.setitimer(signal.ITIMER_REAL, 0)
            seconds *= 2
    finally:
        signal.signal(signal.SIGALRM, before)
    assert same(anchorsplat.read(target), big)


def test_a_refinement_with_a_checkpoint_goes_on_where_it_was(cloud, tmp_path):
    state = tmp_path / "state"
    options = {"pixel_size": 0.005, "steps": 30, "poses": 4, "seed": 3}
    straight, _ = anchorsplat.refine(cloud, **options)
    steps = []

    def press(progress: anchorsplat.Progress) -> None:
        if progress.task == "refine" and progress.done >= 5 and not steps:
            steps.append(progress.done)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        anchorsplat.refine(cloud, checkpoint=state, progress=press, **options)
    if not state.exists():
        pytest.fail(f"nothing was kept at step {steps}")
    with pytest.raises(anchorsplat.ExistsError):
        anchorsplat.refine(cloud, checkpoint=state, **options)
    resumed, report = anchorsplat.refine(cloud, checkpoint=state, resume=True, **options)
    assert report["refine"]["resumed_at"] >= 5 and same(resumed, straight)
    assert not state.exists()


def test_ctrl_c_ends_waiting_for_a_pipe(tmp_path):
    """To which nobody writes."""
    pipe = tmp_path / "pipe.ply"
    os.mkfifo(pipe)

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        for call in (anchorsplat.read, anchorsplat.info, anchorsplat.Cameras):
            signal.setitimer(signal.ITIMER_REAL, 0.05)
            with pytest.raises(KeyboardInterrupt):
                call(pipe)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_a_fork_does_not_wait_for_calls_of_its_parent(python):
    done = python(
        CALL_OF_HOURS + "import os, sys\n"
        "child = os.fork()\n"
        "if child == 0: sys.exit(7)\n"
        "assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7\n"
    )
    assert done.returncode == 0 and "Error" not in done.stderr


def test_numbers_that_are_none_are_said(cloud):
    for given in ({"threads": "2"}, {"threads": None}, {"seed": None}, {"seed": 1.5}):
        with pytest.raises(TypeError, match=f"{next(iter(given))}: expected a whole number, found"):
            anchorsplat.enhance(cloud, **given)
    with pytest.raises(anchorsplat.BadArgumentError, match="seed: must be 0 to"):
        anchorsplat.enhance(cloud, seed=-1)
    for size in ("64x48", 64, (64, 48, 3), (64.5, 48)):
        with pytest.raises(TypeError, match="size: expected"):
            anchorsplat.Cameras.orbit(cloud, 2, size=size)
    with pytest.raises(TypeError, match="count: expected a whole number"):
        anchorsplat.Cameras.orbit(cloud, 2.5)


def test_the_device_is_checked_before_the_work_and_named_in_reports(cloud):
    views = {"orbit": 1, "size": (16, 16)}
    for word in ("tpu", -1, 1.5, ""):
        with pytest.raises(anchorsplat.BadArgumentError, match="device"):
            anchorsplat.render(cloud, **views, device=word)
    with pytest.raises(anchorsplat.NotFoundError):
        anchorsplat.render(cloud, **views, device=1000)
    with pytest.raises(anchorsplat.BadArgumentError, match="max-gpu-memory"):
        anchorsplat.render(cloud, **views, max_gpu_memory="much")
    alone = anchorsplat.render(cloud, **views)
    assert np.array_equal(anchorsplat.render(cloud, **views, device="cpu", max_gpu_memory=10**9), alone)
    report = anchorsplat.compare(cloud, cloud, **views)
    assert report["device"] == {"name": "cpu"} and set(report) == {"mean", "views", "device"}
    _, report = anchorsplat.enhance(cloud, method="filter", pixel_size=0.005, device="auto")
    assert report["device"]["name"] == "cpu" or report["device"]["type"] != "cpu"


def test_without_a_library_there_is_no_gpu(python):
    """A process of its own: the library is looked for once."""
    done = python(
        "import os\n"
        "os.environ['ANCHORSPLAT_WEBGPU'] = '/none.so'\n"
        "import numpy as np, anchorsplat\n"
        "one = np.zeros((1, 3), np.float32)\n"
        "cloud = anchorsplat.Cloud(one, one - 2, np.ones((1, 4), np.float32), one[:, 0], one[:, None])\n"
        "try:\n"
        "    anchorsplat.render(cloud, orbit=1, size=(16, 16), device='gpu')\n"
        "except anchorsplat.NotFoundError as error:\n"
        "    print(error)\n"
        "anchorsplat.render(cloud, orbit=1, size=(16, 16), device='auto')\n"
    )
    assert done.returncode == 0 and "/none.so" in done.stdout and done.stderr == ""


def test_more_threads_than_the_machine_has_are_no_message(python):
    done = python(
        "import numpy as np, anchorsplat\n"
        "one = np.zeros((5000, 3), np.float32)\n"
        "cloud = anchorsplat.Cloud(one, one - 2, np.ones((5000, 4), np.float32), one[:, 0], one[:, None])\n"
        "anchorsplat.render(cloud, orbit=4, size=(256, 256), threads=64)\n"
    )
    assert done.returncode == 0 and done.stderr == ""
