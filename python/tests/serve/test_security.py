"""Who is let in, and what browsers are told."""

from __future__ import annotations

import http.client
import re

import httpx
import pytest
from anchorsplat.serve.security import is_session, session
from anchorsplat.serve.settings import UsageError, parse

from .service import Server, small_ply

TOKEN = "correct-horse-battery-staple"


def ask(server: Server, method: str = "GET", path: str = "/", **headers: str) -> tuple[int, bytes]:
    """Exactly these headers and this path: nothing is put in order on the way."""
    connection = http.client.HTTPConnection("127.0.0.1", server.http.base_url.port, timeout=60)
    connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    answer = connection.getresponse()
    out = answer.status, answer.read()
    connection.close()
    return out


def test_names_of_others_are_refused(server: Server) -> None:
    port = server.http.base_url.port
    for host in (f"127.0.0.1:{port}", f"localhost:{port}", f"LOCALHOST:{port}"):
        assert ask(server, Host=host)[0] == 200, host
    for host in (
        "evil.example",
        f"evil.example:{port}",
        "127.0.0.1",
        f"127.0.0.1.evil.example:{port}",
        f"127.0.0.1:{port}@evil",
        "",
    ):
        status, body = ask(server, Host=host)
        assert status in (400, 403), host
    assert ask(server)[0] == 400  # without any


def test_pages_of_other_origins_are_refused(server: Server) -> None:
    host = f"127.0.0.1:{server.http.base_url.port}"
    assert (
        ask(server, "POST", "/v1/enhance", Host=host, Origin=f"http://{host}", Content_Length="0")[0] == 400
    )  # an empty file
    for origin in (
        "http://evil.example",
        "null",
        f"http://localhost:{server.http.base_url.port}",
        "https://",
        "http://127.0.0.1",
    ):
        for method in ("POST", "GET", "DELETE"):
            status, body = ask(server, method, "/v1/limits", Host=host, Origin=origin, Content_Length="0")
            assert (status, b"bad_origin" in body) == (403, True), (origin, method)
    assert ask(server, "GET", "/v1/limits", Host=host, Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="no-cors")[0] == 403
    assert (
        ask(
            server,
            "GET",
            "/",
            Host=host,
            Sec_Fetch_Site="cross-site",
            Sec_Fetch_Mode="navigate",
            Sec_Fetch_Dest="document",
        )[0]
        == 200
    )
    assert (
        ask(
            server,
            "GET",
            "/",
            Host=host,
            Sec_Fetch_Site="cross-site",
            Sec_Fetch_Mode="navigate",
            Sec_Fetch_Dest="iframe",
        )[0]
        == 403
    )


@pytest.mark.parametrize(
    "path",
    [
        "/static/../api.py",
        "/static/..%2fapi.py",
        "/static/%2e%2e/%2e%2e/store.py",
        "/static/%2fetc%2fpasswd",
        "//etc/passwd",
        "/v1/jobs/../../jobs.sqlite3",
        "/v1/jobs/%2e%2e%2fjobs.sqlite3/result",
        "/v1/jobs/..%5c..%5cx/view",
        "/static/style.css%00",
    ],
)
def test_paths_that_climb(server: Server, path: str) -> None:
    host = f"127.0.0.1:{server.http.base_url.port}"
    status, body = ask(server, "GET", path, Host=host)
    assert status in (400, 404), (path, status)
    assert b"root:" not in body and b"import " not in body and b"SQLite" not in body


def test_files_that_name_files(server: Server) -> None:
    """A glTF whose numbers are elsewhere: nothing is looked for."""
    text = b'{"asset":{"version":"2.0"},"buffers":[{"uri":"/etc/passwd","byteLength":10}]}'
    answer = server.http.post("/v1/convert?to=ply&name=scan.gltf", content=text)
    assert answer.status_code == 400 and "root:" not in answer.text


def test_what_browsers_are_told(server: Server) -> None:
    for path in ("/", "/docs"):
        headers = server.http.get(path).headers
        policy = dict(part.strip().split(" ", 1) for part in headers["content-security-policy"].split(";"))
        assert (
            policy["default-src"] == "'none'" and policy["script-src"] == "'self'" and policy["style-src"] == "'self'"
        )
        assert policy["frame-ancestors"] == "'none'" and "unsafe" not in headers["content-security-policy"]
        assert headers["x-frame-options"] == "DENY"
        html = server.http.get(path).text
        assert not re.search(r"<script(?![^>]*\bsrc=)|<style|\son\w+=|\sstyle=|https?://", html)
    for path in ("/v1/limits", "/none", "/static/app.js"):
        headers = server.http.get(path).headers
        assert headers["x-content-type-options"] == "nosniff" and headers["content-security-policy"].startswith(
            "default-src 'none'"
        )
        assert "server" not in headers
    assert server.http.get("/v1/limits").headers["cache-control"] == "no-store"
    assert not [name for name in server.http.options("/v1/limits").headers if name.startswith("access-control")]


def test_ids_cannot_be_guessed(server: Server) -> None:
    ids = [server.submit(small_ply(), upscale=2)["id"] for _ in range(3)]
    assert len(set(ids)) == 3 and all(len(job) >= 24 for job in ids)


def test_a_token(serve) -> None:
    server = serve("--host", "0.0.0.0", environment={"ANCHORSPLAT_TOKEN": TOKEN})
    url = f"http://127.0.0.1:{server.http.base_url.port}"
    with (
        httpx.Client(base_url=url, trust_env=False) as stranger,
        httpx.Client(base_url=url, trust_env=False) as browser,
    ):
        for path in ("/v1/limits", "/v1/jobs/x", "/metrics", "/openapi.json", "/v1/jobs/x/view"):
            assert stranger.get(path).status_code == 401, path
        assert stranger.get("/healthz").status_code == 200
        refused = stranger.post("/v1/enhance", content=b"x")
        assert refused.status_code == 401 and refused.headers["www-authenticate"] == "Bearer"
        for wrong in ("Bearer wrong", f"Basic {TOKEN}", "Bearer", f"Bearer {TOKEN}x", f"Bearer {TOKEN[:-1]}"):
            assert stranger.get("/v1/limits", headers={"authorization": wrong}).status_code == 401, wrong
        assert stranger.get("/v1/limits", headers={"authorization": f"Bearer {TOKEN}"}).status_code == 200
        assert stranger.get("/v1/limits", headers={"cookie": f"anchorsplat={TOKEN}"}).status_code == 401

        page = browser.get("/")
        assert page.status_code == 401 and 'action="/login"' in page.text
        assert browser.post("/login", data={"token": "wrong"}).status_code == 401
        let_in = browser.post("/login", data={"token": TOKEN}, headers={"origin": url})
        assert let_in.status_code == 303
        cookie = let_in.headers["set-cookie"].lower()
        assert "httponly" in cookie and "samesite=strict" in cookie and TOKEN not in cookie
        assert browser.get("/v1/limits").status_code == 200
        assert browser.get("/v1/limits", headers={"origin": "http://evil.example"}).status_code == 403
        assert (
            stranger.post("/login", data={"token": TOKEN}, headers={"origin": "http://evil.example"}).status_code == 403
        )
    assert server.stop() == 0
    assert TOKEN not in server.logged()


def test_sessions_end() -> None:
    assert is_session(session(TOKEN), TOKEN)
    assert not is_session(session(TOKEN, now=0), TOKEN)
    assert not is_session(session("another-token-of-16"), TOKEN)
    until, _, signature = session(TOKEN).partition(".")
    assert not is_session(f"{int(until) + 1}.{signature}", TOKEN)
    for text in ("", ".", "1", "x.y", "²." + signature, f"{'9' * 400}.{signature}"):
        assert not is_session(text, TOKEN)


def test_a_proxy(serve) -> None:
    server = serve("--allow-host", "splats.example.org", environment={"ANCHORSPLAT_TOKEN": TOKEN})
    bearer = f"Bearer {TOKEN}"
    assert ask(server, "GET", "/v1/limits", Host="splats.example.org", Authorization=bearer)[0] == 200
    assert ask(server, "GET", "/v1/limits", Host="splats.example.org")[0] == 401
    assert ask(server, "GET", "/v1/limits", Host="other.example.org", Authorization=bearer)[0] == 403


@pytest.mark.parametrize(
    "words, says",
    [
        (["--host", "0.0.0.0"], "needs a token"),
        (["--host", "192.168.1.7"], "needs a token"),
        (["--allow-host", "splats.example.org"], "needs a token"),
        (["--token", "short"], "at least 16"),
        (["--token", ""], "at least 16"),
        (["--max-upload", "many"], "not a size"),
        (["--max-upload", "0"], "at least one byte"),
        (["--port", "70000"], "65,535"),
        (["--max-seconds", "nan"], "must be from"),
        (["--colour"], "--help"),
    ],
)
def test_command_lines_that_make_no_sense(words: list[str], says: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ANCHORSPLAT_TOKEN", raising=False)
    with pytest.raises(UsageError, match=re.escape(says)):
        parse(words)


def test_sizes() -> None:
    assert parse(["--max-upload", "1.5GB"]).max_upload == 1_500_000_000
    assert parse(["--max-memory", "2 GiB"]).max_memory == 2 * 2**30
    assert parse([]).local and not parse(["--host", "::", "--token", TOKEN]).local


def test_the_page_without_uploads_is_isolated_and_nothing_else_of_its_folder_is_there(serve, tmp_path) -> None:
    web = tmp_path / "dist"
    web.mkdir()
    with pytest.raises(UsageError, match="index.html"):
        parse(["--web", str(web)])
    (web / "index.html").write_text("<title>web</title>")
    (web / "engine-threads.wasm").write_bytes(b"\0asm")
    (web / "notes.txt").write_text("not for others")
    server = serve("--web", str(web))
    page = server.http.get("/web/")
    assert page.text == "<title>web</title>"
    assert page.headers["cross-origin-embedder-policy"] == "require-corp"
    assert page.headers["cross-origin-opener-policy"] == "same-origin"
    policy = page.headers["content-security-policy"]
    assert "default-src 'none'" in policy and "connect-src 'self'" in policy and "http" not in policy
    module = server.http.get("/web/engine-threads.wasm")
    assert (module.content, module.headers["content-type"]) == (b"\0asm", "application/wasm")
    for name in ("notes.txt", "..%2fdata%2fjobs.sqlite", "%2e%2e"):
        assert server.http.get(f"/web/{name}").status_code == 404, name
    assert '<a href="/web/">' in server.http.get("/").text
