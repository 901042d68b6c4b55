"""Files on any fsspec file system. Written files appear only when complete."""

from __future__ import annotations

import hashlib
import os
import shutil
import uuid
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import fsspec
from fsspec.core import url_to_fs
from fsspec.utils import get_protocol

from .._errors import IoError, NotFoundError

#: File systems where objects appear only when complete. Elsewhere files are written under another name and moved.
_PUTS_WHOLE = {"s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "adl", "oci", "r2", "memory"}

#: Keys of file information that change with the content, best first.
_MARKS = ("ETag", "etag", "generation", "md5Hash", "LastModified", "last_modified", "Last-Modified", "mtime", "created")


class TransientError(Exception):
    """A temporary failure, as of storage: the task is retried."""

    code = "io"  # of the row if retries fail


def is_local(uri: str) -> bool:
    return str(get_protocol(uri)) in ("file", "local")


def in_driver_only(uri: str) -> bool:
    """Files of memory:// exist in one process only, so their bytes are sent with the tasks."""
    return bool(get_protocol(uri) == "memory")


def absolute(uri: str) -> str:
    """Normalised address: local paths absolute and without protocol, valid in any worker; URLs as in listings."""
    fs, path = open_place(uri)
    return os.path.abspath(path) if is_local(uri) else fs.unstrip_protocol(path)


def join(folder: str, name: str) -> str:
    return f"{folder.rstrip('/')}/{name}"


def same_file_system(uri: str, fs: Any, path: str) -> str:
    """Address of `path` from a listing of `uri`."""
    return path if is_local(uri) else fs.unstrip_protocol(path)


def open_place(uri: str) -> tuple[Any, str]:
    """File system and path on it. Raises NotFoundError, naming the package for the protocol."""
    try:
        fs, path = url_to_fs(uri)
        return fs, path
    except (ImportError, ValueError) as error:
        raise NotFoundError(f"{uri}: {error}") from error


def identity(info: dict[str, Any]) -> str:
    """Size and identity of a file, without reading it. The identity changes with the content; "" if unknown."""
    if "ino" in info and "mtime" in info:  # local; listings round the time
        try:
            state = os.stat(info["name"])
        except OSError:
            return ""
        return f"{state.st_size}-{state.st_mtime_ns}"
    mark = next((info[name] for name in _MARKS if info.get(name)), None)
    if mark is None:
        return ""
    return f"{info.get('size')}-{str(mark).strip(chr(34))}"


def stat(uri: str) -> dict[str, Any] | None:
    """File information, or None if there is no such file."""
    fs, path = open_place(uri)
    try:
        info = fs.info(path)
    except FileNotFoundError:
        return None
    return info if info.get("type") != "directory" else None


def stat_many(uris: list[str]) -> dict[str, dict[str, Any] | None]:
    """stat() of many files: folders with several of them are listed once, the rest are queried in parallel."""
    folders: dict[str, list[str]] = {}
    for uri in uris:
        folders.setdefault(uri.rsplit("/", 1)[0], []).append(uri)
    found: dict[str, dict[str, Any] | None] = {}
    single: list[str] = []
    for folder, members in folders.items():
        if len(members) < 8 or is_local(members[0]) or get_protocol(members[0]) in ("http", "https"):
            single += members
            continue
        fs, path = open_place(folder)
        try:
            listing = {same_file_system(folder, fs, i["name"]): i for i in fs.ls(path, detail=True)}
        except FileNotFoundError:
            listing = {}
        found.update((uri, listing.get(uri)) for uri in members)
    if all(is_local(uri) for uri in single):
        found.update((uri, stat(uri)) for uri in single)
    else:
        with ThreadPoolExecutor(16) as pool:
            found.update(zip(single, pool.map(stat, single), strict=True))
    return found


def sizes_below(uri: str, names: list[str]) -> dict[str, int]:
    """Sizes of the files that exist."""
    if is_local(uri):
        sizes = {}
        for name in names:
            try:
                sizes[name] = os.stat(join(uri, name)).st_size
            except OSError:
                continue
        return sizes
    fs, path = open_place(uri)
    try:
        listing = fs.find(path, detail=True)
    except FileNotFoundError:
        return {}
    prefix = len(path.rstrip("/")) + 1
    return {found[prefix:]: int(info.get("size") or 0) for found, info in listing.items()}


def fetch(uri: str, to: Path) -> None:
    """Copies a file or folder to this machine. Raises NotFoundError, TransientError."""
    fs, path = open_place(uri)
    try:
        if get_protocol(uri) not in ("http", "https") and fs.isdir(path):
            fs.get(path.rstrip("/") + "/", str(to) + "/", recursive=True)
        else:
            fs.get_file(path, str(to))
    except FileNotFoundError as error:
        raise NotFoundError(f"{uri}: no such file") from error
    except PermissionError as error:
        raise IoError(f"{uri}: not allowed: {error}") from error
    except (TimeoutError, OSError) as error:
        raise TransientError(f"{uri}: could not be read: {error}") from error
    except Exception as error:  # clients of object stores have no common exception
        raise TransientError(f"{uri}: could not be read: {type(error).__name__}: {error}") from error


def put(file: Path, uri: str) -> None:
    """Moves a local file to its address, whole or not at all. Raises IoError, TransientError."""
    if is_local(uri):
        target = Path(absolute(uri))
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                os.replace(file, target)
            except OSError:  # from another file system
                near = target.with_name(f".{target.name}.{uuid.uuid4().hex[:8]}")
                try:
                    shutil.copyfile(file, near)
                    os.replace(near, target)
                finally:
                    near.unlink(missing_ok=True)
        except OSError as error:
            raise IoError(f"{target}: could not be written: {error.strerror or error}") from error
        return
    fs, path = open_place(uri)
    try:
        if get_protocol(uri) in _PUTS_WHOLE:
            fs.put_file(str(file), path)
        else:
            part = f"{path}.{uuid.uuid4().hex[:8]}.part"
            fs.makedirs(path.rsplit("/", 1)[0], exist_ok=True)
            fs.put_file(str(file), part)
            fs.mv(part, path)
    except PermissionError as error:
        raise IoError(f"{uri}: not allowed: {error}") from error
    except NotImplementedError as error:
        raise IoError(f"{uri}: this address is not writable") from error
    except Exception as error:
        raise TransientError(f"{uri}: could not be written: {type(error).__name__}: {error}") from error
    file.unlink()


def sha256(file: Path) -> str:
    with open(file, "rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


def state_of_tree(uri: str) -> str:
    """Identity of a file, or of a folder from the names, sizes and identities of its files. "" if missing."""
    fs, path = open_place(uri)
    try:
        if not fs.isdir(path):
            return identity(fs.info(path))
        members = fs.find(path, detail=True)
    except FileNotFoundError:
        return ""
    told = "\n".join(f"{name[len(path):]} {identity(info)}" for name, info in sorted(members.items()))
    return hashlib.sha256(told.encode()).hexdigest()[:32]


def filesystem_error(uri: str, error: Exception) -> IoError:
    return IoError(f"{uri}: {type(error).__name__}: {error}")


def read_text(uri: str) -> str:
    """Errors: NotFoundError, IoError."""
    try:
        with fsspec.open(uri, "rt", encoding="utf-8") as file:
            return str(file.read())
    except FileNotFoundError as error:
        raise NotFoundError(f"{uri}: no such file") from error
    except Exception as error:
        raise filesystem_error(uri, error) from error
