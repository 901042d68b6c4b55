from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from .service import GatedProgram, Server


@pytest.fixture
def gated(tmp_path: Path) -> GatedProgram:
    return GatedProgram(tmp_path / "gated")


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Callable[..., Server]]:
    """Starts services that are gone at the end of the test."""
    started: list[Server] = []

    def start(*words: str, data: str = "data", environment: dict[str, str] | None = None) -> Server:
        started.append(Server(tmp_path / data, *words, environment=environment))
        return started[-1]

    yield start
    for server in started:
        if server.process.poll() is None:
            server.kill()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for all tests of a file that leave it as it was."""
    made = Server(tmp_path_factory.mktemp("serve") / "data", "--workers", "2", "--threads", "1")
    yield made
    assert made.stop() == 0, made.logged()
    assert "Traceback" not in made.logged(), made.logged()
