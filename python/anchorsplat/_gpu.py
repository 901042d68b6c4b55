"""Finds the WebGPU library of the package wgpu, which ``pip install 'anchorsplat[gpu]'`` installs."""

from __future__ import annotations

import functools
import importlib.util
import os

from . import _core


def _folder() -> str:
    """Finds the package without importing it."""
    try:
        found = importlib.util.find_spec("wgpu")
    except (ImportError, ValueError):  # a module put into sys.modules by hand
        found = None
    if found is not None and found.submodule_search_locations:
        return os.path.join(found.submodule_search_locations[0], "resources")
    return os.path.dirname(os.path.abspath(__file__))


@functools.cache
def tell_library() -> None:
    """Tells the engine to look there first."""
    _core.set_gpu_folder(os.fsencode(_folder()))
