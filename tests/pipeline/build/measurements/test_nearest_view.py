"""How near the flight comes to a mesh: told of the mesh's places, not of its bounding sphere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from paradize.build.measurements import nearest_view
from paradize.build.measurements.nearest_view import nearest_pixel_m, sample_points
from paradize.data import Lod, Mesh
from paradize.errors import FormatError
from paradize.formats.glb.encode import encode_glb
from paradize.placement import largest_scale, to_world
from paradize.scene.flight import plan_flight, sightings_of
from paradize.scene.placement import placed
from paradize.scene.settings import Scene, load_scene
from tests.pipeline.scenes import make_cove
from tests.pipeline.shapes import grid, soup, sphere


def glb(mesh: Mesh) -> bytes:
    return encode_glb((Lod(replace(mesh, uvs=None), 0.0, 0.0),), "thing")


def cove(tmp_path: Path, **stands: object) -> Scene:
    scene = load_scene(make_cove(tmp_path))
    post = scene.objects[0]
    return replace(scene, objects=(replace(post, instances=(replace(post.instances[0], **stands),)),))


def near_m(scene: Scene, mesh: Mesh) -> float | None:
    """The nearest view of the scene's one object, metres."""
    places = {"post": sample_points(glb(mesh), "post.glb")}
    found = nearest_pixel_m(scene, plan_flight(scene.flight), places).get("post")
    tangent = np.tan(np.radians(scene.flight.fov_deg) / 2)
    if found is None:
        return None
    return found * scene.objects[0].instances[0].scale * scene.head.viewport[1] / 2 / tangent


@pytest.mark.parametrize("mesh", [sphere(24), sphere(80), grid(1), grid(60)])
def test_places_are_a_few_thousand_spread_over_the_surface(mesh: Mesh) -> None:
    places = np.array(sample_points(glb(mesh), "x.glb"))
    assert 1000 < len(places) < 5000
    assert np.allclose(places.min(axis=0), mesh.positions.min(axis=0), atol=0.1)
    assert np.allclose(places.max(axis=0), mesh.positions.max(axis=0), atol=0.1)
    for corner in mesh.positions[:: max(1, len(mesh.positions) // 50)]:
        assert np.linalg.norm(places - corner, axis=1).min() < 0.2


@pytest.mark.parametrize("yaw_deg, scale", [(0.0, 1.0), (90.0, 1.0), (213.0, 0.5)])
def test_a_small_ball_is_as_near_as_its_sphere(tmp_path: Path, yaw_deg: float, scale: float) -> None:
    scene = cove(tmp_path, position=(1.0, 0.5, -0.5), yaw_deg=yaw_deg, scale=scale)
    # The mesh stands aside of its object's place, so that turns and scales count.
    mesh = sphere(24, radius=0.3, offset=(1.0, 0.0, 0.5))
    a = np.radians(yaw_deg)
    x, z = np.cos(a) + 0.5 * np.sin(a), 0.5 * np.cos(a) - np.sin(a)
    at = (1.0 + scale * x, 0.5, -0.5 + scale * z)
    flight = plan_flight(scene.flight)
    met = sightings_of(flight, scene.flight.fov_deg, 1280 / 720, [(at, 0.3 * scale)])[0]
    assert met.seen
    assert near_m(scene, mesh) == pytest.approx(met.nearest_m, rel=0.02)


def test_an_eye_inside_the_bounding_sphere_of_a_shell_is_not_near_the_shell(tmp_path: Path) -> None:
    """The flight stays 10 metres from the middle or less, and looks through it."""
    scene = cove(tmp_path, position=(0.0, 0.0, 0.0), yaw_deg=0.0, scale=1.0)
    found = near_m(scene, sphere(24, radius=30.0))
    assert found is not None and 20 < found < 40


def test_of_several_instances_the_nearest_counts_in_metres_of_the_mesh(tmp_path: Path) -> None:
    scene, mesh = cove(tmp_path), sphere(24, radius=0.3)
    places = {"post": sample_points(glb(mesh), "post.glb")}
    flight, post = plan_flight(scene.flight), scene.objects[0]
    near = replace(post.instances[0], position=(4.0, 1.0, 3.0), scale=1.0)
    far = replace(near, position=(0.0, 0.0, 0.0))
    alone = []
    for stands in ((near,), (far,), (near, far), (far, near)):
        known = replace(scene, objects=(replace(post, instances=stands),))
        alone.append(nearest_pixel_m(known, flight, places)["post"])
    assert alone[0] < 0.7 * alone[1]
    assert alone[2] == alone[3] == alone[0]


def test_of_many_instances_few_are_looked_at_and_a_search_of_all_finds_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, post = cove(tmp_path), load_scene(make_cove(tmp_path / "again")).objects[0]
    places = np.array(sample_points(glb(sphere(8, radius=0.3, offset=(0.2, 0.0, 0.1))), "post.glb"))
    rng = np.random.default_rng(5)
    stands = [
        replace(
            post.instances[0],
            position=tuple(rng.uniform(-60.0, 60.0, 3).tolist()),
            yaw_deg=float(rng.uniform(0.0, 360.0)),
            pitch_deg=float(rng.uniform(-90.0, 90.0)),
            scale=tuple((rng.uniform(0.2, 2.0, 3) * rng.choice([-1.0, 1.0], 3)).tolist()),
        )
        for _ in range(100)
    ]
    scene = replace(scene, objects=(replace(post, instances=tuple(stands)),))
    flight, looked_at = plan_flight(scene.flight), []
    nearest = nearest_view._Cone.nearest

    def counted(cone: nearest_view._Cone, world: np.ndarray) -> float | None:
        looked_at.append(world)
        return nearest(cone, world)

    monkeypatch.setattr(nearest_view._Cone, "nearest", counted)
    found = nearest_pixel_m(scene, flight, {"post": [tuple(place) for place in places.tolist()]})["post"]
    assert 1 <= len(looked_at) < 60
    width, height = scene.head.viewport
    tangent = np.tan(np.radians(0.5 * scene.flight.fov_deg))
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent * (1.0 + (width / height) ** 2))
    count = round(flight.duration_s / 0.25)
    pixels = []
    for instance in map(placed, stands):
        world = np.stack(to_world(places.T, instance), axis=1)
        for k in range(count):
            eye, target = map(np.array, flight.view(flight.duration_s * k / count))
            toward = world - eye
            away = np.linalg.norm(toward, axis=1)
            shown = toward @ (target - eye) / np.linalg.norm(target - eye) >= cosine * away
            if shown.any():
                near = max(float(away[shown].min()), scene.flight.near_m)
                pixels.append(2.0 * near * tangent / height / largest_scale(instance))
    assert found == pytest.approx(min(pixels), rel=1e-9)


def test_what_never_comes_into_view_is_left_out(tmp_path: Path) -> None:
    scene = cove(tmp_path, position=(0.0, 500.0, 0.0))
    assert near_m(scene, sphere(8)) is None


def test_what_the_camera_touches_is_as_near_as_the_near_plane(tmp_path: Path) -> None:
    scene = cove(tmp_path, position=(9.0, 2.0, 0.0), yaw_deg=0.0, scale=1.0)
    corner_at_the_eye = soup([(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)], [(0, 1, 2)])
    for mesh in (sphere(24, radius=0.02), corner_at_the_eye):
        assert near_m(scene, mesh) == pytest.approx(scene.flight.near_m, rel=1e-6)


@pytest.mark.parametrize("length", [0, 12, 20, 60, 400])
def test_a_cut_file_is_refused(length: int) -> None:
    with pytest.raises(FormatError, match=r"cut.glb: .*(not a mesh that|not a GLB|is not JSON)"):
        sample_points(glb(sphere(8))[:length], "cut.glb")
