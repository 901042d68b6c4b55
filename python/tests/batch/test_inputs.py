"""Names of results, before any work begins."""

from __future__ import annotations

from pathlib import Path

import fsspec
import pytest

from anchorsplat._errors import BadArgumentError, NotFoundError
from anchorsplat.batch.inputs import expand

from .conftest import splat


def names(*words: object, **how: object) -> dict[str, str]:
    return {item.uri: item.name for item in expand([str(word) for word in words], **how)}


def test_a_path_keeps_its_name_and_its_format_where_it_can_be_written(tmp_path: Path) -> None:
    for name, expected in {
        "a.ply": "a.ply", "b.spz": "b.spz", "c.ksplat": "c.ply", "d.compressed.ply": "d.compressed.ply", "e.v2.ply": "e.v2.ply",
        "f": "f.ply", "G.PLY": "G.ply",
    }.items():  # fmt: skip
        (tmp_path / name).touch()
        assert names(tmp_path / name) == {str(tmp_path / name): expected}
    assert list(names(tmp_path / "d.compressed.ply", format="spz").values()) == ["d.spz"]


def test_folders_below_the_wild_part_of_a_pattern_stay(tmp_path: Path) -> None:
    for name in ("x/a.ply", "y/a.ply", "a.ply"):
        splat(tmp_path / name)
    assert sorted(names(f"{tmp_path}/**/*.ply").values()) == ["a.ply", "x/a.ply", "y/a.ply"]


def test_inputs_of_one_name_are_refused_and_root_keeps_their_folders(tmp_path: Path) -> None:
    words = [splat(tmp_path / "x/a.ply"), splat(tmp_path / "y/a.ply")]
    with pytest.raises(BadArgumentError, match=r"x/a\.ply and .*y/a\.ply would both become a\.ply; --root"):
        names(*words)
    assert list(names(*words, root=str(tmp_path)).values()) == ["x/a.ply", "y/a.ply"]
    with pytest.raises(BadArgumentError, match="is not below --root"):
        names(words[0], root=str(tmp_path / "y"))
    (tmp_path / "x/a.spz").touch()
    with pytest.raises(BadArgumentError, match=r"would both become a\.spz"):
        names(tmp_path / "x/*.*", format="spz")


def test_the_same_input_twice_is_one(tmp_path: Path) -> None:
    path = splat(tmp_path / "a.ply")
    assert len(names(path, path, f"{tmp_path}/*.ply", f"file://{path}")) == 1


def test_lists_have_comments_and_patterns_and_may_name_what_is_not_there(tmp_path: Path) -> None:
    splat(tmp_path / "a.ply")
    splat(tmp_path / "b.ply")
    listed = tmp_path / "list.txt"
    listed.write_text(f"# scans\n{tmp_path}/[ab].ply\n\n{tmp_path}/gone.ply  # not there\n")
    found = expand([], [str(listed)])
    assert [(item.name, item.there) for item in found] == [("a.ply", True), ("b.ply", True), ("gone.ply", False)]


def test_a_pattern_that_nothing_matches_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="no file matches"):
        names(tmp_path / "*.ply")
    with pytest.raises(NotFoundError, match="no such file"):
        expand([], [str(tmp_path / "list.txt")])
    with pytest.raises(BadArgumentError, match="no inputs"):
        expand([])
    with pytest.raises(BadArgumentError, match="is a folder"):
        names(tmp_path)
    with pytest.raises(NotFoundError, match="nope://"):
        names("nope://a.ply")


def test_a_file_whose_name_looks_like_a_pattern_is_a_file(tmp_path: Path) -> None:
    assert list(names(splat(tmp_path / "a[1].ply")).values()) == ["a[1].ply"]


def test_urls_have_identities_and_names(tmp_path: Path) -> None:
    with fsspec.open("memory://in/x/a.ply", "wb") as file:
        file.write(splat(tmp_path / "a.ply").read_bytes())
    (item,) = expand(["memory://in/**/*.ply"])
    assert (item.uri, item.name, item.there) == ("memory:///in/x/a.ply", "x/a.ply", True)
    assert item.identity and item.size == (tmp_path / "a.ply").stat().st_size


@pytest.mark.parametrize("name", ["memory://bucket/..", "memory://bucket/.ply"])
def test_names_that_lead_elsewhere_are_refused(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("anchorsplat.batch.storage.stat_many", lambda uris: dict.fromkeys(uris))
    with pytest.raises(BadArgumentError, match="no valid name for the result"):
        names(name)
