"""Converts keywords to command-line words, so that the same declarations check them and the same messages appear."""

from __future__ import annotations

import operator
import os
from collections.abc import Collection, Mapping
from typing import Any, Callable

from ._errors import BadArgumentError

#: Keywords that are not passed as words.
NO_WORDS = ("threads", "device", "max_gpu_memory", "seed", "progress", "overwrite")


def path_bytes(path: str | os.PathLike[str]) -> bytes:
    """The path in the system's encoding. Raises BadArgumentError if it contains a NUL."""
    name = os.fsencode(path)
    if b"\0" in name:
        raise BadArgumentError(f"{os.fsdecode(name)!r}: this path contains a NUL")
    return name


def whole_number(name: str, value: Any) -> int:
    """Raises TypeError for anything else."""
    try:
        return operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected a whole number, found {value!r}") from None


def natural(name: str, value: Any) -> int:
    """Raises TypeError unless it is a whole number, BadArgumentError unless it is 0 to 2⁶⁴ − 1."""
    number = whole_number(name, value)
    if not 0 <= number < 1 << 64:
        raise BadArgumentError(f"{name}: must be 0 to 2^64 - 1, found {number}")
    return number


def text_of(name: str, value: Any) -> str | bytes:
    if isinstance(value, bytes):
        return value
    if isinstance(value, (str, os.PathLike)):
        return os.fsencode(value)
    if isinstance(value, (tuple, list)) or hasattr(value, "tolist"):
        values = value.tolist() if hasattr(value, "tolist") else value
        if isinstance(values, (tuple, list)):
            return ("x" if name == "size" else ",").join(str(part) for part in values)
        value = values
    return str(value)


def option_words(name: str, value: Any) -> list[bytes]:
    """A keyword with a value as ``--name=value``. Raises BadArgumentError for a NUL."""
    option = os.fsencode("--" + name.replace("_", "-"))
    text = os.fsencode(text_of(name, value))
    if b"\0" in text:
        raise BadArgumentError(f"{name}: {value!r} contains a NUL")
    return [option + b"=" + text] if text else [option, text]


def words_of(function: Callable[..., Any], given: Mapping[str, Any], *, besides: Collection[str] = ()) -> list[bytes]:
    """``--name=value`` for every keyword of `function` in `given` that differs from its default."""
    words = []
    for name, default in (function.__kwdefaults__ or {}).items():
        if name in NO_WORDS or name in besides:
            continue
        value = given[name]
        if value is None or value is default or (isinstance(value, type(default)) and value == default):
            continue
        if default is False:
            if value is not True:
                raise BadArgumentError(f"{name}: must be True or False, found {value!r}")
            words.append(os.fsencode("--" + name.replace("_", "-")))
        else:
            words += option_words(name, value)
    return words
