"""No pixel of a flight ever asks for a finer mip or level than is baked, and hardly less is asked for.

The reference samples the flight and the surface densely and knows nothing of boxes, runs and bounds: it meets
the surface's plane with the rays of a pixel and of its neighbours, and takes the texels between by OpenGL's
formula (3.3, 3.8.11, and EXT_texture_filter_anisotropic).
"""

from __future__ import annotations

import itertools
import json
import os
import re
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.artifact import Artifact
from paradize.build import provenance
from paradize.build.bake import bake
from paradize.build.manifest import mesh_facts
from paradize.build.measurements import required_detail
from paradize.build.options import BuildOptions
from paradize.build.verify import verify
from paradize.data import Mesh
from paradize.formats.glb.cut import cut_glb
from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.cut import can_cut
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.scene import finest_views
from paradize.scene.flight import Flight, plan_flight
from paradize.scene.placement import placed
from paradize.scene.settings import EyePoint, Instance, TargetPoint, load_scene
from paradize.scene.settings import Flight as FlightSettings
from paradize.visibility import finest_mip
from paradize.visibility.finest_mip import (
    MAX_SAMPLES,
    SLACK,
    FinestMip,
    Placement,
    Surface,
    finest,
    finest_lod,
    surface_of,
)
from paradize.visibility.texel_footprint import FREE_CAMERA, views_of
from tests.pictures import load
from tests.pipeline.full_bake import full_bake
from tests.pipeline.scene.test_placement import matrix_of
from tests.pipeline.scenes import make_cove, write_image
from tests.places import ROOT
from tests.sweeps import sample, sweep

F64 = npt.NDArray[np.float64]
Run = Callable[..., Any]
FOV_DEG, WIDTH, HEIGHT = 50.0, 160, 90
FINER = 4.0  # the reference finds the least within this factor of the bound: two levels, SLACK not counted
FAR_AWAY = Placement(placed(Instance(position=(0.0, 900.0, 0.0))))


def circle(radius_m: float, height_m: float, *, up_m: float = 0.0) -> FlightSettings:
    eye = [(radius_m, height_m, 0.0), (0.0, height_m, radius_m), (-radius_m, height_m, 0.0)]
    return FlightSettings(
        duration_s=8.0,
        fov_deg=FOV_DEG,
        near_m=0.2,
        far_m=500.0,
        eye=tuple(EyePoint(position=place) for place in eye),
        target=tuple(TargetPoint(position=(0.0, up_m, 0.3 * k)) for k in range(3)),
    )


def flight_views_of(flight: FlightSettings, **more: Any) -> dict[str, Any]:
    message = {"flight": asdict(flight), "viewport": [WIDTH, HEIGHT], "error_px": 1.0, "mirror_m": None}
    return message | {"water_m": None, "shadow": None, "sun": [0.0, 1.0, 0.0], "scales": {}} | more


def waves(side: int, size_m: float, bend: float) -> Mesh:
    """A bent square of side x side quads with texture coordinates that are stretched, and steep places."""
    z, x = np.mgrid[0 : side + 1, 0 : side + 1] / side
    y = bend * np.sin(5.0 * x) * np.cos(4.0 * z)
    positions = np.stack([(x - 0.5) * size_m, y, (z - 0.5) * size_m], axis=2).reshape(-1, 3)
    uvs = np.stack([0.1 + 0.8 * x * x, 0.1 + 0.6 * z + 0.1 * x], axis=2).reshape(-1, 2)
    at = np.arange(side * (side + 1)).reshape(side, side + 1)[:, :-1].ravel()
    quads = np.stack([at, at + side + 1, at + 1, at + 1, at + side + 1, at + side + 2], axis=1)
    return Mesh(
        positions=positions.astype(np.float32),
        uvs=uvs.astype(np.float32),
        triangles=quads.reshape(-1, 3).astype(np.uint32),
    )


def least_texels(
    flight: Flight, mesh: Mesh, size: tuple[int, int], *, mirror_m: float | None = None, rows: int = HEIGHT
) -> float:
    """The least of texels_at over 200 moments."""
    moments = np.linspace(0.0, flight.duration_s, 200, endpoint=False)
    return float(texels_at(moments, flight, mesh, size, mirror_m=mirror_m, rows=rows).min())


def texels_at(
    moments: F64,
    flight: Flight,
    mesh: Mesh,
    size: tuple[int, int],
    *,
    mirror_m: float | None = None,
    rows: int = HEIGHT,
) -> F64:
    """Of each moment, in seconds, the fewest texels between neighbouring pixels, the smaller of both ways,
    over 10,000 places; infinite where none is seen. mirror_m: as the picture in the water shows it, from an
    eye below."""
    rng = np.random.default_rng(3)
    chosen = rng.integers(len(mesh.triangles), size=10_000)
    corners = mesh.positions.astype(np.float64)[mesh.triangles][chosen]
    texels = (mesh.uvs.astype(np.float64) * size)[mesh.triangles][chosen]  # type: ignore[union-attr]
    if mirror_m is not None:
        corners[:, :, 1] = 2.0 * mirror_m - corners[:, :, 1]
    share = rng.dirichlet((1.0, 1.0, 1.0), len(chosen))
    points = np.einsum("nk,nkd->nd", share, corners)
    a, e, f = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(e, f)
    # Of a step along the surface: in the triangle's own coordinates, then in texels. (3, n) each.
    s, v = (part.T / (normal * normal).sum(axis=1) for part in (np.cross(f, normal), np.cross(normal, e)))
    p, q = texels[:, 1] - texels[:, 0], texels[:, 2] - texels[:, 0]
    to_texels = [s * p[:, k] + v * q[:, k] for k in range(2)]
    at_points, at_plane = [(part * points.T).sum(axis=0) for part in to_texels], (a * normal).sum(axis=1)
    points, normal = np.ascontiguousarray(points.T), np.ascontiguousarray(normal.T)
    pixel = 2.0 * np.tan(np.radians(FOV_DEG) / 2) / rows
    half = rows / 2 * pixel
    least = np.full(len(moments), np.inf)
    for at, t in enumerate(moments):
        eye, target = (np.array(place) for place in flight.view(float(t)))
        ahead = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(ahead, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        up = np.cross(right, ahead)
        axes = np.stack([ahead, right, up])
        depth, x, y = axes @ points - (axes @ eye)[:, None]
        x, y = x / depth, y / depth
        seen = (depth > 0.2) & (np.abs(y) < half) & (np.abs(x) < half * WIDTH / HEIGHT)
        found = []
        height, facing = at_plane - eye @ normal, axes @ normal
        ways = [(axes @ part, eye @ part - there) for part, there in zip(to_texels, at_points, strict=True)]
        for across, down in ((x + pixel, y), (x, y + pixel)):  # the neighbour's ray: 1 ahead, and these
            with np.errstate(divide="ignore", invalid="ignore"):
                reach = height / (facing[0] + across * facing[1] + down * facing[2])
                step = [eye_to + reach * (w[0] + across * w[1] + down * w[2]) for w, eye_to in ways]
                square = step[0] * step[0] + step[1] * step[1]
                found.append(np.where(reach > 0.0, np.sqrt(square), np.inf))
        rows_seen = np.minimum(*found)[seen]
        if len(rows_seen):
            least[at] = np.nanmin(rows_seen)
    return least


@pytest.mark.parametrize(
    ("radius_m", "height_m", "size_m", "bend"),
    sample([(25, 20, 14, 2.0), (60, 12, 8, 0.5), (9, 1.5, 10, 0.2)], every=3),
)
def test_no_pixel_asks_for_a_finer_mip_than_is_baked(
    radius_m: float, height_m: float, size_m: float, bend: float
) -> None:
    mesh, flight, size = waves(12, size_m, bend), circle(radius_m, height_m), (2048, 1024)
    assert mesh.uvs is not None
    views = views_of(flight_views_of(flight), ("camera",), None)
    found = finest(views, [(surface_of(mesh, mesh.uvs, *size), Placement())])
    least = least_texels(plan_flight(flight), mesh, size)
    assert found.texels <= least * 1.0001  # float32 vertices
    assert least < FINER * found.texels or least < 2.0 * SLACK  # level 0: no need to know by how much
    assert 2.0 ** found.level() <= max(1.0, least)
    assert found.view == "camera" and 0.0 <= (found.second_s or 0.0) < 8.0


def test_the_mirror_asks_by_its_own_eye_and_its_own_pixels() -> None:
    mesh, size = waves(12, 6.0, 0.3), (1024, 1024)
    assert mesh.uvs is not None
    flight = circle(30.0, 8.0)
    flight_views = flight_views_of(flight, mirror_m=-2.0, scales={"reflection": 2.0})
    surface = surface_of(mesh, mesh.uvs, *size)
    found = finest(views_of(flight_views, ("reflection",), None), [(surface, Placement())])
    least = least_texels(plan_flight(flight), mesh, size, mirror_m=-2.0, rows=2 * HEIGHT)
    assert found.view == "mirror"
    assert found.texels <= least * 1.0001 < FINER * found.texels


@pytest.mark.deep
@pytest.mark.parametrize("scale", [2.5, -2.5, (2.5, 2.0, -1.5)])
def test_instances_turn_scale_and_move_a_surface(scale: float | tuple[float, float, float]) -> None:
    """Under uneven scale the largest counts for all directions, which may be more than is needed."""
    mesh, size = waves(8, 4.0, 0.4), (8192, 8192)
    assert mesh.uvs is not None
    stand = Instance(position=(5.0, 1.0, -3.0), yaw_deg=40.0, pitch_deg=12.0, roll_deg=-7.0, scale=scale)
    place = Placement(placed(stand))
    moved = mesh.positions.astype(np.float64) @ matrix_of(stand).T + stand.position
    assert np.allclose([place.at(point) for point in mesh.positions.tolist()], moved, atol=1e-12)
    moved = moved.astype(np.float32)
    there = Mesh(positions=moved, uvs=mesh.uvs, triangles=mesh.triangles)
    flight = circle(40.0, 9.0)
    found = finest(
        views_of(flight_views_of(flight), ("camera",), None), [(surface_of(mesh, mesh.uvs, *size), place)]
    )
    least = least_texels(plan_flight(flight), there, size)
    assert (
        found.texels
        <= least * 1.0001
        < FINER * found.texels * (2.5 / 1.5 if isinstance(scale, tuple) else 1.0)
    )


def asked_of_waves(rows: int, **more: Any) -> tuple[FinestMip, Surface]:
    mesh = waves(rows, 4.0, 0.4)
    assert mesh.uvs is not None
    surface = surface_of(mesh, mesh.uvs, 2048, 2048)
    flight_views = flight_views_of(circle(60.0, 12.0), **more)
    return finest(views_of(flight_views, ("camera",), None), [(surface, Placement())]), surface


@pytest.mark.deep
def test_a_larger_picture_asks_for_more() -> None:
    plain, large = asked_of_waves(8)[0], asked_of_waves(8, viewport=[WIDTH * 2, HEIGHT * 2])[0]
    assert large.texels < 0.6 * plain.texels


@pytest.mark.parametrize("rows", sweep([2, 8], test=[2]))
def test_a_free_camera_asks_for_more_the_nearer_it_comes(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its bound holds after any number of boxes; all that are allowed take seconds."""
    monkeypatch.setattr(finest_mip, "_MAX_BOXES", 500)
    region = {"low": [10.0, 0.0, -5.0], "high": [20.0, 5.0, 5.0], "near_m": 1.0}
    free, surface = asked_of_waves(rows, region=region)
    assert free.view == FREE_CAMERA and free.second_s is None
    # Eight metres from the box to the surface's edge, with the sharpest corner of the picture upon it.
    corner = (1.0 + np.tan(np.radians(25.0)) ** 2 * (1.0 + (WIDTH / HEIGHT) ** 2)) ** -1
    expected = 8.0 * 2.0 * np.tan(np.radians(25.0)) / HEIGHT * corner * float(surface.density.min())
    assert expected < free.texels < 3.0 * expected
    assert asked_of_waves(rows, region=region | {"near_m": 30.0})[0].texels > free.texels


def test_what_no_view_shows_asks_for_nothing() -> None:
    mesh, flight = waves(4, 2.0, 0.1), circle(60.0, 12.0)
    assert mesh.uvs is not None
    surface = surface_of(mesh, mesh.uvs, 512, 512)
    found = finest(
        views_of(flight_views_of(flight), ("camera",), None),
        [(surface, FAR_AWAY)],
    )
    assert found == FinestMip(float("inf"), None, None)


def test_density_is_the_smaller_singular_value_or_what_the_filter_s_samples_leave_of_the_larger() -> None:
    """EXT_texture_filter_anisotropic: at most 16 samples along the longer axis, so that a stretched triangle
    is never read finer than that axis over 16."""
    rng = np.random.default_rng(5)
    positions = rng.normal(size=(60, 3)).astype(np.float32)
    uvs = rng.normal(size=(60, 2)).astype(np.float32)
    uvs[30:, 1] *= 0.01
    mesh = Mesh(positions=positions, uvs=uvs, triangles=np.arange(60, dtype=np.uint32).reshape(-1, 3))
    found = surface_of(mesh, uvs, 300, 200).density
    for k, (a, b, c) in enumerate(positions.astype(np.float64).reshape(-1, 3, 3)):
        q, _ = np.linalg.qr(np.stack([b - a, c - a], axis=1))
        metres = q.T @ np.stack([b - a, c - a], axis=1)
        u = uvs.astype(np.float64).reshape(-1, 3, 2)[k] * [300, 200]
        texels = np.stack([u[1] - u[0], u[2] - u[0]], axis=1) @ np.linalg.inv(metres)
        larger, smaller = np.linalg.svd(texels)[1]
        assert found[k] == pytest.approx(max(smaller, larger / (MAX_SAMPLES * SLACK)), rel=1e-6)


def test_levels_follow_texels_with_the_slack_that_devices_are_allowed() -> None:
    for texels, level in ((0.0, 0), (1.9, 0), (2.0 * SLACK, 1), (4.0 * SLACK - 0.01, 1), (4.0 * SLACK, 2)):
        assert FinestMip(texels, 0.0, "camera").level() == level


def test_the_finest_level_of_a_mesh_is_the_one_that_the_player_takes_where_it_is_nearest() -> None:
    flight = circle(50.0, 5.0)
    views = views_of(flight_views_of(flight), ("camera",), None)
    errors = [0.0, 0.01, 0.1, 1.0]
    pixels = HEIGHT / (2.0 * np.tan(np.radians(FOV_DEG) / 2))
    planned = plan_flight(flight)
    nearest = min(float(np.linalg.norm(planned.view(t)[0])) for t in np.linspace(0, 8, 4000)) - 2.0
    expected = max(k for k, error in enumerate(errors) if error * pixels / nearest <= 1.0)
    assert 1 <= expected <= 2
    level, second, view, _ = finest_lod(views, (0.0, 0.0, 0.0), 2.0, errors, [Placement()])
    assert (level, view) == (expected, "camera") and second is not None
    assert finest_lod(views, (0.0, 0.0, 0.0), 2.0, errors, [FAR_AWAY])[0] == 3


def test_the_shaders_have_the_numbers_that_are_reckoned_with() -> None:
    def text(name: str) -> str:
        return (ROOT / name).read_text()

    terrain = text("shaders/terrain.frag")
    assert f"max(sqrt(sqrt(short_axis / max(long_axis, 1e-20))), {required_detail.SHORTEST})" in terrain
    assert "const float LUMPS = 0.19;" in terrain and "mix(shorten, 1.0, 0.6)" in terrain
    least = 0.19 * (required_detail.SHORTEST * 0.4 + 0.6)
    assert least + 1e-9 >= required_detail.LUMPS
    assert "s.far = 0.25 * s.near;" in terrain and "smoothstep(0.25, 0.95, octave - whole)" in terrain
    assert required_detail.GRAINS <= 0.25 * 4.0**0.25 + 1e-9
    assert "4.0F * repeat_m" in text("player/passes/terrain_pass.cpp")
    layers = re.search(r"layer_table\{\s*\{\{([^;]*)\}\};", text("player/passes/environment_bindings.cpp"))
    assert layers is not None
    scales = [float(found) for found in re.findall(r"\{?([\d.]+), -?[\d.]+, -?[\d.]+\}", layers[1])]
    assert {"normal": min(scales), "dudv": min(scales[:2])} == required_detail.WAVES
    assert f"textureLod(u_sky, up, {required_detail.SEA_MIP}.0 - u_sky_trimmed_mips)" in text(
        "shaders/water.frag"
    )
    bindings = text("player/passes/environment_bindings.cpp")
    assert "coarser_than_all = 2.3F;" in bindings
    assert "static_cast<float>(sky->levels()) - coarser_than_all" in bindings
    assert "(u_sky_blur + u_sky_trimmed_mips) * sqrt(sqrt(alpha)) - u_sky_trimmed_mips" in text(
        "shaders/lib/light.glsl"
    )


def test_the_finest_quality_of_the_player_is_the_one_that_is_asked_for() -> None:
    quality = (ROOT / "player/scene/quality.cpp").read_text()
    lods = f"{finest_views.COARSEST_LOD}F * file.lod_error_px, file.lod_error_px, {finest_views.FINEST_LOD}F"
    assert f"{lods} * file.lod_error_px)" in " ".join(quality.split())
    assert f"0.5F * balanced, balanced, std::max(balanced, {finest_views.FINEST_SCALE}F))" in quality
    assert f"std::min({finest_views.FINEST_SHADOW} * size, device.max_texture_px)" in quality
    assert "QualityFeature::shadow, 1, max_cascades, max_cascades)" in quality
    cascades = (ROOT / "player/scene/cascades.hpp").read_text()
    assert f"max_cascades = {finest_views.SHADOW_CASCADES};" in cascades
    assert f"cascade_ratio = {finest_views.CASCADE_RATIO};" in cascades


def test_the_finest_shadow_texel_is_an_eighteenth_of_the_one_that_the_scene_names(tmp_path: Path) -> None:
    """The map is twice as wide, and two cascades follow the first, each three times finer."""
    scene = load_scene(make_cove(tmp_path))  # 256 texels over 20 m
    assert finest_views.finest_shadow_texel_m(scene) == pytest.approx(20.0 / 256.0 / 18.0)


@pytest.fixture(scope="module", params=sweep([50.0, 90.0], test=[50.0]), ids=["narrow", "wide"])
def far(
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
    cove_store: Callable[[Path], Path],
) -> tuple[Path, Path, Path]:
    """(scene, its path-aware bake, its full bake): the cove with pictures far too fine for its flight."""
    top = tmp_path_factory.mktemp("far")
    scene = make_cove(top / "scene")
    rng = np.random.default_rng(11)
    for k, name in enumerate(("px", "nx", "py", "ny", "pz", "nz")):
        sky = rng.uniform(0.1, 0.4, (256, 256, 3)) + 0.1 * k
        write_image(scene.parent / f"{name}.exr", sky.astype(np.float32))
    for name in ("wood", "effect"):
        write_image(scene.parent / f"{name}.png", rng.integers(40, 220, (256, 256, 3), np.uint8))
    text = scene.read_text()
    for old, new in (
        (
            'name = "cove"\n',
            'name = "cove"\nviewport = [32, 18]\nlod_error_deg = 180\nlod_silhouette = 1\nlod_flip = 1\n',
        ),
        ('effect_color = "sand.png"', 'effect_color = "effect.png"'),
        ("parallax_scale = 0.01\n", ""),
        ("lods = 3\n", "lods = 3\nbleed = 0.9\n"),
        ("[flight]\n", f"[flight]\nfov_deg = {request.param}\n"),
        ("[9, 2, 0]", "[70, 14, 0]"),
        ("[0, 2, 9]", "[0, 14, 70]"),
        ("[-9, 2, 0]", "[-70, 14, 0]"),
        ("[0, 2, -9]", "[0, 14, -70]"),
    ):
        assert old in text
        text = text.replace(old, new)
    scene.write_text(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(cove_store(top / "store")))
        for report in (
            bake(scene, top / "path", BuildOptions(jobs=1)),
            full_bake(scene, top / "full", BuildOptions(jobs=1)),
        ):
            assert not report.errors, report.errors
    return scene, top / "path", top / "full"


def manifest_of(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "scene.json").read_text())
    return found


def test_a_texture_begins_at_the_finest_level_that_is_asked_for(far: tuple[Path, Path, Path]) -> None:
    scene, path, full = far
    names = ["post_color", "post_normal", "post_gloss", "effect_color", "effect_normal"]
    if "fov_deg = 90" not in scene.read_text():  # there the corners see the sky as fine as it is
        names.append("sky")
    ours, whole = manifest_of(path)["artifacts"], manifest_of(full)["artifacts"]
    for name in names:
        detail = ours[name]["required_detail"]
        left = detail["left_out"]
        assert left >= 1, name
        texture, all_of_it = (
            decode_ktx2((folder / entries[name]["file"]).read_bytes())
            for folder, entries in ((path, ours), (full, whole))
        )
        assert texture.levels == all_of_it.levels[left:]
        assert (texture.width, texture.height) == (all_of_it.width >> left, all_of_it.height >> left)
        assert detail["saved_bytes"] == whole[name]["bytes"] - ours[name]["bytes"] > 0
        assert ours[name]["levels"] == whole[name]["levels"][left:]
        assert can_cut(all_of_it.width, all_of_it.height, all_of_it.format, left)
    assert sum(entry["bytes"] for entry in ours.values()) < sum(entry["bytes"] for entry in whole.values())


MOMENTS_S = (0.0, 1.3, 2.9, 4.4, 6.1, 7.7)


MOMENTS = list(itertools.product(["balanced", "exact"], MOMENTS_S))


@pytest.mark.parametrize(("quality", "moment"), sweep(MOMENTS, test=[("balanced", MOMENTS_S[1])]))
def test_what_was_left_out_is_not_seen(
    far: tuple[Path, Path, Path], player: Run, tmp_path: Path, quality: str, moment: float
) -> None:
    _, path, full = far
    pictures = []
    for folder in (path, full):
        file = tmp_path / f"{folder.name}.png"
        done = player(folder, "--time", moment, "--quality", quality, "--screenshot", file)
        assert done.returncode == 0, done.stderr
        pictures.append(load(file))
    assert float(np.abs(pictures[0] - pictures[1]).max()) <= 1.0 / 255.0 + 1e-6
    assert float(pictures[0].std()) > 0.02


def test_a_bake_of_less_passes_check(far: tuple[Path, Path, Path], paradize: Run) -> None:
    done = paradize("check", far[1], "--format", "json")
    assert done.returncode == 0, done.stdout
    assert not [finding for finding in json.loads(done.stdout)["findings"] if finding["severity"] == "error"]


def test_a_mesh_is_cut_where_its_finer_levels_are_never_drawn(far: tuple[Path, Path, Path]) -> None:
    _, path, full = far
    ours, whole = manifest_of(path), manifest_of(full)
    left = ours["artifacts"]["post_mesh"]["required_detail"]["left_out"]
    lods, all_of_them = ours["objects"][0]["lods"], whole["objects"][0]["lods"]
    assert 1 <= left == len(all_of_them) - len(lods)
    assert [lod["error_m"] for lod in lods] == [lod["error_m"] for lod in all_of_them[left:]]
    assert [lod["node"] for lod in lods] == [f"lod{k}" for k in range(len(lods))]
    mesh = decode_glb((path / ours["artifacts"]["post_mesh"]["file"]).read_bytes())
    other = decode_glb((full / whole["artifacts"]["post_mesh"]["file"]).read_bytes())[left:]
    for one, two in zip(mesh, other, strict=True):
        assert np.array_equal(one.mesh.positions, two.mesh.positions)
        assert np.array_equal(one.mesh.triangles, two.mesh.triangles)
    assert ours["objects"][0]["radius_m"] == whole["objects"][0]["radius_m"]


@pytest.mark.deep
@pytest.mark.parametrize("far", [50.0, 90.0], ids=["narrow", "wide"], indirect=True)
def test_verify_compares_what_is_published(
    far: tuple[Path, Path, Path], tmp_path: Path, paradize: Run
) -> None:
    scene, path, _ = far
    environment = {**os.environ, "PARADIZE_STORE": str(path.parent / "store")}
    done = paradize("bake", scene, "-o", tmp_path / "out", "--verify", "100%", "--json", env=environment)
    assert done.returncode == 0, done.stderr
    manifest = manifest_of(tmp_path / "out")
    entry = manifest["artifacts"]["post_color"]
    assert entry["required_detail"]["left_out"] >= 1
    file = tmp_path / "out" / entry["file"]
    file.write_bytes(file.read_bytes()[:-1] + b"x")
    artifacts = [Artifact.from_json(row) for row in json.loads(done.stdout)["artifacts"]]
    report = provenance.BakeReport(tmp_path / "out", artifacts)
    chosen, errors = verify(scene, report, percent=100.0, options=BuildOptions(jobs=1))
    assert "post_color" in chosen and [error.place for error in errors] == ["post_color"]


def test_what_is_asked_is_kept_and_asked_once(
    far: tuple[Path, Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, path, _ = far
    monkeypatch.setenv("PARADIZE_STORE", str(path.parent / "store"))
    called: list[Any] = []
    monkeypatch.setattr("paradize.build.trim.run_build_jobs", lambda _, jobs: called.extend(jobs) or [])
    report = bake(scene, tmp_path / "again", BuildOptions(jobs=1))
    assert not report.errors and not called
    assert (tmp_path / "again" / "scene.json").read_bytes() == (path / "scene.json").read_bytes()


def test_levels_of_a_glb_are_left_out_one_by_one(far: tuple[Path, Path, Path]) -> None:
    _, _, full = far
    data = (full / manifest_of(full)["artifacts"]["post_mesh"]["file"]).read_bytes()
    count = len(decode_glb(data))
    assert (
        decode_glb(cut_glb(data))[0].mesh.positions.tobytes() == decode_glb(data)[0].mesh.positions.tobytes()
    )
    for finer in range(1, count):
        rest = cut_glb(data, finer=finer)
        assert len(decode_glb(rest)) == count - finer
        assert mesh_facts(rest, "rest").lods[0][1] == mesh_facts(data, "whole").lods[finer][1]
    for coarser in range(1, count):
        rest = cut_glb(data, coarser=coarser)
        assert mesh_facts(rest, "rest").lods == mesh_facts(data, "whole").lods[:-coarser]
    for finer, coarser in ((count, 0), (0, count), (1, count - 1)):
        with pytest.raises(ValueError, match="cannot remove"):
            cut_glb(data, finer=finer, coarser=coarser)
    bare = decode_glb(cut_glb(data, attributes=["POSITION"]))
    assert all(lod.mesh.normals is lod.mesh.uvs is lod.mesh.tangents is None for lod in bare)
