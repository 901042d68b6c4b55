"""Batches on one Ray for all tests, and a program that tests can watch, stop and have killed."""

from __future__ import annotations

import os
import random
import stat
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from anchorsplat.batch import cluster
from anchorsplat.batch.engine import engine, program

# Between the batch and the program: writes down every splat it is asked for, and kills the worker that asks when told.
_WRAPPER = """#!/bin/sh
control={control}
case "$1 ${{2##*/}}" in
"enhance none.ply" | "enhance one.ply") ;;
"enhance "*)
  name="${{2##*/}}"
  echo "$name" >> "$control/calls"
  if rm "$control/kill-$name" 2>/dev/null || [ -e "$control/always-kill-$name" ]; then kill -9 $PPID; exit 1; fi
  if rm "$control/end-$name" 2>/dev/null || [ -e "$control/always-end-$name" ]; then kill -9 $$; fi
  if [ -e "$control/hold-$name" ]; then echo $$ > "$control/held-$name"; read -r _ < "$control/hold-$name"; fi ;;
esac
exec {program} "$@"
"""


class Control:
    """What tests tell the program, and hear of it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def reset(self) -> None:
        for path in self.folder.iterdir():
            path.unlink()

    def calls(self) -> list[str]:
        """Names of the inputs that it was started for since the last look, sorted."""
        try:
            names = (self.folder / "calls").read_text().split()
            (self.folder / "calls").unlink()
        except FileNotFoundError:
            return []
        return sorted(names)

    def kill_worker_of(self, name: str, *, always: bool = False) -> None:
        (self.folder / f"{'always-' if always else ''}kill-{name}").touch()

    def kill_program_of(self, name: str, *, always: bool = False) -> None:
        (self.folder / f"{'always-' if always else ''}end-{name}").touch()

    def hold(self, name: str) -> Path:
        """The program stops at this input until somebody writes to the pipe."""
        pipe = self.folder / f"hold-{name}"
        os.mkfifo(pipe)
        return pipe


@pytest.fixture(scope="session")
def native() -> Path:
    return program()


@pytest.fixture(scope="session")
def watched(native: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Control]:
    """The control of the program that batches run in these tests."""
    folder = tmp_path_factory.mktemp("watched")
    control = folder / "control"
    control.mkdir()
    wrapper = folder / "anchorsplat"
    wrapper.write_text(_WRAPPER.format(control=control, program=native))
    wrapper.chmod(wrapper.stat().st_mode | stat.S_IXUSR)
    before = os.environ.get("ANCHORSPLAT_PROGRAM")
    os.environ["ANCHORSPLAT_PROGRAM"] = str(wrapper)
    engine.cache_clear()
    yield Control(control)
    engine.cache_clear()
    if before is None:
        del os.environ["ANCHORSPLAT_PROGRAM"]
    else:
        os.environ["ANCHORSPLAT_PROGRAM"] = before


@pytest.fixture(scope="session")
def ray(watched: Control) -> Iterator[object]:
    """A Ray of two workers. Starting one takes seconds, so all tests share it."""
    with cluster.connected(None, 2) as connected:
        yield connected


@pytest.fixture
def control(watched: Control, ray: object) -> Control:
    watched.reset()
    return watched


def splat(path: Path, seed: int = 0, gaussians: int = 40) -> Path:
    """A small splat of SH degree 0."""
    random_ = random.Random(seed)
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", *(f"scale_{i}" for i in range(3)),
             *(f"rot_{i}" for i in range(4))]  # fmt: skip
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {gaussians}\n"
    header += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    body = b""
    for _ in range(gaussians):
        values = [random_.uniform(-1, 1) for _ in range(6)] + [random_.uniform(0, 3)]
        values += [random_.uniform(-4, -3) for _ in range(3)] + [1.0, 0.0, 0.0, 0.0]
        body += struct.pack("<14f", *values)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(header.encode() + body)
    return path


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    """A folder of four splats: a, b, c, d.ply."""
    for seed, name in enumerate("abcd"):
        splat(tmp_path / "scans" / f"{name}.ply", seed)
    return tmp_path / "scans"


def enhanced_by_hand(native: Path, source: Path, out: Path, *options: str) -> bytes:
    """What the program itself makes of it."""
    subprocess.run([native, "enhance", source, "-o", out, "-q", *options], check=True, capture_output=True)
    return out.read_bytes()


def command_line(*words: str | Path, **environment: str) -> subprocess.Popen[str]:
    """`anchorsplat batch ...` as a process of its own."""
    script = "import sys; from anchorsplat.batch import main; sys.exit(main(sys.argv[1:]))"
    return subprocess.Popen(
        [sys.executable, "-c", script, *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
    )
