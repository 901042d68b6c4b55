"""A real service in a process of its own, on loopback, and small splats for it."""

from __future__ import annotations

import json
import math
import os
import random
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import anchorsplat
import httpx
from anchorsplat._program import program

_FIELDS = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()
PATIENCE = 120.0  # seconds until what has to happen is taken for lost


def small_ply(gaussians: int = 60, seed: int = 0) -> bytes:
    """A sphere of Gaussians as an INRIA PLY of degree 0."""
    draw = random.Random(seed)
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {gaussians}\n"
    header += "".join(f"property float {name}\n" for name in _FIELDS) + "end_header\n"
    rows = []
    for _ in range(gaussians):
        u, angle = draw.uniform(-1, 1), draw.uniform(0, 2 * math.pi)
        r = math.sqrt(1 - u * u)
        place = [r * math.cos(angle), r * math.sin(angle), u]
        scale = [draw.uniform(-3.5, -2.5), draw.uniform(-3.5, -2.5), draw.uniform(-7, -6)]
        rows.append(
            struct.pack(
                "<17f",
                *place,
                0,
                0,
                0,
                *(draw.uniform(-1, 1) for _ in range(3)),
                draw.uniform(0, 4),
                *scale,
                *(draw.gauss(0, 1) for _ in range(4)),
            )
        )
    return header.encode() + b"".join(rows)


def until(condition: Callable[[], object], what: str) -> object:
    """Looks again and again; what never happens is a failure that says so."""
    end = time.monotonic() + PATIENCE
    while not (result := condition()):
        assert time.monotonic() < end, f"{what}: not after {PATIENCE:g} s"
        time.sleep(0.02)
    return result


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


class Server:
    """`anchorsplat serve` on a free port of loopback."""

    def __init__(self, data: Path, *words: str, environment: dict[str, str] | None = None):
        self.data, self._words = data, words
        self._environment = environment or {}
        self.start()

    def start(self) -> None:
        package = str(Path(anchorsplat.__file__).parents[1])
        known = {"PATH": os.environ["PATH"], "PYTHONPATH": package, "HOME": str(self.data)}
        self.log = open(f"{self.data}.log", "a+")
        self.process = subprocess.Popen(
            [sys.executable, "-m", "anchorsplat", "serve", "--port", "0", "--data", str(self.data), *self._words],
            env=known | self._environment,
            stdout=subprocess.PIPE,
            stderr=self.log,
            text=True,
        )
        first = self.process.stdout.readline()
        if not first.startswith("anchorsplat serves http://"):
            said = first + self.logged()
            self.process.kill()
            self.process.wait()
            self.process.stdout.close()
            self.log.close()
            raise AssertionError(f"the service did not start: {said}")
        self.url = first.split()[-1]
        token = self._environment.get("ANCHORSPLAT_TOKEN")
        self.http = httpx.Client(
            base_url=self.url,
            timeout=PATIENCE,
            headers={"authorization": f"Bearer {token}"} if token else {},
            trust_env=False,
        )

    def stop(self) -> int:
        self.http.close()
        self.process.terminate()
        code = self.process.wait(PATIENCE)
        self.process.stdout.close()
        self.log.close()
        return code

    def kill(self) -> None:
        self.http.close()
        self.process.kill()
        self.process.wait(PATIENCE)
        self.process.stdout.close()
        self.log.close()

    def logged(self) -> str:
        return Path(self.log.name).read_text()

    def submit(self, data: bytes, kind: str = "enhance", name: str = "scan.ply", **options: object) -> dict:
        answer = self.http.post(
            f"/v1/{kind}", files={"file": (name, data)}, data={k: str(v) for k, v in options.items()}
        )
        assert answer.status_code in (200, 202), answer.text
        return answer.json()

    def events(self, job: dict) -> Iterator[dict]:
        with self.http.stream("GET", job["links"]["events"]) as stream:
            for line in stream.iter_lines():
                if line.startswith("data: "):
                    yield json.loads(line.removeprefix("data: "))

    def wait(self, job: dict) -> dict:
        """The job when it is over."""
        *_, last = self.events(job)
        return last


class GatedProgram:
    """The native program, but `enhance` says that it has begun and waits for a gate to be opened."""

    def __init__(self, folder: Path):
        folder.mkdir()
        self._gate, self._pids, self.path = folder / "gate", folder / "pids", folder / "anchorsplat"
        self._pids.mkdir()
        self.path.write_text(
            "#!/bin/sh\n"
            'if [ "$1" = enhance ]; then\n'
            f'  : >"{self._pids}/$$"\n'
            """  echo '{"task": "gate", "done": 1, "total": 2}' >&2\n"""
            f'  while [ ! -e "{self._gate}" ]; do sleep 0.02; done\n'
            "fi\n"
            f'exec "{os.path.realpath(program())}" "$@"\n'
        )
        self.path.chmod(0o755)

    @property
    def environment(self) -> dict[str, str]:
        return {"ANCHORSPLAT_PROGRAM": str(self.path)}

    def open(self) -> None:
        self._gate.touch()

    def pids(self) -> list[int]:
        return sorted(int(path.name) for path in self._pids.iterdir())

    def running(self) -> list[int]:
        return [pid for pid in self.pids() if alive(pid)]
