"""The body of a request, streamed to disk: raw, or multipart with the splat as `file`, cameras and options beside it."""

from __future__ import annotations

import asyncio
import hashlib
import os
import re
import time
from dataclasses import dataclass, field
from pathlib import Path

import python_multipart
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import parse_options_header
from starlette.requests import ClientDisconnect, Request

from .cameras import MOST_BYTES as MOST_CAMERA_BYTES

_FLUSH_BYTES = 2**20
_MOST_FIELDS = 64
_LONGEST_FIELD = 4096
_LONGEST_HEADERS = 16 * 1024
_LEAST_RATE = 16 * 1024  # bytes a second, over the whole upload
_DRAIN_BYTES = 16 * 2**20


class BadUpload(Exception):
    def __init__(self, status: int, code: str, message: str):
        super().__init__(message)
        self.status, self.code = status, code


@dataclass
class Upload:
    path: Path
    name: str = ""  # the client's name for it; never a path
    size: int = 0
    sha256: str = ""
    fields: list[tuple[str, str]] = field(default_factory=list)
    cameras: bytes | None = None


def plain_name(name: str) -> str:
    """The last part of the path, without terminal controls and characters that break headers."""
    last = re.split(r"[/\\]", name)[-1]
    return "".join(c for c in last if c.isprintable())[:120].strip(" .") or "splat"


class _Sink:
    """Buffers bytes of the splat; a thread writes and hashes them."""

    def __init__(self, path: Path, limit: int):
        self._file = open(path, "xb", opener=lambda name, flags: os.open(name, flags, 0o600))
        self._hash = hashlib.sha256()
        self._held = bytearray()
        self._limit = limit
        self.bytes = 0

    def add(self, data: bytes) -> None:
        self.bytes += len(data)
        if self.bytes > self._limit:
            raise BadUpload(413, "too_large", f"The file is larger than this service accepts ({self._limit:,} bytes).")
        self._held += data

    async def flush(self, least: int) -> None:
        if len(self._held) >= least and self._held:
            held, self._held = self._held, bytearray()
            await asyncio.to_thread(self._write, held)

    def _write(self, data: bytearray) -> None:
        self._file.write(data)
        self._hash.update(data)

    async def end(self) -> str:
        await self.flush(0)
        await asyncio.to_thread(self._file.close)
        return self._hash.hexdigest()

    def close(self) -> None:
        self._file.close()


class _Form:
    """Parses a multipart body as its bytes arrive."""

    def __init__(self, boundary: bytes, upload: Upload, sink: _Sink):
        self._upload, self._sink = upload, sink
        self._headers: dict[str, bytes] = {}
        self._header = [b"", b""]
        self._header_bytes = 0
        self._part: str | None = None
        self._value = bytearray()
        self.has_file = self.ended = False
        self.parser = python_multipart.MultipartParser(
            boundary,
            {
                "on_part_begin": self._begin,
                "on_header_field": lambda data, a, b: self._header_part(0, data[a:b]),
                "on_header_value": lambda data, a, b: self._header_part(1, data[a:b]),
                "on_header_end": self._header_end,
                "on_headers_finished": self._headers_finished,
                "on_part_data": lambda data, a, b: self._data(data[a:b]),
                "on_part_end": self._part_end,
                "on_end": self._end,
            },
        )

    def _begin(self) -> None:
        self._headers, self._header, self._header_bytes = {}, [b"", b""], 0
        self._part, self._value = None, bytearray()

    def _header_part(self, which: int, data: bytes) -> None:
        self._header_bytes += len(data)
        if self._header_bytes > _LONGEST_HEADERS:
            raise BadUpload(400, "bad_request", "The headers of a part of the form are too long.")
        self._header[which] += data

    def _header_end(self) -> None:
        self._headers[self._header[0].decode("latin-1").lower()] = self._header[1]
        self._header = [b"", b""]

    def _headers_finished(self) -> None:
        kind, params = parse_options_header(self._headers.get("content-disposition", b""))
        if kind != b"form-data" or b"name" not in params:
            raise BadUpload(400, "bad_request", "A part of the form has no name.")
        self._part = params[b"name"].decode("utf-8", "replace")
        if self._part == "file":
            if self.has_file:
                raise BadUpload(400, "bad_request", "The form has more than one 'file'; send one request for each.")
            self.has_file = True
            self._upload.name = plain_name(params.get(b"filename", b"").decode("utf-8", "replace"))

    def _data(self, data: bytes) -> None:
        if self._part == "file":
            self._sink.add(data)
            return
        self._value += data
        if len(self._value) > (MOST_CAMERA_BYTES if self._part == "cameras" else _LONGEST_FIELD):
            raise BadUpload(413, "too_large", f"The form's field '{plain_name(self._part or '')}' is too long.")

    def _part_end(self) -> None:
        if self._part == "file":
            return
        if self._part == "cameras":
            if self._upload.cameras is not None:
                raise BadUpload(400, "bad_request", "The form has more than one 'cameras'.")
            self._upload.cameras = bytes(self._value)
            return
        if len(self._upload.fields) >= _MOST_FIELDS:
            raise BadUpload(400, "bad_request", "The form has too many fields.")
        self._upload.fields.append((self._part or "", self._value.decode("utf-8", "replace")))

    def _end(self) -> None:
        self.ended = True


async def receive(request: Request, path: Path, limit: int, stall_seconds: float) -> Upload:
    """Writes the splat to the new file `path`. Raises BadUpload; the caller then removes the file."""
    _refuse_announced(request, limit)
    upload = Upload(path, plain_name(request.query_params.get("name", "")))
    sink = _Sink(path, limit)
    form = None
    try:
        kind, params = parse_options_header(request.headers.get("content-type", "").encode("latin-1"))
        if kind == b"multipart/form-data":
            if not 1 <= len(params.get(b"boundary", b"")) <= 70:
                raise BadUpload(400, "bad_request", "The form's content type has no boundary.")
            form = _Form(params[b"boundary"], upload, sink)
        async for chunk in _chunks(request, stall_seconds):
            if form is None:
                sink.add(chunk)
            else:
                form.parser.write(chunk)
            await sink.flush(_FLUSH_BYTES)
        if form is not None:
            form.parser.finalize()
            if not form.ended:
                raise BadUpload(400, "bad_request", "The form is incomplete.")
            if not form.has_file:
                raise BadUpload(400, "bad_request", "The form has no 'file'.")
        if sink.bytes == 0:
            raise BadUpload(400, "bad_file", f"{upload.name}: the file is empty.")
        upload.size, upload.sha256 = sink.bytes, await sink.end()
        return upload
    except FormParserError as error:
        raise BadUpload(400, "bad_request", f"The form is malformed: {plain_name(str(error))}") from None
    except ClientDisconnect:
        raise BadUpload(400, "bad_request", "The upload is incomplete.") from None
    finally:
        sink.close()


def _refuse_announced(request: Request, limit: int) -> None:
    announced = request.headers.get("content-length", "0")
    if announced.isascii() and announced.isdigit() and int(announced) > limit + MOST_CAMERA_BYTES + _FLUSH_BYTES:
        raise BadUpload(413, "too_large", f"The file is larger than this service accepts ({limit:,} bytes).")


async def _chunks(request: Request, stall_seconds: float):
    begin, received = time.monotonic(), 0
    stream = request.stream().__aiter__()
    while True:
        left = begin + stall_seconds + received / _LEAST_RATE - time.monotonic()
        try:
            chunk = await asyncio.wait_for(anext(stream), max(0.01, min(stall_seconds, left)))
        except StopAsyncIteration:
            return
        except TimeoutError:
            raise BadUpload(408, "timeout", "The upload is too slow or has stopped.") from None
        received += len(chunk)
        yield chunk


async def drain(request: Request) -> None:
    """Reads the rest of a small body, so that the client gets the answer instead of a broken connection."""
    received = 0
    announced = request.headers.get("content-length", "0")
    if not announced.isdigit() or int(announced) > _DRAIN_BYTES:
        return
    try:
        async for chunk in _chunks(request, 5.0):
            received += len(chunk)
            if received > _DRAIN_BYTES:
                return
    except (BadUpload, ClientDisconnect, RuntimeError):  # RuntimeError: already read
        pass
