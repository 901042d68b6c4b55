"""200 requests, 20 at once: none lost, memory bounded. Conversions, so that it is the service that is measured. Prints the figures of docs/serve.md (`make serve-test`)."""

from __future__ import annotations

import asyncio
import json
import subprocess
import time
from pathlib import Path

import httpx
from anchorsplat._program import program

from .service import PATIENCE, GatedProgram, Server, small_ply, until

REQUESTS, AT_ONCE = 200, 20
MOST_GROWTH = 64 * 2**20  # bytes of the service while it answers all of them


def resident(server: Server) -> int:
    for line in Path(f"/proc/{server.process.pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024
    raise AssertionError("no VmRSS")


def peak(server: Server) -> int:
    lines = Path(f"/proc/{server.process.pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:")) * 1024


async def one(client: httpx.AsyncClient, splat: bytes) -> tuple[bytes, float]:
    """Sent, waited for by its events, fetched. Told that too many wait it comes back."""
    begin = time.monotonic()
    while (
        answer := await client.post("/v1/convert", files={"file": ("a.ply", splat)}, data={"to": "spz"})
    ).status_code == 429:
        await asyncio.sleep(float(answer.headers["retry-after"]))
    assert answer.status_code in (200, 202), answer.text
    job = answer.json()
    async with client.stream("GET", job["links"]["events"]) as events:
        said = [line async for line in events.aiter_lines() if line.startswith("data: ")]
    assert json.loads(said[-1].removeprefix("data: "))["state"] == "done", said
    result = await client.get(f"{job['links']['self']}/result")
    assert result.status_code == 200
    return result.content, time.monotonic() - begin


async def all_of(server: Server, splats: list[bytes]) -> list[tuple[bytes, float]]:
    gate = asyncio.Semaphore(AT_ONCE)
    limits = httpx.Limits(max_connections=2 * AT_ONCE)
    async with httpx.AsyncClient(base_url=server.url, timeout=PATIENCE, trust_env=False, limits=limits) as client:

        async def gated(splat: bytes) -> tuple[bytes, float]:
            async with gate:
                return await one(client, splat)

        return await asyncio.gather(*(gated(splat) for splat in splats))


def test_two_hundred_requests(serve, capsys) -> None:
    server = serve("--workers", "2", "--threads", "1")
    splats = [small_ply(2000, seed) for seed in range(REQUESTS)]
    server.wait(
        server.submit(small_ply(2000, REQUESTS), "convert", to="spz")
    )  # what is loaded at the first request is there
    before = resident(server)
    begin = time.monotonic()
    answers = asyncio.run(all_of(server, splats))
    seconds = time.monotonic() - begin
    assert len(answers) == REQUESTS
    assert len({answer for answer, _ in answers}) == REQUESTS  # each its own
    assert peak(server) - before < MOST_GROWTH, (before, peak(server))

    again = time.monotonic()
    repeated = asyncio.run(all_of(server, splats))
    repeated_seconds = time.monotonic() - again
    assert [answer for answer, _ in repeated] == [answer for answer, _ in answers]
    waits = sorted(wait for _, wait in answers)
    with capsys.disabled():
        print(
            f"\n{REQUESTS} splats of 2,000 Gaussians, {AT_ONCE} at once: {seconds:.1f} s, {REQUESTS / seconds:.1f} a second, "
            f"median {waits[REQUESTS // 2]:.2f} s, slowest {waits[-1]:.2f} s"
        )
        print(
            f"the same again, from what is there: {repeated_seconds:.1f} s, {REQUESTS / repeated_seconds:.0f} a second"
        )
        print(f"memory of the service: {before / 2**20:.0f} MiB before, {peak(server) / 2**20:.0f} MiB at most")


def test_what_a_request_costs(serve, capsys, tmp_path: Path) -> None:
    """One after the other: what the service adds to the program's own time."""
    server = serve("--workers", "1", "--threads", "1")
    count = 30
    paths = []
    for seed in range(count):
        paths.append(tmp_path / f"{seed}.ply")
        paths[-1].write_bytes(small_ply(2000, seed))
    begin = time.monotonic()
    for path in paths:
        subprocess.run([program(), "convert", path, f"{path}.spz", "--threads", "1", "-q"], check=True)
    alone = (time.monotonic() - begin) / count
    begin = time.monotonic()
    for path in paths:
        job = server.wait(server.submit(path.read_bytes(), "convert", to="spz"))
        assert server.http.get(job["links"]["result"]).content == Path(f"{path}.spz").read_bytes()
    served = (time.monotonic() - begin) / count
    with capsys.disabled():
        print(
            f"\none after the other: {1000 * served:.0f} ms each, {1000 * alone:.0f} ms by the command line: {1000 * (served - alone):.0f} ms more"
        )


def test_coming_back_while_it_is_being_ended(serve, gated: GatedProgram) -> None:
    """A job is cancelled, its process takes its time to end, and somebody wants the same: it is done for them."""
    gated.path.write_text(gated.path.read_text().replace("#!/bin/sh\n", "#!/bin/sh\ntrap '' TERM\n"))
    server = serve("--workers", "1", environment=gated.environment)
    splat = small_ply()
    mine = server.submit(splat)
    next(e for e in server.events(mine) if e.get("progress"))
    server.http.delete(mine["links"]["self"])
    yours = server.submit(splat)
    until(lambda: len(gated.pids()) == 2, "the second attempt")
    gated.open()
    assert server.wait(yours)["state"] == "done"
    assert server.wait(mine)["state"] == "cancelled"
