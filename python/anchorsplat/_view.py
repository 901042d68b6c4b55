"""HTML pages that show a splat."""

from __future__ import annotations

import html
from typing import Literal

from . import _core
from ._cameras import CamerasLike, Color, camera_words
from ._cloud import Cloud, RenderMode
from ._files import PathLike
from ._run import DeviceLike, ProgressLike, run
from ._words import path_bytes, words_of


class Page:
    """One HTML file that shows a splat in any browser with WebGL 2, offline. A notebook shows it inline."""

    __slots__ = ("_bytes",)

    def __init__(self, data: bytes) -> None:
        self._bytes = data

    def __bytes__(self) -> bytes:
        return self._bytes

    @property
    def html(self) -> str:
        """The HTML text."""
        return self._bytes.decode()

    def save(self, path: PathLike, *, overwrite: bool = False) -> None:
        """Writes the page, whole or not at all. Raises ExistsError unless `overwrite`, NotFoundError (the folder), IoError."""
        with run() as how:
            _core.write_file(path_bytes(path), self._bytes, overwrite, how)

    def _repr_html_(self, height: int = 480) -> str:
        return (
            f'<iframe srcdoc="{html.escape(self.html)}" style="width:100%;height:{height}px;border:0" '
            'sandbox="allow-scripts allow-downloads"></iframe>'
        )

    def __repr__(self) -> str:
        return f"<anchorsplat.Page: {len(self._bytes) / 1e6:.1f} MB of HTML; save() writes it>"


def view(
    after: Cloud,
    before: Cloud | None = None,
    *,
    cameras: CamerasLike | None = None,
    truth: PathLike | None = None,
    views: int = 10,
    pixel_size: float | Literal["auto"] = "auto",
    sh_degree: int = 3,
    mode: RenderMode | None = None,
    background: Color | None = None,
    title: str | None = None,
    open_your_own: str | None = None,
    device: DeviceLike = "cpu",
    max_gpu_memory: int | str | None = None,
    threads: int = 0,
    progress: ProgressLike = None,
) -> Page:
    """A page that shows the splat `after`, and optionally one before it.

    before: a splat to compare with.
    cameras: views to jump to, at most `views`, evenly chosen; the page opens at the first.
    truth: folder of ground-truth pictures, named as the cameras.
    pixel_size: world size of a training pixel, for the scale bar; "auto": estimated from `before`.
    sh_degree: highest degree of spherical harmonics to keep; 0 makes small pages.
    mode: rasterization of both; default: the tag of each, else classic.
    background: r, g, b from 0 to 1; default: from the camera file, else black.
    title: heading of the page.
    open_your_own: add a button to open another splat, in the hosted page at this address (docs/web.md).
    device: rasterize on "cpu", "gpu", "auto" (a hardware GPU, else the CPU) or an adapter by number.
        max_gpu_memory: most GPU memory to use, bytes or "4G"; default: 2 GiB (docs/gpu.md).

    Raises BadArgumentError: nothing to show, a page above 300 MB; NotFoundError, BadFileError: of the ground-truth pictures.
    """
    words = words_of(view, locals(), besides=("cameras",))
    given = camera_words(cameras, words)
    with run(threads, progress, device=device, max_gpu_memory=max_gpu_memory) as how:
        return Page(_core.view(after, before, words, given, title or "splat", how))
