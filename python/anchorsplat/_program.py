"""The console script ``anchorsplat``: runs `serve` and `batch` in Python, every other verb in the native program."""

from __future__ import annotations

import importlib
import os
import signal
import sys

#: Verb: pip extra with its dependencies.
PYTHON_VERBS = {"serve": "serve", "batch": "batch"}


def program() -> str:
    """The path of the native program."""
    return os.path.join(os.path.dirname(os.path.abspath(__file__)), "_bin", "anchorsplat")


def main(argv: list[str] | None = None) -> int:
    words = list(sys.argv[1:] if argv is None else argv)
    if words and words[0] in PYTHON_VERBS:
        verb, extra = words[0], PYTHON_VERBS[words[0]]
        try:
            module = importlib.import_module(f"anchorsplat.{verb}")
        except ModuleNotFoundError as missing:
            print(
                f"error: anchorsplat {verb} needs the package {missing.name}: pip install 'anchorsplat[{extra}]'",
                file=sys.stderr,
            )
            return 2
        return int(module.main(words[1:]) or 0)
    sys.stdout.flush()
    for ignored in (signal.SIGPIPE, signal.SIGXFSZ):  # ignored by Python, which the program would inherit
        signal.signal(ignored, signal.SIG_DFL)
    os.execv(program(), ["anchorsplat", *words])
