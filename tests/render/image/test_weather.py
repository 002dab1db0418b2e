"""Fog, rain, night and tunnel: their effects on images, and none on ids."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.errors import RenderError
from simbench.core.trajectories import Vehicle
from simbench.render import render_frames as rendering
from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.gl.scene_renderer import SceneRenderer
from simbench.render.image.exposure import AutoExposure
from simbench.render.image.glare_and_rain import add_glare_and_rain
from simbench.render.image.rain import draw_rain, falling_drops
from simbench.render.world.illumination import extinction_per_m, illuminate
from simbench.render.world.lamplight import LampMap, Lamps, gather_lamps, vehicle_lamps
from simbench.render.world.scene import Scene, build_scene, vehicle_poses
from simbench.render.world.street_furniture import lamp_post
from simbench.render.world.vehicles import body
from simbench.scenarios.highway.fleet import FLEET, PAINTS
from simbench.scenarios.schema import Light
from simbench.scenarios.stage import build_stage
from tests.scenarios.small_scenario import small_scenario


@dataclass(frozen=True)
class Rendered:
    scene: Scene
    frames: list[RenderedFrame]
    images: list[NDArray[np.uint8]]


def _render(gain: float = 1.0, **parts: Any) -> Rendered:
    """Render a scenario with glare and rain."""
    stage = build_stage(small_scenario(**parts), 0)
    scene = build_scene(stage)
    camera = stage.cameras[0]
    frames, images = [], []
    with SceneRenderer(scene, camera.width, camera.height, 2) as renderer:
        for index, view in enumerate(stage.cameras):
            poses, present = vehicle_poses(stage.trajectories, index)
            target = stage.trajectories.target
            frame = renderer.render(view, poses, present, target, gain=gain)
            frames.append(frame)
            images.append(
                add_glare_and_rain(stage, scene, frame, poses, present, index, gain)
            )
    return Rendered(scene, frames, images)


def _mean_light(image: NDArray[np.uint8]) -> float:
    """Return an image's mean light by the tone curve of the shaders."""
    return float(_linear(np.arange(256.0))[image].mean())


def _linear(level: NDArray[np.float64]) -> NDArray[np.float64]:
    """Invert the tone curve of the shaders."""
    light = np.linspace(0.0, 2.0, 20_001)
    mapped = light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14)
    shown = 255.0 * np.sqrt(np.clip(mapped, 0.0, 1.0))
    rising = shown < 254.9
    return np.interp(level, shown[rising], light[rising])


def _camera() -> Camera:
    return Camera.look_at((0, 0, 5), (20, 0, 1), fov_rad=0.8, width=160, height=120)


class TestLight:
    def test_fog_leaves_five_per_cent_at_its_visibility(self) -> None:
        light = Light(weather="fog", fog_visibility_m=200, haze_per_km=0)
        assert np.exp(-200 * extinction_per_m(light)) == pytest.approx(0.05)

    def test_rain_of_one_mm_an_hour_leaves_two_per_cent_at_11_600_m(self) -> None:
        light = Light(weather="rain", rain_mm_per_h=1, haze_per_km=0)
        assert np.exp(-11_600 * extinction_per_m(light)) == pytest.approx(0.02)

    def test_haze_adds_to_fog(self) -> None:
        clear, hazy = (Light(weather="fog", haze_per_km=haze) for haze in (0.0, 2.0))
        more = extinction_per_m(hazy) - extinction_per_m(clear)
        assert more == pytest.approx(0.002)

    @pytest.mark.parametrize("time", ["day", "dusk", "night"])
    @pytest.mark.parametrize("weather", ["clear", "fog", "rain"])
    def test_half_the_illumination_is_half_of_every_light(
        self, time: str, weather: str
    ) -> None:
        light = Light.model_validate({"time": time, "weather": weather})
        full = illuminate(light)
        half = illuminate(light.model_copy(update={"illumination": 0.5}))
        for name in ("sun", "ambient", "ground", "zenith", "horizon", "glow"):
            assert getattr(half, name) == pytest.approx(getattr(full, name) / 2)
        assert (half.lamps, half.beams) == (full.lamps / 2, full.beams / 2)
        assert half.haze_per_m == full.haze_per_m

    def test_night_is_darker_than_dusk_and_dusk_than_day(self) -> None:
        ambient = [
            illuminate(Light.model_validate({"time": time})).ambient.sum()
            for time in ("day", "dusk", "night")
        ]
        assert ambient[0] > 2 * ambient[1] > 4 * ambient[2]


class TestRain:
    def test_more_rain_is_more_and_larger_drops(self, rng: np.random.Generator) -> None:
        tele = Camera.look_at((0, 0, 5), (9, 0, 5), fov_rad=0.2, width=160, height=120)
        few, small, _ = falling_drops(0.5, tele, rng)
        many, large, speeds = falling_drops(5.0, tele, rng)
        assert len(many) > 2 * len(few)
        assert large.mean() > small.mean()
        # A drop of 1 mm falls with 4 m/s, one of 5 mm with 9.
        assert 3.9 < speeds.min() and speeds.max() < 9.3

    def test_drops_fill_the_view_in_front_of_the_camera(
        self, rng: np.random.Generator
    ) -> None:
        camera = _camera()
        pixels, depth = camera.project(falling_drops(30.0, camera, rng)[0])
        assert 0.6 <= depth.min() and depth.max() <= 14.0
        assert np.all(np.abs(pixels.mean(axis=0) - [80, 60]) < 5)

    def test_the_same_generator_state_gives_the_same_streaks(self) -> None:
        image = np.full((120, 160, 3), 90, np.uint8)
        image[:40] = 200
        one, two, other = (
            draw_rain(image, 20.0, _camera(), np.zeros(3), np.random.default_rng(seed))
            for seed in (3, 3, 4)
        )
        assert np.array_equal(one, two)
        assert not np.array_equal(one, other)
        assert np.all(image[:40] == 200)  # not written into

    def test_streaks_are_upright_for_a_camera_at_rest(
        self, rng: np.random.Generator
    ) -> None:
        image = np.full((120, 160, 3), 60, np.uint8)
        image[0] = 255
        level = Camera.look_at((0, 0, 2), (9, 0, 2), fov_rad=0.5, width=160, height=120)
        drawn = draw_rain(image, 40.0, level, np.zeros(3), rng)[1:, :, 0].astype(float)
        down = np.abs(np.diff(drawn, axis=0)).mean()
        across = np.abs(np.diff(drawn, axis=1)).mean()
        assert across > 3 * down > 0


def _street(*places: tuple[float, float, float], heading: float = 0.0) -> Lamps:
    """Return street lamps at places (x, y, height) along a road of one heading."""
    count = len(places)
    return Lamps(
        (),
        street=np.array(places).reshape(-1, 3),
        heights=np.array([height for *_, height in places]),
        headings=np.full(count, heading),
        ids=np.zeros(count, np.int64),
        on_camera=False,
    )


def _light_at(lamps: LampMap, x: float, y: float) -> NDArray[np.float32]:
    u, v = (lamps.to_map @ [x, y, 0, 1])[:2]
    rows, columns = lamps.texels.shape[:2]
    texel: NDArray[np.float32] = lamps.texels[int(v * rows), int(u * columns)]
    return texel


def _looking(heading: float) -> Camera:
    """Return a camera that looks at (30, 0) from 40 m away, in a direction [rad]."""
    eye = 30 - 40 * np.cos(heading), -40 * np.sin(heading), 7.0
    return Camera.look_at(eye, (30, 0, 0), fov_rad=0.8, width=160, height=120)


class TestLampMap:
    def test_a_beam_lies_ahead_of_its_vehicle_and_a_red_glow_behind(self) -> None:
        lamps = LampMap(_street())
        lamps.update(_camera(), np.array([[50.0, 0.0, 0.0, 2.0]]))
        ahead, behind = _light_at(lamps, 62, 0), _light_at(lamps, 47, 0)
        assert ahead[1] > 5 * _light_at(lamps, 62, 6)[1]
        assert ahead[1] > 0.3 > _light_at(lamps, 45, 0)[1]
        assert ahead[3] == pytest.approx(ahead[1], rel=1e-3)
        assert behind[2] > 0.5 > _light_at(lamps, 55, 0)[2]

    @pytest.mark.parametrize("down", [0.1, 0.6, 1.4])
    def test_beams_reach_all_that_a_camera_sees(self, down: float) -> None:
        eye = np.array([1.9, -1.9, 9.0])
        look = eye + [np.cos(down), 0.01, -np.sin(down)]
        camera = Camera.look_at(eye, look, fov_rad=0.9, width=160, height=120)
        x, y = np.meshgrid(np.arange(-30.0, 80.0, 1.0), np.arange(-40.0, 40.0, 1.0))
        points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
        pixels, _ = camera.project(points)
        seen = np.all((pixels >= 0.0) & (pixels <= [160, 120]), axis=1)
        assert seen.any()
        beams = np.array([[-20.0, 0.0, 0.0, 2.0], [60.0, 0.0, np.pi, 2.0]])
        lamps, every = LampMap(_street()), LampMap(_street())
        lamps.update(camera, beams)
        every.update(replace(camera, width=10**6), beams)
        for point in points[seen]:
            expected = _light_at(every, *point[:2])
            assert _light_at(lamps, *point[:2]) == pytest.approx(expected)

    def test_a_street_lamp_shines_full_below_and_by_the_inverse_square_aside(
        self,
    ) -> None:
        lamps = LampMap(_street((30.25, 0.25, 10.0)))
        lamps.update(_camera(), np.zeros((0, 4)))
        assert _light_at(lamps, 30.25, 0.25)[0] == pytest.approx(1.0, abs=0.01)
        # As far aside as it is high: 1 / sqrt(8), times the fade towards the edge.
        expected = 8**-0.5 * (1 - 100 / 1600)
        assert _light_at(lamps, 30.25, 10.25)[0] == pytest.approx(expected, abs=0.01)

    @pytest.mark.parametrize("road", [0.0, 1.0, np.pi / 2])
    @pytest.mark.parametrize("look", [0.0, 0.7, np.pi / 2, -2.0])
    def test_a_pool_is_long_along_the_road_wherever_the_camera_looks(
        self, road: float, look: float
    ) -> None:
        lamps = LampMap(_street((30.0, 0.0, 10.0), heading=road))
        lamps.update(_looking(look), np.zeros((0, 4)))
        cos, sin = np.cos(road), np.sin(road)
        # 1.4 times as far along as aside: as much light.
        along = [_light_at(lamps, 30 + s * 14 * cos, s * 14 * sin)[0] for s in (-1, 1)]
        aside = [_light_at(lamps, 30 - s * 10 * sin, s * 10 * cos)[0] for s in (-1, 1)]
        expected = 8**-0.5 * (1 - 100 / 1600)
        assert [*along, *aside] == pytest.approx([expected] * 4, abs=0.03)

    @pytest.mark.parametrize("look", [0.0, 0.7])
    def test_a_pool_fades_out_before_it_ends(self, look: float) -> None:
        lamps = LampMap(_street((30.0, 0.0, 40.0)))
        lamps.update(_looking(look), np.zeros((0, 4)))
        light = [_light_at(lamps, x, 0.0)[0] for x in np.arange(30.0, 95.0, 0.5)]
        # It falls by some 1 / 56 a metre; the map is in steps of half a metre.
        assert np.abs(np.diff(light)).max() < 0.04
        assert light[2 * 50] > 0.0 == light[2 * 57]

    def test_a_post_lights_the_road_that_its_arm_reaches_across(self) -> None:
        posts = [
            lamp_post().moved((5.0, 6.0, 2.0), heading) for heading in (0.0, 1.0, -2.5)
        ]
        lamps = gather_lamps([], posts, on_camera=False)
        assert lamps.headings == pytest.approx([0.0, 1.0, -2.5], abs=1e-4)
        assert lamps.heights == pytest.approx([10.0] * 3, abs=1e-4)
        assert lamps.street[0, :2] == pytest.approx([5.0, 6.0 + 2.35], abs=1e-4)

    def test_a_car_has_two_white_lamps_ahead_and_two_red_behind(self) -> None:
        build = FLEET["car"]
        size = build.length, build.width, build.height
        lamps = vehicle_lamps(body(Vehicle("v", "car", *size, PAINTS["white"])))
        assert lamps.ahead.tolist() == [1, 1, -1, -1]
        assert lamps.positions[:2, 0].min() > 0 > lamps.positions[2:, 0].max()
        red, green, _ = lamps.colours[2:].mean(axis=0)
        assert lamps.colours[:2].min() > 0.7 and red > 10 * green


class TestAutoExposure:
    def test_gain_stays_at_one_without_a_time_constant(self) -> None:
        exposure = AutoExposure(None)
        for level in (100, 5, 250):
            exposure.measure(np.full((4, 4, 3), level, np.uint8), 0.04)
            assert exposure.gain == 1.0

    def test_a_darkened_scene_recovers_within_some_time_constants(self) -> None:
        exposure = AutoExposure(0.5)
        exposure.measure(np.full((4, 4, 3), 128, np.uint8), 0.04)
        gains = []
        for _ in range(50):  # 2 s: four time constants
            level = 255 * ((128 / 255) ** 2.2 / 8 * exposure.gain) ** (1 / 2.2)
            exposure.measure(np.full((4, 4, 3), round(level), np.uint8), 0.04)
            gains.append(exposure.gain)
        assert np.all(np.diff(gains) >= 0.0)
        # After one time constant 8 ** (1 - 1/e) of the factor 8 is compensated.
        assert gains[12] == pytest.approx(8 ** (1 - np.exp(-13 * 0.04 / 0.5)), rel=0.03)
        assert gains[-1] == pytest.approx(8.0, rel=0.06)

    def test_the_first_image_keeps_the_gain_at_one(self) -> None:
        exposure = AutoExposure(0.5)
        exposure.measure(np.full((4, 4, 3), 30, np.uint8), 0.04)
        assert exposure.gain == 1.0

    @pytest.mark.gl
    def test_it_uses_the_actual_intervals_where_frames_are_dropped(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        intervals = []

        class Watched(AutoExposure):
            def measure(self, image: NDArray[np.uint8], next_in_s: float) -> None:
                intervals.append(next_in_s)
                super().measure(image, next_in_s)

        monkeypatch.setattr(rendering, "AutoExposure", Watched)
        view = {
            "position": {"along_m": -4, "height_m": 3},
            "look_at": {"along_m": 2},
            "fov_rad": 0.8,
        }
        imaging = {"width_px": 64, "height_px": 48, "drop_share": 0.6}
        scenario = small_scenario(
            frames=6,
            road={"floor": {}},
            target={"ball": {"diameter_m": 1}},
            camera=view,
            imaging=imaging | {"auto_exposure_s": 0.2},
        )
        stage = build_stage(scenario, 0)
        rendering.render_frames(stage, lambda index, image: None)
        gaps = np.diff(stage.trajectories.times)
        assert np.ptp(gaps) > 0.03
        assert intervals[:-1] == pytest.approx(gaps)


_TUNNEL: dict[str, Any] = {
    "guard_rails": False,
    "tree_spacing_m": None,
    "tunnel": {"from_m": 30, "to_m": 110},
}
_STREET: dict[str, Any] = {
    "guard_rails": False,
    "tree_spacing_m": None,
    "lamp_spacing_m": 30,
}


@pytest.mark.gl
@pytest.mark.sumo
class TestRendered:
    def test_contrast_falls_exponentially_with_distance_in_fog(self) -> None:
        # White signs, upright and facing the camera, every 20 m on a hazy plain.
        signs: list[dict[str, Any]] = [
            {"kind": "sign", "along_m": d, "lateral_m": lateral, "width_m": 2.0}
            for d, lateral in [(20, -5.0), (40, -2.0), (60, -10.0), (80, -13.0)]
        ]
        view = {
            "position": {"along_m": 0, "lateral_m": -7.25, "height_m": 6},
            "look_at": {"along_m": 40, "lateral_m": -7.25, "height_m": 6},
            "fov_rad": 0.6,
        }
        parts: dict[str, Any] = {
            "frames": 2,
            "occluders": signs,
            "camera": view,
            "imaging": {"width_px": 320, "height_px": 240},
        }
        fog = {"weather": "fog", "fog_visibility_m": 60.0, "haze_per_km": 0.0}
        thick = _render(**parts, light=fog)
        thin = _render(**parts, light=fog | {"fog_visibility_m": 1000.0})
        air = thick.scene.light.horizon[1]
        per_m = [f.scene.light.haze_per_m for f in (thick, thin)]
        for number, sign in enumerate(signs):
            where = thick.frames[0].ids[::2, ::2] == 100 + number
            gaps = [
                _linear(f.frames[0].image[where][:, 1].astype(float)).mean() - air
                for f in (thick, thin)
            ]
            distance = np.hypot(sign["along_m"], sign["lateral_m"] + 7.25)
            expected = np.exp(-(per_m[0] - per_m[1]) * distance)
            # Levels are integers, which limits the accuracy of the contrast.
            assert gaps[0] / gaps[1] == pytest.approx(expected, rel=0.08, abs=0.02)

    def test_rain_and_glare_do_not_change_ids(self) -> None:
        view = small_scenario().camera.model_dump()
        parts: dict[str, Any] = {"frames": 2, "camera": view, "surroundings": _STREET}
        day = _render(**parts)
        wet = _render(**parts, light={"time": "night", "weather": "rain"})
        for one, two in zip(day.frames, wet.frames, strict=True):
            assert np.array_equal(one.ids, two.ids)
            assert np.array_equal(one.target_silhouette, two.target_silhouette)
        assert not np.array_equal(wet.frames[0].image, wet.images[0])

    def test_a_clear_day_leaves_the_image_unchanged(self) -> None:
        day = _render(frames=2)
        assert day.images[0] is day.frames[0].image

    def test_the_same_seed_gives_the_same_night_of_rain(self) -> None:
        light = {"time": "night", "weather": "rain"}
        one, two = (_render(frames=2, light=light) for _ in range(2))
        assert all(map(np.array_equal, one.images, two.images))
        assert not np.array_equal(one.images[0], one.images[1])

    def test_lamps_are_the_brightest_of_a_car_at_night(self) -> None:
        # Seen from behind at 40 m, alone on an unlit road.
        night = _render(frames=2, light={"time": "night"})
        image, alone = night.images[0].astype(int), night.frames[0].target_silhouette
        rows, columns = np.nonzero(alone[::2, ::2])
        car = image[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
        red = car[..., 0] - car[..., 1]
        assert red.max() > 80
        lamps = red > 0.6 * red.max()
        assert 2 <= lamps.sum() < 0.15 * lamps.size
        assert car[lamps][:, 0].min() > 2 * np.median(car[..., 0])

    def test_head_lamps_light_the_road_ahead_of_a_car_at_night(self) -> None:
        view = {
            "position": {"along_m": 0, "lateral_m": -7.25, "height_m": 9},
            "look_at": {"along_m": 50, "lateral_m": -7.25, "height_m": 0},
            "fov_rad": 0.5,
        }
        parts: dict[str, Any] = {
            "frames": 2,
            "camera": view,
            "light": {"time": "night"},
        }
        camera = build_stage(small_scenario(**parts), 0).cameras[0]
        picture = _render(**parts).frames[0].image.astype(float).mean(axis=-1)

        def at(along: float, lateral: float) -> float:
            place = build_stage(small_scenario(**parts), 0).line.point(along, lateral)
            x, y = camera.project(place)[0].astype(int)
            return float(picture[y - 1 : y + 2, x - 1 : x + 2].mean())

        assert at(54, -7.25) > 2 * at(54, 0.9)

    def test_a_street_lamp_lights_what_is_below_it(self) -> None:
        view = {
            "position": {"along_m": 0, "lateral_m": -7.25, "height_m": 9},
            "look_at": {"along_m": 50, "lateral_m": -7.25, "height_m": 0},
            "fov_rad": 0.5,
        }
        parts: dict[str, Any] = {
            "frames": 2,
            "camera": view,
            "light": {"time": "night"},
        }
        dark, lit = _render(**parts), _render(**parts, surroundings=_STREET)
        assert _mean_light(lit.images[0]) > 1.5 * _mean_light(dark.images[0])

    def test_gain_has_the_effect_of_illumination(self) -> None:
        brighter = _render(frames=2, gain=2.0)
        lit = _render(frames=2, light={"illumination": 2.0})
        assert np.array_equal(brighter.frames[0].image, lit.frames[0].image)

    def test_it_is_dark_in_a_tunnel_and_bright_beyond(self) -> None:
        def view(along: float) -> dict[str, Any]:
            place = {"along_m": along, "lateral_m": -7.25, "height_m": 1.5}
            aim = place | {"along_m": along + 40}
            return {"position": place, "look_at": aim, "fov_rad": 0.5}

        levels = []
        for along in (-25.0, 45.0, 120.0):
            target = {"lane": 0, "along_m": along + 25, "speed_mps": 15}
            rendered = _render(
                frames=2,
                camera=view(along),
                target=target,
                surroundings=_TUNNEL,
            )
            levels.append(_mean_light(rendered.frames[0].image[60:]))
        assert levels[1] < 0.25 * levels[0]
        assert levels[2] > 0.8 * levels[0]

    def test_a_car_in_the_open_is_bright_seen_from_the_tunnel(self) -> None:
        view = {
            "position": {"along_m": 90, "lateral_m": -7.25, "height_m": 1.5},
            "look_at": {"along_m": 140, "lateral_m": -7.25, "height_m": 1.5},
            "fov_rad": 0.2,
        }

        def car(along: float, surroundings: dict[str, Any]) -> float:
            target = {
                "colour": "white",
                "lane": 0,
                "along_m": along,
                "speed_mps": 1,
            }
            rendered = _render(
                frames=2, camera=view, target=target, surroundings=surroundings
            )
            seen = rendered.frames[0].target_silhouette[::2, ::2]
            return float(np.median(rendered.frames[0].image[seen]))

        open_road = {"guard_rails": False, "tree_spacing_m": None}
        assert car(140, _TUNNEL) == pytest.approx(car(140, open_road), abs=3)
        assert car(103, _TUNNEL) < 0.6 * car(103, open_road)

    def test_a_portal_hides_the_target_and_is_named(self) -> None:
        view = {
            "position": {"along_m": 0, "lateral_m": -45, "height_m": 4},
            "look_at": {"along_m": 60, "lateral_m": -7.25, "height_m": 1},
            "fov_rad": 0.6,
        }
        target = {"lane": 0, "along_m": 60, "speed_mps": 15}
        rendered = _render(frames=2, camera=view, target=target, surroundings=_TUNNEL)
        frame = rendered.frames[0]
        hidden = frame.ids[frame.target_silhouette]
        assert frame.target_silhouette.any()
        assert {rendered.scene.labels[int(value)] for value in set(hidden)} == {
            "tunnel"
        }

    @pytest.mark.parametrize(
        ("surroundings", "position", "message"),
        [
            pytest.param(
                {"tunnel": {"from_m": 30, "to_m": 2500}},
                {"along_m": 0, "lateral_m": -7, "height_m": 2},
                "expected a tunnel on the road",
                id="beyond the road",
            ),
            pytest.param(
                _TUNNEL,
                {"along_m": 50, "lateral_m": -7, "height_m": 7.5},
                "inside the hill",
                id="camera in the hill",
            ),
        ],
    )
    def test_an_invalid_tunnel_is_refused(
        self, surroundings: dict[str, Any], position: dict[str, Any], message: str
    ) -> None:
        view = {
            "position": position,
            "look_at": {"along_m": 140, "lateral_m": -7.25, "height_m": 1},
        }
        stage = build_stage(
            small_scenario(
                surroundings=surroundings, camera=view, target={"along_m": 80}
            ),
            0,
        )
        with pytest.raises(RenderError, match=message):
            build_scene(stage)

    def test_posts_and_trees_stay_out_of_the_tunnel(self) -> None:
        rich = _TUNNEL | {"lamp_spacing_m": 20, "gantry_spacing_m": 40}
        scene = build_scene(build_stage(small_scenario(surroundings=rich), 0))
        along = scene.lamps.street[:, 0]
        assert not np.any((along > 30) & (along < 110))
        assert np.any(along < 30) and np.any(along > 110)


def test_the_hour_sets_the_height_of_the_sun_in_clear_weather() -> None:
    light = Light(sun_elevation_rad=0.4, sun_azimuth_rad=0.0)
    expected = [math.cos(0.4), 0.0, math.sin(0.4)]
    assert illuminate(light).to_sun == pytest.approx(expected)
    usual = illuminate(Light(sun_azimuth_rad=0.0)).to_sun
    assert usual == pytest.approx([math.cos(0.75), 0.0, math.sin(0.75)])
