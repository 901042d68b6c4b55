"""Uploads that are damaged, cut or something else: each is answered with a clean 4xx, and the service goes on."""

from __future__ import annotations

import asyncio
import os
import random

import httpx

from .service import PATIENCE, Server, small_ply

COUNT = int(os.environ.get("ANCHORSPLAT_MALFORMED", "100"))  # 1,000 in `make serve-test`
AT_ONCE = 8


def damaged(server: Server) -> list[bytes]:
    """One splat in several formats, each to be damaged."""
    whole = small_ply(30)
    formats = ["ply", "compressed.ply", "spz", "sog", "glb"]
    answers = [server.wait(server.submit(whole, "convert", to=to)) for to in formats]
    return [server.http.get(job["links"]["result"]).content for job in answers]


def malformed(draw: random.Random, seeds: list[bytes]) -> bytes:
    """Not a splat: its head is broken, or its end is missing."""
    seed = bytearray(draw.choice(seeds))
    kind = draw.randrange(4)
    if kind == 0:
        return bytes(seed[: draw.randrange(1, len(seed) * 9 // 10)])
    if kind == 1:
        return draw.randbytes(draw.randrange(1, 400))
    if kind == 2:
        return draw.choice(
            [b"ply\n", b"PK\x03\x04", b"glTF", b"\x1f\x8b", b"NGSP", b"{", b"\x89PNG\r\n"]
        ) + draw.randbytes(draw.randrange(100))
    for k in range(4):
        seed[k] ^= draw.randrange(1, 256)
    return bytes(seed)


def broken_form(draw: random.Random, body: bytes) -> tuple[bytes, str]:
    """A form that is none: its end is missing, its name, its boundary."""
    whole = b'--b\r\nContent-Disposition: form-data; name="file"; filename="a.ply"\r\n\r\n' + body + b"\r\n--b--\r\n"
    kind = draw.randrange(5)
    if kind == 0:
        return whole[: draw.randrange(len(whole) - 6)], "multipart/form-data; boundary=b"
    if kind == 1:
        return whole, "multipart/form-data"
    if kind == 2:
        return whole.replace(b'name="file"', b'name="other"'), "multipart/form-data; boundary=b"
    if kind == 3:
        return whole.replace(b"form-data", b"\xff"), "multipart/form-data; boundary=b"
    return whole, "multipart/form-data; boundary=other"


async def send_all(server: Server, seeds: list[bytes]) -> list[tuple[int, httpx.Response]]:
    gate = asyncio.Semaphore(AT_ONCE)

    async def send(client: httpx.AsyncClient, number: int) -> tuple[int, httpx.Response]:
        draw = random.Random(number)
        body = malformed(draw, seeds)
        path = draw.choice(["/v1/enhance", "/v1/convert", "/v1/render"])
        async with gate:
            if number % 4 == 0:
                content, kind = broken_form(draw, body)
                return number, await client.post(path, content=content, headers={"content-type": kind})
            if number % 2:
                return number, await client.post(path, content=body)
            return number, await client.post(path, files={"file": ("a.ply", body)})

    async with httpx.AsyncClient(base_url=server.url, timeout=PATIENCE, trust_env=False) as client:
        return await asyncio.gather(*(send(client, number) for number in range(COUNT)))


def test_malformed_uploads(server: Server) -> None:
    seeds = damaged(server)
    answers = asyncio.run(send_all(server, seeds))
    assert len(answers) == COUNT
    for number, answer in answers:
        assert 400 <= answer.status_code < 500 and answer.status_code != 429, (number, answer.status_code, answer.text)
        error = answer.json()["error"]
        assert error["code"] in ("bad_file", "bad_request", "too_large"), (number, error)
        assert error["message"] and str(server.data) not in error["message"], (number, error)
    assert not list((server.data / "uploads").iterdir())
    assert server.wait(server.submit(small_ply()))["state"] == "done"
