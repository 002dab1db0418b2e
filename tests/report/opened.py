"""Context manager that opens a report in a browser, offline."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page

__all__ = ["opened"]


@contextmanager
def opened(browser: Browser, report: Path, width: int) -> Iterator[Page]:
    """Yield the page when it is ready; at the end, fail on any error of the browser."""
    errors: list[str] = []
    context = browser.new_context(
        viewport={"width": width, "height": 900}, offline=True
    )
    context.set_default_timeout(120_000)  # ms, for a busy machine
    page = context.new_page()
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on(
        "console",
        lambda message: (
            errors.append(message.text) if message.type == "error" else None
        ),
    )
    page.on(
        "request",
        lambda request: (
            errors.append(f"request to {request.url}")
            if not request.url.startswith(("file:", "data:", "blob:"))
            else None
        ),
    )
    page.goto(report.as_uri())
    page.wait_for_selector("html[data-ready]", state="attached")
    yield page
    context.close()
    assert errors == []
