"""The manifest: a line of JSON per event of a result. Only the process that runs the batch writes it.

Lines, in the order of time; the last one about a name counts:

    {"claim": [NAME, ...]}                      about to be made: what is there under these names is this batch's
    {"output": NAME, "state": "done", ...}      made; docs/batch.md has all members
    {"output": NAME, "state": "failed", "error": {"code": ..., "message": ...}, ...}
    {"same": NAME, "identity": ...}             read again, and its content is what it was

In a folder it is one file that is appended to; a line cut short by the end of the process counts as not written. Object
stores cannot append: there it is a folder of such files, each written once.
"""

from __future__ import annotations

import fcntl
import json
import os
import sys
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from .._errors import BadFileError, ExistsError, IoError
from . import storage

_SYNC_EVERY = 1.0  # seconds between fsyncs: at most this is lost in a power cut, nothing in a kill
_SEGMENT_EVERY = 5.0  # seconds between segments on object stores
_SEGMENT_BYTES = 1 << 20
_MANY_SEGMENTS = 32


class Known(NamedTuple):
    """What the manifest keeps per name between runs. Small, as there may be a million."""

    state: str  # "claimed", "done", "failed"
    fingerprint: str = ""
    identity: str = ""
    sha256: str = ""
    output_size: int = -1
    output_sha256: str = ""


def _known(row: dict[str, Any]) -> Known:
    if row.get("state") != "done":
        return Known("failed")
    return Known(
        "done",
        sys.intern(str(row.get("fingerprint", ""))),
        str(row.get("identity", "")),
        str(row.get("sha256", "")),
        int(row.get("output_size", -1)),
        str(row.get("output_sha256", "")),
    )


def _line(value: dict[str, Any]) -> str:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


class Manifest:
    """After opening it holds the known rows; claim() and record() add to it and to the file.

    Errors: BadFileError: a line that is none of a manifest's; ExistsError: another batch works with it; IoError.
    """

    def __init__(self, uri: str) -> None:
        self.uri = uri
        self.known: dict[str, Known] = {}
        self._lines = 0
        self._journal = _File(Path(uri)) if storage.is_local(uri) else _Segments(uri)
        try:
            for where, text in self._journal.read():
                self._take(where, text)
            if self._lines > 2 * len(self.known) + 1000 or self._journal.wants_compaction():
                self._compact()
        except BaseException:
            self._journal.close()
            raise

    def _take(self, where: str, text: str) -> None:
        try:
            line = json.loads(text)
            if not isinstance(line, dict):
                raise ValueError(text)
            self._lines += 1
            if "claim" in line:
                for name in line["claim"]:
                    self.known.setdefault(str(name), Known("claimed"))
            elif "same" in line:
                name = str(line["same"])
                self.known[name] = self.known[name]._replace(identity=str(line["identity"]))
            else:
                self.known[str(line["output"])] = _known(line)
        except (ValueError, TypeError, KeyError) as error:
            raise BadFileError(f"{where}: is not a line of a batch manifest; pass another --manifest or --out") from error

    def _compact(self) -> None:
        """The relevant state of each name."""
        claimed = [name for name, known in self.known.items() if known.state == "claimed"]
        head = [_line({"claim": claimed})] if claimed else []
        self._journal.replace([*head, *map(_line, self.rows().values())])

    def claim(self, names: list[str]) -> None:
        """Records names before work on them begins."""
        if names:
            self._journal.append(_line({"claim": names}))
            self._journal.flush()
            for name in names:
                self.known.setdefault(name, Known("claimed"))

    def record(self, row: dict[str, Any]) -> None:
        self._journal.append(_line(row))
        self.known[row["output"]] = _known(row)

    def same(self, name: str, identity: str) -> None:
        """Records that the input has a new identity but the same content."""
        self._journal.append(_line({"same": name, "identity": identity}))
        self.known[name] = self.known[name]._replace(identity=identity)

    def rows(self) -> dict[str, dict[str, Any]]:
        """The full last row of each name."""
        self._journal.flush()
        last: dict[str, dict[str, Any]] = {}
        for _, text in self._journal.read():
            line = json.loads(text)
            if "output" in line:
                last[line["output"]] = line
            elif "same" in line:
                last[line["same"]]["identity"] = line["identity"]
        return last

    def close(self) -> None:
        self._journal.flush()
        self._journal.close()


class _File:
    """A single file, locked while open, with one write per line."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._synced = time.monotonic()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._descriptor = self._open_locked()
        except ExistsError:
            raise
        except OSError as error:
            raise IoError(f"{path}: {error.strerror}") from error

    def _open_locked(self) -> int:
        while True:
            descriptor = os.open(self._path, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(descriptor)
                raise ExistsError(f"{self._path}: another batch uses it") from None
            # Compaction replaces the file of this name.
            try:
                if os.path.samestat(os.fstat(descriptor), os.stat(self._path)):
                    return descriptor
            except FileNotFoundError:
                pass
            os.close(descriptor)

    def read(self) -> Iterator[tuple[str, str]]:
        whole = 0
        with open(self._path, "rb") as file:
            for number, line in enumerate(file, 1):
                if not line.endswith(b"\n"):
                    break
                whole += len(line)
                if line.strip():
                    yield f"{self._path}: line {number}", line.decode("utf-8", "surrogateescape")
        if os.fstat(self._descriptor).st_size > whole:  # an unfinished last line
            os.ftruncate(self._descriptor, whole)

    def append(self, line: str) -> None:
        data = line.encode("utf-8", "surrogateescape") + b"\n"
        try:
            while data:
                data = data[os.write(self._descriptor, data) :]
            if time.monotonic() - self._synced > _SYNC_EVERY:
                os.fsync(self._descriptor)
                self._synced = time.monotonic()
        except OSError as error:
            raise IoError(f"{self._path}: {error.strerror}") from error

    def flush(self) -> None:
        """Nothing to do: every line is already written."""

    def wants_compaction(self) -> bool:
        return False

    def replace(self, lines: list[str]) -> None:
        near = self._path.with_name(f".{self._path.name}.{uuid.uuid4().hex[:8]}")
        descriptor = os.open(near, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            with open(descriptor, "wb", closefd=False) as file:
                file.writelines(line.rstrip("\n").encode("utf-8", "surrogateescape") + b"\n" for line in lines)
            os.fsync(descriptor)
            os.replace(near, self._path)
        except BaseException:
            os.close(descriptor)
            near.unlink(missing_ok=True)
            raise
        os.close(self._descriptor)
        self._descriptor = descriptor

    def close(self) -> None:
        try:
            os.fsync(self._descriptor)
        finally:
            os.close(self._descriptor)


class _Segments:
    """A folder of files, each written once as a whole, with names that sort by time."""

    def __init__(self, uri: str) -> None:
        self._uri = uri
        self._fs, self._path = storage.open_place(uri)
        self._waiting: list[str] = []
        self._bytes = 0
        self._flushed = time.monotonic()

    def _names(self) -> list[str]:
        try:
            self._fs.invalidate_cache()
            found = self._fs.find(self._path)
        except FileNotFoundError:
            return []
        except Exception as error:
            raise storage.filesystem_error(self._uri, error) from error
        return sorted(name for name in found if name.endswith(".jsonl"))

    def read(self) -> Iterator[tuple[str, str]]:
        for name in self._names():
            try:
                text = self._fs.cat_file(name).decode("utf-8", "surrogateescape")
            except Exception as error:
                raise storage.filesystem_error(name, error) from error
            for number, line in enumerate(text.splitlines(), 1):
                if line.strip():
                    yield f"{self._fs.unstrip_protocol(name)}: line {number}", line

    def append(self, line: str) -> None:
        self._waiting.append(line)
        self._bytes += len(line)
        if self._bytes > _SEGMENT_BYTES or time.monotonic() - self._flushed > _SEGMENT_EVERY:
            self.flush()

    def flush(self) -> None:
        if self._waiting:
            self._write(self._waiting)
        self._waiting, self._bytes, self._flushed = [], 0, time.monotonic()

    def _write(self, lines: list[str]) -> str:
        name = f"{self._path}/{time.time_ns():020d}-{uuid.uuid4().hex[:8]}.jsonl"
        try:
            self._fs.pipe_file(name, ("\n".join(lines) + "\n").encode("utf-8", "surrogateescape"))
        except Exception as error:
            raise storage.filesystem_error(self._uri, error) from error
        return name

    def wants_compaction(self) -> bool:
        return len(self._names()) > _MANY_SEGMENTS

    def replace(self, lines: list[str]) -> None:
        old = self._names()
        self._write([line.rstrip("\n") for line in lines])
        # If this is interrupted, duplicate rows are harmless.
        for name in old:
            self._fs.rm_file(name)

    def close(self) -> None:
        """Nothing to do: flush() has written everything."""
