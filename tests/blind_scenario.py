"""A scenario that is valid, but whose camera cannot see its target."""

from __future__ import annotations

from simbench.scenarios.files.loading import load_scenario
from simbench.scenarios.schema import Scenario


def blind_smoke() -> Scenario:
    """Return ``smoke`` with the camera turned the other way."""
    smoke = load_scenario("smoke")
    behind = smoke.camera.look_at.model_copy(update={"along_m": -60.0})
    camera = smoke.camera.model_copy(update={"look_at": behind})
    update = {"name": "blind", "camera": camera, "occluders": ()}
    return smoke.model_copy(update=update)
