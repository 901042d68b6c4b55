"""Guards the whole application: tokens, hosts and origins, and headers for browsers."""

from __future__ import annotations

import hashlib
import hmac
import json
import time
from collections.abc import Callable
from http.cookies import CookieError, SimpleCookie
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders

from .settings import Settings

COOKIE = "anchorsplat"
_SESSION_SECONDS = 30 * 86400
#: Paths that need no token: the login, and the health check.
_OPEN = ("/healthz", "/login")
_NOTHING = "default-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "frame-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
#: The viewer is one file with scripts and a user's splat: no origin, no connections.
VIEWER_POLICY = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline' blob:; worker-src blob:; img-src data: blob:; "
    "style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
#: The engine in the browser (docs/web.md): one page with scripts, and the files beside it.
WEB_POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src 'self' blob:; "
    "connect-src 'self'; frame-src blob:; img-src data: blob:; style-src 'unsafe-inline'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'self'"
)
_HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "same-origin",  # with no-referrer browsers send forms with the origin "null"
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
    "cache-control": "no-store",
    "content-security-policy": _NOTHING,
    "x-frame-options": "DENY",
}


def same(a: str, b: str) -> bool:
    """Compares in constant time."""
    return hmac.compare_digest(a.encode("utf-8", "replace"), b.encode("utf-8", "replace"))


def session(token: str, now: float | None = None) -> str:
    """Value of a cookie that proves knowledge of the token. Valid for a month, and only for this token."""
    until = str(int((time.time() if now is None else now) + _SESSION_SECONDS))
    return f"{until}.{_signature(token, until)}"


def _signature(token: str, until: str) -> str:
    return hmac.new(token.encode(), b"anchorsplat session " + until.encode(), hashlib.sha256).hexdigest()


def is_session(value: str, token: str) -> bool:
    until, _, signature = value.partition(".")
    if not (until.isascii() and until.isdigit() and len(until) < 15):
        return False
    return same(signature, _signature(token, until)) and int(until) > time.time()


class Guard:
    def __init__(self, app, settings: Settings, login_page: bytes, count: Callable[[dict, int], None], service):
        self.service = service  # for shutting it down
        self._app, self._settings, self._login_page, self._count = app, settings, login_page, count
        self._hosts = {f"{name}:{settings.port}" for name in ("127.0.0.1", "localhost", "[::1]")}
        if settings.host not in ("127.0.0.1", "localhost", "::1"):
            self._hosts.add(f"{settings.host}:{settings.port}".lower())
        if settings.port == 80:
            self._hosts |= {name.rsplit(":", 1)[0] for name in self._hosts}

    async def __call__(self, scope, receive, send):
        if scope["type"] == "lifespan":
            return await self._app(scope, receive, send)
        if scope["type"] != "http":  # no web sockets
            return await send({"type": "websocket.close", "code": 1008})
        headers = Headers(scope=scope)

        async def send_guarded(message):
            if message["type"] == "http.response.start":
                self._count(scope, message["status"])
                out = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    out.setdefault(name, value)
            await send(message)

        refusal = self._refusal(scope, headers)
        if refusal is None:
            return await self._app(scope, receive, send_guarded)
        await self._refuse(scope, headers, send_guarded, *refusal)

    def _refusal(self, scope, headers: Headers) -> tuple[int, str, str] | None:
        hosts = headers.getlist("host")
        host = hosts[0].lower() if len(hosts) == 1 else ""
        if not self._knows(host):
            return (
                403,
                "bad_host",
                (
                    "This service does not go by that name. Open it as http://127.0.0.1:PORT, or start it with --allow-host NAME."
                ),
            )
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc.lower() != host:
            return 403, "bad_origin", "Pages of other origins may not use this service."
        if headers.get("sec-fetch-site") in ("cross-site", "same-site"):
            opened = headers.get("sec-fetch-mode") == "navigate" and headers.get("sec-fetch-dest") == "document"
            if scope["method"] != "GET" or not opened:
                return 403, "bad_origin", "Pages of other origins may not use this service."
        path = scope["path"]
        if self._settings.token is None or path in _OPEN or path.startswith("/static/"):
            return None
        if self._is_known(headers):
            return None
        return 401, "unauthorized", "This service needs a token: send the header 'Authorization: Bearer TOKEN'."

    def _knows(self, host: str) -> bool:
        """Whether the host name is ours. Others may be DNS rebinding."""
        if not self._settings.local:
            return bool(host)  # any name may be ours; the token decides
        return host in self._hosts or host.rsplit(":", 1)[0] in self._settings.allow_hosts

    def _is_known(self, headers: Headers) -> bool:
        token = self._settings.token or ""
        kind, _, given = headers.get("authorization", "").partition(" ")
        if kind.lower() == "bearer" and same(given.strip(), token):
            return True
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
        except CookieError:
            return False
        return cookie is not None and is_session(cookie.value, token)

    async def _refuse(self, scope, headers: Headers, send, status: int, code: str, message: str) -> None:
        page = status == 401 and scope["method"] == "GET" and scope["path"] in ("/", "/docs")
        body = self._login_page if page else json.dumps({"error": {"code": code, "message": message}}).encode()
        out = [
            (b"content-type", b"text/html; charset=utf-8" if page else b"application/json"),
            (b"content-length", str(len(body)).encode()),
        ]
        if page:
            out.append((b"content-security-policy", PAGE_POLICY.encode()))
        if status == 401:
            out.append((b"www-authenticate", b"Bearer"))
        await send({"type": "http.response.start", "status": status, "headers": out})
        await send({"type": "http.response.body", "body": b"" if scope["method"] == "HEAD" else body})
