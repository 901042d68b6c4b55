"""The console script ``anchorsplat``: `serve` and `batch` are Python, every other verb is the native program."""

from __future__ import annotations

import importlib
import os
import signal
import subprocess
import sys
from typing import TextIO

#: Verb: what its packages are called in pip's extras.
PYTHON_VERBS = {"serve": "serve", "batch": "batch"}


def program() -> str:
    """The path of the native program."""
    return os.path.join(os.path.dirname(os.path.abspath(__file__)), "_bin", "anchorsplat")


def _same(words: list[str]) -> TextIO:
    """Where the native program writes its help: no verb is an error."""
    return sys.stdout if words else sys.stderr


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
    if not words or words in (["-h"], ["--help"]):  # which the native program does not know to be there
        code = subprocess.run([program(), *words], check=False).returncode
        print("\nIn Python:\n  serve                       a page and an API over HTTP (docs/serve.md)", file=_same(words))
        print("  batch                       many splats on many cores and machines, by Ray (docs/batch.md)", file=_same(words))
        return code
    sys.stdout.flush()
    for ignored in (signal.SIGPIPE, signal.SIGXFSZ):  # by Python; whoever is started inherits it
        signal.signal(ignored, signal.SIG_DFL)
    os.execv(program(), ["anchorsplat", *words])
