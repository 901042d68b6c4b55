"""Ends that nobody asked for: of a job, of the service. Nothing is lost, nothing is done twice, no process is left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import anchorsplat

from .service import GatedProgram, Server, small_ply, until

SPLAT = small_ply()


def begun(server: Server, job: dict) -> None:
    next(e for e in server.events(job) if e.get("progress"))


def test_a_killed_job_is_tried_once_more(serve, gated: GatedProgram) -> None:
    server = serve("--workers", "1", environment=gated.environment)
    job = server.submit(SPLAT)
    begun(server, job)
    os.kill(gated.running()[0], signal.SIGKILL)
    until(lambda: len(gated.pids()) == 2 and gated.running(), "the second attempt")
    gated.open()
    done = server.wait(job)
    assert done["state"] == "done"
    assert len(gated.pids()) == 2


def test_a_job_that_is_killed_twice_fails_and_others_go_on(serve, gated: GatedProgram) -> None:
    server = serve("--workers", "1", environment=gated.environment)
    job, other = server.submit(SPLAT, upscale=2), server.submit(SPLAT, "convert", to="spz")
    begun(server, job)
    first = gated.running()[0]
    os.kill(first, signal.SIGKILL)
    until(lambda: [pid for pid in gated.running() if pid != first], "the second attempt")
    os.kill(gated.running()[0], signal.SIGKILL)
    failed = server.wait(job)
    assert failed["state"] == "failed" and failed["error"]["code"] == "killed"
    assert "was killed" in failed["error"]["message"] and "tried 2 times" in failed["error"]["message"]
    assert server.wait(other)["state"] == "done"


def test_a_killed_service_takes_its_jobs_along_and_goes_on(serve, gated: GatedProgram) -> None:
    server = serve("--workers", "1", environment=gated.environment)
    done = server.wait(server.submit(SPLAT, "convert", to="spz"))
    running, waiting = server.submit(SPLAT, upscale=2), server.submit(SPLAT, upscale=3)
    begun(server, running)
    server.kill()
    until(lambda: not gated.running(), "the end of the job of a service that is gone")

    server.start()
    begun(server, running)
    gated.open()
    assert [server.wait(job)["state"] for job in (running, waiting)] == ["done", "done"]
    assert server.http.get(done["links"]["result"]).status_code == 200
    assert len(gated.pids()) == 3  # the one that was killed, and each once
    for folder in ("work", "uploads"):
        assert not list((server.data / folder).iterdir())


def test_a_stopped_service_ends_in_order_and_goes_on(serve, gated: GatedProgram) -> None:
    server = serve("--workers", "1", environment=gated.environment)
    job = server.submit(SPLAT)
    begun(server, job)
    assert server.stop() == 0
    assert not gated.running()
    assert "Traceback" not in server.logged()
    gated.open()
    server.start()
    assert server.wait(job)["state"] == "done"


def test_a_work_that_ends_the_service_every_time(serve, gated: GatedProgram) -> None:
    server = serve("--workers", "1", environment=gated.environment)
    job = server.submit(SPLAT)
    for _ in range(3):
        begun(server, job)
        server.kill()
        server.start()
    failed = server.wait(job)
    assert failed["state"] == "failed" and "not tried again" in failed["error"]["message"]


def test_two_services_in_one_folder(serve, tmp_path) -> None:
    server = serve()
    package = os.path.dirname(os.path.dirname(anchorsplat.__file__))
    second = subprocess.run(
        [sys.executable, "-m", "anchorsplat", "serve", "--port", "0", "--data", str(server.data)],
        env={"PATH": os.environ["PATH"], "PYTHONPATH": package, "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert second.returncode == 6 and "another 'anchorsplat serve' uses this folder" in second.stderr


def test_a_port_that_is_taken(serve, tmp_path) -> None:
    server = serve()
    package = os.path.dirname(os.path.dirname(anchorsplat.__file__))
    second = subprocess.run(
        [
            sys.executable,
            "-m",
            "anchorsplat",
            "serve",
            "--port",
            str(server.http.base_url.port),
            "--data",
            str(tmp_path / "other"),
        ],
        env={"PATH": os.environ["PATH"], "PYTHONPATH": package, "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert second.returncode == 6 and "pass another --port" in second.stderr
