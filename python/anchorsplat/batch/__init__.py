"""Many splats on many cores and machines, by Ray. docs/batch.md is a page of examples.

    from anchorsplat import batch
    report = batch.enhance("s3://scans/**/*.ply", out="s3://sharp", upscale=4, format="spz")
    report.done, report.failed, report.skipped
"""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike, fspath
from typing import Any

from .._run import ProgressLike, shower
from .command_line import main
from .enhance import How, run_splats
from .progress import Show
from .report import BatchReport
from .scheduler import Stopped
from .settings import as_arguments

__all__ = ["BatchReport", "Stopped", "enhance", "main", "refine"]

Inputs = str | PathLike[str] | Iterable[str | PathLike[str]]


def enhance(
    inputs: Inputs,
    out: str | PathLike[str],
    *,
    lists: Inputs = (),
    root: str | None = None,
    format: str | None = None,
    manifest: str | PathLike[str] | None = None,
    overwrite: bool = False,
    verify: bool = False,
    ray: str | None = None,
    workers: int | None = None,
    threads: int = 1,
    in_flight: int | None = None,
    retries: int = 3,
    progress: ProgressLike = False,
    **options: Any,
) -> BatchReport:
    """Enhances every input into the folder `out` and records each in the manifest. Called again, it makes only what is missing
    or has changed.

    `inputs` are paths, fsspec URLs or patterns; `lists` are text files of them. `options` are the options of
    ``anchorsplat enhance`` as keywords: ``upscale=4``, ``cameras="{folder}/transforms.json"``, ``clean=True``. The other
    arguments are those of the command line (``anchorsplat batch enhance --help``). `progress`: True for lines on stderr, or as
    for other functions: a class such as tqdm.tqdm, a bar, or a function that is called with a :class:`anchorsplat.Progress`.

    A failed input is a row in ``report.failures``, not an exception. Raises, before any work, BadArgumentError for invalid
    options and inputs; ExistsError if results would replace files that no batch made; NotFoundError if a pattern matches
    nothing; IoError if the manifest is lost or the cluster cannot be reached; Stopped, a KeyboardInterrupt, on Ctrl-C.
    """
    return run_splats(
        _words(inputs),
        fspath(out),
        as_arguments(options),
        How(ray, workers, threads, in_flight, retries, progress in (None, False), _show(progress)),
        lists=_words(lists),
        root=root,
        format=format,
        manifest=fspath(manifest) if manifest is not None else None,
        overwrite=overwrite,
        verify=verify,
    )


def refine(inputs: Inputs, out: str | PathLike[str], *, method: str = "refine", **options: Any) -> BatchReport:
    """enhance() with the method refine, which takes minutes per splat. After Ctrl-C the next call resumes from checkpoints, if
    `out` is a folder."""
    return enhance(inputs, out, method=method, **options)


def _show(progress: ProgressLike) -> Show | None:
    return None if progress is True else shower(progress)


def _words(inputs: Inputs) -> list[str]:
    return [fspath(inputs)] if isinstance(inputs, (str, PathLike)) else [fspath(word) for word in inputs]
