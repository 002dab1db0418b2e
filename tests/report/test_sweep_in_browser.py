"""Report of a sweep in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from simbench.evaluation.statistics.sweep_axes import Sweep
from simbench.report import write_report
from tests.report.opened import opened
from tests.report.synthetic_sweep import one_dial, synthetic_sweep, two_dials

pytestmark = pytest.mark.browser


def written(folder: Path, sweep: Sweep) -> Path:
    scores, sequences, run, swept = synthetic_sweep(sweep)
    write_report(scores, sequences, run, folder / "report.html", swept=swept)
    return folder / "report.html"


@pytest.fixture(scope="module", params=[1280, 400], ids=["desktop", "phone"])
def page(
    request: pytest.FixtureRequest,
    browser: Browser,
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[Page]:
    report = written(tmp_path_factory.mktemp("sweep"), one_dial())
    with opened(browser, report, request.param) as page:
        yield page


@pytest.fixture(scope="module")
def map_page(
    browser: Browser, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Page]:
    report = written(tmp_path_factory.mktemp("map"), two_dials())
    with opened(browser, report, 1280) as page:
        yield page


def lines(page: Page, plot: str) -> int:
    return page.locator(f"[data-plot={plot}] .scatterlayer .js-line").count()


def test_every_figure_is_drawn_with_its_lines(page: Page) -> None:
    # a line each (three seeds are too few for bands of their means); frail's fitted
    # curve and the line of its breaking point
    assert lines(page, "success") == 4
    assert lines(page, "precision") == 2
    assert lines(page, "area") == 2
    assert lines(page, "particles") == 2
    assert lines(page, "error") == 3


def test_page_is_no_wider_than_the_screen(page: Page) -> None:
    assert page.viewport_size is not None
    width = page.evaluate("document.documentElement.scrollWidth")
    assert width <= page.viewport_size["width"]


def test_pictures_can_be_scrolled_to(page: Page) -> None:
    strip = page.locator(".pictures")
    assert strip.locator("svg image").count() == 5
    last = strip.locator("figure").last
    last.scroll_into_view_if_needed()
    box = last.bounding_box()
    assert box is not None
    assert box["x"] < page.evaluate("innerWidth")


def test_hidden_tracker_is_removed_with_its_breaking_point(page: Page) -> None:
    page.get_by_label("frail").uncheck()
    page.wait_for_function(
        "document.querySelectorAll('[data-plot=success] .js-line').length === 1"
    )
    assert page.locator("[data-plot=success] path.point[d*='L']").count() == 0
    page.get_by_label("frail").check()
    page.wait_for_function(
        "document.querySelectorAll('[data-plot=success] .js-line').length === 4"
    )


def test_another_value_changes_the_plot_by_frame(page: Page) -> None:
    line = page.locator("[data-plot=error] .js-line").last
    before = line.get_attribute("d")
    page.locator("[data-seed]").select_option("occlusion.hidden=0.75")
    page.wait_for_function(
        "(before) => [...document.querySelectorAll('[data-plot=error] .js-line')]"
        ".at(-1).getAttribute('d') !== before",
        arg=before,
    )


def test_maps_are_drawn_with_the_line_at_one_half(map_page: Page) -> None:
    frail = map_page.locator("[data-plot=map-1]")
    assert frail.locator(".heatmaplayer image").count() == 1
    assert frail.locator(".contourlines path").count() == 1
    firm = map_page.locator("[data-plot=map-0]")
    assert firm.locator(".contourlines path").count() == 0
    assert lines(map_page, "breaking") == 2
