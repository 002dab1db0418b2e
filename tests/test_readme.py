from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

import simbench
from simbench.scenarios.schema import Scenario

ROOT = Path(__file__).parent.parent


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_every_file_a_page_links_to_exists(page: str) -> None:
    links = re.findall(r"\]\(([^)#]+)\)", (ROOT / page).read_text(encoding="utf-8"))
    local = [link for link in links if "://" not in link]
    assert [link for link in local if not (ROOT / link).exists()] == []


def test_readme_names_every_library_scenario_and_tracker() -> None:
    from simbench.scenarios.files.library import list_scenarios

    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert [name for name in list_scenarios() if f"`{name}`" not in text] == []


@pytest.mark.gl
@pytest.mark.sumo
def test_the_scenario_that_readme_shows_can_be_filmed_with_the_dials_it_shows() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    story, dials, cameras = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    told = Scenario.model_validate(yaml.safe_load(story))
    assert len(simbench.generate(told.shortened(2), 0)) == 2
    Scenario.model_validate(yaml.safe_load(story) | yaml.safe_load(cameras))
    small = {"width_px": 240, "height_px": 160, "samples": 1}
    asked = yaml.safe_load(story) | yaml.safe_load(dials) | {"imaging": small}
    asked["dials"]["target_px"] /= 2  # as the picture is half as large
    asked["dials"]["displacement_px"] /= 2
    sequence = simbench.generate(Scenario.model_validate(asked), 0)
    assert sequence.achieved["occlusion.frames"] == pytest.approx(12, abs=1)
