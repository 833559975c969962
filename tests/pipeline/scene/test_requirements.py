"""A scene's passes decide which maps and attributes exist at all, and nothing else is made."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from paradize.build.bake import bake
from paradize.build.materials.map_sets import find_map_sets
from paradize.build.options import BuildOptions
from paradize.checks import check_paths
from paradize.errors import ParadizeError
from paradize.formats.glb.reader import decode_glb
from paradize.formats.glb.tiles import decode_tile
from paradize.material import AlphaMode
from paradize.player_limits import VIEWS
from paradize.scene.finest_views import sun_direction
from paradize.scene.flight import plan_flight, sightings_of
from paradize.scene.jobs import BakeJob
from paradize.scene.map_sets import DrawnMaterial, MapSet, ObjectMaps, SceneMaps
from paradize.scene.pass_inputs import map_inputs, mesh_inputs
from paradize.scene.requirements import require
from paradize.scene.settings import Instance, SceneObject, View, load_scene
from paradize.scene.sightings import ObjectSighting, object_sightings
from paradize.stages.unwrappers import unwrapper_version
from tests.pipeline.glb_json import document
from tests.pipeline.scene.test_placement import matrix_of
from tests.pipeline.scenes import make_cove
from tests.places import ROOT

LIT = {"POSITION", "NORMAL"}
PAINTED = LIT | {"TEXCOORD_0", "color"}
FRAMED = PAINTED | {"TANGENT"}
# views; painted; strength of bumps; parallax; specular; alpha cutoff -> attributes and maps.
READ = [
    (VIEWS, True, 1.0, 0.01, 0.2, 0.0, FRAMED | {"normal", "height", "gloss"}),
    (VIEWS, True, 1.0, 0.0, 0.2, 0.0, FRAMED | {"normal", "gloss"}),
    (VIEWS, True, 0.0, 0.01, 0.2, 0.0, FRAMED | {"height", "gloss"}),
    (VIEWS, True, 0.0, 0.0, 0.2, 0.0, PAINTED | {"gloss"}),
    (VIEWS, True, 1.0, 0.0, 0.0, 0.0, FRAMED | {"normal"}),
    (VIEWS, True, 0.0, 0.0, 0.0, 0.0, PAINTED),
    (VIEWS, False, 1.0, 0.01, 0.2, 0.5, LIT),
    (("shadow",), True, 1.0, 0.01, 0.2, 0.0, {"POSITION"}),
    (("shadow",), True, 1.0, 0.01, 0.2, 0.5, {"POSITION", "TEXCOORD_0", "color"}),
    (("shadow",), False, 1.0, 0.01, 0.2, 0.5, {"POSITION"}),
    (("reflection",), True, 1.0, 0.0, 0.0, 0.0, FRAMED | {"normal"}),
    (("refraction",), False, 0.0, 0.0, 0.2, 0.0, LIT),
    (("camera",), True, 0.0, 0.0, 0.0, 0.5, PAINTED),
    (("camera", "shadow"), True, 0.0, 0.0, 0.0, 0.5, PAINTED),
]  # fmt: skip


@pytest.mark.parametrize(("views", "painted", "strength", "parallax", "specular", "cutoff", "read"), READ)
def test_passes_decide_which_attributes_and_maps_there_are(
    views: tuple[str, ...],
    painted: bool,
    strength: float,
    parallax: float,
    specular: float,
    cutoff: float,
    read: set[str],
) -> None:
    wood = DrawnMaterial(
        parallax_scale=parallax, specular=specular, alpha_mode="mask" if cutoff else "opaque"
    )
    item = SceneObject(name="post", mesh=Path("post.obj"), instances=())
    pictures = {"color": Path("wood.png")} if painted else {}
    one = MapSet("post", {"post": ("wood",)}, pictures, strength=strength)
    maps = SceneMaps((one,), {"post": ObjectMaps({"wood": wood}, {"wood": one})})
    found = map_inputs(one, one.materials, maps, {"post": views})
    found |= mesh_inputs(item, maps.objects["post"], views, found)
    assert found.keys() == read
    assert all(found.values())


def jobs_by_name(scene: Path) -> dict[str, BakeJob]:
    known = load_scene(scene)
    return {job.name: job for job in require(known, find_map_sets(known, scene).maps).jobs}


def names(scene: Path) -> set[str]:
    return {output.artifact for job in jobs_by_name(scene).values() for output in job.outputs if output.kind}


def edited(folder: Path, *changes: tuple[str, str]) -> Path:
    scene = make_cove(folder)
    text = scene.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    scene.write_text(text)
    return scene


def test_without_a_pass_there_is_nothing_that_only_it_reads(tmp_path: Path) -> None:
    whole = names(make_cove(tmp_path / "whole"))
    water = ('[water]\nwaves = "waves.png"\n', "")
    cases: dict[str, tuple[set[str], tuple[str, str]]] = {
        "water": ({"water_normal", "water_dudv"}, water),
        "parallax": ({"post_height"}, ("parallax_scale = 0.01\n", "")),
        "shine": ({"post_gloss"}, ("specular = 0.2\n", "")),
        "grain": ({"sand_normal"}, ("sand_strength = 0.5\n", "")),
        "effect": ({"effect_color", "effect_normal"}, ('effect_color = "sand.png"\n', "")),
        "sound": ({"sound"}, ('[sound]\nfile = "sea.ogg"\n', "")),
    }
    for name, (gone, change) in cases.items():
        assert names(edited(tmp_path / name, change)) == whole - gone, name


def test_an_object_that_only_casts_a_shadow_is_depth_alone(tmp_path: Path) -> None:
    shadow = ("lods = 3\n", 'lods = 3\nviews = ["shadow"]\n')
    scene = edited(tmp_path / "solid", shadow)
    found = jobs_by_name(scene)
    assert {name for name in found if name.startswith("post")} == {"post mesh"}
    (output,) = found["post mesh"].outputs
    assert output.passes == ("shadow",)
    assert output.reason == "the object post: its shadow"
    leaves = edited(tmp_path / "leaves", shadow, ("specular = 0.2\n", "alpha_cutoff = 0.5\n"))
    assert {name for name in jobs_by_name(leaves) if name.startswith("post")} == {"post mesh", "post colour"}


def test_a_baked_mesh_holds_what_is_read_and_no_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cove_store: Callable[[Path], Path]
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    for name, change, attributes in (
        ("all", ("lods = 3\n", "lods = 2\n"), LIT | {"TEXCOORD_0", "TANGENT"}),
        ("shadow", ("lods = 3\n", 'lods = 2\nviews = ["shadow"]\n'), {"POSITION"}),
    ):
        scene = edited(tmp_path / name, change)
        report = bake(scene, tmp_path / name / "out", BuildOptions(jobs=1))
        assert not report.errors, report.errors
        manifest = json.loads((tmp_path / name / "out" / "scene.json").read_text())
        assert manifest["objects"][0]["views"] == (["shadow"] if name == "shadow" else list(VIEWS))
        tree = document((tmp_path / name / "out" / manifest["artifacts"]["post_mesh"]["file"]).read_bytes())
        for mesh in tree["meshes"]:
            assert all(primitive["attributes"].keys() == attributes for primitive in mesh["primitives"])


def test_a_terrain_without_relief_has_no_tangents(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cove_store: Callable[[Path], Path]
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    plain = (
        ("sand_strength = 0.5\n", ""),
        ("sand_repeat = 8.0\n", "sand_repeat = 8.0\neffect_strength = 0.0\n"),
    )
    for name, changes, there in (
        ("plain", plain, False),
        ("codes", (*plain, ("max_error_m = 0.05\n", "max_error_m = 0.05\nquantise = true\n")), False),
        ("grain", plain[1:], True),
    ):
        assert jobs_by_name(edited(tmp_path / name, *changes))["terrain"].settings["tangents"] is there
        scene, out = edited(tmp_path / name, *changes), tmp_path / name / "out"
        assert not bake(scene, out, BuildOptions(jobs=1)).errors
        manifest = json.loads((out / "scene.json").read_text())
        tile = (out / manifest["artifacts"]["terrain_mesh"]["file"]).read_bytes()
        assert all((patch.mesh.tangents is not None) == there for patch in decode_tile(tile))
        assert not [finding for finding in check_paths([out]) if finding.severity == "error"]


@pytest.mark.parametrize("views", [(0.5, 0.25), (0.25, 2.0), (1.0, None)])
def test_the_flight_meets_an_object_where_its_instances_stand(
    tmp_path: Path, views: tuple[float, float | None]
) -> None:
    """Turned by a matrix of numpy's, scaled and moved; the earliest sight and the largest pixel count."""
    scene = load_scene(make_cove(tmp_path))
    stands = (
        Instance(position=(6.0, 0.5, 1.5), yaw_deg=35.0, scale=2.0),
        Instance(position=(5.0, 0.0, -3.0), yaw_deg=-110.0, roll_deg=20.0, scale=(0.5, -0.4, 0.3)),
    )
    gone = Instance(position=(0.0, 500.0, 0.0))
    post = scene.objects[0]
    items = (replace(post, instances=stands), replace(post, name="gone", instances=(gone,)))
    mirror, refraction = views
    scene = replace(
        scene,
        objects=items,
        reflection=View(scale=mirror),
        refraction=None if refraction is None else View(scale=refraction),
    )
    center, radius = np.array([4.0, 0.5, 1.5]), 0.25
    flight = plan_flight(scene.flight)
    spheres = []
    for stand in stands:
        x, y, z = (matrix_of(stand) @ center + stand.position).tolist()
        spheres.append(((x, y, z), np.max(np.abs(stand.scale)) * radius))
    width, height = scene.head.viewport
    seen = sightings_of(flight, scene.flight.fov_deg, width / height, spheres)
    assert all(one.seen for one in seen) and seen[0].first_seen_s != seen[1].first_seen_s
    tangent = np.tan(np.radians(scene.flight.fov_deg) / 2)
    rows = height * min(1.0, mirror, refraction or 1.0)
    pixels = [
        2 * one.farthest_seen_m * tangent / rows / np.max(np.abs(stand.scale))
        for one, stand in zip(seen, stands, strict=True)
    ]
    assert pixels[1] > 1.5 * pixels[0]
    for order in (stands, stands[::-1]):
        known = replace(scene, objects=(replace(post, instances=order), items[1]))
        sightings = object_sightings(
            known, flight, dict.fromkeys(("post", "gone"), (tuple(center.tolist()), radius))
        )
        assert sightings["post"].first_s == min(one.first_seen_s for one in seen)
        assert sightings["post"].pixel_m == pytest.approx(max(pixels), rel=1e-9)
        assert sightings["gone"] == ObjectSighting(flight.duration_s, None)


def test_the_sun_stands_where_its_angles_say() -> None:
    """Azimuth from north (-Z) towards east (+X)."""
    for azimuth, elevation, there in (
        (0.0, 0.0, (0.0, 0.0, -1.0)),
        (90.0, 0.0, (1.0, 0.0, 0.0)),
        (200.0, 90.0, (0.0, 1.0, 0.0)),
        (30.0, 60.0, (0.25, 0.75**0.5, -(0.1875**0.5))),
    ):
        assert sun_direction(azimuth, elevation) == pytest.approx(there, abs=1e-12)


def test_what_is_seen_of_the_ground_follows_from_the_views_that_there_are(tmp_path: Path) -> None:
    def flight_views_with(name: str, *changes: tuple[str, str]) -> dict[str, object]:
        found: dict[str, object] = jobs_by_name(edited(tmp_path / name, *changes))["terrain"].settings[
            "flight_views"
        ]
        return found

    whole = flight_views_with("whole", ("[water]\n", "[water]\nlevel_m = 0.25\n"))
    assert (whole["mirror_m"], whole["water_m"], whole["viewport"]) == (0.25, 0.25, [1280, 720])
    assert whole["shadow"] == {"extent_m": 20.0, "center": [0.0, 0.0, 0.0]} and "region" not in whole
    assert flight_views_with("flat", ("[refraction]\n", ""))["water_m"] is None
    assert flight_views_with("dull", ("[reflection]\n", ""))["mirror_m"] is None
    assert flight_views_with("dark", ("[shadow]\nsize = 256\nextent_m = 20.0\n", ""))["shadow"] is None
    large = ('name = "cove"\n', 'name = "cove"\nlargest_viewport = [2560, 720]\n')
    assert flight_views_with("large", large)["viewport"] == [2560, 720]
    region = "[free_camera]\nlow = [0, 2, 0]\nhigh = [1, 2, 1]\n"
    free = flight_views_with("free", ("[reflection]\n", f"{region}[reflection]\n"))
    assert free["region"] == {"low": (0.0, 2.0, 0.0), "high": (1.0, 2.0, 1.0), "near_m": 1.0}


def test_of_several_alpha_cutoffs_the_colour_map_keeps_the_least(tmp_path: Path) -> None:
    more = "alpha_cutoff = 0.7\n[object.material.leaf]\nalpha_cutoff = 0.3\n[object.material.bark]\n"
    scene = edited(tmp_path, ("parallax_scale = 0.01\n", more))
    model = scene.parent / "post.obj"
    before, face, last = model.read_text().rpartition("\nf ")
    model.write_text(f"{before}\nusemtl leaf{face}{last}")
    assert jobs_by_name(scene)["post colour"].settings["alpha_cutoff"] == 0.3
    assert jobs_by_name(make_cove(tmp_path / "none"))["post colour"].settings["alpha_cutoff"] == 0.5


def test_shaders_read_no_attribute_that_the_table_leaves_out() -> None:
    """The light's reads places, coordinates and the alpha of colours alone."""
    inputs = {}
    for name in ("object", "depth"):
        text = (ROOT / "shaders" / f"{name}.vert").read_text()
        inputs[name] = set(re.findall(r"^layout\(location = \d\) in \w+ (\w+);", text, re.MULTILINE))
    assert inputs == {
        "object": {"position", "normal", "tangent", "uv0", "uv1", "color", "sway"},
        "depth": {"position", "uv0", "color", "sway"},
    }


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[shadow]\nsize = 256\nextent_m = 20.0\n", "", "object[0].views: draws it nowhere"),
        ('name = "cove"\n', 'name = "cove"\nlargest_viewport = [1280, 719]\n', "largest_viewport[1]: is 719"),
        ("[reflection]\n", "[free_camera]\nlow = [0, 5, 0]\nhigh = [1, 4, 1]\n", "free_camera.low[1]: is 5"),
    ],
)
def test_what_cannot_be_is_told_with_its_place(tmp_path: Path, old: str, new: str, message: str) -> None:
    scene = edited(tmp_path, (old, new), ("lods = 3\n", 'lods = 3\nviews = ["shadow"]\n'))
    with pytest.raises(ParadizeError, match=re.escape(message)):
        load_scene(scene)


@pytest.mark.skipif(unwrapper_version("xatlas") is None, reason="xatlas is not installed")
def test_an_object_names_its_unwrapper_and_its_row_tells_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cove_store: Callable[[Path], Path]
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    named = ('name = "post"\n', 'name = "post"\nunwrapper = "xatlas"\n')
    with pytest.raises(ParadizeError, match=r"object\[0\].unwrapper: .*'magic'.*paradize, xatlas"):
        load_scene(edited(tmp_path / "magic", (named[0], named[1].replace("xatlas", "magic"))))
    scene = edited(tmp_path / "bare", named)
    post = scene.parent / "post.obj"
    lines = [line for line in post.read_text().splitlines() if not line.startswith("vt ")]
    post.write_text("\n".join(re.sub(r"/\d+", "", line) for line in lines) + "\n")
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not report.errors
    row = next(row for row in report.rows if row["name"] == "post_mesh")
    assert row["reason"] == f"UV layout by xatlas {unwrapper_version('xatlas')}"
    assert not [one for one in check_paths([tmp_path / "out"]) if one.severity == "error"]


def test_an_object_names_its_simplifier_and_its_row_tells_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cove_store: Callable[[Path], Path]
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    changes = ('name = "post"\n', 'name = "post"\nsimplifier = "meshoptimizer"\n')
    with pytest.raises(
        ParadizeError, match=r"object\[0\].simplifier: .*'magic'.*paradize, meshoptimizer, fast"
    ):
        load_scene(edited(tmp_path / "magic", (changes[0], changes[1].replace("meshoptimizer", "magic"))))
    rows = []
    for name, more in (("ours", ()), ("theirs", (changes,))):
        scene, out = edited(tmp_path / name, *more), tmp_path / name / "out"
        report = bake(scene, out, BuildOptions(jobs=1, whole=True))  # the coarser level too
        assert not report.errors
        rows.append(next(row for row in report.rows if row["name"] == "post_mesh"))
        assert not [one for one in check_paths([out]) if one.severity == "error"]
    assert rows[0]["reason"] is None and rows[1]["reason"].startswith("levels by meshoptimizer 0.")
    assert [row["status"] for row in rows] == ["reused", "baked"], "each is a job of its own"
    assert rows[0]["sha256"] != rows[1]["sha256"]


@pytest.mark.parametrize(
    ("vertex_colors", "mode", "views", "read"),
    [
        (True, "opaque", ("camera", "shadow"), True),
        (True, "opaque", ("shadow",), False),
        (True, "blend", ("shadow",), True),
        (False, "blend", ("camera",), False),
    ],
)
def test_vertex_colours_are_kept_where_a_view_reads_them(
    vertex_colors: bool, mode: AlphaMode, views: tuple[str, ...], read: bool
) -> None:
    item = SceneObject(name="post", mesh=Path("post.obj"), instances=())
    wood = DrawnMaterial(alpha_mode=mode, vertex_colors=vertex_colors)
    assert ("COLOR_0" in mesh_inputs(item, ObjectMaps({"wood": wood}), views, ())) is read


@pytest.mark.parametrize("tint", ["0.2 0.5 0.8", "1 1 1"])
def test_a_baked_scene_has_the_vertex_colours_of_its_models_unless_they_are_white(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cove_store: Callable[[Path], Path], tint: str
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    scene = make_cove(tmp_path / "cove")
    model = scene.parent / "post.obj"
    model.write_text(re.sub(r"^(v .*)$", rf"\1 {tint}", model.read_text(), flags=re.MULTILINE))
    report = bake(scene, tmp_path / "out", BuildOptions())
    assert not report.errors
    baked = json.loads((tmp_path / "out/scene.json").read_text())
    tinted = tint != "1 1 1"
    (post,) = baked["objects"]
    assert [one["vertex_colors"] for one in post["materials"].values()] == [tinted]
    glb = (tmp_path / "out" / baked["artifacts"][post["mesh"]]["file"]).read_bytes()
    for lod in decode_glb(glb, "post"):
        assert (lod.mesh.colors is not None) is tinted
        if lod.mesh.colors is not None:
            expected = [((c + 0.055) / 1.055) ** 2.4 for c in (0.2, 0.5, 0.8)]  # the files hold sRGB
            assert np.allclose(lod.mesh.colors, [*expected, 1.0], atol=1e-6)
