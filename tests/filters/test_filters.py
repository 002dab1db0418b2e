"""The page that compares the filters before and after."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simbench.core.errors import SimbenchError
from simbench.datasets.formats.readers.annotation import Place, ReadOptions
from simbench.experiments.clips import Clip
from simbench.trackers.find_tracker import find_tracker
from tests.filters.page import Origin, page
from tests.filters.plan import Plan, read_tuned, seconds
from tests.filters.tables import loss_table, mend_table, overlap_table, table_of
from tests.filters.trackers import FILTERS, MENDS, Filter, Mend

LOSS = {"frame": 7, "found": None, "kind": "distractor", "visible": 0.25}
ONE = (Filter("condensation", "condensation@drift=false"),)
OFF = Mend("a ring", "condensation", "@surround=0")


def row(setting: str, seed: int | None, overlap: float, **other: Any) -> dict[str, Any]:
    """Return the row of one run."""
    name = "poles" if seed is not None else "Car4"
    return {
        "scenario": name,
        "variant": "",
        "name": name,
        "seed": seed,
        "tracker": "condensation",
        "setting": setting,
        "repetition": 0,
        "frames": 100,
        "average_overlap": overlap,
        "precision_20": overlap,
        "success_50": overlap,
        "fps": 1000.0,
        "reason": "",
        "losses": [],
        **other,
    }


def films(gain: float) -> list[dict[str, Any]]:
    """Return rows of eight films on which ours is better by about a gain."""
    rng = np.random.default_rng(0)
    rows = []
    for seed in range(8):
        base = 0.5 + 0.05 * rng.standard_normal()
        for setting, overlap in (
            ("before", base),
            ("ours", base + gain + 0.01 * rng.standard_normal()),
            ("paper", base - 0.1),
            (OFF.off, base - 0.2),
        ):
            losses = [LOSS] if setting == "ours" and seed == 3 else []
            rows.append(row(setting, seed, overlap, losses=losses))
        rows.append(row("still", seed, 0.04, tracker="still"))
    return rows


def clip(name: str, seed: int | None) -> Clip:
    """Return a clip that is nowhere."""
    place = Place("otb", Path("nowhere"), name, name)
    return Clip(place, ReadOptions(), name, seed=seed, frames=100)


@pytest.mark.parametrize(
    ("gain", "verdict"),
    [(0.2, "**better**"), (-0.2, "**worse**"), (0.001, "no difference that matters")],
)
def test_verdicts_are_those_of_compare(gain: float, verdict: str) -> None:
    text = overlap_table(table_of(films(gain)), ONE)
    (line,) = text.splitlines()[2:]
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[:3] == ["condensation", "poles", "8"]
    assert cells[-1] == verdict
    assert float(cells[-3].split()[0]) == pytest.approx(gain, abs=0.01)
    assert all("[" in cell for cell in cells[3:7]), "intervals"


def test_few_films_are_too_few_and_one_clip_has_the_range_of_its_runs() -> None:
    rows = [each for each in films(0.2) if each["seed"] < 3]
    (line,) = overlap_table(table_of(rows), ONE).splitlines()[2:]
    assert "[" not in line and line.endswith(" | n too small |")
    runs = [
        row(setting, None, 0.3 + 0.1 * repetition, repetition=repetition)
        for setting in ("before", "ours")
        for repetition in range(3)
    ]
    (line,) = overlap_table(table_of(runs), ONE).splitlines()[2:]
    assert "| Car4 | 1 | - | 0.400 (0.30 to 0.50) |" in line


def test_a_mend_turned_off_is_compared_with_all_mends_on() -> None:
    table = table_of(films(0.0))
    text = mend_table(table, table_of([]), [OFF], set(range(8)))
    (line,) = text.splitlines()[2:]
    assert "`@surround=0`" in line and "+0.199 [" in line and "**better**" in line


def test_losses_name_frame_seed_kind_and_what_was_visible() -> None:
    (line,) = loss_table(table_of(films(0.0)), ONE).splitlines()[2:]
    assert line == (
        "| poles | condensation | 1 of 8 | 7 (seed 3) | 0.25 | distractor | 0 of 1 |"
    )


def test_the_page_is_whole_without_clips_and_without_films() -> None:
    origin = Origin("make filters", "abc", "def", {"numpy": "2"}, "a processor", 2)
    plan = Plan(filters=ONE, mends=(OFF,))
    table = table_of(films(0.1))
    text = page(plan, table, table_of([]), origin, "by hand")
    for part in (
        "8 films of the library (seeds 0 to 7; at most 100",
        "`abc`",
        "by hand",
        "numpy 2",
    ):
        assert part in text
    assert (
        "Real clips:" not in text
        and "failed" not in text
        and "Tuned without" not in text
    )
    rows = [row(one, None, 0.3) for one in ("before", "ours", "paper", OFF.off)]
    rows.append(row("left out", None, 0.2))
    rows[0]["reason"] = "it raised"
    text = page(plan, table_of([]), table_of(rows), origin, "")
    assert "- before, condensation on Car4: it raised" in text
    assert "| condensation | Car4 | 0.300 | 0.200 |" in text
    assert "## Films" not in text and "## Notes" not in text


def test_every_filter_runs_before_now_and_by_the_paper_on_films_and_clips() -> None:
    plan = Plan(mended_seeds=frozenset({0}))
    runs = plan.runs([clip("poles", 0), clip("poles", 1)], [clip("Car4", None)])
    by_clip: Mapping[int | None, list[str]] = {
        seed: [run.setting for run in runs if run.clip.seed == seed]
        for seed in (0, 1, None)
    }
    assert len(by_clip[1]) == 1 + 3 * len(FILTERS)
    assert len(by_clip[0]) == len(by_clip[1]) + len(MENDS)
    assert len(by_clip[None]) == 1 + 3 * (3 * len(FILTERS) + len(MENDS))
    assert seconds(runs, 200) > 30.0


def test_every_listed_specification_is_accepted_by_the_present_commit() -> None:
    for spec in Plan().specs()["now"]:
        assert find_tracker(spec).is_builtin


def test_settings_tuned_without_a_clip_are_read_and_must_be_of_clips(
    tmp_path: Path,
) -> None:
    file = tmp_path / "tuned.yaml"
    file.write_text("Car4: {dsp: {trust: 0.5, keep_cloud: true}}")
    tuned = read_tuned(file)
    assert tuned == {"Car4": {"dsp": "dsp@trust=0.5@keep_cloud=True"}}
    plan = Plan(tuned=tuned)
    plan.require_clips([clip("Car4", None)])
    assert "dsp@trust=0.5@keep_cloud=True" in plan.specs()["now"]
    with pytest.raises(SimbenchError, match="expected a clip of ball1, got 'Car4'"):
        plan.require_clips([clip("ball1", None)])
    file.write_text("[1]")
    with pytest.raises(SimbenchError, match=r"expected \{clip: \{filter: "):
        read_tuned(file)
