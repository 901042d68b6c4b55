"""Splat files."""

from __future__ import annotations

import io
import os
from typing import IO, Any, Literal, NamedTuple, Union

from . import _core
from ._cloud import Cloud
from ._errors import BadArgumentError, IoError
from ._run import ProgressLike, run
from ._words import path_bytes, words_of

PathLike = Union[str, "os.PathLike[str]"]
Order = Literal["format", "keep", "morton", "importance"]


class Format(NamedTuple):
    """A splat format."""

    name: str  #: "SPZ", for people
    extensions: tuple[str, ...]  #: (".spz",); the first one is what functions here are told
    is_read: bool
    is_written: bool


def formats() -> list[Format]:
    """Those that are read or written."""
    return [Format(name, tuple(extensions), read, written) for name, extensions, read, written in _core.formats()]


def is_buffer(source: object) -> bool:
    return isinstance(source, (bytes, bytearray, memoryview))


def read(
    source: PathLike | bytes | bytearray | memoryview | IO[bytes],
    *,
    format: str | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> Cloud:
    """Reads a splat of any known format, found by its content first and its extension second.

    `source` is a path, the bytes of a file or a file that is open for reading bytes; a folder with a meta.json is a SOG.
    `format` is an extension (".spz", "spz"), for those formats that have no mark of their own.

    Values that are not finite come through. Raises NotFoundError, IoError and BadFileError, which says the byte or line, the
    property and what was expected; BadArgumentError: a format that is none.
    """
    with run(threads, progress) as how:
        if isinstance(source, (str, os.PathLike)):
            return Cloud._of(_core.read_path(path_bytes(source), format or "", how))
        if hasattr(source, "read"):
            if format is None and str(getattr(source, "name", "")).lower().endswith(".splat"):
                format = "splat"  # which has no mark of its own
            source = source.read()
        if not is_buffer(source):
            raise TypeError("read: expected a path, bytes or a file opened for bytes, found " + type(source).__name__)
        return Cloud._of(_core.read_bytes(source, format or "", how))


def write(
    target: PathLike | IO[bytes],
    cloud: Cloud,
    *,
    format: str | None = None,
    sort: Order = "format",
    spz_version: int = 4,
    overwrite: bool = False,
    threads: int = 0,
    progress: ProgressLike = None,
) -> None:
    """Writes a splat in the format of the extension of a path, or as `format` into a file that is open for bytes.

    The file appears whole or not at all. What the format has no place for is a SplatWarning. `sort`: the order of the
    Gaussians in the file, "format" as the format likes it; `spz_version`: 4, or 3 for programs that only know gzip.

    Raises ExistsError unless `overwrite`, NotFoundError (the folder), IoError; BadArgumentError: no Gaussians, an extension
    that is not written.
    """
    words = words_of(write, locals(), besides=("format",))
    if isinstance(target, (str, os.PathLike)):
        if format is not None:
            raise BadArgumentError("format: the extension of a path says it")
        with run(threads, progress) as how:
            _core.write_path(path_bytes(target), cloud, words, overwrite, how)
        return
    if not hasattr(target, "write"):
        raise TypeError("write: expected a path or a file opened for bytes, found " + type(target).__name__)
    if format is None:
        raise BadArgumentError("format: a file that is open has no extension; say which, such as format='spz'")
    data: bytes = to_bytes(
        cloud, format, sort=sort, spz_version=spz_version, threads=threads, progress=progress
    )
    _write_all(target, data)


def _write_all(target: IO[bytes], data: bytes) -> None:
    """A file without a buffer may take a part and say how much."""
    rest = memoryview(data)
    while rest:
        written = target.write(rest)
        if written is None and not isinstance(target, io.RawIOBase):  # of a kind of file that does not say
            return
        if not written:
            raise IoError(f"the file took only {len(data) - len(rest):,} of {len(data):,} bytes")
        rest = rest[written:]


def to_bytes(
    cloud: Cloud,
    format: str,
    *,
    sort: Order = "format",
    spz_version: int = 4,
    threads: int = 0,
    progress: ProgressLike = None,
) -> bytes:
    """The bytes of the file that ``write`` would make; `format` is its extension (".spz", "spz").

    Raises BadArgumentError: no Gaussians, a format that is none, is not written, or of several files.
    """
    words = words_of(to_bytes, locals())
    with run(threads, progress) as how:
        return _core.write_bytes(format, cloud, words, how)
