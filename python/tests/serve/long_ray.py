"""Jobs on a Ray cluster of this machine (`make serve-test`; needs the package ray)."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import anchorsplat
import pytest
from ray.cluster_utils import Cluster

from .service import GatedProgram, small_ply, until

SPLAT = small_ply()
PACKAGE = str(Path(anchorsplat.__file__).parents[1])
# Nobody else reaches this cluster, and the service has another home folder than it, so they share no token of Ray's.
ENVIRONMENT = {"RAY_AUTH_MODE": "disabled"}


@pytest.fixture(scope="module")
def everywhere(tmp_path_factory: pytest.TempPathFactory) -> GatedProgram:
    """The program of the service and of the nodes."""
    return GatedProgram(tmp_path_factory.mktemp("ray") / "gated")


@pytest.fixture(scope="module")
def cluster(everywhere: GatedProgram) -> Iterator[str]:
    """The address of a head node with two CPUs, on this machine. Its processes are this test's and end with it."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (ENVIRONMENT | everywhere.environment | {"PYTHONPATH": PACKAGE}).items():
            patch.setenv(name, value)
        nodes = Cluster(
            initialize_head=True,
            head_node_args={
                "num_cpus": 2,
                "include_dashboard": False,
                "object_store_memory": 200_000_000,
            },
        )
        yield nodes.address
        nodes.shutdown()


def test_jobs_on_ray(serve, cluster: str, everywhere: GatedProgram) -> None:
    words = ("--ray", cluster, "--workers", "1", "--threads", "1")
    server = serve(*words, environment=ENVIRONMENT | everywhere.environment)
    # What does not need the gate: the same bits as here.
    local = serve("--threads", "1", data="local", environment=ENVIRONMENT | everywhere.environment)
    here, there = (s.wait(s.submit(SPLAT, "render", orbit=2, size="32x32")) for s in (local, server))
    assert there["state"] == "done", there
    results = [s.http.get(job["links"]["result"]).content for s, job in ((local, here), (server, there))]
    assert results[0][:2] == results[1][:2] == b"PK" and len(results[0]) == len(results[1])

    # Progress, and being cancelled.
    cancelled = server.submit(SPLAT, upscale=2)
    next(e for e in server.events(cancelled) if e.get("progress") == {"task": "gate", "done": 1, "total": 2})
    server.http.delete(cancelled["links"]["self"])
    assert server.wait(cancelled)["state"] == "cancelled"
    until(lambda: not everywhere.running(), "the end of the cancelled process")

    # A process that is killed is tried again, also there.
    job = server.submit(SPLAT, upscale=3)
    next(e for e in server.events(job) if e.get("progress"))
    first = everywhere.running()[0]
    os.kill(first, signal.SIGKILL)
    until(lambda: [pid for pid in everywhere.running() if pid != first], "the second attempt")

    # The service ends in the middle, its jobs on the nodes with it; started again it goes on.
    assert server.stop() == 0
    until(lambda: not everywhere.running(), "the end of a stopped service's process")
    server.start()
    everywhere.open()
    done = server.wait(job)
    assert done["state"] == "done", done
    assert server.http.get(done["links"]["view"]).status_code == 200
    same = local.wait(local.submit(SPLAT, upscale=3))
    assert server.http.get(done["links"]["result"]).content == local.http.get(same["links"]["result"]).content


def test_a_node_with_another_build(serve, cluster: str) -> None:
    server = serve("--ray", cluster, "--workers", "1", "--threads", "1", data="other", environment=ENVIRONMENT)
    failed = server.wait(server.submit(SPLAT))
    assert failed["state"] == "failed" and "another build" in failed["error"]["message"], failed


def test_a_cluster_that_is_not_there(tmp_path: Path) -> None:
    tried = subprocess.run(
        [sys.executable, "-m", "anchorsplat", "serve", "--port", "0", "--data", str(tmp_path), "--ray", "127.0.0.1:1"],
        env={"PATH": os.environ["PATH"], "PYTHONPATH": PACKAGE, "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert tried.returncode == 6 and "error: no Ray cluster at 127.0.0.1:1" in tried.stderr, tried.stderr
