"""The page in headless Chromium: `make serve-test` (scripts/serve_test.sh brings the browser).

Screenshots of what it looked at stay in ANCHORSPLAT_PICTURES.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import anchorsplat
import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from .service import GatedProgram, Server, small_ply

PICTURES = Path(os.environ.get("ANCHORSPLAT_PICTURES", "."))
EXAMPLE = Path(os.environ["ANCHORSPLAT_EXAMPLE"])
PATIENCE_MS = 120_000
TOKEN = "correct-horse-battery-staple"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=os.environ.get("CHROMIUM", "/usr/bin/chromium"),
            args=[
                "--use-gl=angle",
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--no-sandbox",
                "--disable-gpu-sandbox",
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
                "--no-first-run",
            ],
        )
        yield chromium
        chromium.close()


class Tab:
    """A tab that notes everything that it should not say or ask for."""

    def __init__(self, browser: Browser, server: Server, **context: object):
        self.context = browser.new_context(viewport=context.pop("viewport", {"width": 1200, "height": 900}), **context)
        self.context.set_default_timeout(PATIENCE_MS)
        self.page: Page = self.context.new_page()
        self.complaints: list[str] = []
        self.page.on(
            "console",
            lambda message: self.complaints.append(message.text) if message.type in ("error", "warning") else None,
        )
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self._asked(request.url, server.url))

    def _asked(self, url: str, base: str) -> None:
        if not url.startswith((base, "blob:", "data:")):
            self.complaints.append(f"asked for {url}")

    def picture(self, name: str, full: bool = True) -> None:
        self.page.screenshot(path=PICTURES / f"{name}.png", full_page=full)

    def close(self, allowed: tuple[str, ...] = ()) -> None:
        self.context.close()
        # The software renderer warns that reading a canvas is slow there; the viewer's closed dialog has a button that
        # would be focused.
        allowed = (*allowed, "GPU stall", "Blocked autofocusing on a <button> element in a cross-origin subframe")
        bad = [text for text in self.complaints if not any(part in text for part in allowed)]
        assert not bad, bad


def drop(page: Page, path: Path) -> None:
    """A file from outside the browser, onto the page: the browser itself makes the events."""
    session = page.context.new_cdp_session(page)
    box = page.locator("#drop").bounding_box()
    data = {"items": [], "files": [str(path)], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        session.send("Input.dispatchDragEvent", {"type": kind, "x": box["x"] + 50, "y": box["y"] + 30, "data": data})


def viewer_ready(page: Page) -> None:
    page.locator(
        "#viewer"
    ).scroll_into_view_if_needed()  # browsers draw no frame of another origin that is out of sight
    frame = page.frame_locator("#viewer")
    expect(frame.locator("html")).to_have_attribute("data-state", "ready", timeout=PATIENCE_MS)
    expect(frame.locator("html")).to_have_attribute("data-settled", "true", timeout=PATIENCE_MS)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_from_a_file_to_a_download(browser: Browser, serve, tmp_path: Path, scheme: str) -> None:
    server = serve()
    tab = Tab(browser, server, color_scheme=scheme, accept_downloads=True)
    page = tab.page
    page.goto(server.url)
    tab.picture(f"{scheme}-empty")
    drop(page, EXAMPLE)
    expect(page.locator("#picked")).to_have_text(EXAMPLE.name)
    expect(page.locator("#start")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.locator("#job")).to_have_attribute("data-state", "done", timeout=PATIENCE_MS)
    viewer_ready(page)
    expect(page.locator("#sentences")).to_contain_text("20,000 Gaussians in")
    expect(page.locator("#state")).to_contain_text("Done in")
    tab.picture(f"{scheme}-done")
    page.locator("#format").select_option("spz")
    with page.expect_download() as download:
        page.locator("#download").click()
    assert download.value.suggested_filename == f"{EXAMPLE.stem}-4x.spz"
    assert len(anchorsplat.read(Path(download.value.path()).read_bytes())) > 20_000
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    tab.close()


def test_progress_and_a_reload_in_the_middle(browser: Browser, serve, gated: GatedProgram, tmp_path: Path) -> None:
    server = serve(environment=gated.environment)
    splat = tmp_path / "small.ply"
    splat.write_bytes(small_ply())
    tab = Tab(browser, server)
    page = tab.page
    page.goto(server.url)
    page.locator("#file").set_input_files(splat)
    page.locator("#start").click()
    expect(page.locator("#state")).to_have_text("Working: gate, 1 of 2.")
    assert page.locator("#bar").evaluate("bar => bar.value") == 0.5
    tab.picture("working")
    page.reload()
    expect(page.locator("#state")).to_have_text("Working: gate, 1 of 2.")
    page.goto("about:blank")
    page.goto(server.url)  # without the job's address: it is among the past ones
    expect(page.locator("#jobs li")).to_have_count(1)
    page.locator("#jobs a").click()
    expect(page.locator("#state")).to_have_text("Working: gate, 1 of 2.")
    server.kill()  # and the service comes back, at the same place
    port = page.url.split(":")[2].split("/")[0]
    server._words = ("--port", port)
    server.start()
    gated.open()
    expect(page.locator("#job")).to_have_attribute("data-state", "done", timeout=PATIENCE_MS)
    viewer_ready(page)
    page.reload()
    expect(page.locator("#jobs small")).to_contain_text("done")
    viewer_ready(page)
    page.locator("#jobs button").click()
    expect(page.locator("#past")).to_be_hidden()
    expect(page.locator("#job")).to_be_hidden()
    tab.close(
        allowed=("ERR_CONNECTION_REFUSED", "ERR_INCOMPLETE_CHUNKED", "ERR_CONNECTION_RESET", "ERR_EMPTY_RESPONSE")
    )


def test_cancelling(browser: Browser, serve, gated: GatedProgram, tmp_path: Path) -> None:
    server = serve(environment=gated.environment)
    splat = tmp_path / "small.ply"
    splat.write_bytes(small_ply())
    tab = Tab(browser, server)
    tab.page.goto(server.url)
    tab.page.locator("#file").set_input_files(splat)
    tab.page.locator("#start").click()
    tab.page.locator("#cancel").click()
    expect(tab.page.locator("#state")).to_have_text("Cancelled.")
    expect(tab.page.locator("#jobs small")).to_contain_text("cancelled")
    tab.close()


def test_files_that_are_no_splats(browser: Browser, serve, tmp_path: Path) -> None:
    server = serve("--max-upload", "1MB")
    tab = Tab(browser, server)
    page = tab.page
    page.goto(server.url)
    bad = tmp_path / "<b>bad.ply"
    bad.write_bytes(small_ply()[:900])
    page.locator("#file").set_input_files(bad)
    page.locator("#start").click()
    expect(page.locator("#refused")).to_contain_text("<b>bad.ply: ")
    expect(page.locator("#start")).to_be_enabled()
    tab.picture("bad-file")
    large = tmp_path / "large.ply"
    large.write_bytes(bytes(1_100_000))
    page.locator("#file").set_input_files(large)
    expect(page.locator("#refused")).to_contain_text("this service takes 1.00 MB")
    expect(page.locator("#start")).to_be_disabled()
    page.goto(f"{server.url}/#gone")
    expect(page.locator("#job")).to_be_hidden()
    tab.close(allowed=("status of 400", "status of 404", "EventSource"))


def test_a_phone(browser: Browser, serve) -> None:
    server = serve()
    tab = Tab(
        browser, server, viewport={"width": 390, "height": 844}, device_scale_factor=2, has_touch=True, is_mobile=True
    )
    page = tab.page
    page.goto(server.url)
    tab.picture("phone-empty")
    page.locator("summary").tap()
    tab.picture("phone-more")
    page.locator("#file").set_input_files(EXAMPLE)
    page.locator("#start").tap()
    expect(page.locator("#job")).to_have_attribute("data-state", "done", timeout=PATIENCE_MS)
    viewer_ready(page)
    tab.picture("phone-done")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    small = page.evaluate("""[...document.querySelectorAll('button, .button, select, .segments label')]
        .filter((e) => e.checkVisibility() && e.getBoundingClientRect().height < 44).map((e) => e.outerHTML)""")
    assert not small, small
    tab.close()


def test_keys_and_names(browser: Browser, serve, tmp_path: Path) -> None:
    server = serve()
    tab = Tab(browser, server)
    page = tab.page
    page.goto(server.url)
    unnamed = page.evaluate("""[...document.querySelectorAll('button, select, input, a, iframe, progress')]
        .filter((e) => !(e.getAttribute('aria-label') || e.title || e.textContent.trim() || e.closest('label') || e.getAttribute('aria-labelledby')))
        .map((e) => e.outerHTML)""")
    assert not unnamed, unnamed
    order = []
    for _ in range(8):
        page.keyboard.press("Tab")
        order.append(
            page.evaluate(
                "document.activeElement.id || document.activeElement.name || document.activeElement.textContent.trim()"
            )
        )
    assert order[:7] == ["Skip to the upload", "anchorsplat", "API", "file", "quality", "upscale", "start"], order
    page.locator("input[name=quality][value=fast]").focus()
    page.keyboard.press("ArrowRight")
    assert page.evaluate("document.querySelector('#form').elements.quality.value") == "good"
    tab.close()


def test_the_page_of_the_api(browser: Browser, serve) -> None:
    server = serve()
    tab = Tab(browser, server)
    tab.page.goto(f"{server.url}/docs")
    expect(tab.page.locator(".card")).to_have_count(11)
    expect(tab.page.locator("#operations")).to_contain_text("/v1/enhance")
    tab.picture("api", full=False)
    tab.close()


def test_a_token(browser: Browser, serve, tmp_path: Path) -> None:
    server = serve(environment={"ANCHORSPLAT_TOKEN": TOKEN})
    splat = tmp_path / "small.ply"
    splat.write_bytes(small_ply())
    tab = Tab(browser, server)
    page = tab.page
    page.goto(server.url)
    page.locator("#token").fill("wrong")
    page.keyboard.press("Enter")
    expect(page.locator("#wrong")).to_be_visible()
    tab.picture("login", full=False)
    page.locator("#token").fill(TOKEN)
    page.keyboard.press("Enter")
    page.locator("#file").set_input_files(splat)
    page.locator("#start").click()
    expect(page.locator("#job")).to_have_attribute("data-state", "done", timeout=PATIENCE_MS)
    viewer_ready(page)  # the cookie goes along into the frame
    tab.close(allowed=("status of 401",))
