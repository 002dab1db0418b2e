"""Report in a browser: no errors, every figure is drawn, the player plays."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from simbench.report import write_report
from tests.report.opened import opened
from tests.report.synthetic_run import synthetic_run

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report") / "report.html"
    scores, sequences, run = synthetic_run()
    write_report(scores, sequences, run, out)
    return out


@pytest.fixture(scope="module", params=[1280, 400], ids=["desktop", "phone"])
def page(
    request: pytest.FixtureRequest, browser: Browser, report: Path
) -> Iterator[Page]:
    with opened(browser, report, request.param) as page:
        yield page


def traces(page: Page, chapter: str, plot: str) -> int:
    """Return the number of lines that a figure shows."""
    found = page.locator(
        f"#scenario-{chapter} [data-plot={plot}] .scatterlayer .js-line"
    )
    return found.count()


@pytest.mark.parametrize("chapter", ["poles", "open-road"])
def test_every_figure_is_drawn_with_its_lines(page: Page, chapter: str) -> None:
    # One line per tracker; the curves also have the outline of a band each, and the
    # centre error that of the visible share. still uses no particles.
    assert traces(page, chapter, "success") == 6
    assert traces(page, chapter, "precision") == 6
    assert traces(page, chapter, "error") == 4
    assert traces(page, chapter, "particles") == 2


def test_figures_offer_no_upload(page: Page) -> None:
    assert page.locator(".modebar [data-title='Reset axes']").count() > 0
    assert page.locator(".modebar [data-title*='Share']").count() == 0


def test_page_is_no_wider_than_the_screen(page: Page) -> None:
    assert page.viewport_size is not None
    width = page.evaluate("document.documentElement.scrollWidth")
    assert width <= page.viewport_size["width"]


def test_player_shows_the_picture_and_the_boxes(page: Page) -> None:
    page.locator("[data-player]").scroll_into_view_if_needed()
    colors = page.evaluate(
        """() => {
            const canvas = document.querySelector("[data-player] canvas");
            const {width, height} = canvas;
            const pixels = canvas.getContext("2d").getImageData(0, 0, width, height);
            const words = new Uint32Array(pixels.data.buffer);
            return new Set(words).size;
        }"""
    )
    assert colors > 50  # a blank canvas has one


def test_player_advances_only_after_play_is_pressed(page: Page) -> None:
    canvas = page.locator("[data-player] canvas")
    page.locator("[data-scrub]").fill("0")
    page.wait_for_function(
        "document.querySelector('[data-player] canvas').dataset.frame === '0'"
    )
    page.wait_for_timeout(300)  # in which it would play on
    assert canvas.get_attribute("data-frame") == "0"
    page.get_by_role("button", name="Play").click()
    page.wait_for_function(
        "Number(document.querySelector('[data-player] canvas').dataset.frame) >= 4"
    )
    page.get_by_role("button", name="Pause").click()
    assert "visible" in page.locator("[data-status]").inner_text()


def test_player_plays_to_the_end_and_stops_there(page: Page) -> None:
    scrubber = page.locator("[data-scrub]")
    scrubber.fill(str(int(scrubber.get_attribute("max") or 0) - 1))
    page.get_by_role("button", name="Play").click()
    page.get_by_role("button", name="Play").wait_for()  # labelled Pause while it plays
    page.wait_for_function(
        "document.querySelector('[data-player] canvas').dataset.frame === '118'"
    )


def test_scrubber_moves_to_a_frame(page: Page) -> None:
    page.locator("[data-scrub]").fill("28")  # every second frame is kept
    page.wait_for_function(
        "document.querySelector('[data-player] canvas').dataset.frame === '56'"
    )
    # The car spans 132 to 172 px, the pole begins at 150: 18 of 40 px are visible.
    assert "45 % visible, behind pole" in page.locator("[data-status]").inner_text()


def test_hidden_tracker_leaves_figures_and_player(page: Page) -> None:
    chapter = page.locator("#scenario-poles")
    red = """() => {
        const canvas = document.querySelector("[data-player] canvas");
        const {width, height} = canvas;
        const {data} = canvas.getContext("2d").getImageData(0, 0, width, height);
        let count = 0;
        for (let i = 0; i < data.length; i += 4) {
            if (data[i] === 0xD5 && data[i + 1] === 0x5E && data[i + 2] === 0) count++;
        }
        return count;
    }"""
    page.locator("[data-scrub]").fill("10")
    page.wait_for_function(f"({red})() > 0")
    chapter.get_by_label("loose").uncheck()
    page.wait_for_function(f"({red})() === 0")
    page.wait_for_function(
        "document.querySelectorAll('#scenario-poles [data-plot=particles] .js-line')"
        ".length === 1"
    )
    assert traces(page, "poles", "success") == 4
    chapter.get_by_label("loose").check()
    page.wait_for_function(f"({red})() > 0")


def test_another_seed_changes_the_plots_by_frame(page: Page) -> None:
    line = page.locator("#scenario-poles [data-plot=error] .js-line").first
    before = line.get_attribute("d")
    page.locator("#scenario-poles [data-seed]").select_option("1")
    page.wait_for_function(
        "(before) => document.querySelector("
        "'#scenario-poles [data-plot=error] .js-line').getAttribute('d') !== before",
        arg=before,
    )


def test_messages_of_a_tracker_are_text_not_markup(page: Page) -> None:
    assert page.get_by_text("<script>alert(1)</script>").count() > 0
