"""The truth of library scenarios is that of an independent ray caster."""

from __future__ import annotations

import pytest

from simbench.scenarios.files.library import list_scenarios
from simbench.scenarios.files.loading import load_scenario
from simbench.verification.cast_frames import cast_stage, whole_stage
from tests.verification.library_oracle import compare, report

pytestmark = [pytest.mark.gl, pytest.mark.sumo]

_QUICK = "smoke", "overtaken-by-truck"
_WHOLE = "poles", "car-rear-moving@extreme", "rain"  # still, moving, lamps at dusk


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name in _QUICK else pytest.mark.slow)
        for name in list_scenarios()
    ],
)
def test_three_frames_agree_with_their_rays(name: str) -> None:
    result = compare(name)
    assert result.agrees, str(result)
    assert len(result.frames) == 3
    hidden = [frame.hidden_by_rays for frame in result.frames]
    assert name not in _QUICK or max(hidden) > 0.3
    assert f"| `{name}` | " in report([result], 60.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", _WHOLE)
def test_every_frame_agrees_with_its_rays(name: str) -> None:
    frames = cast_stage(whole_stage(load_scenario(name), 0))
    assert [fault for frame in frames for fault in frame.faults] == []
