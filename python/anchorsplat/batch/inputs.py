"""Expands addresses, patterns and lists to inputs, and names their results."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from .._errors import BadArgumentError, NotFoundError
from . import storage

#: Formats of results: those of `enhance` with a single file.
FORMATS = ("ply", "compressed.ply", "spz", "sog", "splat", "glb")

_WILD = re.compile(r"[*?\[]")
_SUFFIX = re.compile(r"(\.compressed\.ply|\.[A-Za-z0-9]+)$")


@dataclass
class Input:
    uri: str
    name: str  # of the result, below the batch's folder
    size: int | None = None  # bytes
    identity: str = ""  # changes with the content; "": unknown
    there: bool = True


def expand(words: Iterable[str], lists: Iterable[str] = (), *, root: str | None = None, format: str | None = None) -> list[Input]:
    """The inputs, each once, in order of first mention.

    A word is a path, a URL or a pattern of either (`*`, `?`, `[a-z]`, `**`); a list is a text file of words, one a line,
    `#` begins a comment. The result of `ROOT/a/b.ply` is called `a/b.ply`; ROOT is `root`, else what stands before a
    pattern's first wild folder, else the input's own folder. `format` replaces the ending; without it, formats that are
    not written become PLY.

    Errors: BadArgumentError: two inputs whose results would have the same name, a folder, an input outside of root;
    NotFoundError: a list that is not there, a pattern that nothing matches. An input that is not there is no error.
    """
    if format is not None and format not in FORMATS:
        raise BadArgumentError(f"--format {format}: must be one of {', '.join(FORMATS)}")
    wanted = list(words)
    for source in lists:
        for line in storage.read_text(storage.absolute(source)).splitlines():
            line = line.partition(" #")[0].strip()
            if line and not line.startswith("#"):
                wanted.append(line)
    if not wanted:
        raise BadArgumentError("no inputs: pass paths, patterns, URLs, or --list FILE")

    found: dict[str, tuple[str, dict[str, Any] | None]] = {}  # address: root, info from its file system
    plain: dict[str, str] = {}
    for word in wanted:
        literal = storage.is_local(word) and storage.stat(storage.absolute(word)) is not None
        if _wild(word) and not literal:
            matches = _matches(word)
            if not matches:
                raise NotFoundError(f"{word}: no file matches")
            for uri, told in matches.items():
                found.setdefault(uri, (_before_wild(word), told))
        else:
            uri = storage.absolute(word)
            plain.setdefault(uri, posixpath.dirname(uri))
            found.setdefault(uri, (posixpath.dirname(uri), None))
    for uri, info in storage.stat_many([uri for uri in plain if found[uri][1] is None]).items():
        found[uri] = (found[uri][0], info)

    inputs = []
    base = storage.absolute(root) if root else None
    for uri, (own_root, info) in found.items():
        if info is None and storage.is_local(uri) and storage.open_place(uri)[0].isdir(uri):
            raise BadArgumentError(f"{uri}: is a folder; pass the files in it: '{uri}/*.ply', or '{uri}/**/*.ply'")
        name = _name(uri, base or own_root, format)
        size = info.get("size") if info else None
        inputs.append(Input(uri, name, size, storage.identity(info) if info else "", info is not None))
    _refuse_same_names(inputs)
    return inputs


def _wild(word: str) -> bool:
    """In web URLs, ? starts a query."""
    return bool(_WILD.search(word.partition("?")[0] if word.startswith(("http://", "https://")) else word))


def _matches(pattern: str) -> dict[str, dict[str, Any]]:
    address = storage.absolute(pattern)
    fs, path = storage.open_place(address)
    listing = fs.glob(path, detail=True)
    return {
        storage.same_file_system(address, fs, name): info
        for name, info in sorted(listing.items())
        if info.get("type") != "directory"
    }


def _before_wild(pattern: str) -> str:
    kept = []
    for part in storage.absolute(pattern).split("/"):
        if _WILD.search(part):
            break
        kept.append(part)
    return "/".join(kept)


def _name(uri: str, root: str, format: str | None) -> str:
    prefix = root.rstrip("/") + "/"
    if not uri.startswith(prefix):
        raise BadArgumentError(f"{uri}: is not below --root {root}")
    name = uri[len(prefix) :].partition("?")[0]
    if not name or any(part in ("", ".", "..") for part in name.split("/")) or "\0" in name:
        raise BadArgumentError(f"{uri}: no valid name for the result follows from it; rename the file")
    found = _SUFFIX.search(name)
    suffix = found[1] if found else ""
    stem = name[: len(name) - len(suffix)]
    if format is None:
        format = suffix[1:].lower() if suffix[1:].lower() in FORMATS else "ply"
    if not stem.rpartition("/")[2]:
        raise BadArgumentError(f"{uri}: no valid name for the result follows from it; rename the file")
    return f"{stem}.{format}"


def _refuse_same_names(inputs: list[Input]) -> None:
    by_name: dict[str, str] = {}
    for item in inputs:
        other = by_name.setdefault(item.name, item.uri)
        if other != item.uri:
            raise BadArgumentError(
                f"{other} and {item.uri} would both become {item.name}; --root FOLDER keeps the folders below it, "
                "or run two batches"
            )
