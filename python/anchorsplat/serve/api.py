"""The endpoints."""

from __future__ import annotations

import asyncio
import errno
import hashlib
import json
import shutil
import sqlite3
from typing import Literal
from urllib.parse import parse_qs

from fastapi import APIRouter, Query, Request
from fastapi.responses import FileResponse, JSONResponse, Response, StreamingResponse
from pydantic import ValidationError

from . import store as states
from .cameras import BadCameras, plain_cameras
from .metrics import CONTENT_TYPE, Metrics
from .options import (
    FORMATS,
    KINDS,
    ConvertOptions,
    EnhanceOptions,
    Format,
    Options,
    RenderOptions,
)
from .scheduler import Refused, Scheduler
from .security import COOKIE, PAGE_POLICY, VIEWER_POLICY, same, session
from .settings import Settings
from .store import Store
from .upload import BadUpload, Upload, receive

_KEEP_ALIVE_SECONDS = 15
_STATUS = {
    "bad_file": 400,
    "memory": 413,
    "too_large": 413,
    "timeout": 413,
    "disk_full": 507,
    "bad_option": 422,
    "interrupted": 503,
}
_VIEWABLE = ("ply", "compressed.ply", "spz", "sog", "splat", "glb")


def _no_such_job() -> ApiError:
    return ApiError(404, "not_found", "There is no such job. Old ones are deleted with their results.")


class ApiError(Exception):
    def __init__(
        self, status: int, code: str, message: str, headers: dict[str, str] | None = None, details: list | None = None
    ):
        super().__init__(message)
        self.status, self.code, self.headers, self.details = status, code, headers or {}, details

    def response(self) -> JSONResponse:
        error = {"code": self.code, "message": str(self)} | ({"details": self.details} if self.details else {})
        return JSONResponse({"error": error}, self.status, self.headers)


def bad_options(error: ValidationError) -> ApiError:
    details = [
        {"option": ".".join(map(str, e["loc"])) or "options", "message": e["msg"].removeprefix("Value error, ")}
        for e in error.errors()
    ]
    # A union reports an error per member; the first name of its location is the option. Without a location the message names
    # it.
    sentences = dict.fromkeys(
        d["message"] if d["option"] == "options" else f"{d['option'].split('.')[0]}: {d['message']}" for d in details
    )
    return ApiError(422, "bad_option", "; ".join(sentences), details=details)


def disk_full(error: BaseException) -> bool:
    if isinstance(error, OSError):
        return error.errno in (errno.ENOSPC, errno.EDQUOT)
    return isinstance(error, sqlite3.OperationalError) and "full" in str(error)


class Service:
    def __init__(self, settings: Settings, store: Store, scheduler: Scheduler, metrics: Metrics):
        self.settings, self.store, self.scheduler, self.metrics = settings, store, scheduler, metrics
        self._one_at_a_time = asyncio.Lock()

    async def submit(self, kind: str, request: Request) -> JSONResponse:
        """Accepts an upload: 202 with a queued job, or 200 if its result exists."""
        pairs = [pair for pair in request.query_params.multi_items() if pair[0] != "name"]
        validate(kind, pairs)  # before receiving gigabytes
        scheduler, store = self.scheduler, self.store
        scheduler.admit()
        scheduler.uploading += 1
        path = store.new_upload()
        try:
            upload = await receive(request, path, self.settings.max_upload, self.settings.stall_seconds)
            self.metrics.uploaded.inc(upload.size)
            options = validate(kind, pairs + upload.fields)
            cameras = await self._cameras(kind, options, upload)
            input_id, facts = await self._known_input(upload)
            job_id = store.add_job(
                kind, options.canonical(), input_id, cameras, scheduler.engine.fingerprint, upload.name
            )
        except Refused as error:
            raise ApiError(_STATUS.get(error.code, 400), error.code, str(error)) from None
        except BadCameras as error:
            raise ApiError(400, "bad_file", str(error)) from None
        except BadUpload as error:
            raise ApiError(error.status, error.code, str(error)) from None
        finally:
            scheduler.uploading -= 1
            path.unlink(missing_ok=True)
        job, _ = self.find(job_id)
        scheduler.submitted(job["key"])
        answer = self.describe(job)
        if answer["state"] == states.DONE:
            self.metrics.answered.inc()
        return JSONResponse(
            answer, 200 if answer["state"] == states.DONE else 202, {"location": answer["links"]["self"]}
        )

    async def _known_input(self, upload: Upload) -> tuple[str, dict]:
        # Only this format cannot be recognised by content, so the name decides.
        hint = ".splat" if upload.name.lower().endswith(".splat") else ""
        input_id = upload.sha256 + hint
        facts = self.store.input_facts(input_id)
        if facts is None:
            facts = await self.scheduler.check(upload.path, hint, upload.name)
        if facts["gaussians"] > self.settings.max_gaussians:
            raise Refused(
                "too_large",
                f"{upload.name} has {facts['gaussians']:,} Gaussians; this service accepts at most {self.settings.max_gaussians:,}.",
            )
        if facts["gaussians"] == 0:
            raise Refused("bad_file", f"{upload.name} has no Gaussians.")
        if not self.store.input_path(input_id).exists():
            self.store.add_input(upload.path, input_id, facts)
        return input_id, facts

    async def _cameras(self, kind: str, options: Options, upload: Upload) -> str | None:
        if upload.cameras is None:
            if isinstance(options, EnhanceOptions) and options.train_width is not None:
                raise ApiError(422, "bad_option", "train_width: has an effect only with cameras")
            return None
        if kind != "enhance":
            raise ApiError(422, "bad_option", f"cameras: have no effect on {kind}")
        async with self._one_at_a_time:  # numbers in Python take ten times the memory
            plain = await asyncio.to_thread(plain_cameras, upload.cameras)
        path = self.store.new_upload()
        await asyncio.to_thread(path.write_bytes, plain)
        cameras_id = hashlib.sha256(plain).hexdigest()
        self.store.add_input(path, cameras_id, {})
        return cameras_id

    def find(self, job_id: str) -> tuple[sqlite3.Row, sqlite3.Row]:
        job = self.store.job(job_id) if len(job_id) < 100 else None
        if job is None:
            raise _no_such_job()
        return job, self._work_of(job)

    def _work_of(self, job: sqlite3.Row) -> sqlite3.Row:
        work = self.store.work(job["key"])
        if work is None:
            raise _no_such_job()
        return work

    def describe(self, job: sqlite3.Row) -> dict:
        work = self._work_of(job)
        state = states.CANCELLED if job["cancelled"] else work["state"]
        link = f"/v1/jobs/{job['id']}"
        facts = self.store.input_facts(work["input"]) or {}
        out = {
            "id": job["id"],
            "kind": work["kind"],
            "name": job["name"],
            "state": state,
            "created": job["created"],
            "options": json.loads(work["options"]),
            "input": facts | {"cameras": work["cameras"] is not None},
            "links": {"self": link, "events": f"{link}/events"},
        }
        if state == states.QUEUED:
            out["position"] = self.store.position(work)
        if state == states.RUNNING:
            out["started"] = work["started"]
            out["progress"] = self.scheduler.progress.get(work["key"])
        if state == states.FAILED:
            out["error"] = {"code": work["error_code"], "message": work["error"]}
        if state == states.DONE:
            out["finished"] = work["finished"]
            out["report"] = json.loads(work["report"])
            out["formats"] = formats_of(work)
            out["links"]["result"] = f"{link}/result"
            if viewable(work):
                out["links"]["view"] = f"{link}/view"
        return out

    def done(self, job_id: str) -> tuple[sqlite3.Row, sqlite3.Row]:
        job, work = self.find(job_id)
        if job["cancelled"] or work["state"] != states.DONE:
            raise ApiError(
                409, "not_done", f"The job is {'cancelled' if job['cancelled'] else work['state']}; there is no result."
            )
        return job, work

    async def events(self, job_id: str):
        job, _ = self.find(job_id)
        changes = self.scheduler.changes(job["key"])
        last = None
        while True:
            change = changes.next()
            try:
                now = self.describe(self.find(job_id)[0])
            except ApiError:
                yield "event: gone\ndata: {}\n\n"
                return
            yield f"data: {json.dumps(now)}\n\n" if now != last else ": still here\n\n"
            if now["state"] in states.ENDED or self.scheduler.stopping:
                return
            last = now
            try:
                await asyncio.wait_for(change.wait(), _KEEP_ALIVE_SECONDS)
            except TimeoutError:
                pass


def validate(kind: str, pairs: list[tuple[str, str]]) -> Options:
    given: dict[str, str | list[tuple[str, str]]] = {}
    edits = []
    for said, value in pairs:
        name = said.replace("-", "_")  # spelled as on the command line or as in a form
        if name in KINDS[kind].in_order:
            edits.append((name, value))
            continue
        if name in given:
            raise ApiError(422, "bad_option", f"{name}: given more than once")
        given[name] = value
    if edits:
        if "edits" in given:
            raise ApiError(422, "bad_option", "edits: pass each edit by its own name, such as translate")
        given["edits"] = edits
    try:
        return KINDS[kind].model_validate(given)
    except ValidationError as error:
        raise bad_options(error) from None


def formats_of(work: sqlite3.Row) -> list[str]:
    options = KINDS[work["kind"]].model_validate_json(work["options"])
    if isinstance(options, EnhanceOptions):
        return list(FORMATS)
    if isinstance(options, ConvertOptions):
        return [options.to]
    assert isinstance(options, RenderOptions)
    return ["png" if options.orbit == 1 else "zip"]


def viewable(work: sqlite3.Row) -> bool:
    return work["kind"] != "render" and formats_of(work)[0] in _VIEWABLE


def _stem(name: str) -> str:
    for extension in (".compressed.ply", *(f".{f}" for f in FORMATS), ".ksplat", ".pt", ".pth", ".ckpt"):
        if name.lower().endswith(extension) and len(name) > len(extension):
            return name[: -len(extension)]
    return name


def router(service: Service, static: dict[str, tuple[bytes, str]]) -> APIRouter:
    api = APIRouter()
    scheduler, settings = service.scheduler, service.settings

    @api.get("/v1/jobs/{job_id}", tags=["jobs"], summary="State, progress and report of a job")
    async def job(job_id: str) -> dict:
        found, _ = service.find(job_id)
        return service.describe(found)

    @api.get(
        "/v1/jobs/{job_id}/events",
        tags=["jobs"],
        summary="The same whenever it changes, as server-sent events",
        response_class=StreamingResponse,
    )
    async def events(job_id: str) -> StreamingResponse:
        service.find(job_id)
        return StreamingResponse(
            service.events(job_id), media_type="text/event-stream", headers={"x-accel-buffering": "no"}
        )

    @api.get(
        "/v1/jobs/{job_id}/result",
        tags=["jobs"],
        summary="The result, an enhanced splat in any format",
        response_class=FileResponse,
    )
    async def result(
        job_id: str,
        format: Format | Literal["png", "zip"] | None = Query(
            None, description="default: ply of an enhanced splat, else what was asked for"
        ),
    ) -> FileResponse:
        found, work = service.done(job_id)
        known = formats_of(work)
        wanted = format or known[0]
        if wanted not in known:
            raise ApiError(422, "bad_option", f"format: this result is available as {', '.join(known)}")
        ending = {"png": "png", "zip": "zip", "gltf": "gltf.zip"}.get(wanted, wanted)
        name = {"png": "view.png", "zip": "views.zip"}.get(wanted, f"result.{ending}")
        path = service.store.result_folder(work["key"]) / name
        if work["kind"] == "enhance" and wanted != "ply":
            path = await scheduler.other_format(work["key"], wanted)
        service.store.touch(work["key"])
        options = json.loads(work["options"])
        suffix = f"-{options['upscale']:g}x" if work["kind"] == "enhance" else ""
        media = {"png": "image/png", "zip": "application/zip"}.get(wanted) or FORMATS[wanted]
        return FileResponse(path, media_type=media, filename=f"{_stem(found['name'])}{suffix}.{ending}")

    @api.get(
        "/v1/jobs/{job_id}/view",
        tags=["jobs"],
        summary="A page that shows before and after",
        response_class=FileResponse,
    )
    async def view(job_id: str) -> FileResponse:
        _, work = service.done(job_id)
        if not viewable(work):
            raise ApiError(409, "not_viewable", "Results of this kind have no page.")
        options = json.loads(work["options"])
        title = f"Seen {options['upscale']:g} times closer" if work["kind"] == "enhance" else f"As {options['to']}"
        path = await scheduler.page(work, f"result.{formats_of(work)[0]}", title)
        return FileResponse(
            path,
            media_type="text/html",
            headers={"content-security-policy": VIEWER_POLICY, "x-frame-options": "SAMEORIGIN"},
        )

    @api.delete(
        "/v1/jobs/{job_id}",
        tags=["jobs"],
        summary="Cancel a job that is not over (200); forget one that is (204)",
        responses={200: {"description": "Cancelled"}, 204: {"description": "Forgotten, and its result"}},
    )
    async def delete(job_id: str) -> Response:
        found, work = service.find(job_id)
        if not found["cancelled"] and work["state"] not in states.ENDED:
            scheduler.cancel(found)
            return JSONResponse(service.describe(service.find(job_id)[0]))
        service.store.forget_job(job_id, work["key"])
        return Response(status_code=204)

    @api.get("/v1/limits", tags=["service"], summary="What this service takes, and what it makes")
    async def limits() -> dict:
        return {
            "version": scheduler.engine.version,
            "max_upload": settings.max_upload,
            "max_gaussians": settings.max_gaussians,
            "max_seconds": settings.max_seconds,
            "keep_days": settings.keep_days,
            "formats": list(FORMATS),
        }

    @api.get("/metrics", tags=["service"], summary="For Prometheus", response_class=Response)
    async def metrics() -> Response:
        service.metrics.queued.set(service.store.count(states.QUEUED))
        service.metrics.running.set(service.store.count(states.RUNNING))
        service.metrics.stored.set(service.store.stored_bytes())
        return Response(service.metrics.text(), media_type=CONTENT_TYPE)

    @api.get("/healthz", tags=["service"], summary="Whether the service lives and can write")
    async def healthz() -> dict:
        service.store.count(states.QUEUED)
        if shutil.disk_usage(service.store.folder).free < 2**20:
            raise ApiError(503, "disk_full", "The disk of this service is full.")
        return {"status": "ok"}

    @api.post("/login", include_in_schema=False)
    async def login(request: Request) -> Response:
        body = b""
        async for chunk in request.stream():
            body += chunk
            if len(body) > 4096:
                raise ApiError(413, "too_large", "That is not a token.")
        given = parse_qs(body.decode("latin-1")).get("token", [""])[0]
        if settings.token is None or not same(given, settings.token):
            page = static["login.html"][0].replace(b'<p id="wrong" hidden>', b'<p id="wrong">')
            return page_response(page, 401)
        answer = Response(status_code=303, headers={"location": "/"})
        answer.set_cookie(
            COOKIE,
            session(settings.token),
            max_age=30 * 86400,
            httponly=True,
            samesite="strict",
            secure=request.url.scheme == "https",
        )
        return answer

    return api


def page_response(body: bytes, status: int = 200) -> Response:
    return Response(body, status, {"content-security-policy": PAGE_POLICY}, "text/html; charset=utf-8")
