"""What survives of a manifest, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import fsspec
import pytest

from anchorsplat._errors import BadFileError, ExistsError
from anchorsplat.batch.manifest import Manifest


def done(name: str, **more: object) -> dict[str, object]:
    return {"output": name, "state": "done", "fingerprint": "f", "identity": "1", "output_size": 5, **more}


@pytest.fixture(params=["file", "memory"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Where a manifest may be: a file, and a folder of segments."""
    return str(tmp_path / "manifest.jsonl") if request.param == "file" else f"memory://{tmp_path.name}-{id(request)}/manifest"


def test_rows_are_there_when_it_is_opened_again(place: str) -> None:
    first = Manifest(place)
    first.claim(["a", "b", "c"])
    first.record(done("a"))
    first.record({"output": "b", "state": "failed", "error": {"code": "bad_file", "message": "no"}})
    first.same("a", "2")
    first.close()
    again = Manifest(place)
    assert {name: known.state for name, known in again.known.items()} == {"a": "done", "b": "failed", "c": "claimed"}
    assert again.known["a"].identity == "2" and again.known["a"].output_size == 5
    assert again.rows()["a"]["identity"] == "2"
    again.close()


def test_compaction_keeps_what_counts(place: str) -> None:
    first = Manifest(place)
    first.claim(["a", "later"])
    for number in range(3000):
        first.record(done("a", number=number))
    first.same("a", "new")
    first.close()
    again = Manifest(place)
    rows, known = again.rows(), dict(again.known)
    again.close()
    if not place.startswith("memory"):
        assert len(Path(place).read_text().splitlines()) == 2
    assert rows["a"]["number"] == 2999 and rows["a"]["identity"] == "new"
    assert known["later"].state == "claimed" and known["a"].identity == "new"


def test_a_line_cut_short_counts_as_not_written(tmp_path: Path) -> None:
    path = tmp_path / "manifest.jsonl"
    manifest = Manifest(str(path))
    manifest.record(done("a"))
    manifest.record(done("b"))
    manifest.close()
    whole = path.read_bytes()
    lines = whole.splitlines(keepends=True)
    for end in range(len(lines[0]), len(whole)):  # wherever a kill may have cut the second one
        path.write_bytes(whole[:end])
        manifest = Manifest(str(path))
        assert set(manifest.known) == {"a"}
        manifest.record(done("c"))
        manifest.close()
        assert [json.loads(line)["output"] for line in path.read_text().splitlines()] == ["a", "c"]


def test_one_batch_at_a_time(tmp_path: Path) -> None:
    path = str(tmp_path / "manifest.jsonl")
    first = Manifest(path)
    with pytest.raises(ExistsError, match="another batch uses it"):
        Manifest(path)
    first.close()
    Manifest(path).close()


def test_what_is_no_manifest_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    for text in ("buy milk\n", "[]\n", '{"state": "done"}\n', '{"same": "never", "identity": ""}\n'):
        path.write_text(text)
        with pytest.raises(BadFileError, match=r"notes\.txt: line 1: is not a line of a batch manifest"):
            Manifest(str(path))
        assert path.read_text() == text


def test_segments_of_many_runs_become_few() -> None:
    place = "memory://many-segments/manifest"
    for number in range(40):
        manifest = Manifest(place)
        manifest.record(done(f"{number}"))
        manifest.close()
    fs = fsspec.filesystem("memory")
    Manifest(place).close()
    assert len(fs.find("/many-segments/manifest")) <= 32
    manifest = Manifest(place)
    assert len(manifest.known) == 40
    manifest.close()
