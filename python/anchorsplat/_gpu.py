"""Where the package wgpu has the library that speaks WebGPU: ``pip install 'anchorsplat[gpu]'`` brings it."""

from __future__ import annotations

import functools
import importlib.util
import os

from . import _core


def _folder() -> str:
    """The package is looked for, not imported."""
    try:
        found = importlib.util.find_spec("wgpu")
    except (ImportError, ValueError):  # of a module that somebody has put into sys.modules by hand
        found = None
    if found is not None and found.submodule_search_locations:
        return os.path.join(found.submodule_search_locations[0], "resources")
    return os.path.dirname(os.path.abspath(__file__))


@functools.cache
def tell_library() -> None:
    """The engine looks there first."""
    _core.set_gpu_folder(os.fsencode(_folder()))
