"""Pictures enlarged by a network."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, cast

import numpy as np

from . import _core
from ._cameras import Color
from ._compare import _pictures
from ._files import PathLike
from ._run import ProgressLike, run
from ._words import path_bytes, words_of

if TYPE_CHECKING:
    import numpy.typing as npt


def upscale(
    pictures: npt.ArrayLike,
    network: PathLike,
    *,
    factor: int | None = None,
    background: Color | None = None,
    alpha: Literal["network", "bicubic"] = "network",
    threads: int = 0,
    progress: ProgressLike = None,
) -> npt.NDArray[np.float32]:
    """Enlarges pictures [V,H,W,C] or [H,W,C] with 3 or 4 channels, uint8 or floats from 0 to 1: float32 of as many
    dimensions, from 0 to 1. What the network adds is invented: likely, not seen. The same bits for any number of threads.

    `network`: a .safetensors of scripts/fetch-upscaler.sh.

    factor: enlargement, a power of the network's factor; default: the network's factor.
    background: r, g, b from 0 to 1 behind pictures with alpha; default: black.
    alpha: how to enlarge the fourth channel; "bicubic" takes half the time and has softer edges.

    Raises BadFileError if the file is not such a network, BadArgumentError for other shapes and factors.
    """
    array = _pictures("pictures", pictures)
    words = [b"--network=" + path_bytes(network), *words_of(upscale, locals())]
    with run(threads, progress) as how:
        enlarged = cast("npt.NDArray[np.float32]", _core.upscale(array, words, how))
    return enlarged if np.ndim(cast("npt.NDArray[np.float32]", pictures)) == 4 else enlarged[0]
