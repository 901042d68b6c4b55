"""Whether there is a Ray cluster at an address."""

from __future__ import annotations

import socket

_CONNECT_SECONDS = 10


def look_for(address: str) -> None:
    """Ray itself tries for minutes. Raises ConnectionError where nobody listens at HOST:PORT; other words are Ray's affair."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdigit():
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), _CONNECT_SECONDS).close()
    except (OSError, OverflowError) as error:
        raise ConnectionError(f"no Ray cluster at {address}: {error}") from None
