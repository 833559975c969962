"""`new` takes the cameras and the sun of a glTF model, and names what it leaves out."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.new.scene import new_scene
from paradize.readers.model import read_model
from paradize.scene.finest_views import sun_direction
from paradize.scene.flight import plan_flight
from paradize.scene.settings import load_scene
from tests.pipeline.readers.gltf.made import Made, shown, square

LIGHTS = "KHR_lights_punctual"


def quaternion(axis: tuple[float, float, float], degrees: float) -> list[float]:
    half = radians(degrees) / 2
    return [*(np.sin(half) * np.array(axis)).tolist(), float(np.cos(half))]


def panel(*nodes: dict[str, Any]) -> Made:
    """A square one metre wide, and nodes beside it."""
    made, primitive = square(NORMAL=np.tile(np.float32([0, 0, 1]), (4, 1)))
    shown(primitive, made)
    made.show(0, *(made.add("nodes", **node) for node in nodes))
    return made


def perspective(made: Made, yfov_deg: float, **lens: float) -> int:
    lens = {"yfov": radians(yfov_deg), "znear": 0.1} | lens
    return made.add("cameras", type="perspective", perspective=lens)


def lit(made: Made, *lights: dict[str, Any]) -> Made:
    made.tree["extensionsUsed"] = [LIGHTS]
    made.tree["extensions"] = {LIGHTS: {"lights": list(lights)}}
    return made


def light(number: int) -> dict[str, Any]:
    return {LIGHTS: {"light": number}}


def test_a_picture_that_is_not_read_is_copied_so_that_the_scene_says_the_same_of_it(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=np.float32([[0, 0], [1, 0], [1, 1], [0, 1]]))
    (tmp_path / "m").mkdir()
    (tmp_path / "m/wood.ktx2").write_bytes(b"\xabKTX 20\xbb\r\n\x1a\n")
    texture = made.add("textures", source=made.add("images", uri="wood.ktx2"))
    primitive["material"] = made.add("materials", normalTexture={"index": texture})
    new = new_scene(tmp_path / "s", shown(primitive, made).glb(tmp_path / "m/a.glb"))
    for notes in (new.notes, read_model(tmp_path / "s/model/a.glb").warnings):
        assert any("'wood.ktx2': KTX2 is not read" in text and "ktxdecompress" in text for text in notes)
        assert not any("does not exist" in text for text in notes)


def test_the_flight_begins_at_the_cameras_of_the_model(tmp_path: Path) -> None:
    """Level, and rolled by 30 degrees from above on the right."""
    yaw, roll = quaternion((0, 1, 0), 45), quaternion((0, 0, 1), 30)
    tilt = [yaw[3] * roll[0] + yaw[1] * roll[2], yaw[1] * roll[3], yaw[3] * roll[2], yaw[3] * roll[3]]
    made = panel(
        {"camera": 0, "name": "front", "translation": [0.5, 0.6, 4.0]},
        {"camera": 1, "name": "side", "translation": [3.5, 2.0, 3.0], "rotation": tilt},
    )
    perspective(made, 30, aspectRatio=1.5)
    perspective(made, 30)
    new = new_scene(tmp_path / "s", made.glb(tmp_path / "Panel.glb"))
    assert new.taken == ["the flight begins with the cameras of the model: 'front', 'side'"] and not new.notes
    scene = load_scene(new.scene)
    (item,) = scene.objects
    flight = plan_flight(scene.flight)
    assert scene.head.viewport == (1080, 720) and scene.flight.fov_deg == pytest.approx(30, abs=1e-3)
    offset = np.array(item.instances[0].position)
    for waypoint, forward, wanted in (
        (0, (0.0, 0.0, -1.0), ((0.5, 0.6, 4.0), 0.0)),
        (1, (-(0.5**0.5), 0.0, -(0.5**0.5)), ((3.5, 2.0, 3.0), 30.0)),
    ):
        u = flight.waypoint_u[waypoint]
        eye, target = (np.array([axis[0] for axis in path[u]]) for path in (flight.eye, flight.target))
        assert np.allclose(eye - offset, wanted[0], atol=1e-4)
        assert np.allclose((target - eye) / np.linalg.norm(target - eye), forward, atol=1e-4)
        assert np.degrees(flight.roll[u][0]) == pytest.approx(wanted[1], abs=0.01)


@pytest.mark.parametrize("size", [1.0, 2000.0])
def test_the_near_plane_of_a_flight_is_that_of_its_nearest_camera(tmp_path: Path, size: float) -> None:
    """As a model of two kilometres is shown, smaller than it is."""
    eye = [0.5 * size, 0.6 * size, 4.0 * size]

    def planes(name: str, *near: float) -> tuple[float, float, float]:
        made, primitive = square()
        cameras = [{"camera": k, "translation": [eye[0] + k * size, *eye[1:]]} for k in range(len(near))]
        nodes = [made.add("nodes", **node) for node in cameras]
        made.show(made.add("nodes", mesh=made.mesh(primitive), scale=[size] * 3), *nodes)
        for each in near:
            perspective(made, 40, znear=each * size)
        new = new_scene(tmp_path / name, made.glb(tmp_path / f"{name}.glb"))
        flight = load_scene(new.scene).flight
        return flight.near_m, flight.far_m, new.scale * size

    own, far_m, shown_as = planes("none")
    assert planes("far", 0.5)[0] == own
    assert planes("near", 0.5, 0.01, 0.012)[0] == pytest.approx(0.01 * shown_as, rel=1e-4)
    assert planes("least", 1e-9)[0] == pytest.approx(far_m / 20000, rel=1e-4)  # what depth serves


def test_the_sun_is_the_directional_light_of_the_model(tmp_path: Path) -> None:
    made = panel(
        {"extensions": light(0), "name": "bulb", "translation": [0, 2, 0]},
        {"extensions": light(1), "rotation": quaternion((1, 0, 0), -60)},
        {"extensions": light(1), "name": "second"},
    )
    sun = {"type": "directional", "name": "noon", "color": [1, 0.5, 0.25], "intensity": 4}
    lit(made, {"type": "point"}, sun)
    new = new_scene(tmp_path / "s", made.glb(tmp_path / "Panel.glb"))
    found = load_scene(new.scene).sun
    toward = sun_direction(found.azimuth_deg, found.elevation_deg)
    assert np.allclose(toward, [0, 3**0.5 / 2, 0.5], atol=1e-4)
    assert found.color == (1, 0.5, 0.25) and found.intensity == 4
    assert new.taken == ["the sun is the light 'noon'"]
    assert "the point light 'bulb' is left out" in new.notes[0]
    assert "the directional light 'noon' is left out: a scene has one sun" in new.notes[1]


def test_other_readers_of_a_model_are_not_warned_of_its_cameras_and_lights(tmp_path: Path) -> None:
    """They are no part of a mesh; a scene of `new` has taken those that it can have."""
    made = panel({"camera": 0, "translation": [0, 0, 4]}, {"extensions": light(0)})
    perspective(made, 30)
    read = read_model(lit(made, {"type": "directional"}).glb(tmp_path / "Panel.glb"))
    assert read.views and read.views.cameras and read.views.lights
    assert not read.warnings


def test_cameras_and_lights_that_a_scene_cannot_have_are_named(tmp_path: Path) -> None:
    below = {"type": "directional", "name": "under", "intensity": 2}
    made = panel(
        {"camera": 0, "name": "flat", "translation": [0, 0, 3]},
        {"camera": 1, "name": "cellar", "translation": [0, -1, 3]},
        {"camera": 1, "name": "moon", "translation": [0, 1, 3e5]},
        {"camera": 1, "name": "well", "translation": [0, 3, 0], "rotation": quaternion((1, 0, 0), -90)},
        {"camera": 2, "name": "eagle", "translation": [0, 1, 3]},
        {"camera": 7, "name": "lost"},
        {"extensions": light(0), "rotation": quaternion((1, 0, 0), 60)},
    )
    made.add("cameras", type="orthographic", orthographic={"xmag": 1, "ymag": 1, "znear": 0, "zfar": 9})
    perspective(made, 40)
    perspective(made, 0.5)
    new = new_scene(tmp_path / "s", lit(made, below).glb(tmp_path / "Panel.glb"))
    said = "\n".join(new.notes)
    for words in (
        "'flat' is left out: it is not a perspective camera",
        "'cellar' is left out: it stands below the ground",
        "'moon' is left out: it stands 3e+05 from the model's middle",
        "'well' is left out: it looks straight up or down",
        "'eagle' is left out: it sees 0.5 degrees; 5 to 120 is the range",
        "/cameras",
        "'under' stands -60 degrees above the horizon",
    ):
        assert words in said
    plain = load_scene(new_scene(tmp_path / "t").scene)
    scene = load_scene(new.scene)
    assert not new.taken and scene.sun == plain.sun and len(scene.flight.eye) == len(plain.flight.eye)


def test_an_aspect_that_a_picture_cannot_have_is_named(tmp_path: Path) -> None:
    made = panel({"camera": 0, "name": "wide", "translation": [0.5, 0.6, 4.0]})
    perspective(made, 30, aspectRatio=7.0)
    new = new_scene(tmp_path / "s", made.glb(tmp_path / "Panel.glb"))
    (note,) = new.notes
    assert "the aspect of the camera 'wide', 7, is not taken over; 0.2 to 5 is the range" in note


def test_of_many_cameras_one_note_says_how_many_are_left_out(tmp_path: Path) -> None:
    places = [{"camera": 0, "name": f"c{k}", "translation": [0.1 * k, 1.0, 4.0]} for k in range(40)]
    made = panel(*places)
    perspective(made, 30)
    new = new_scene(tmp_path / "s", made.glb(tmp_path / "Panel.glb"))
    (note,) = new.notes
    assert "24 cameras ('c16', 'c17', 'c18', 'c19' and 20 more) are left out: a flight takes 16" in note


def test_bright_lux_are_not_taken_over(tmp_path: Path) -> None:
    made = panel({"extensions": light(0), "rotation": quaternion((1, 0, 0), -60)})
    lit(made, {"type": "directional", "intensity": 1e5})
    new = new_scene(tmp_path / "s", made.glb(tmp_path / "Panel.glb"))
    assert "100000 lux" in new.notes[0] and load_scene(new.scene).sun.intensity == 3.0


@pytest.mark.parametrize(("extension", "yaw_deg", "x"), [("VRM", 180.0, 3.5), ("VRMC_vrm", 0.0, -3.5)])
def test_an_avatar_of_vrm_0_is_turned_so_that_the_flight_begins_before_its_face(
    extension: str, yaw_deg: float, x: float, tmp_path: Path
) -> None:
    made, primitive = square()
    shown(primitive, made).tree["nodes"][0]["translation"] = [3, 0, 0]
    made.tree |= {"extensionsUsed": [extension], "extensions": {extension: {}}}
    new_scene(tmp_path / "s", made.glb(tmp_path / "a.vrm"))
    (placed,) = load_scene(tmp_path / "s/scene.toml").objects[0].instances
    assert placed.yaw_deg == yaw_deg and placed.position[0] == pytest.approx(x)
