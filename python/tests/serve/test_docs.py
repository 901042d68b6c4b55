"""What docs/serve.md shows, run as it stands there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import anchorsplat
from anchorsplat.serve.settings import _parser

from .service import Server, small_ply

PAGE = (Path(__file__).parents[3] / "docs" / "serve.md").read_text()


def snippets(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_lines_of_python(server: Server, tmp_path: Path) -> None:
    (tmp_path / "scan.ply").write_bytes(small_ply())
    (code,) = snippets("python")
    program = f"service = {server.url!r}\n{code}"
    subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, check=True, timeout=120, env={"PATH": os.environ["PATH"]}
    )
    assert len(anchorsplat.read(tmp_path / "scan-4x.ply")) >= 60


def test_every_option_and_endpoint_is_there(server: Server) -> None:
    for option in re.findall(r"--[a-z][a-z-]+", _parser().format_help()):
        assert option == "--help" or option in PAGE, option
    for path in server.http.get("/openapi.json").json()["paths"]:
        short = path.removeprefix("/v1/jobs").replace("job_id", "id")
        assert short in PAGE, path
