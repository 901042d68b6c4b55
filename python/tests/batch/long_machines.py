"""What takes long to test of batches: kills from outside, object stores, clusters, folders. `make batch-test` runs it."""

from __future__ import annotations

import functools
import http.server
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import fsspec
import pytest

from .conftest import Control, command_line, enhanced_by_hand, splat


def finish(process, seconds: float = 120) -> tuple[int, str, str]:
    try:
        out, err = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise
    return process.returncode, out, err


def rows(manifest: Path) -> list[dict]:
    return [line for line in map(json.loads, manifest.read_text().splitlines()) if "output" in line]


@pytest.fixture
def control(watched: Control) -> Control:
    """Without the Ray that other tests share: the processes here have their own."""
    watched.reset()
    return watched


@pytest.fixture
def held(control: Control, scans: Path) -> Path:
    """A pipe; the program waits at c.ply until somebody writes there."""
    return control.hold("c.ply")


def wait_for(path: Path, process) -> None:
    while not path.exists():
        assert process.poll() is None, process.communicate()
        threading.Event().wait(0.05)


def test_one_batch_after_the_other_in_one_process(scans: Path, tmp_path: Path) -> None:
    code = (
        "from anchorsplat import batch\n"
        f"for k in range(2): assert batch.enhance({str(scans / 'a.ply')!r}, {str(tmp_path)!r} + f'/out{{k}}', method='filter').done\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=200)


@pytest.mark.parametrize("mode", ["token", "disabled"])
@pytest.mark.parametrize("earlier", [False, True])
def test_a_ray_of_the_users_own_beside_batches(mode: str, earlier: bool, scans: Path, tmp_path: Path) -> None:
    """Ray's core keeps what it was told about tokens first."""
    own = "ray.init(num_cpus=1); assert ray.get(ray.remote(lambda: 7).remote()) == 7; ray.shutdown()\n"
    code = "import sys, ray; from anchorsplat import batch\n" + (own if earlier else "")
    code += f"report = batch.enhance({str(scans / 'a.ply')!r}, {str(tmp_path / 'out')!r}, method='filter')\n" + own
    code += "sys.exit(report.failed)\n"
    environment = {**os.environ, "RAY_AUTH_MODE": mode, "HOME": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_cleanly_and_it_goes_on(
    control: Control, held: Path, scans: Path, tmp_path: Path, number: signal.Signals
) -> None:
    words = ["enhance", f"{scans}/*.ply", "-o", tmp_path / "out", "--method", "filter", "--workers", "1"]
    process = command_line(*words)
    wait_for(control.folder / "held-c.ply", process)
    process.send_signal(number)
    code, out, err = finish(process)
    assert code == 130 and "2 still to do" in out and "interrupted; run the same command to continue" in err
    assert not (tmp_path / "out/.batch").exists()
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["a.ply", "b.ply", "manifest.jsonl"]
    held.unlink()
    control.calls()
    code, out, _ = finish(command_line(*words))
    assert code == 0 and "2 enhanced, 2 there already" in out and control.calls() == ["c.ply", "d.ply"]


def test_kill_9_of_the_driver_loses_nothing(control: Control, held: Path, scans: Path, tmp_path: Path, native: Path) -> None:
    words = ["enhance", f"{scans}/*.ply", "-o", tmp_path / "out", "--method", "filter", "--workers", "1"]
    process = command_line(*words)
    wait_for(control.folder / "held-c.ply", process)
    program = int((control.folder / "held-c.ply").read_text())
    process.kill()
    finish(process)
    while Path(f"/proc/{program}").exists():  # dies with its worker, and that with Ray, and that with the driver
        threading.Event().wait(0.05)
    held.unlink()
    control.calls()
    code, out, _ = finish(command_line(*words))
    assert code == 0 and "2 enhanced, 2 there already" in out and control.calls() == ["c.ply", "d.ply"]
    for name in "abcd":
        by_hand = enhanced_by_hand(native, scans / f"{name}.ply", tmp_path / f"{name}.ply", "--method=filter")
        assert (tmp_path / "out" / f"{name}.ply").read_bytes() == by_hand
    assert not (tmp_path / "out/.batch").exists()


@pytest.fixture
def s3(monkeypatch: pytest.MonkeyPatch) -> Iterator[fsspec.AbstractFileSystem]:
    """An S3 of this machine, which the processes that a test starts find, too."""
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    for name, value in {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}", "AWS_ACCESS_KEY_ID": "testing", "AWS_SECRET_ACCESS_KEY": "testing",
        "AWS_DEFAULT_REGION": "us-east-1",
    }.items():  # fmt: skip
        monkeypatch.setenv(name, value)
    fs = fsspec.filesystem("s3", skip_instance_cache=True)
    fs.mkdir("scans")
    fs.mkdir("sharp")
    yield fs
    server.stop()


def test_s3(control: Control, s3: fsspec.AbstractFileSystem, scans: Path, tmp_path: Path, native: Path) -> None:
    for name in "abcd":
        s3.put_file(str(scans / f"{name}.ply"), f"scans/day/{name}.ply")
    s3.pipe_file("scans/day/e.ply", b"no splat")
    words = ["enhance", "s3://scans/**/*.ply", "-o", "s3://sharp/x4", "--method", "filter", "--format", "spz"]
    code, out, err = finish(command_line(*words))
    assert code == 1 and "4 enhanced, 0 there already, 1 failed" in out, err
    assert "s3://scans/day/e.ply: byte 0: is not a PLY file" in err
    by_hand = enhanced_by_hand(native, scans / "b.ply", tmp_path / "b.spz", "--method=filter")
    assert s3.cat_file("sharp/x4/day/b.spz") == by_hand
    assert sorted(s3.find("sharp/x4/day")) == [f"sharp/x4/day/{name}.spz" for name in "abcd"]
    assert control.calls() == [f"{name}.ply" for name in "abcde"]
    s3.put_file(str(splat(tmp_path / "new.ply", 9)), "scans/day/c.ply")
    s3.rm("sharp/x4/day/d.spz")
    s3.rm("scans/day/e.ply")
    code, out, err = finish(command_line(*words))
    assert code == 0 and "2 enhanced, 2 there already" in out, err
    assert control.calls() == ["c.ply", "d.ply"]


def test_http_inputs(control: Control, scans: Path, tmp_path: Path) -> None:
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(scans))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        urls = [f"http://127.0.0.1:{server.server_port}/{name}.ply?token=1" for name in ("a", "b", "gone")]
        words = ["enhance", *urls, "-o", tmp_path / "out", "--method", "filter"]
        code, out, err = finish(command_line(*words))
        assert code == 1 and "2 enhanced, 0 there already, 1 failed" in out, err
        assert control.calls() == ["a.ply", "b.ply"]
        code, out, err = finish(command_line(*words))
        server.shutdown()
    assert code == 1 and "0 enhanced, 2 there already, 1 failed" in out, err
    assert control.calls() == []


def test_a_machine_of_a_cluster_that_dies(control: Control, held: Path, scans: Path, tmp_path: Path) -> None:
    """The machine that has c.ply goes, and another makes it."""
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
    try:
        machines = [cluster.add_node(num_cpus=1) for _ in range(2)]
        words = ["enhance", f"{scans}/*.ply", "-o", tmp_path / "out", "--method", "filter", "--ray", cluster.address]
        process = command_line(*words)
        wait_for(control.folder / "held-c.ply", process)
        program = int((control.folder / "held-c.ply").read_text())
        held.unlink()
        machine = next(node for node in machines if raylet_of(program) == node.all_processes["raylet"][0].process.pid)
        cluster.remove_node(machine, allow_graceful=False)
        code, out, err = finish(process)
    finally:
        cluster.shutdown()
    assert code == 0 and "4 enhanced" in out, err
    assert control.calls() == ["a.ply", "b.ply", "c.ply", "c.ply", "d.ply"]
    assert sorted(row["output"] for row in rows(tmp_path / "out/manifest.jsonl")) == [f"{name}.ply" for name in "abcd"]


def raylet_of(process: int) -> int:
    """The parent of the worker that runs the program."""
    for _ in range(2):
        process = int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])
    return process


def test_a_refinement_goes_on_from_its_checkpoint(watched: Control, native: Path, tmp_path: Path) -> None:
    source = splat(tmp_path / "in/a.ply", gaussians=400)
    options = ["--pixel-size=0.02", "--steps=3000"]
    words = ["refine", source, "-o", tmp_path / "out", *options]
    process = command_line(*words, ANCHORSPLAT_PROGRAM=str(native))
    work = tmp_path / "out/.batch/work"
    wait_for(work, process)
    while not any(work.rglob("result")):
        threading.Event().wait(0.05)
    process.send_signal(signal.SIGINT)
    code, _, err = finish(process)
    assert code == 130, err
    code, _, err = finish(command_line(*words, ANCHORSPLAT_PROGRAM=str(native)))
    assert code == 0, err
    by_hand = enhanced_by_hand(native, source, tmp_path / "by-hand.ply", "--method=refine", *options)
    assert (tmp_path / "out/a.ply").read_bytes() == by_hand
    assert not (tmp_path / "out/.batch").exists()
