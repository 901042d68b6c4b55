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

    name: str  #: such as "SPZ"
    extensions: tuple[str, ...]  #: such as (".spz",); functions take the first
    is_read: bool
    is_written: bool


def formats() -> list[Format]:
    """All formats that can be read or written."""
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
    """Reads a splat of any known format, recognised by content, then by extension.

    `source` is a path, the bytes of a file, or a file opened for reading bytes; a folder with a meta.json is a SOG.
    `format` is an extension (".spz", "spz"), for formats that cannot be recognised by content.

    Values that are not finite are kept. Raises NotFoundError, IoError; BadFileError, which names the byte or line, the
    property and what was expected; BadArgumentError: an unknown format.
    """
    with run(threads, progress) as how:
        if isinstance(source, (str, os.PathLike)):
            return Cloud._of(_core.read_path(path_bytes(source), format or "", how))
        if hasattr(source, "read"):
            if format is None and str(getattr(source, "name", "")).lower().endswith(".splat"):
                format = "splat"  # cannot be recognised by content
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
    """Writes a splat to a path, in the format of its extension, or to a file opened for bytes, as `format`.

    A path appears whole or not at all. A SplatWarning names what the format cannot store. `sort`: order of the Gaussians in the
    file; "format" is best for the format. `spz_version`: 4, or 3 for programs that only read gzip.

    Raises ExistsError unless `overwrite`, NotFoundError (the folder), IoError; BadArgumentError: no Gaussians, or an extension
    that cannot be written.
    """
    words = words_of(write, locals(), besides=("format",))
    if isinstance(target, (str, os.PathLike)):
        if format is not None:
            raise BadArgumentError("format: omit it for a path, whose extension gives the format")
        with run(threads, progress) as how:
            _core.write_path(path_bytes(target), cloud, words, overwrite, how)
        return
    if not hasattr(target, "write"):
        raise TypeError("write: expected a path or a file opened for bytes, found " + type(target).__name__)
    if format is None:
        raise BadArgumentError("format: required for an open file, such as format='spz'")
    data: bytes = to_bytes(
        cloud, format, sort=sort, spz_version=spz_version, threads=threads, progress=progress
    )
    _write_all(target, data)


def _write_all(target: IO[bytes], data: bytes) -> None:
    """Unbuffered files may write only a part and return its size."""
    rest = memoryview(data)
    while rest:
        written = target.write(rest)
        if written is None and not isinstance(target, io.RawIOBase):  # a file that does not return it
            return
        if not written:
            raise IoError(f"only {len(data) - len(rest):,} of {len(data):,} bytes were written")
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
    """The bytes of the file that ``write`` would write; `format` is its extension (".spz", "spz").

    Raises BadArgumentError: no Gaussians, or a format that is unknown, cannot be written, or has several files.
    """
    words = words_of(to_bytes, locals())
    with run(threads, progress) as how:
        return _core.write_bytes(format, cloud, words, how)
