"""Look-up of trackers by specification, and one-line errors for mistakes."""

from __future__ import annotations

import pickle
import sys

import cv2
import pytest

from simbench.core.errors import TrackerError
from simbench.trackers.condensation import Condensation
from simbench.trackers.directional import Directional
from simbench.trackers.find_tracker import TrackerSpec, find_tracker, list_trackers
from simbench.trackers.opencv import OpenCvTracker
from simbench.trackers.still import Still


def test_entry_point_is_found_by_name() -> None:
    spec = find_tracker("condensation")
    assert spec == TrackerSpec("condensation", "condensation", {})
    assert isinstance(spec.make(), Condensation)


def test_label_and_parameters_are_read() -> None:
    spec = find_tracker("tenth=condensation@particles=10@sigma=0.2@keep_cloud=true")
    assert spec.label == "tenth"
    assert spec.parameters == {"particles": 10, "sigma": 0.2, "keep_cloud": True}
    tracker = spec.make()
    assert isinstance(tracker, Condensation)
    assert (tracker.particles, tracker.sigma, tracker.keep_cloud) == (10, 0.2, True)


def test_label_is_the_whole_spec_where_none_is_given() -> None:
    assert find_tracker("dsp@particles=20").label == "dsp@particles=20"


def test_class_is_found_by_module_and_name() -> None:
    assert isinstance(find_tracker("simbench.trackers.still:Still").make(), Still)


def test_factory_passes_parameters_on_to_the_class_it_returns() -> None:
    tracker = find_tracker("directional-45@particles=20").make()
    assert isinstance(tracker, Directional)
    assert tracker.particles == 20


@pytest.mark.skipif(not hasattr(cv2, "TrackerMIL"), reason="OpenCV without MIL")
@pytest.mark.parametrize("name", ["MIL", "opencv:MIL"])
def test_tracker_of_opencv_is_found_by_its_name(name: str) -> None:
    assert isinstance(find_tracker(name).make(), OpenCvTracker)


def test_every_make_returns_a_fresh_tracker() -> None:
    spec = find_tracker("condensation")
    assert spec.make() is not spec.make()


def test_spec_round_trips_through_pickle() -> None:
    spec = find_tracker("a=directional-90@particles=30")
    assert pickle.loads(pickle.dumps(spec)) == spec


def test_every_available_tracker_can_be_made() -> None:
    available = list_trackers()
    assert {"condensation", "directional-45", "dsp", "still"} <= set(available)
    for name, line in available.items():
        assert line and "cannot be loaded" not in line
        if "needs" not in line:
            find_tracker(name)


class BrokenStr(Exception):
    def __str__(self) -> str:
        raise RuntimeError("no text")


class Broken:
    """A tracker whose constructor raises ``raised``."""

    raised: type[BaseException]

    def __init__(self) -> None:
        raise self.raised


@pytest.mark.parametrize(
    "raised", [KeyError, OSError, BrokenStr, SystemExit, GeneratorExit]
)
def test_constructor_that_raises_gives_a_one_line_error(
    raised: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Broken, "raised", raised, raising=False)
    broken = TrackerSpec("mine", f"{__name__}:Broken")
    with pytest.raises(TrackerError) as caught:
        broken.make()
    assert str(caught.value) == f"tracker mine not made: {raised.__name__}"


def test_constructor_can_be_stopped_with_ctrl_c(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Broken, "raised", KeyboardInterrupt, raising=False)
    with pytest.raises(KeyboardInterrupt):
        TrackerSpec("mine", f"{__name__}:Broken").make()


def test_factory_without_readable_signature_accepts_no_parameters(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def make(**parameters: object):  # type: ignore[no-untyped-def]
        return Still()

    make.__annotations__["return"] = "NoSuchClass"
    monkeypatch.setattr(sys.modules[__name__], "make", make, raising=False)
    assert isinstance(find_tracker(f"{__name__}:make").make(), Still)


@pytest.mark.parametrize(
    ("spec", "module"),
    [
        ("directional-45", "simbench.trackers.directional"),
        ("collections.abc:Sized", "collections.abc"),
        ("opencv:MIL", "simbench.trackers.opencv"),
    ],
)
def test_module_is_the_one_that_defines_the_tracker(spec: str, module: str) -> None:
    assert TrackerSpec(spec, spec).module == module


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("condensatoin", "no tracker 'condensatoin'; .*did you mean 'condensation'"),
        ("condensation@particle=3", "no parameter 'particle'.*sigma.*mean 'particles'"),
        ("condensation@particles=few", "particles must be int, got 'few'"),
        ("condensation@particles=true", "particles must be int, got True"),
        ("condensation@particles=0", "particles must be at least 1, got 0"),
        ("condensation@sigma=-1", "sigma must be above 0, got -1"),
        ("directional-45@half_angle=9", "half_angle must be in"),
        ("condensation-kld@epsilon=0", "epsilon must be above 0, got 0"),
        ("condensation-kld@delta=1", r"delta must be in \(0, 1\), got 1"),
        ("condensation-kld@particles=9", "least_particles must be at most particles"),
        ("condensation-kld@resampling=residual", "resampling must be multinomial"),
        ("condensation@resampling=systemic", "did you mean 'systematic'"),
        ("condensation@resampling=[1]", "resampling must be one of systematic, strat"),
        ("still@speed=1", "no parameter 'speed'; it accepts: none"),
        ("condensation@particles", "'particles' must read PARAMETER=VALUE"),
        ("condensation@", "must read PARAMETER=VALUE"),
        ("condensation@sigma=[1", "unreadable value"),
        ("=condensation", r"must read \[LABEL=\]NAME"),
        ("", r"must read \[LABEL=\]NAME"),
        ("no_such_module:Tracker", "cannot be loaded"),
        ("simbench.trackers.still:Runner", "cannot be loaded"),
        ("collections:OrderedDict", "lacks them"),
        ("math:pi", "must be a callable, got 3.14"),
        ("opencv:Nonesuch", "OpenCV .* has no tracker 'Nonesuch'"),
    ],
)
def test_mistake_gives_a_one_line_error(spec: str, message: str) -> None:
    with pytest.raises(TrackerError, match=message) as raised:
        find_tracker(spec).make()
    assert "\n" not in str(raised.value)
