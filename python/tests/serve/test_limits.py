"""What one client may take, and what happens to the others meanwhile."""

from __future__ import annotations

import asyncio
import errno
import socket
from pathlib import Path

import httpx
import pytest
from anchorsplat.serve import upload
from anchorsplat.serve.app import make_app
from anchorsplat.serve.settings import Settings

from .service import GatedProgram, Server, small_ply, until

SPLAT = small_ply()


def test_files_that_are_too_large(serve) -> None:
    server = serve("--max-upload", "10kB", "--max-gaussians", "60")
    assert len(small_ply(200)) > 10_000 > len(SPLAT)
    large = small_ply(200)
    answers = [
        server.http.post("/v1/enhance", files={"file": ("a.ply", large)}),
        server.http.post("/v1/enhance", content=large),
        server.http.post(
            "/v1/enhance", content=iter([large[:5000], large[5000:]])
        ),  # chunked: its size is not announced
        server.http.post("/v1/enhance", content=small_ply(61)),
    ]
    for answer in answers:
        assert answer.status_code == 413 and answer.json()["error"]["code"] == "too_large", answer.text
    # What only announces to be large is refused before it is sent.
    with socket.create_connection(("127.0.0.1", server.http.base_url.port)) as connection:
        head = f"POST /v1/enhance HTTP/1.1\r\nHost: 127.0.0.1:{server.http.base_url.port}\r\nContent-Length: 99999999999\r\n\r\n"
        connection.sendall(head.encode())
        assert b" 413 " in connection.recv(4096).split(b"\r\n")[0]
    assert server.wait(server.submit(SPLAT))["state"] == "done"
    assert not list((server.data / "uploads").iterdir())


def test_the_queue_ends_somewhere(serve, gated: GatedProgram) -> None:
    server = serve("--queue", "2", "--workers", "1", environment=gated.environment)
    jobs = [server.submit(SPLAT, upscale=2)]
    next(e for e in server.events(jobs[0]) if e["state"] == "running")
    jobs += [server.submit(SPLAT, upscale=k) for k in (3, 4)]
    assert [server.http.get(j["links"]["self"]).json()["position"] for j in jobs[1:]] == [1, 2]
    refused = server.http.post("/v1/enhance?upscale=5", content=SPLAT)
    assert refused.status_code == 429 and refused.json()["error"]["code"] == "busy"
    assert 1 <= int(refused.headers["retry-after"]) <= 600
    gated.open()
    assert [server.wait(j)["state"] for j in jobs] == ["done"] * 3
    assert server.http.post("/v1/enhance?upscale=5", content=SPLAT).status_code == 202


def test_time_ends(serve, gated: GatedProgram) -> None:
    server = serve("--max-seconds", "2", environment=gated.environment)
    failed = server.wait(server.submit(SPLAT))
    assert failed["state"] == "failed" and failed["error"]["code"] == "timeout"
    assert "longer than 2 s" in failed["error"]["message"]
    until(lambda: not gated.running(), "the end of the process")


def test_memory_ends_for_one_job_only(serve) -> None:
    """With 100 MiB of addresses the program starts, and a large splat does not fit."""
    server = serve("--max-memory", "100MiB", "--workers", "1", "--threads", "1")
    small = server.wait(server.submit(SPLAT, "convert", to="spz"))
    assert small["state"] == "done"
    refused = server.http.post("/v1/convert", content=small_ply(2000))
    large = (
        b"ply\nformat binary_little_endian 1.0\nelement vertex 1500000\n"
        + b"".join(
            f"property float {name}\n".encode()
            for name in "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()
        )
        + b"end_header\n"
        + bytes(1_500_000 * 14 * 4)
    )
    assert refused.status_code == 202, refused.text
    refused = server.http.post("/v1/convert", content=large)
    assert refused.status_code == 413 and refused.json()["error"]["code"] == "memory", refused.text
    assert "100 MiB" in refused.text or "0.0977 GiB" in refused.text
    assert server.wait(server.submit(SPLAT, "convert", to="ply"))["state"] == "done"


def test_cancelling(serve, gated: GatedProgram) -> None:
    server = serve("--workers", "1", environment=gated.environment)
    running = server.submit(SPLAT, upscale=2)
    waiting = server.submit(SPLAT, upscale=3)
    next(e for e in server.events(running) if e.get("progress") == {"task": "gate", "done": 1, "total": 2})
    assert server.http.get(f"{running['links']['self']}/result").status_code == 409
    assert server.http.delete(waiting["links"]["self"]).json()["state"] == "cancelled"
    assert server.http.delete(running["links"]["self"]).json()["state"] == "cancelled"
    assert server.wait(running)["state"] == "cancelled"
    until(lambda: not gated.running(), "the end of the process")
    gated.open()
    again = server.wait(server.submit(SPLAT, upscale=3))  # what was cancelled can be asked for again
    assert again["state"] == "done"
    assert len(gated.pids()) == 2


def test_one_of_two_who_wait_for_the_same_goes_away(serve, gated: GatedProgram) -> None:
    server = serve(environment=gated.environment)
    mine, yours = server.submit(SPLAT), server.submit(SPLAT)
    next(e for e in server.events(yours) if e["state"] == "running")
    assert server.http.delete(mine["links"]["self"]).json()["state"] == "cancelled"
    gated.open()
    assert server.wait(yours)["state"] == "done"
    assert server.http.get(mine["links"]["self"]).json()["state"] == "cancelled"
    assert len(gated.pids()) == 1


def test_an_upload_that_stops(serve) -> None:
    """Whoever goes away in the middle leaves nothing, and keeps nobody from it."""
    server = serve("--queue", "1")
    port = server.http.base_url.port
    with socket.create_connection(("127.0.0.1", port)) as connection:
        connection.sendall(
            f"POST /v1/enhance HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: 5000\r\n\r\nply".encode()
        )
        until(lambda: list((server.data / "uploads").iterdir()), "the upload's file")
        assert server.http.post("/v1/enhance", content=SPLAT).status_code == 429  # it counts as one that waits
    until(lambda: not list((server.data / "uploads").iterdir()), "the end of the upload's file")
    assert server.wait(server.submit(SPLAT))["state"] == "done"


def test_a_full_disk(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Writing fails as it does on a full disk, in the service itself: a sentence, and nothing left behind."""

    def full(self: upload._Sink, data: bytearray) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    async def ask() -> None:
        app = make_app(Settings(data=tmp_path))
        transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        await app.service.scheduler.start()
        async with httpx.AsyncClient(base_url="http://127.0.0.1:7860", transport=transport, timeout=120) as client:
            with monkeypatch.context() as patch:
                patch.setattr(upload._Sink, "_write", full)
                answer = await client.post("/v1/enhance", content=SPLAT)
            assert answer.status_code == 507 and answer.json()["error"]["code"] == "disk_full"
            assert not list((tmp_path / "uploads").iterdir())
            assert (await client.post("/v1/enhance", content=SPLAT)).status_code == 202
        await app.service.scheduler.stop()
        app.service.store.close()

    asyncio.run(ask())


def test_a_job_that_fills_the_disk(serve) -> None:
    """A limit on the size of files is met by the program's write, as the end of a disk is."""
    server = serve("--keep-bytes", "20kB")
    failed = server.wait(server.submit(small_ply(250), "convert", to="csv"))
    assert failed["state"] == "failed" and failed["error"]["code"] in ("too_large", "disk_full"), failed
    assert not list((server.data / "results").iterdir())


def test_old_results_go_by_size(serve) -> None:
    server: Server = serve("--keep-bytes", "40kB", "--workers", "1")
    jobs = [server.wait(server.submit(SPLAT, "convert", to="ply", max_gaussians=k)) for k in range(50, 60)]
    assert all(job["state"] == "done" for job in jobs)
    until(lambda: server.http.get(jobs[0]["links"]["self"]).status_code == 404, "the end of the oldest")
    assert server.http.get(jobs[-1]["links"]["result"]).status_code == 200
    kept = sum(
        path.stat().st_size
        for place in ("inputs", "results")
        for path in (server.data / place).rglob("*")
        if path.is_file()
    )
    assert kept <= 40_000
