"""Report of a batch."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from .engine import CODES
from .progress import Counts, duration


@dataclass
class BatchReport:
    """Counts of one run. `failures` are the manifest rows of its failed inputs."""

    total: int
    done: int
    failed: int
    skipped: int  # already up to date
    seconds: float
    manifest: str
    failures: list[dict[str, Any]] = field(default_factory=list, repr=False)
    start_seconds: float = 0.0  # part of `seconds` until Ray was ready
    gaussians_in: int = 0
    gaussians_out: int = 0

    @property
    def exit_code(self) -> int:
        """0: all done; 1: some failed; the code of the last failure if all failed (docs/cli.md)."""
        if self.failed == 0:
            return 0
        if self.failed < self.total or not self.failures:
            return 1
        code = self.failures[-1].get("error", {}).get("code")
        return next((number for number, (name, _) in CODES.items() if name == code), 6)

    def to_json(self) -> dict[str, Any]:
        return asdict(self)

    def sentence(self, what: str, made: str) -> str:
        text = f"{self.total:,} {what}: {self.done:,} {made}, {self.skipped:,} there already, {self.failed:,} failed"
        left = self.total - self.done - self.skipped - self.failed
        if left:
            text += f", {left:,} still to do"
        text += f"; {duration(self.seconds)}"
        if self.gaussians_in:
            text += f"; {self.gaussians_in:,} Gaussians became {self.gaussians_out:,}"
        return f"{text}\n{self.manifest} has a line for each"


def report_of(counts: Counts, seconds: float, manifest: str, failures: list[dict[str, Any]]) -> BatchReport:
    return BatchReport(counts.total, counts.done, counts.failed, counts.skipped, round(seconds, 3), manifest, failures)
