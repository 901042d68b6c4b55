"""`batch dataset` and `batch eval`: the same files as those of the program alone. `make batch-test` runs it."""

from __future__ import annotations

import filecmp
import json
import subprocess
from pathlib import Path

import pytest

from .conftest import command_line

_CUBE = """mtllib none.mtl
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 5 1 4 8
"""
_SMALL = ["--views=6", "--size=32", "--low-size=16", "--steps=20", "--points=100", "--min-psnr=0", "--hold-out=3"]


def run(*words: str | Path) -> tuple[int, str, str]:
    process = command_line(*words)
    out, err = process.communicate(timeout=300)
    return process.returncode, out, err


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("meshes")
    for number, name in enumerate(("low", "middle", "high")):
        lines = _CUBE.replace("v 1 1", f"v 1 {number + 2}").replace("mtllib none.mtl\n", "")
        (folder / f"{name}.obj").write_text(lines)
    (folder / "broken.obj").write_text("v nonsense\n")
    return folder


@pytest.fixture(scope="module")
def data(meshes: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same data set twice: made by batch, and by the program alone."""
    folder = tmp_path_factory.mktemp("data")
    code, out, err = run("dataset", *sorted(meshes.glob("*.obj")), "-o", folder / "batch", *_SMALL)
    assert code == 1 and "4 objects: 3 made, 0 there already, 1 failed" in out, err
    return folder / "batch", folder / "alone"


def test_a_data_set_is_the_programs_own(native: Path, meshes: Path, data: tuple[Path, Path]) -> None:
    made, alone = data
    command = [native, "dataset", "build", *sorted(meshes.glob("*.obj")), "-o", alone, *_SMALL]
    assert subprocess.run(command, capture_output=True).returncode == 1
    for name in ("low", "middle", "high"):
        assert_same_tree(made / name, alone / name)
    assert without_seconds(made / "manifest.jsonl") == without_seconds(alone / "manifest.jsonl")
    failed = [json.loads(line) for line in (made / "failures.jsonl").read_text().splitlines()]
    assert [(f["name"], f["stage"]) for f in failed] == [
        (f["name"], f["stage"]) for f in map(json.loads, (alone / "failures.jsonl").read_text().splitlines())
    ]
    assert not (made / ".batch").exists()
    assert subprocess.run([native, "dataset", "check", made], capture_output=True).returncode == 0


def test_a_data_set_that_is_there_is_not_made_again(meshes: Path, data: tuple[Path, Path]) -> None:
    before = {path: path.stat().st_mtime_ns for path in data[0].rglob("*.png")}
    code, out, _ = run("dataset", *sorted(meshes.glob("*.obj")), "-o", data[0], *_SMALL)
    assert code == 1 and "0 made, 3 there already, 1 failed" in out
    assert before == {path: path.stat().st_mtime_ns for path in data[0].rglob("*.png")}


def test_an_evaluation_is_the_programs_own(native: Path, data: tuple[Path, Path], tmp_path: Path) -> None:
    words = [data[0], "-o", tmp_path / "batch", "--methods", "raw,filter@0.5,filter"]
    code, out, err = run("eval", *words)
    assert code == 0 and "| filter@0.5 |" in out, err
    alone = subprocess.run([native, "eval", data[0], "-o", tmp_path / "alone", *words[3:]], capture_output=True, text=True)
    assert alone.returncode == 0
    for name in ("low", "middle", "high"):
        for method in ("raw", "filter", "filter@0.5"):
            mine, theirs = (json.loads((tmp_path / f / "objects" / name / f"{method}.json").read_text()) for f in ("batch", "alone"))
            assert mine["views"] == theirs["views"] and mine["key"] == theirs["key"]
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "batch/objects").rglob("*.json")}
    assert run("eval", *words)[0] == 0
    after = {path: json.loads(path.read_text()) for path in before}
    assert {path: value["views"] for path, value in after.items()}.keys() == before.keys()
    assert not (tmp_path / "batch/.batch").exists()


def without_seconds(manifest: Path) -> list[dict]:
    return [{k: v for k, v in json.loads(line).items() if k != "seconds"} for line in manifest.read_text().splitlines()]


def assert_same_tree(one: Path, other: Path) -> None:
    """All files but what the record says of seconds."""
    names = sorted(str(path.relative_to(one)) for path in one.rglob("*") if path.is_file())
    assert names == sorted(str(path.relative_to(other)) for path in other.rglob("*") if path.is_file())
    names.remove("record.json")
    _, different, missing = filecmp.cmpfiles(one, other, names, shallow=False)
    assert not different and not missing
