"""Keywords as the words of the command line: its declarations check them, so that both take the same and say the same."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from typing import Any, Callable

from ._errors import BadArgumentError

#: Keywords of every function that no word stands for.
NO_WORDS = ("threads", "seed", "progress", "overwrite")


def _text(name: str, value: Any) -> str | bytes:
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


def words_of(function: Callable[..., Any], given: Mapping[str, Any], *, besides: Collection[str] = ()) -> list[bytes]:
    """``--name=value`` for every keyword of `function` in `given` that differs from its default."""
    words = []
    for name, default in (function.__kwdefaults__ or {}).items():
        if name in NO_WORDS or name in besides:
            continue
        value = given[name]
        if value is None or value is default or (isinstance(value, type(default)) and value == default):
            continue
        option = os.fsencode("--" + name.replace("_", "-"))
        if default is False:
            if value is not True:
                raise BadArgumentError(f"{name}: must be True or False, found {value!r}")
            words.append(option)
        else:
            text = os.fsencode(_text(name, value))
            words += [option + b"=" + text] if text else [option, text]
    return words
