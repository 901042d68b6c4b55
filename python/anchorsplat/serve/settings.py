"""Settings of the service, from its command line."""

from __future__ import annotations

import argparse
import ipaddress
import math
import os
import re
from dataclasses import dataclass
from pathlib import Path

_UNITS = {"": 1, "B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12}
_UNITS |= {"KIB": 2**10, "MIB": 2**20, "GIB": 2**30, "TIB": 2**40}
_LEAST_TOKEN = 16


class UsageError(Exception):
    """Invalid command line; the text says why and what is valid."""


@dataclass(frozen=True)
class Settings:
    data: Path
    host: str = "127.0.0.1"
    port: int = 7860
    token: str | None = None
    allow_hosts: tuple[str, ...] = ()
    max_upload: int = 2 * 10**9  # bytes
    max_gaussians: int = 10_000_000
    max_seconds: float = 600.0
    max_memory: int = 4 * 2**30  # bytes of address space per job
    queue: int = 64
    workers: int = 1
    threads: int = 1  # per job
    keep_days: float = 7.0
    keep_bytes: int = 20 * 10**9
    ray: str | None = None
    web: Path | None = None  # folder of the page of `make web`
    stall_seconds: float = 30.0  # for an upload that sends nothing

    @property
    def local(self) -> bool:
        """Whether only this machine reaches the service."""
        return is_loopback(self.host)


def is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def parse_bytes(text: str) -> int:
    """ "500 MB", "2GiB" or a plain number of bytes."""
    match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([A-Za-z]*)\s*", text)
    if not match or match[2].upper() not in _UNITS:
        raise argparse.ArgumentTypeError(f"'{text}' is not a size such as 500MB or 2GiB")
    size = int(float(match[1]) * _UNITS[match[2].upper()])
    if not 1 <= size < 2**62:
        raise argparse.ArgumentTypeError(f"'{text}' must be at least one byte and less than 2^62")
    return size


def _number(low: float, high: float, kind: type = int):
    def parse_number(text: str):
        try:
            value = kind(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{text}' is not a number") from None
        if not math.isfinite(value) or not low <= value <= high:
            raise argparse.ArgumentTypeError(f"'{text}' must be from {low:,} to {high:,}")
        return value

    return parse_number


class _Parser(argparse.ArgumentParser):
    def error(self, message: str):
        raise UsageError(f"{message} (--help shows how)")


def _data_folder() -> Path:
    home = os.environ.get("XDG_DATA_HOME") or os.path.join(os.path.expanduser("~"), ".local", "share")
    return Path(home) / "anchorsplat" / "serve"


def _memory_per_job(workers: int) -> int:
    """Three quarters of the machine's memory, shared among the jobs, and at least 1 GiB."""
    machine = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return max(2**30, machine * 3 // 4 // workers)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="anchorsplat serve",
        description="Serve a page and an API over HTTP that enhance, convert and render splats.",
        epilog="Example: anchorsplat serve, then open http://127.0.0.1:7860. More: docs/serve.md",
        allow_abbrev=False,
    )
    add = parser.add_argument
    add(
        "--host",
        default="127.0.0.1",
        help="address to listen on; any but loopback needs a token (%(default)s)",
    )
    add("--port", type=_number(0, 65535), default=7860, help="port; 0 picks a free one and prints it (%(default)s)")
    add("--data", type=Path, default=_data_folder(), metavar="DIR", help="jobs, uploads and results (%(default)s)")
    add("--token", help="token that clients must send; better set as ANCHORSPLAT_TOKEN, which other users cannot see")
    add(
        "--allow-host",
        action="append",
        default=[],
        metavar="NAME",
        help="another host name that a proxy on this machine forwards; needs a token (repeatable)",
    )
    add("--max-upload", type=parse_bytes, default=Settings.max_upload, metavar="SIZE", help="largest upload (2GB)")
    add(
        "--max-gaussians",
        type=_number(1, 2**31 - 1),
        default=Settings.max_gaussians,
        metavar="N",
        help="most Gaussians of a splat (%(default)s)",
    )
    add(
        "--max-seconds",
        type=_number(0.1, 1e6, float),
        default=Settings.max_seconds,
        metavar="S",
        help="time limit of a job (%(default)s)",
    )
    add(
        "--max-memory", type=parse_bytes, metavar="SIZE", help="memory limit of a job (3/4 of the machine, shared among --workers)"
    )
    add(
        "--queue",
        type=_number(1, 100_000),
        default=Settings.queue,
        metavar="N",
        help="jobs that may wait; more are answered with 429 (%(default)s)",
    )
    add("--workers", type=_number(1, 256), metavar="N", help="jobs at the same time (1 for each 4 processors)")
    add("--threads", type=_number(1, 1024), metavar="N", help="threads of a job (the processors, shared among --workers)")
    add(
        "--keep-days",
        type=_number(0, 36500, float),
        default=Settings.keep_days,
        metavar="D",
        help="days after which unused results are deleted (%(default)s)",
    )
    add(
        "--keep-bytes",
        type=parse_bytes,
        default=Settings.keep_bytes,
        metavar="SIZE",
        help="limit of all uploads and results; the oldest are deleted first (20GB)",
    )
    add(
        "--ray",
        metavar="ADDRESS",
        help="run jobs on this Ray cluster (host:port, auto, or local) instead of in local processes",
    )
    add(
        "--web",
        type=Path,
        metavar="DIR",
        help="build/web/dist of `make web`, to serve the page that works without uploads at /web/",
    )
    return parser


def parse(argv: list[str]) -> Settings:
    """Raises UsageError. --help prints and raises SystemExit, as in argparse."""
    given = _parser().parse_args(argv)
    token = given.token if given.token is not None else os.environ.get("ANCHORSPLAT_TOKEN")
    if token is not None and (
        len(token) < _LEAST_TOKEN or not token.isascii() or not token.isprintable() or " " in token
    ):
        raise UsageError(
            f"the token must be at least {_LEAST_TOKEN} printable ASCII characters without spaces; "
            "python3 -c 'import secrets; print(secrets.token_urlsafe())' generates one"
        )
    if not is_loopback(given.host) and token is None:
        raise UsageError(
            f"--host {given.host} lets other machines in, so it needs a token: "
            "ANCHORSPLAT_TOKEN=$(python3 -c 'import secrets; print(secrets.token_urlsafe())') anchorsplat serve …"
        )
    if given.allow_host and token is None:
        raise UsageError("--allow-host lets others in through a proxy, so it needs a token (ANCHORSPLAT_TOKEN)")
    if given.web is not None and not (given.web / "index.html").is_file():
        raise UsageError(f"--web: {given.web} has no index.html; `make web` creates build/web/dist")
    processors = len(os.sched_getaffinity(0))
    workers = given.workers or max(1, processors // 4)
    return Settings(
        data=given.data.expanduser().absolute(),
        host=given.host,
        port=given.port,
        token=token,
        allow_hosts=tuple(name.lower() for name in given.allow_host),
        max_upload=given.max_upload,
        max_gaussians=given.max_gaussians,
        max_seconds=given.max_seconds,
        max_memory=given.max_memory or _memory_per_job(workers),
        queue=given.queue,
        workers=workers,
        threads=given.threads or max(1, processors // workers),
        keep_days=given.keep_days,
        keep_bytes=given.keep_bytes,
        ray=given.ray,
        web=given.web,
    )
