"""From one format to another."""

from __future__ import annotations

from typing import Literal

from . import _core
from ._cloud import RenderMode
from ._errors import BadArgumentError
from ._files import Order, PathLike
from ._report import Report
from ._run import ProgressLike, run
from ._words import path_bytes, words_of


def convert(
    source: PathLike,
    target: PathLike,
    *,
    format: str | None = None,
    mode: RenderMode | None = None,
    sh_degree: int | None = None,
    min_opacity: float = 0,
    max_gaussians: int | None = None,
    coords: str | None = None,
    scales: Literal["logarithms", "lengths"] = "logarithms",
    opacities: Literal["logits", "0-1"] = "logits",
    colors: Literal["harmonics", "0-1", "0-255"] = "harmonics",
    double: bool = False,
    sort: Order = "format",
    spz_version: int = 4,
    lod_levels: int = 4,
    lod_ratio: float = 0.25,
    lod_chunk_count: int = 512,
    lod_chunk_extent: float = 16,
    lod_level: int = 0,
    report: bool = False,
    report_views: int = 8,
    overwrite: bool = False,
    threads: int = 0,
    progress: ProgressLike = None,
) -> Report:
    """Changes the format of a splat's file, its size, its order. Other properties of its Gaussians come along where the format
    has a place for them, which ``write(target, read(source))`` would lose.

    format: of the input by its extension, for what neither content nor name tells (the command line's --from).
    mode: how the splat is rasterized, for a tag in the output; otherwise as the input says.
    sh_degree: spherical harmonics to keep, 0 to 3.
    min_opacity: drops Gaussians that are fainter, 0 to 1.
    max_gaussians: keeps at most so many, those of the largest size × opacity.
    coords: what the files' axes really are where they do not follow their format, as "IN:OUT", for example "RUB:".
    scales, opacities, colors: what the source's numbers are, whatever its format wants: "logarithms" or "lengths", "logits" or
    "0-1", "harmonics" or colours "0-1" or "0-255".
    double: a PLY with world coordinates in double precision (see Cloud.origin); otherwise as the source has them.
    sort: order of the Gaussians in the file. spz_version: 4, or 3 for programs that only know gzip.
    lod_levels, lod_ratio, lod_chunk_count, lod_chunk_extent: of a target named lod-meta.json, a scene at several levels of
    detail: their number, the Gaussians of each to those of the finer one, Gaussians in a chunk in units of 1,024, and the
    longest side of what changes its level as one. lod_level: the level to read of such a source; 0 is the finest.
    report: reads the output back: attribute errors, and PSNR of pictures of both, of `report_views` views.
    overwrite: replaces a file that exists.

    Raises as ``read`` and ``write``.
    """
    if isinstance(source, (bytes, bytearray, memoryview)) or isinstance(target, (bytes, bytearray, memoryview)):
        raise BadArgumentError(
            "convert: expected paths, found bytes: anchorsplat.to_bytes(anchorsplat.read(data), 'spz') makes bytes of bytes"
        )
    words = words_of(convert, locals(), besides=("format",))
    if format is not None:
        words.append(b"--from=" + path_bytes(format))
    with run(threads, progress) as how:
        return Report._of(_core.convert(path_bytes(source), path_bytes(target), words, overwrite, how))
