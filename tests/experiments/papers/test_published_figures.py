from __future__ import annotations

from pathlib import Path

import pytest

from simbench.core.errors import SimbenchError
from simbench.experiments.papers import published_figures
from simbench.experiments.papers.published_figures import PAPERS, published

ROOT = Path(__file__).parents[3]


def test_published_figures_have_one_source() -> None:
    package = Path(published_figures.__file__).with_name("published")
    assert (ROOT / "results" / "published").resolve() == package.resolve()
    assert {path.stem for path in package.iterdir()} == set(PAPERS)


@pytest.mark.parametrize("key", PAPERS)
def test_every_row_of_a_published_table_has_its_columns(key: str) -> None:
    for table in published(key).tables:
        for name, row in table.rows.items():
            assert len(row) == len(table.columns), (table.table, name)


def test_published_figures_are_those_of_the_paper() -> None:
    first = published("dpf").tables[0]
    assert first.rows["directional-22"][first.columns.index("mean video 3")] == 37
    assert published("dsp").tables[0].rows["dsp"] == [0.946, 0.934, 0.873]
    assert published("nbrf").tables[0].rows["sirbf"][0] == "lost"


def test_unknown_paper_is_named_with_those_that_there_are() -> None:
    with pytest.raises(
        SimbenchError, match="expected one of dpf, dsp, nbrf, got 'dfp'"
    ):
        published("dfp")
