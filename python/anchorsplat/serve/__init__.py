"""`anchorsplat serve`: a page and an API over HTTP that enhance, convert and render splats. docs/serve.md"""

from __future__ import annotations

import importlib.util
import sys

#: Modules installed by ``pip install "anchorsplat[serve]"``.
_NEEDED = ("fastapi", "uvicorn", "python_multipart", "prometheus_client")


def main(argv: list[str] | None = None) -> int:
    """Runs the service until it is stopped. Returns the exit code (docs/cli.md)."""
    from .settings import UsageError, parse

    try:
        settings = parse(sys.argv[1:] if argv is None else argv)
    except UsageError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    missing = [name for name in _NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        print(
            f"error: 'serve' needs {', '.join(missing)}: run pip install 'anchorsplat[serve]'",
            file=sys.stderr,
        )
        return 2
    if settings.ray is not None and importlib.util.find_spec("ray") is None:
        print("error: --ray needs Ray: run pip install 'anchorsplat[batch]'", file=sys.stderr)
        return 2
    from .server import run

    return run(settings)
