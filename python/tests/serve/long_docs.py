"""The lines for a shell of docs/serve.md, by a real curl (`make serve-test`)."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import anchorsplat

from .service import Server, small_ply
from .test_docs import snippets


def test_the_lines_for_a_shell(server: Server, tmp_path: Path) -> None:
    (tmp_path / "scan.ply").write_bytes(small_ply())
    (lines,) = snippets("sh")
    job = None
    for line in lines.strip().splitlines():
        command = line.split("   #")[0].replace("http://127.0.0.1:7860", server.url)
        if job:
            command = command.replace("2vK…", job["id"])
        said = subprocess.run(
            ["bash", "-c", command + " --fail-with-body -sS"], cwd=tmp_path, capture_output=True, text=True, timeout=120
        )
        assert said.returncode == 0, (command, said)
        job = job or json.loads(said.stdout)
    assert len(anchorsplat.read(tmp_path / "scan-4x.spz")) >= 60
