"""Jobs on a Ray cluster of this machine (`make serve-test`; needs the package ray)."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import anchorsplat

from .service import GatedProgram, small_ply, until

SPLAT = small_ply()


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """A head node with two CPUs, on loopback."""
    ray = [sys.executable, "-m", "ray.scripts.scripts"]
    environment = os.environ | {"PYTHONPATH": str(Path(anchorsplat.__file__).parents[1]), "RAY_DISABLE_IMPORT_WARNING": "1"}
    start = ["start", "--head", "--node-ip-address=127.0.0.1", "--port=0", "--num-cpus=2", "--include-dashboard=false",
             "--object-store-memory=200000000", "--disable-usage-stats"]
    said = subprocess.run([*ray, *start], env=environment, check=True, capture_output=True, text=True).stdout
    address = next(word.strip("'\"") for line in said.splitlines() if "--address=" in line for word in line.split("=")[1:])
    yield address
    subprocess.run([*ray, "stop", "--force"], env=environment, check=False, capture_output=True)


def test_jobs_on_ray(serve, cluster: str, tmp_path) -> None:
    local, server = serve(data="local"), serve("--ray", cluster, "--workers", "2", "--threads", "1", data="ray")
    here, there = (s.wait(s.submit(SPLAT, upscale=3)) for s in (local, server))
    assert there["state"] == "done", there
    results = [s.http.get(job["links"]["result"]).content for s, job in ((local, here), (server, there))]
    assert results[0] == results[1]
    views = server.wait(server.submit(SPLAT, "render", orbit=2, size="32x32"))
    assert views["state"] == "done" and server.http.get(views["links"]["result"]).content[:2] == b"PK"
    assert server.http.get(there["links"]["view"]).status_code == 200
    assert server.stop() == 0


def test_progress_cancelling_and_a_killed_process(serve, cluster: str, gated: GatedProgram) -> None:
    server = serve("--ray", cluster, "--workers", "1", "--threads", "1", environment=gated.environment)
    # Nodes have the same build: here the cluster was started without the gate's program, which is said.
    failed = server.wait(server.submit(SPLAT))
    assert failed["state"] == "failed" and "another build" in failed["error"]["message"], failed
    assert signal.SIGKILL and until
