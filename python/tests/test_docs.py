"""What documents show works: every Python snippet of docs/python.md in order, README's, and the notebook from top to bottom."""

from __future__ import annotations

import ast
import json
import os
import re
import warnings

import pytest
from test_render import project

import anchorsplat

TORCH = os.environ.get("ANCHORSPLAT_TEST_TORCH") != "0"


@pytest.fixture
def scan(whole, tmp_path, monkeypatch):
    """A folder with scan.ply and the pictures of its capture."""
    monkeypatch.chdir(tmp_path)
    anchorsplat.write("scan.ply", whole[:2500])
    os.mkdir("capture")
    project(tmp_path / "capture", whole[:2500], views=6, side=48, images="images")
    warnings.simplefilter("ignore", anchorsplat.SplatWarning)  # of a splat that is a torso of one
    return tmp_path


def run(code: str, where: str, names: dict) -> object:
    """Runs a snippet; the value of its last line, if that is an expression."""
    tree = ast.parse(code, where)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, where, "exec"), names)
    return eval(compile(ast.Expression(last.value), where, "eval"), names) if last is not None else None


def snippets(text: str) -> list[tuple[int, str]]:
    return [
        (text[: match.start()].count("\n") + 1, match.group(1))
        for match in re.finditer(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    ]


def test_docs_python(sources, scan):
    found = snippets((sources / "docs" / "python.md").read_text())
    assert len(found) >= 7
    names: dict = {}
    for line, code in found:
        if "import torch" in code and not TORCH:
            continue
        run(code, f"docs/python.md:{line}", names)
    assert (scan / "scan-4x.ply").exists() and (scan / "page.html").exists()


def test_readme(sources, scan):
    found = snippets((sources / "README.md").read_text())
    assert found
    for line, code in found:
        run(code, f"README.md:{line}", {})
    assert len(anchorsplat.read(scan / "scan-4x.ply")) >= 2500


def test_the_notebook(sources, monkeypatch):
    (path,) = (sources / "examples" / "python").glob("*.ipynb")
    monkeypatch.chdir(path.parent)
    notebook = json.loads(path.read_text())
    assert notebook["nbformat"] == 4
    before = sorted(os.listdir(path.parent))
    names: dict = {}
    shown = []
    for number, cell in enumerate(notebook["cells"]):
        assert not cell.get("outputs"), "outputs are made when it is run"
        if cell["cell_type"] == "code":
            value = run("".join(cell["source"]), f"{path.name}, cell {number}", names)
            shown.append(value._repr_html_() if hasattr(value, "_repr_html_") else value)
    assert any(isinstance(value, str) and value.startswith("<iframe") for value in shown)
    assert sorted(os.listdir(path.parent)) == before
