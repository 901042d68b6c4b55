"""Reports of calls."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any


class Report(Mapping[str, Any]):
    """What a call did: a read-only mapping with the names and values of the command line's ``--json``.

    ``report["method"]``, ``report["gaussians"]["out"]``, ``report["seconds"]``; ``dict(report)`` for all of it.
    """

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)

    @classmethod
    def _of(cls, text: str) -> Report:
        return cls(json.loads(text))

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return f"Report({self._values!r})"
