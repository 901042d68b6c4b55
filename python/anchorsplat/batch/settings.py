"""Options of `enhance` that a batch passes on, and their files."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import posixpath
import struct
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .._errors import BadArgumentError, NotFoundError
from .._words import text_of
from . import storage
from .engine import Engine, engine, options, run
from .inputs import Input

#: Options of `enhance` that the batch sets itself.
OWN = {"--output", "--out-dir", "--json", "--quiet", "--overwrite", "--threads", "--checkpoint", "--resume"}

#: Options whose value is a file or folder. It may be a URL and contain {folder}, {stem} and {name} of the input.
FILES = ("--cameras", "--images", "--model")

# Bytes of memory per byte of file: measured with the network, whose result has four times as many Gaussians
# (docs/batch.md). Small formats hold more Gaussians per byte.
_PER_BYTE = {"ply": 8, "compressed.ply": 40, "splat": 20, "spz": 90, "sog": 120, "ksplat": 60, "glb": 10, "pt": 8}
_OTHER_PER_BYTE = 20
_ALWAYS = 160 << 20  # bytes: the worker's Python and the program
_REFINEMENT = 4
_LEAST_STEP = 256 << 20


def as_arguments(words: Mapping[str, Any]) -> dict[str, Any]:
    """Keywords of a function as options: pixel_size=0.1 is --pixel-size. Raises BadArgumentError for an unknown one."""
    known = options("enhance")
    given = {}
    for word, value in words.items():
        name = "--" + word.replace("_", "-")
        if name not in known or name in OWN:
            raise BadArgumentError(f"{word}: enhance has no such option for batches")
        if value is None or value is False:
            continue
        if (value is True) != (known[name].kind == ""):
            raise BadArgumentError(f"{word}={value!r}: " + ("expected True or False" if value is not True else "expected a value"))
        given[name] = value if value is True else _word(word, value)
    return given


def _word(name: str, value: Any) -> str:
    if name in ("cameras", "images", "model") and not isinstance(value, (str, os.PathLike)):
        raise BadArgumentError(f"{name}: expected a file or folder, found {type(value).__name__}")
    return os.fsdecode(text_of(name, value))


@dataclass(frozen=True)
class Settings:
    """Options for all splats of a batch, with and without files."""

    plain: tuple[str, ...]  # "--upscale=4", sorted
    files: tuple[tuple[str, str], ...]  # option, address or pattern
    engine: Engine
    fingerprint: str  # of program, options, format and content of common files
    common: tuple[tuple[str, str, str], ...]  # option, address, identity of common files
    refines: bool
    resumes: bool

    def told(self) -> list[str]:
        return [*self.plain, *(f"{name}={value}" for name, value in self.files)]

    def memory(self, item: Input, threads: int) -> int:
        """Expected memory of a task in bytes, rounded to powers of two, as Ray keeps a queue per amount."""
        name = item.uri.lower()
        factor = next((f for end, f in reversed(_PER_BYTE.items()) if name.endswith("." + end)), _OTHER_PER_BYTE)
        if name.endswith(".compressed.ply"):
            factor = _PER_BYTE["compressed.ply"]
        bytes_ = _ALWAYS + (item.size or 0) * factor * (_REFINEMENT if self.refines else 1)
        step = _LEAST_STEP
        while step < bytes_:
            step *= 2
        return step


def settings_of(given: Mapping[str, Any], format: str | None, *, local_target: bool) -> Settings:
    """Raises BadArgumentError with the program's message; NotFoundError if a common file is missing."""
    plain, files = [], []
    for name, value in sorted(given.items()):
        if name in FILES:
            value = str(value)
            files.append((name, value if _per_input(value) else storage.absolute(value)))
        elif value is True:
            plain.append(name)
        else:
            plain.append(f"{name}={value}")
    _check(plain, files, format)
    common = []
    contents = []
    for name, uri in files:
        if _per_input(uri):
            continue
        state = storage.state_of_tree(uri)
        if not state:
            raise NotFoundError(f"{name} {uri}: no such file")
        common.append((name, uri, state))
        is_file = storage.is_local(uri) and Path(uri).is_file()
        contents.append((name, storage.sha256(Path(uri)) if is_file else state))
    method, quality = str(given.get("--method", "")), str(given.get("--quality", ""))
    refines = "refine" in method or quality in ("good", "best")
    here = engine()
    told = [dataclasses.astuple(here), plain, contents, [f for f in files if _per_input(f[1])], format]
    fingerprint = hashlib.sha256(json.dumps(told).encode()).hexdigest()[:16]
    resumes = refines and local_target and "--seconds" not in given
    return Settings(tuple(plain), tuple(files), here, fingerprint, tuple(common), refines, resumes)


def _per_input(value: str) -> bool:
    return "{" in value


_OF_CAMERAS = {"--train-width", "--camera-rule"}


def _check(plain: list[str], files: list[tuple[str, str]], format: str | None) -> None:
    """Lets the program check the options before any splat is fetched: once without an input, and once with a small splat, for
    checks such as ranges. Raises BadArgumentError with its message."""
    with tempfile.TemporaryDirectory(prefix="anchorsplat-") as folder:
        out = ["-o", f"{folder}/out.{format or 'ply'}", "--json", *plain]
        words = [word for name, value in files for word in (name, value)]
        ended = run(["enhance", f"{folder}/none.ply", *out, *words])
        if ended.code == 2:
            ended.raise_for_code()
        if any(method in " ".join(plain) for method in ("refine", "--quality=good", "--quality=best")):
            return  # takes long for any splat
        # Without files, and without options that only have an effect with them: the test splat is in no camera's view, and
        # weights bring options of their own.
        if not {name for name, _ in files} <= {"--cameras"}:
            return
        alone = [word for word in out if word.partition("=")[0] not in _OF_CAMERAS]
        splat = Path(folder, "one.ply")
        splat.write_bytes(_one_gaussian())
        ended = run(["enhance", str(splat), *alone, "--threads", "1"])
        if ended.code == 2:
            ended.raise_for_code()


def _one_gaussian() -> bytes:
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", *(f"scale_{i}" for i in range(3)),
             *(f"rot_{i}" for i in range(4))]  # fmt: skip
    header = "".join(["ply\nformat binary_little_endian 1.0\nelement vertex 1\n", *(f"property float {n}\n" for n in names)])
    values = [0.0] * 7 + [-4.0] * 3 + [1.0, 0.0, 0.0, 0.0]
    return (header + "end_header\n").encode() + struct.pack(f"<{len(values)}f", *values)


def files_of(settings: Settings, item: Input) -> tuple[list[tuple[str, str, str]], str]:
    """Files of the options for this input, with identities, and the fingerprint that includes them.

    Errors: NotFoundError: one is not there; BadArgumentError: a placeholder that there is not.
    """
    files = list(settings.common)
    own = []
    for name, pattern in settings.files:
        if not _per_input(pattern):
            continue
        base = posixpath.basename(item.uri.partition("?")[0])
        try:
            uri = pattern.format(folder=posixpath.dirname(item.uri), name=base, stem=base.split(".")[0])
        except (KeyError, IndexError, ValueError) as error:
            raise BadArgumentError(f"{name} {pattern}: only {{folder}}, {{stem}} and {{name}} are allowed") from error
        uri = storage.absolute(uri)
        state = storage.state_of_tree(uri)
        if not state:
            raise NotFoundError(f"{name} {uri}: no such file")
        own.append((name, uri, state))
    if not own:
        return files, settings.fingerprint
    told = json.dumps([settings.fingerprint, [(name, state) for name, _, state in own]])
    return files + own, hashlib.sha256(told.encode()).hexdigest()[:16]
