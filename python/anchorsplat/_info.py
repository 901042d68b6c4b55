"""What is in a file."""

from __future__ import annotations

import json
from typing import Any

from . import _core
from ._cloud import Cloud
from ._errors import BadArgumentError
from ._files import PathLike
from ._run import ProgressLike, run
from ._words import path_bytes


def info(
    source: PathLike | Cloud, *, format: str | None = None, threads: int = 0, progress: ProgressLike = None
) -> dict[str, Any]:
    """Inspects `source`, a Cloud, a splat file or the weights of a network, and reports problems, as ``anchorsplat info --json``
    does. `format` as for ``read``. For a Cloud, "file", "format" and "bytes" are None.

    Raises as ``read``.
    """
    if isinstance(source, (bytes, bytearray, memoryview)):
        raise BadArgumentError("info: expected a path or a Cloud, found bytes; use anchorsplat.info(anchorsplat.read(data))")
    with run(threads, progress) as how:
        if isinstance(source, Cloud):
            return dict(json.loads(_core.info_cloud(source, how)))
        return dict(json.loads(_core.info_path(path_bytes(source), format or "", how)))
