"""`anchorsplat batch VERB`: options of batches, and those of the verb itself."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from .._errors import Error
from .engine import CODES, INTERRUPTED, options
from .enhance import How, run_splats
from .inputs import FORMATS
from .progress import printable
from .report import BatchReport
from .settings import OWN

_VERBS = {
    "enhance": "splats, with the options of `anchorsplat enhance`",
    "refine": "the same with --method refine: minutes per splat, resumes after Ctrl-C",
    "dataset": "a data set, object by object, with the options of `anchorsplat dataset build`",
    "eval": "methods on a benchmark, with the options of `anchorsplat eval`",
}
_OWN_OF_FOLDERS = {"--output", "--json", "--quiet", "--overwrite", "--threads", "--plan"}
_OWN_OF_DATASET = _OWN_OF_FOLDERS | {"--jobs", "--retry", "--timeout"}


def main(argv: Sequence[str]) -> int:
    """Runs `anchorsplat batch ARGV`. Returns the exit code (docs/cli.md)."""
    words = list(argv)
    if not words or words[0] in ("-h", "--help"):
        _usage()
        return 0 if words else 2
    verb = words[0]
    if verb not in _VERBS:
        print(f"error: batch has no verb '{printable(verb)}'; known: {', '.join(_VERBS)}", file=sys.stderr)
        return 2
    asked: argparse.Namespace | None = None
    try:
        asked = _parser(verb).parse_intermixed_args(words[1:])
        return {"enhance": _splats, "refine": _splats, "dataset": _dataset, "eval": _eval}[verb](verb, asked)
    except SystemExit as ended:  # argparse has printed the reason
        return int(ended.code or 0)
    except KeyboardInterrupt:
        return _complain(asked, INTERRUPTED, "interrupted", "interrupted; run the same command to continue")
    except Error as error:
        code = next((number for number, (_, kind) in CODES.items() if isinstance(error, kind)), 6)
        return _complain(asked, code, CODES[code][0], str(error))
    except OSError as error:
        return _complain(asked, 6, "io", str(error))


def _complain(asked: argparse.Namespace | None, code: int, name: str, message: str) -> int:
    print(f"error: {printable(message)}", file=sys.stderr)
    if asked is not None and asked.json:
        print(json.dumps({"error": {"code": name, "message": message}}, indent=2))
    return code


def _usage() -> None:
    print("Many splats on many cores and machines, with Ray (docs/batch.md)\n")
    print("Usage: anchorsplat batch VERB ...\n")
    for verb, what in _VERBS.items():
        print(f"  {verb:<9} {what}")
    print("\nExample:\n  anchorsplat batch enhance 'scans/**/*.ply' --out sharp --format spz")


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """Prints two lines, as the program does, without all options."""
        print(f"error: {printable(message)}\nTry: {self.prog} --help", file=sys.stderr)
        raise SystemExit(2)


def _parser(verb: str) -> argparse.ArgumentParser:
    parser = _Parser(f"anchorsplat batch {verb}", allow_abbrev=False, description=f"Makes {_VERBS[verb]}.")
    add = parser.add_argument
    if verb in ("enhance", "refine"):
        add("inputs", nargs="*", metavar="IN", help="paths, URLs (s3://, gs://, http://) or patterns of them; ** is any folders")
        add("--out", "-o", required=True, metavar="DIR", help="folder or URL of the results")
        add("--list", action="append", default=[], metavar="FILE", help="text file of inputs, one a line")
        add("--root", metavar="DIR", help="results keep the input folders below this one (default: those from the first wildcard on)")
        add("--format", choices=FORMATS, help="format of the results (default: that of each input if it can be written, else ply)")
        add("--manifest", metavar="FILE", help="list of what was done with each input (default: manifest.jsonl in DIR)")
        add("--verify", action="store_true", help="also read inputs and results that look unchanged")
    elif verb == "dataset":
        add("meshes", nargs="*", metavar="MESH", help="meshes, as for dataset build")
        add("--out", "-o", required=True, metavar="DIR", help="folder of the data set, shared by all machines")
        add("--retry", action="store_true", help="try again what failed in an earlier run")
        add("--timeout", type=float, default=14400, metavar="SECONDS", help="time limit of an object; 0: none (default: 14400)")
    else:
        add("benchmark", metavar="BENCHMARK", help="folder with a folder per object, shared by all machines")
        add("--out", "-o", required=True, metavar="DIR", help="folder of tables and results, shared by all machines")
    if verb in ("dataset", "eval"):
        add("--memory", type=float, default=2, metavar="GB", help="expected memory of a task (default: 2)")
    add("--ray", metavar="ADDRESS", help="HOST:PORT of a cluster's head, or auto (default: Ray on this machine only)")
    add("--workers", type=int, metavar="N", help="tasks at a time on this machine (default: as many as its cores allow)")
    add("--threads", type=int, default=1, metavar="N", help="cores of one task (default: 1)")
    add("--in-flight", type=int, metavar="N", help="tasks submitted to Ray at a time (default: twice as many as can run)")
    add("--retries", type=int, default=3, metavar="N", help="retries of a task whose worker or program was killed, or whose storage failed (default: 3)")
    add("-w", "--overwrite", action="store_true", help="redo everything")
    add("-q", "--quiet", action="store_true", help="only errors on stderr, no summary")
    add("--json", action="store_true", help="the result as one JSON document on stdout")
    native = _native_verb(verb)
    group = parser.add_argument_group(f"passed on (anchorsplat {' '.join(native)} --help-all explains them)")
    for option in options(*native).values():
        if option.name in _own(verb):
            continue
        how: dict[str, Any] = {"dest": f"passed {option.name}", "default": None}
        if not option.kind:
            how["action"] = "store_true"
        elif option.several:
            how.update(nargs="+", metavar=option.kind)
        else:
            how["metavar"] = option.kind
        group.add_argument(option.name, **how)
    return parser


def _native_verb(verb: str) -> tuple[str, ...]:
    return {"enhance": ("enhance",), "refine": ("enhance",), "dataset": ("dataset", "build"), "eval": ("eval",)}[verb]


def _own(verb: str) -> set[str]:
    return {"enhance": OWN, "refine": OWN, "dataset": _OWN_OF_DATASET, "eval": _OWN_OF_FOLDERS}[verb]


def _passed(asked: argparse.Namespace) -> dict[str, Any]:
    """Given options of the verb itself."""
    given = {}
    for name, value in vars(asked).items():
        if name.startswith("passed ") and value:
            given[name.removeprefix("passed ")] = ",".join(value) if isinstance(value, list) else value
    return given


def _as_words(given: dict[str, Any]) -> list[str]:
    return [name if value is True else f"{name}={value}" for name, value in given.items()]


def _how(asked: argparse.Namespace) -> How:
    return How(asked.ray, asked.workers, asked.threads, asked.in_flight, asked.retries, asked.quiet)


def _tell(asked: argparse.Namespace, report: BatchReport, what: str, made: str) -> int:
    if asked.json:
        print(json.dumps({**dataclasses.asdict(report), "exit_code": report.exit_code}, indent=2, ensure_ascii=False))
    elif not asked.quiet:
        print("\n".join(printable(line) for line in report.sentence(what, made).splitlines()))
    return report.exit_code


def _splats(verb: str, asked: argparse.Namespace) -> int:
    given = _passed(asked)
    if verb == "refine":
        given.setdefault("--method", "refine")

    def stopped(report: BatchReport) -> None:
        if not asked.json and not asked.quiet:
            print(printable(report.sentence("splats", "enhanced").splitlines()[0]))

    report = run_splats(
        asked.inputs, asked.out, given, _how(asked), lists=asked.list, root=asked.root, format=asked.format,
        manifest=asked.manifest, overwrite=asked.overwrite, verify=asked.verify, stopped=stopped,
    )  # fmt: skip
    return _tell(asked, report, "splats", "enhanced")


def _dataset(_: str, asked: argparse.Namespace) -> int:
    from . import dataset

    report = dataset.build(asked.meshes, asked.out, _as_words(_passed(asked)), _how(asked), overwrite=asked.overwrite,
                           retry=asked.retry, timeout=asked.timeout, memory=int(asked.memory * 2**30))  # fmt: skip
    return _tell(asked, report, "objects", "made")


def _eval(_: str, asked: argparse.Namespace) -> int:
    from .evaluate import evaluate

    report, code = evaluate(asked.benchmark, asked.out, _as_words(_passed(asked)), _how(asked), overwrite=asked.overwrite,
                            json=asked.json, memory=int(asked.memory * 2**30))  # fmt: skip
    if not asked.json and not asked.quiet:
        print(printable(report.sentence("results", "measured or there already").splitlines()[0]), file=sys.stderr)
    return code or (1 if report.failed else 0)
