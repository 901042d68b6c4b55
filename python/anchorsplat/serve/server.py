"""Listens, prints the address, and shuts down cleanly."""

from __future__ import annotations

import contextlib
import dataclasses
import logging
import signal
import socket
import sys

import uvicorn

from .api import Service
from .app import make_app
from .engine import EngineMissing
from .settings import Settings
from .store import DataInUse


class _Server(uvicorn.Server):
    def __init__(self, config: uvicorn.Config, service: Service):
        super().__init__(config)
        self._service = service

    @contextlib.contextmanager
    def capture_signals(self):
        """A requested stop is not a failure: uvicorn itself would end the process by the signal."""
        before = {number: signal.signal(number, self.handle_exit) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def handle_exit(self, sig, frame) -> None:
        # Watchers of a job would otherwise keep their connections, and so the service, open.
        self._service.scheduler.begin_to_stop()
        super().handle_exit(sig, frame)


def listen(host: str, port: int) -> socket.socket:
    family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    sock = socket.socket(family, socket.SOCK_STREAM)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        sock.bind(address)
        sock.listen(512)
    except OSError:
        sock.close()
        raise
    return sock


def run(settings: Settings) -> int:
    logging.basicConfig(level=logging.INFO, format="%(levelname)s: %(message)s", stream=sys.stderr)
    try:
        sock = listen(settings.host, settings.port)
    except OSError as error:
        print(
            f"error: cannot listen at {settings.host}, port {settings.port}: {error.strerror or error}; pass another --port",
            file=sys.stderr,
        )
        return 6
    settings = dataclasses.replace(settings, port=sock.getsockname()[1])
    try:
        app = make_app(settings)
    except (DataInUse, EngineMissing, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 3 if isinstance(error, EngineMissing) else 6
    host = f"[{settings.host}]" if ":" in settings.host else settings.host
    print(f"anchorsplat serves http://{host}:{settings.port}", flush=True)
    print(
        f"  {settings.workers} at a time with {settings.threads} threads and {settings.max_memory / 2**30:.3g} GiB each"
        f"{', on Ray' if settings.ray else ''}; jobs and results in {settings.data}; stop with Ctrl-C",
        flush=True,
    )
    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=5,
        limit_concurrency=1000,
        h11_max_incomplete_event_size=64 * 1024,
    )
    server = _Server(config, app.service)
    server.run(sockets=[sock])
    return 0
