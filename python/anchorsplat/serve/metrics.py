"""GET /metrics, for Prometheus."""

from __future__ import annotations

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    PlatformCollector,
    ProcessCollector,
    generate_latest,
)

from .process import Outcome

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"


class Metrics:
    def __init__(self) -> None:
        self._registry = registry = CollectorRegistry()
        ProcessCollector(registry=registry)
        PlatformCollector(registry=registry)
        self.requests = Counter(
            "anchorsplat_requests", "HTTP requests", ["method", "route", "status"], registry=registry
        )
        self.uploaded = Counter("anchorsplat_uploaded_bytes", "Bytes of uploads", registry=registry)
        self.answered = Counter("anchorsplat_answered", "Jobs answered by a result that was there", registry=registry)
        self._ended = Counter("anchorsplat_jobs", "Jobs that ended", ["kind", "state"], registry=registry)
        self._seconds = Histogram(
            "anchorsplat_job_seconds",
            "Of jobs that ran",
            ["kind"],
            registry=registry,
            buckets=(0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60, 300, 1800),
        )
        self._peak = Gauge("anchorsplat_job_peak_bytes", "Most resident memory of a job so far", registry=registry)
        self._most = 0
        self.queued = Gauge("anchorsplat_queued", "Jobs that wait", registry=registry)
        self.running = Gauge("anchorsplat_running", "Jobs that run", registry=registry)
        self.stored = Gauge("anchorsplat_stored_bytes", "Uploads and results on disk", registry=registry)

    def job_ended(self, kind: str, state: str, outcome: Outcome) -> None:
        self._ended.labels(kind, state).inc()
        self._seconds.labels(kind).observe(outcome.seconds)
        self._most = max(self._most, outcome.peak_bytes)
        self._peak.set(self._most)

    def text(self) -> bytes:
        return generate_latest(self._registry)
