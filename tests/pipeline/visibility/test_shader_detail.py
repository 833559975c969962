"""The required detail of a map includes what shaders do beside sampling it by its coordinates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.build import trim
from paradize.build.manifest import MeshFacts
from paradize.build.measurements.required_detail import (
    GRAINS,
    LUMPS,
    REFERENCE_REPEATS,
    SHORTEST,
    measure_required_detail,
)
from paradize.build.options import BuildOptions
from paradize.build.trim import find_required_detail, gutter_without_finest
from paradize.data import Lod, Mesh, Texture
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.tiles import TilePatch, encode_tiles
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.scene.map_sets import DrawnMaterial, MapSet, ObjectMaps, SceneMaps
from paradize.scene.placement import placed
from paradize.scene.settings import Instance, load_scene
from paradize.store.local import Store
from paradize.visibility.finest_mip import Placement, finest, surface_of
from paradize.visibility.query import Sphere
from paradize.visibility.texel_footprint import views_of
from tests.pipeline.scenes import make_cove
from tests.pipeline.visibility.test_required_detail import (
    FOV_DEG,
    HEIGHT,
    WIDTH,
    circle,
    flight_views_of,
    waves,
)

TANGENT = float(np.tan(np.radians(FOV_DEG) / 2))
PIXEL = 2.0 * TANGENT / HEIGHT  # width at one metre straight ahead
CORNER = 1.0 / (1.0 + TANGENT**2 * (1.0 + (WIDTH / HEIGHT) ** 2))  # squared cosine to the picture's corner


def required(flight_views: dict[str, Any], **parts: Any) -> dict[str, dict[str, Any]]:
    plain: dict[str, Any] = {"objects": {}, "terrain": None, "water": None, "sky": None}
    return measure_required_detail(flight_views=flight_views | {"light_m": None}, **plain | parts)


def test_the_sky_is_asked_for_by_the_camera_by_what_mirrors_it_and_by_what_shines() -> None:
    flight_views, cube = flight_views_of(circle(60.0, 12.0)), {"side": 8192, "levels": 14, "smoothest": None}
    texels = 0.5 * 8192 * PIXEL * CORNER
    water = {"textures": {}, "level_m": 0.0, "size_m": 100.0, "repeat": 10.0}

    def level(more: dict[str, Any], **parts: Any) -> int:
        return int(required(flight_views, sky=cube | more, **parts)["sky"]["level"])

    assert required(flight_views, sky=cube)["sky"]["texels"] == pytest.approx(texels, rel=1e-5)
    assert level({}) == 3
    assert 8 * 2**0.5 <= texels < 16 * 2**0.5
    assert level({}, water=water) == 2  # shaders/water.frag
    # The square root of 1 - smoothness of 14 - 2.3 levels.
    for smoothest, found in ((0.99, 1), (0.95, 2), (0.5, 3), (0.0, 3)):
        assert level({"smoothest": smoothest}) == found
    sharp = flight_views | {"mirror_m": 0.0, "scales": {"reflection": 2.0}}
    assert required(sharp, sky=cube)["sky"]["texels"] == pytest.approx(0.5 * texels, rel=1e-5)
    dull = flight_views | {"mirror_m": 0.0, "scales": {"reflection": 0.5}}
    assert required(dull, sky=cube)["sky"]["texels"] == pytest.approx(texels, rel=1e-5)


def test_waves_are_asked_for_along_their_shorter_side_and_wholly_from_under_water() -> None:
    water = {"level_m": 0.0, "size_m": 400.0, "repeat": 5.0}
    sizes = {"water_dudv": (4096, 1024), "water_normal": (1024, 4096)}
    found = required(flight_views_of(circle(60.0, 30.0)), water=water | {"textures": sizes})
    square = required(
        flight_views_of(circle(60.0, 30.0)), water=water | {"textures": {"water_dudv": (1024, 1024)}}
    )
    assert len(found["water_dudv"].pop("levels_s")) == 13  # it has two mips more than the square
    assert len(square["water_dudv"].pop("levels_s")) == 11
    assert found["water_dudv"] == square["water_dudv"]
    assert found["water_normal"]["texels"] == pytest.approx(0.137 * found["water_dudv"]["texels"], rel=1e-4)
    below = required(flight_views_of(circle(60.0, -3.0)), water=water | {"textures": sizes})
    assert below["water_dudv"]["texels"] == below["water_normal"]["texels"] == 0.0
    assert found["water_dudv"]["texels"] > 0.01


def test_sand_is_asked_for_as_grains_as_lumps_and_no_farther_than_its_reference() -> None:
    """Far grains are as wide as at a share of the reference, where the ground's texels are sparsest."""
    mesh = waves(6, 20.0, 0.4)
    count = len(mesh.positions)
    assert mesh.uvs is not None
    ground = replace(
        mesh, normals=np.tile(np.float32([0, 1, 0]), (count, 1)), uvs1=mesh.uvs, uvs=3 * mesh.uvs, groups=()
    )
    ((tile, _),) = encode_tiles([TilePatch(0, ground, 0.0, True)])
    sizes = dict.fromkeys(("sand_color", "sand_normal", "effect_color"), (256, 256))

    def texels(repeat_m: float) -> tuple[float, float, float]:
        result = {"textures": sizes, "tiles": [tile], "repeat_m": repeat_m}
        found = required(flight_views_of(circle(60.0, 12.0)), terrain=result)
        color, normal, effect = (found[name]["texels"] for name in sizes)
        return color, normal, effect

    views = views_of(flight_views_of(circle(60.0, 12.0)), ("camera",), None)
    sand, once = (
        finest(views, [(surface_of(ground, uvs, 256, 256), Placement())]).texels
        for uvs in (3 * mesh.uvs, mesh.uvs)
    )
    color, normal, effect = texels(1e6)
    assert (color, effect) == pytest.approx((SHORTEST * sand, once), rel=1e-4)
    assert normal == pytest.approx(LUMPS * sand, rel=1e-4)
    least = float(surface_of(ground, 3 * mesh.uvs, 256, 256).density.min())
    near, lumps, _ = texels(0.5)
    assert near == pytest.approx(
        SHORTEST * GRAINS * REFERENCE_REPEATS * 0.5 * PIXEL * CORNER * least, rel=1e-4
    )
    assert near == lumps < 0.2 * color


def thing(
    fine: Mesh, coarse: Mesh, *, size: tuple[int, int] = (1024, 512), spread: float = 0.0, **more: Any
) -> dict[str, Any]:
    glb = encode_glb((Lod(fine, 0.0, 0.0), Lod(coarse, 0.5, 0.1)), "thing")
    texture = {"size": size, "materials": ("default",), "spread": spread}
    result = {"glb": glb, "textures": {"a_color": texture}, "drawn": ("camera",)}
    result |= {"instances": [placed(Instance())]}
    return result | {"center": (0.0, 0.0, 0.0), "radius_m": 8.0, "errors_m": [0.0, 0.4]} | more


def test_parallax_moves_samples_by_a_share_of_the_longer_side() -> None:
    mesh, flight_views = waves(6, 8.0, 0.3), flight_views_of(circle(60.0, 12.0))
    plain, moved = (
        required(flight_views, objects={"a": thing(mesh, mesh, spread=spread)})["a_color"]["texels"]
        for spread in (0.0, 0.001)
    )
    assert plain > 2.0 and plain - moved == pytest.approx(1.024, rel=0.15)  # both are bounds


@pytest.mark.parametrize(("scale", "error_m"), [(0.25, 40.0), (4.0, 0.2)])
def test_a_coarse_level_is_not_seen_nearer_than_its_error_allows(scale: float, error_m: float) -> None:
    """Its texels lie so sparsely that it decides. Of a mesh of another scale the error is as much larger and
    its texels as much sparser, which cancels."""
    fine, flight_views = waves(6, 8.0, 0.3), flight_views_of(circle(60.0, 12.0))
    assert fine.uvs is not None
    sparse = (0.01 * fine.uvs).astype(np.float32)
    stand = placed(Instance(scale=scale))
    found, alone = (
        required(
            flight_views,
            objects={"a": thing(fine, coarse, instances=[stand], errors_m=[0.0, error_m], size=(128, 64))},
        )
        for coarse in (replace(fine, uvs=sparse), fine)
    )
    least = float(surface_of(fine, sparse, 128, 64).density.min())
    assert found["a_color"]["texels"] == pytest.approx(error_m * CORNER * least, rel=1e-3)
    assert found["a_color"]["texels"] < 0.5 * alone["a_color"]["texels"]


def test_a_finer_picture_of_mirror_or_refraction_covers_less() -> None:
    ball = Sphere((1.0, 0.0, 2.0), 0.5)
    for name, view in (("reflection", "mirror"), ("refraction", "refraction")):
        found = []
        for scale in (1.0, 0.25):
            flight_views = flight_views_of(
                circle(30.0, 12.0), mirror_m=-1.0, water_m=2.0, scales={name: scale}
            )
            views = views_of(flight_views, (name,), None)
            found.append(views.covered(ball, views.query.runs)[view])
        assert np.isfinite(found[0]).any()
        assert np.array_equal(found[1], 4.0 * found[0])


def test_facts_of_gutters_are_those_of_the_levels_that_stay() -> None:
    facts = {
        "needed_texels": 24.0,
        "width_texels": 10.0,
        "level_in_use": 4,
        "level_by_width": 2,
        "max_level": 5,
    }
    facts |= {"bleed_p99": [0.1, 0.2, 0.3, 0.4], "bleed_max": [0.5, 0.6, 0.7, 0.8], "bound": 0.125}
    assert gutter_without_finest(facts, 2) == {
        "needed_texels": 6.0, "width_texels": 2.5, "level_in_use": 2, "level_by_width": 0, "max_level": 3,
        "bleed_p99": [0.3, 0.4], "bleed_max": [0.7, 0.8], "bound": 0.125,
    }  # fmt: skip
    found = gutter_without_finest(facts | {"width_texels": None, "max_level": None, "level_in_use": 1}, 3)
    assert (found["width_texels"], found["max_level"], found["level_in_use"]) == (None, None, 0)
    assert (found["needed_texels"], found["level_by_width"]) == (3.0, -1)


def test_what_is_asked_of_is_what_the_scene_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The steepest parallax, the smoothest of what shines, and the sand's repeats along X."""
    scene = load_scene(make_cove(tmp_path))
    drawn = {
        "wood": DrawnMaterial(parallax_scale=0.01, specular=0.5, smoothness=0.7),
        "tin": DrawnMaterial(parallax_scale=0.03, specular=0.2, smoothness=0.8),
        "felt": DrawnMaterial(smoothness=0.99),
    }
    one = MapSet("post", {"post": ("wood", "tin")})
    maps = SceneMaps((one,), {"post": ObjectMaps(drawn)})
    assert scene.terrain is not None
    scene = replace(
        scene,
        terrain=replace(scene.terrain, size_m=(20.0, 50.0), sand_repeat=8.0, wet_smoothness=0.6),
    )
    texture = encode_ktx2(Texture("R8_UNORM", 8, 4, (bytes(32), bytes(8), bytes(2), bytes(1))))
    names = ("post_mesh", "post_color", "post_height", "terrain_mesh", "sand_color", "water_normal", "sky")
    data = dict.fromkeys(names, texture)
    jobs: list[Any] = []
    monkeypatch.setattr(trim, "run_build_jobs", lambda how, found: jobs.extend(found) or [])
    facts = {"post_mesh": MeshFacts((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (("lod0", 0.0),), {}, (0.0,))}
    with pytest.raises(ValueError):  # no outcomes: nobody works
        find_required_detail(
            Store(tmp_path / "store"),
            scene,
            maps,
            data,
            dict.fromkeys(names, "0" * 64),
            facts,
            BuildOptions(jobs=1),
        )
    post, rest = (job.arguments for job in jobs)
    lies = {"size": (8, 4), "materials": ("wood", "tin"), "spread": 0.03, "lit": False, "second": False}
    assert post["objects"]["post"]["textures"] == {"post_color": lies, "post_height": lies}
    assert rest["sky"] == {"side": 8, "levels": 4, "smoothest": 0.8}
    assert rest["terrain"]["repeat_m"] == 2.5
