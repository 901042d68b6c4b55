from __future__ import annotations

import os
import pathlib
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator

import numpy as np
import pytest

import anchorsplat

SOURCES = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(anchorsplat.__file__).parent / "_bin" / "anchorsplat"


@pytest.fixture(scope="session")
def sources() -> pathlib.Path:
    return SOURCES


@pytest.fixture(scope="session")
def biplane() -> pathlib.Path:
    return SOURCES / "examples" / "biplane" / "input.ply"


@pytest.fixture(scope="session")
def whole(biplane: pathlib.Path) -> anchorsplat.Cloud:
    return anchorsplat.read(biplane)


@pytest.fixture
def cloud(whole: anchorsplat.Cloud) -> anchorsplat.Cloud:
    """Some of it, so that tests take little; nobody else's."""
    return whole[:2500].copy()


@pytest.fixture(scope="session")
def program() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs the native program."""

    def run(*words: object, code: int = 0) -> subprocess.CompletedProcess[str]:
        done = subprocess.run([str(PROGRAM), *map(str, words)], capture_output=True, text=True)
        assert done.returncode == code, done.stderr
        return done

    return run


@pytest.fixture(scope="session")
def python() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs a Python of its own, which finds the same package."""

    def run(code: str, **keywords: object) -> subprocess.CompletedProcess[str]:
        package = str(pathlib.Path(anchorsplat.__file__).parents[1])
        paths = os.pathsep.join([package, os.environ.get("PYTHONPATH", "")])
        environment = {**os.environ, "PYTHONPATH": paths}
        return subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, env=environment, **keywords  # type: ignore
        )

    return run


@pytest.fixture(autouse=True)
def ctrl_c() -> Iterator[None]:
    """As in a terminal: what a shell starts in the background ignores Ctrl-C, and Python leaves it at that."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def same(a: anchorsplat.Cloud, b: anchorsplat.Cloud) -> bool:
    """The same bits."""
    names = ("means", "log_scales", "quats", "opacity_logits", "sh")
    return all(np.array_equal(getattr(a, n).view(np.uint32), getattr(b, n).view(np.uint32)) for n in names)
