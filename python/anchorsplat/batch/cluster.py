"""Connects to Ray: by default its own on this machine, or a running cluster."""

from __future__ import annotations

import contextlib
import logging
import os
import secrets
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .._cluster_address import look_for
from .._errors import BadArgumentError, IoError, NotFoundError

_OBJECT_STORE = 80 << 20  # bytes, Ray's minimum: results of tasks are only rows
_PRIVATE = {
    # Every process listens on 127.0.0.1 only. (The variable is named after the systems where that is Ray's default.)
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",
    "RAY_USAGE_STATS_ENABLED": "0",
    # Workers keep this process's niceness. Ray adds 15, which makes them several times slower on a busy machine.
    "RAY_worker_niceness": "0",
}


# One for the whole process, as older versions of Ray keep the first token.
_TOKEN = {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32)}
_PREFIX = "anchorsplat-ray-"


def ray_module() -> Any:
    try:
        import ray
    except ImportError as error:
        raise NotFoundError("batches need Ray: run pip install 'anchorsplat[batch]'") from error
    return ray


def cores() -> int:
    return len(os.sched_getaffinity(0))


@contextlib.contextmanager
def _token_read_again() -> Iterator[None]:
    """Ray's core keeps its first token in a process: the user's from an earlier Ray, or ours. If the user has disabled tokens in
    this process, ours cannot be enabled."""

    def forget() -> None:
        with contextlib.suppress(AttributeError):
            ray_module()._raylet.AuthenticationTokenLoader.instance().reset_cache()

    forget()
    with contextlib.suppress(AttributeError):
        core = ray_module()._raylet
        if core.get_authentication_mode() != core.AuthenticationMode.TOKEN:
            os.environ["RAY_AUTH_MODE"] = "disabled"
    try:
        yield
    finally:
        forget()


@contextlib.contextmanager
def connected(address: str | None, cpus: int | None) -> Iterator[Any]:
    """Connects Ray. An existing connection is used and kept; one started here is shut down here.

    `address`: of a cluster ("auto", "HOST:PORT"); None: a Ray on this machine, for as long as this lasts, that listens
    on 127.0.0.1 only and asks for a token that only this process knows.
    """
    if address is not None and "://" in address:
        raise BadArgumentError(
            f"--ray {address}: pass HOST:PORT of the cluster's head, or auto, on a machine of the cluster, "
            "or run the whole command with `ray job submit`"
        )
    if address is None and "ray" in sys.modules and sys.modules["ray"].is_initialized():
        yield sys.modules["ray"]
        return
    quiet = {"logging_level": logging.ERROR, "log_to_driver": False}
    if address is not None:
        ray = ray_module()
        try:
            look_for(address)
            ray.init(address=address, **quiet)
        except (ConnectionError, ValueError, RuntimeError) as error:
            raise IoError(f"--ray {address}: {error}") from error
        try:
            yield ray
        finally:
            ray.shutdown()
        return
    with _environment({**_PRIVATE, **_TOKEN}), _token_read_again():
        ray = ray_module()
        with contextlib.suppress(AttributeError):  # read when Ray was imported, maybe earlier
            ray._private.ray_constants.ENABLE_RAY_CLUSTER = False
        # Contains Unix sockets, whose paths may have at most 107 bytes.
        place = Path("/tmp" if len(tempfile.gettempdir()) > 30 else tempfile.gettempdir())
        _sweep(place)
        folder = tempfile.mkdtemp(prefix=f"{_PREFIX}{os.getpid()}-", dir=place)
        try:
            ray.init(
                address="local",
                num_cpus=cpus or cores(),
                include_dashboard=False,
                object_store_memory=_OBJECT_STORE,
                _temp_dir=folder,
                **quiet,
            )
            try:
                yield ray
            finally:
                ray.shutdown()
        finally:
            shutil.rmtree(folder, ignore_errors=True)


def _sweep(place: Path) -> None:
    """Removes what killed (-9) processes of ours left."""
    for folder in place.glob(_PREFIX + "*"):
        owner = folder.name.removeprefix(_PREFIX).partition("-")[0]
        try:
            if owner.isdigit() and folder.stat().st_uid == os.getuid() and not Path("/proc", owner).exists():
                shutil.rmtree(folder, ignore_errors=True)
        except OSError:
            pass


@contextlib.contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Environment variables that Ray's processes and its C++ core read on start."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def memory_of_largest_machine(ray: Any) -> int:
    """Most memory, in bytes, that a machine of the cluster gives to tasks."""
    return int(max((node["Resources"].get("memory", 0) for node in ray.nodes() if node["Alive"]), default=0))


def cpus_of_largest_machine(ray: Any) -> int:
    return int(max((node["Resources"].get("CPU", 0) for node in ray.nodes() if node["Alive"]), default=0))


def slots(ray: Any, cpus_per_task: int) -> int:
    """Number of tasks that the cluster can run at a time now."""
    return sum(
        int(node["Resources"].get("CPU", 0)) // cpus_per_task for node in ray.nodes() if node["Alive"]
    )
