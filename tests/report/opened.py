"""A report opened in a browser, offline."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page

__all__ = ["opened"]


@contextmanager
def opened(browser: Browser, report: Path, width: int) -> Iterator[Page]:
    """Yield the page when it is ready; at the end, fail on what the browser minded."""
    faults: list[str] = []
    context = browser.new_context(
        viewport={"width": width, "height": 900}, offline=True
    )
    page = context.new_page()
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on(
        "console",
        lambda said: faults.append(said.text) if said.type == "error" else None,
    )
    page.on(
        "request",
        lambda sent: (
            faults.append(f"asked the network for {sent.url}")
            if not sent.url.startswith(("file:", "data:", "blob:"))
            else None
        ),
    )
    page.goto(report.as_uri())
    page.wait_for_selector("html[data-ready]", state="attached", timeout=60_000)
    yield page
    context.close()
    assert faults == []
