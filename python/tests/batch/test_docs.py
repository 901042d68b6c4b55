"""docs/batch.md does what it says."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from anchorsplat import batch
from anchorsplat.batch.command_line import _parser

from .conftest import Control, splat

PAGE = (Path(__file__).resolve().parents[3] / "docs/batch.md").read_text()
COMMANDS = re.findall(r"^    anchorsplat batch ([^#\n]+?) *(?:#.*)?$", PAGE, re.MULTILINE)
SNIPPETS = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


def test_there_is_something_to_test() -> None:
    assert len(COMMANDS) >= 3 and len(SNIPPETS) >= 1


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_are_understood(command: str, watched: Control) -> None:
    words = [word for word in shlex.split(command) if word != "…"]
    if "--out" not in words:
        words += ["--out", "x"]
    _parser(words[0]).parse_intermixed_args(words[1:])


def test_the_first_command_and_the_snippets(control: Control, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    splat(tmp_path / "scans/day/a.ply")
    monkeypatch.chdir(tmp_path)
    assert batch.main(shlex.split(COMMANDS[0])) == 0
    assert (tmp_path / "sharp/day/a.spz").exists()
    for snippet in SNIPPETS:
        exec(compile(snippet, "docs/batch.md", "exec"), {})
    assert control.calls() == ["a.ply", "a.ply"]  # --upscale 4 was given the second time


def test_every_option_has_its_page() -> None:
    for option in ("--list", "--root", "--format", "--manifest", "--verify", "--ray", "--retries", "--retry", "--timeout"):
        assert f"`{option}" in PAGE or f" {option} " in PAGE, option
