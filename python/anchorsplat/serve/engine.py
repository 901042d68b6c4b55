"""The native program: its path, the words for a job, and the meaning of its exit."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
from pathlib import Path

from .._program import program as bundled_program
from . import options as asked
from .process import Limits, Outcome
from .settings import Settings

#: Error codes in the program's --json for unreadable files (docs/cli.md).
BAD_ARGUMENT, BAD_FILE, IO = 2, 4, 6


class EngineMissing(Exception):
    """The native program is missing."""


def find_program() -> Path:
    """Path of this package's program, or of ANCHORSPLAT_PROGRAM."""
    named = os.environ.get("ANCHORSPLAT_PROGRAM")
    candidate = named or bundled_program()
    if os.access(candidate, os.X_OK) and os.path.isfile(candidate):
        return Path(candidate).resolve()
    raise EngineMissing(f"{candidate}: the native program is missing or cannot be run")


def fingerprint_of(program: Path) -> str:
    """Identity of the build, as other builds give other results."""
    with open(program, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]


class Engine:
    def __init__(self, program: Path, settings: Settings):
        self.program = program
        self._settings = settings
        answer = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=60, check=False)
        if answer.returncode != 0:
            raise EngineMissing(f"{program} --version failed: {answer.stderr.strip()}")
        self.version = answer.stdout.split()[-1]
        self.fingerprint = fingerprint_of(program)

    def limits(self) -> Limits:
        s = self._settings
        cpu = int(s.max_seconds * (s.threads + 1)) + 1
        return Limits(seconds=s.max_seconds, memory=s.max_memory, cpu_seconds=cpu, file_bytes=s.keep_bytes)

    def _shared(self) -> list[str]:
        return ["--json", "--progress", "json", "--threads", str(self._settings.threads)]

    def check(self, source: str, hint: str) -> list[str]:
        """Words that check a splat and find its format and size: they read all and write one Gaussian."""
        return [
            "convert",
            source,
            "one.ply",
            "--max-gaussians",
            "1",
            *(["--from", hint] if hint else []),
            *self._shared(),
        ]

    def job(self, kind: str, options: asked.Options, source: str, hint: str, cameras: bool) -> list[str]:
        """Words for a job. Its files have generated names in its folder."""
        if isinstance(options, asked.EnhanceOptions):
            resume = ["--resume", "--checkpoint", "state"] if options.quality == "good" else []
            return ["enhance", source, "-o", "result.ply", *options.words(cameras), *resume, *self._shared()]
        if isinstance(options, asked.ConvertOptions):
            named = ["--from", hint] if hint else []
            return ["convert", source, f"result.{options.to}", *named, *options.words(), *self._shared()]
        assert isinstance(options, asked.RenderOptions), kind
        output = "view.png" if options.orbit == 1 else "views"
        return ["render", source, "-o", output, *options.words(), *self._shared()]

    def derive(self, source: str, to: str) -> list[str]:
        return ["convert", source, f"result.{to}", *self._shared()]

    def page(self, after: str, before: str | None, title: str) -> list[str]:
        sides = ["--before", before] if before else []
        return ["view", after, *sides, "-o", "view.html", "--title", title, *self._shared()]

    def explain(self, outcome: Outcome, name: str = "the splat") -> tuple[str, str]:
        """Error code and message of a failed outcome."""
        s = self._settings
        memory = f"{s.max_memory / 2**30:.3g} GiB"
        if outcome.why == "timeout":
            return "timeout", f"This took longer than {s.max_seconds:g} s, the most that this service gives one job."
        if outcome.why == "stopped":
            return "interrupted", "The job was stopped."
        message = _without_dash(outcome.error, name)
        lower = message.lower()
        if outcome.code == BAD_FILE:
            return "bad_file", message
        if outcome.code == BAD_ARGUMENT:
            return "bad_option", message
        if "no space left" in lower or "quota" in lower:
            return "disk_full", f"The disk of this service is full: {message}"
        if "file too large" in lower:
            return "too_large", f"The result is larger than this service keeps ({s.keep_bytes:,} bytes)."
        if "memory" in lower and outcome.code == IO:
            return "memory", f"The splat needs more memory than this service gives one job ({memory})."
        if outcome.code == -signal.SIGKILL:
            return "killed", "The job's process was killed, perhaps because the machine ran out of memory."
        if outcome.code < 0:
            name_of = signal.Signals(-outcome.code).name
            return (
                "crashed",
                f"The job's process ended by {name_of}; it may use {memory} of memory. Please report this.",
            )
        return "failed", message or f"The job's process ended with code {outcome.code} and no message."


def _without_dash(message: str, name: str) -> str:
    """Replaces "-", standard input, by the file's name."""
    return name + message[1:] if message.startswith("-:") else message
