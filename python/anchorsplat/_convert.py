"""Converts splat files."""

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
    """Converts, shrinks or sorts a splat file. Unlike ``write(target, read(source))``, it keeps extra properties of the Gaussians if
    the format can store them.

    format: format of the source, by its extension, if neither name nor content shows it (--from on the command line).
    mode: rasterization to note in the output; default: as in the source.
    sh_degree: highest degree of spherical harmonics to keep, 0 to 3.
    min_opacity: drop Gaussians with less opacity, 0 to 1.
    max_gaussians: keep at most so many, the largest by size × opacity.
    coords: axes of files that break the rule of their format, as "IN:OUT", for example "RUB:".
    scales, opacities, colors: how the source stores them, if not as its format requires: "logarithms" or "lengths", "logits" or
    "0-1", "harmonics" or colours "0-1" or "0-255".
    double: PLY: write world coordinates as doubles (see Cloud.origin); default: as in the source.
    sort: order of the Gaussians in the file. spz_version: 4, or 3 for programs that only read gzip.
    lod_levels, lod_ratio, lod_chunk_count, lod_chunk_extent: for a target named lod-meta.json: levels, Gaussians in each level as
    a fraction of the finer one, most Gaussians in a chunk in units of 1,024, and longest side of a chunk. lod_level: level to
    read from such a source; 0 is the finest.
    report: read the output back and report errors per attribute and PSNR of renders from `report_views` views.
    overwrite: replace an existing file.

    Raises as ``read`` and ``write``.
    """
    if isinstance(source, (bytes, bytearray, memoryview)) or isinstance(target, (bytes, bytearray, memoryview)):
        raise BadArgumentError(
            "convert: expected paths, found bytes; use anchorsplat.to_bytes(anchorsplat.read(data), 'spz')"
        )
    words = words_of(convert, locals(), besides=("format",))
    if format is not None:
        words.append(b"--from=" + path_bytes(format))
    with run(threads, progress) as how:
        return Report._of(_core.convert(path_bytes(source), path_bytes(target), words, overwrite, how))
