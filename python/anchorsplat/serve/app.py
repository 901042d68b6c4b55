"""The application: endpoints, pages, errors, and the guard around all of it."""

from __future__ import annotations

import contextlib
import logging
import sqlite3
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from starlette.exceptions import HTTPException

from .api import ApiError, Service, disk_full, page_response, router
from .engine import Engine, find_program
from .metrics import Metrics
from .options import KINDS
from .runner import LocalRunner, Runner
from .scheduler import Busy, Refused, Scheduler
from .security import WEB_POLICY, Guard
from .settings import Settings
from .store import Store
from .upload import drain

log = logging.getLogger("anchorsplat.serve")
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".wasm": "application/wasm",
}
#: Headers that let a page use threads.
_ISOLATED = {"cross-origin-opener-policy": "same-origin", "cross-origin-embedder-policy": "require-corp"}
_PAGES = {"/": "index.html", "/docs": "api.html"}
_SUMMARIES = {
    "enhance": "Make a splat hold up when seen closer",
    "convert": "Change the format of a splat, its size, its order; turn, move, scale, crop and clean it",
    "render": "Pictures of a splat on an orbit around it",
}


def read_static(folder: Path) -> dict[str, tuple[bytes, str]]:
    """Reads all files once, so that no path of a request is ever opened."""
    return {path.name: (path.read_bytes(), _TYPES[path.suffix]) for path in folder.iterdir() if path.suffix in _TYPES}


def make_runner(settings: Settings, engine: Engine) -> Runner:
    if settings.ray is None:
        return LocalRunner(engine.program)
    from .ray_runner import RayRunner

    return RayRunner(settings.ray, settings.threads, engine.fingerprint)


def make_app(settings: Settings):
    """The ASGI application, with its service in `app.service`. Raises DataInUse, EngineMissing."""
    engine = Engine(find_program(), settings)
    store, metrics = Store(settings.data), Metrics()
    static = read_static(Path(__file__).with_name("static"))
    scheduler = Scheduler(store, engine, make_runner(settings, engine), settings, metrics)
    service = Service(settings, store, scheduler, metrics)

    @contextlib.asynccontextmanager
    async def lifespan(app: FastAPI):
        await scheduler.start()
        yield
        await scheduler.stop()
        store.close()

    app = FastAPI(
        title="anchorsplat",
        version=engine.version,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        description="Makes 3D Gaussian splats hold up when seen closer.",
    )
    for kind in KINDS:
        _add_submission(app, service, kind)
    app.include_router(router(service, static))
    if settings.web is not None:
        _add_web(app, read_static(settings.web), static)
    for path, name in _PAGES.items():
        app.add_api_route(path, _page(static[name][0]), include_in_schema=False, response_class=Response)

    @app.get("/static/{name}", include_in_schema=False)
    async def static_file(name: str) -> Response:
        if name not in static:
            raise ApiError(404, "not_found", "There is no such file.")
        body, media = static[name]
        return Response(body, 200, {"cache-control": "no-cache"}, media)

    _add_errors(app, scheduler)

    def count(scope: dict, status: int) -> None:
        route = getattr(scope.get("route"), "path", "other")
        metrics.requests.labels(_method(scope["method"]), route, status).inc()

    guarded = Guard(app, settings, static["login.html"][0], count, service)
    return guarded


def _method(name: str) -> str:
    return name if name in ("GET", "HEAD", "POST", "DELETE") else "other"


def _page(body: bytes):
    async def page() -> Response:
        return page_response(body)

    return page


def _add_web(app: FastAPI, web: dict[str, tuple[bytes, str]], static: dict[str, tuple[bytes, str]]) -> None:
    """Serves the page that works without uploads, and links to it."""
    body, media = static["index.html"]
    link = b'<a href="/web/">Without upload</a> '
    static["index.html"] = body.replace(b'<a href="/docs">', link + b'<a href="/docs">'), media

    @app.get("/web/", include_in_schema=False)
    @app.get("/web/{name}", include_in_schema=False)
    async def web_file(name: str = "index.html") -> Response:
        if name not in web:
            raise ApiError(404, "not_found", "There is no such file.")
        body, media = web[name]
        headers = _ISOLATED | {"content-security-policy": WEB_POLICY, "cache-control": "no-cache"}
        return Response(body, 200, headers, media)


def _add_submission(app: FastAPI, service: Service, kind: str) -> None:
    schema = KINDS[kind].model_json_schema()
    parameters = [
        {"name": name, "in": "query", "required": False, "description": value.pop("description", ""), "schema": value}
        for name, value in schema["properties"].items()
        if name != "edits"
    ]
    for name, (about, value_form) in KINDS[kind].in_order.items():
        shape = f" {value_form}." if value_form else ""
        parameters.append(
            {
                "name": name,
                "in": "query",
                "required": False,
                "description": f"{about}.{shape} Done in the order in which they stand; may stand several times",
                "schema": {"type": "array", "items": {"type": "string"}},
            }
        )
    parameters.append(
        {
            "name": "name",
            "in": "query",
            "required": False,
            "schema": {"type": "string"},
            "description": "of the file, where the body is the file itself; .splat files need it",
        }
    )
    binary = {"type": "string", "format": "binary"}
    form: dict[str, Any] = {"type": "object", "required": ["file"], "properties": {"file": binary}}
    if kind == "enhance":
        form["properties"]["cameras"] = binary | {
            "description": "transforms.json or cameras.json of the training views"
        }
    body = {
        "required": True,
        "content": {"multipart/form-data": {"schema": form}, "application/octet-stream": {"schema": binary}},
    }
    responses: dict[int | str, dict[str, Any]] = {
        200: {"description": "The result is there already"},
        202: {"description": "The job waits or runs"},
        400: {"description": "Not a splat, or a malformed request"},
        413: {"description": "Too large for this service"},
        422: {"description": "An option that is not known or makes no sense"},
        429: {"description": "Too many jobs wait; see Retry-After"},
    }

    async def submit(request: Request) -> JSONResponse:
        try:
            return await service.submit(kind, request)
        except (ApiError, Busy):
            await drain(request)
            raise

    app.add_api_route(
        f"/v1/{kind}",
        submit,
        methods=["POST"],
        name=kind,
        summary=_SUMMARIES[kind],
        tags=["jobs"],
        status_code=202,
        description="Options as query or form fields. Nothing that a file names is opened.",
        responses=responses,
        openapi_extra={"parameters": parameters, "requestBody": body},
        response_class=JSONResponse,
    )


def _add_errors(app: FastAPI, scheduler: Scheduler) -> None:
    @app.exception_handler(ApiError)
    async def api_error(_: Request, error: ApiError) -> JSONResponse:
        return error.response()

    @app.exception_handler(Refused)
    async def refused(_: Request, error: Refused) -> JSONResponse:
        return ApiError(507 if error.code == "disk_full" else 422, error.code, str(error)).response()

    @app.exception_handler(Busy)
    async def busy(_: Request, error: Busy) -> JSONResponse:
        return ApiError(429, "busy", f"{str(error).capitalize()}.", {"retry-after": str(error.seconds)}).response()

    @app.exception_handler(RequestValidationError)
    async def invalid(_: Request, error: RequestValidationError) -> JSONResponse:
        details = [{"option": str(e["loc"][-1]), "message": e["msg"]} for e in error.errors()]
        return ApiError(
            422, "bad_option", "; ".join(f"{d['option']}: {d['message']}" for d in details), details=details
        ).response()

    @app.exception_handler(HTTPException)
    async def http(_: Request, error: HTTPException) -> JSONResponse:
        code = {404: "not_found", 405: "bad_method"}.get(error.status_code, "bad_request")
        return ApiError(error.status_code, code, str(error.detail), dict(error.headers or {})).response()

    async def broken(_: Request, error: Exception) -> JSONResponse:
        if disk_full(error):
            scheduler.make_room()
            return ApiError(
                507, "disk_full", "The disk of this service is full. Old results were deleted; please try again."
            ).response()
        log.error("a request failed", exc_info=error)
        return ApiError(500, "failed", "The service failed; its log says why.").response()

    app.add_exception_handler(OSError, broken)
    app.add_exception_handler(sqlite3.Error, broken)
    app.add_exception_handler(Exception, broken)
