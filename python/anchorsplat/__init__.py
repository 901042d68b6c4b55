"""anchorsplat: makes a low-quality 3D Gaussian splat hold up when seen closer. docs/python.md is a page of examples.

    import anchorsplat
    sharp, report = anchorsplat.enhance(anchorsplat.read("scan.ply"), upscale=4)
    anchorsplat.write("scan-4x.ply", sharp)
"""

from . import _core
from ._cameras import Cameras
from ._cloud import Cloud
from ._compare import compare, psnr, sheet, ssim
from ._convert import convert
from ._edit import Edit, edit
from ._enhance import enhance, methods, refine
from ._errors import (
    BadArgumentError,
    BadFileError,
    Error,
    ExistsError,
    IoError,
    NotFoundError,
    SplatWarning,
    StoppedError,
)
from ._files import Format, formats, read, to_bytes, write
from ._fit import fit
from ._info import info
from ._render import render
from ._report import Report
from ._run import Progress
from ._upscale import upscale
from ._view import Page, view

__version__: str = _core.version

__all__ = [
    "BadArgumentError",
    "BadFileError",
    "Cameras",
    "Cloud",
    "Edit",
    "Error",
    "ExistsError",
    "Format",
    "IoError",
    "NotFoundError",
    "Page",
    "Progress",
    "Report",
    "SplatWarning",
    "StoppedError",
    "compare",
    "convert",
    "edit",
    "enhance",
    "fit",
    "formats",
    "info",
    "methods",
    "psnr",
    "read",
    "refine",
    "render",
    "sheet",
    "ssim",
    "to_bytes",
    "upscale",
    "view",
    "write",
]
