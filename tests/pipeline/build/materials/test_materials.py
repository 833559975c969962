"""An object of several materials: each has its own maps, and what is equal is baked once."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers.maps.bake import bake_maps
from paradize.build.bake import bake
from paradize.build.materials.drawn_materials import authored_fields, drawn
from paradize.build.materials.map_sets import find_map_sets
from paradize.build.materials.model_facts import read_model_facts
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.checks import check_paths
from paradize.errors import SceneError, SourceError
from paradize.explain.facts import explain
from paradize.export.scene import export
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.png import decode_png
from paradize.material import MapSource, Material, Picture
from paradize.metrics.texels import decode_texels
from paradize.new.scene import new_scene
from paradize.scene.pass_inputs import unread_pictures
from paradize.scene.settings import load_scene
from paradize.scene.settings.objects import ObjectMaterial
from tests.pipeline.material_scene import SCENE, make_panels, noise, squares
from tests.pipeline.scenes import write_image
from tests.sweeps import sample

PANELS = {
    "panel_wood_color", "panel_wood_normal", "panel_metal_color", "panel_metal_gloss",
    "panel_metal_occlusion", "panel_leaf_color",
}  # fmt: skip


@pytest.fixture(scope="module")
def module_store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("store")


@pytest.fixture(autouse=True)
def shared_store(module_store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One for all these tests, most of which bake the same panels with one change."""
    monkeypatch.setenv("PARADIZE_STORE", str(module_store))


@pytest.fixture
def own_store(shared_store: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """For a test that judges which artifacts are baked."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))


def baked(scene: Path, out: Path, jobs: int = 1) -> tuple[BakeReport, dict[str, Any]]:
    report = bake(scene, out, BuildOptions(jobs=jobs))
    assert not report.errors, report.errors
    return report, json.loads((out / "scene.json").read_text())


def edited(scene: Path, old: str, new: str) -> Path:
    text = scene.read_text()
    assert old in text
    scene.write_text(text.replace(old, new, 1))
    return scene


def test_each_material_has_the_maps_that_its_pictures_make_and_check_finds_nothing(tmp_path: Path) -> None:
    report, manifest = baked(make_panels(tmp_path / "s", lods=2), tmp_path / "out")
    assert {one.name for one in report.artifacts if one.kind == "texture"} == PANELS
    (item,) = manifest["objects"]
    maps = {name: {k for k, v in one["maps"].items() if v} for name, one in item["materials"].items()}
    assert maps == {
        "wood": {"color", "normal"},
        "metal": {"color", "gloss", "occlusion"},
        "leaf": {"color"},
    }
    leaf, metal, wood = (item["materials"][name] for name in ("leaf", "metal", "wood"))
    assert (leaf["alpha_mode"], wood["alpha_mode"]) == ("mask", "opaque")
    assert metal["metalness"] == 1.0 and wood["metalness"] == 0.0
    assert any("'leaf'" in text and "mask" in text for text in report.warnings)
    found = list(check_paths([tmp_path / "out"]))
    assert not found, found


@pytest.mark.parametrize("grey", [102, 255])
def test_an_occlusion_picture_of_one_grey_darkens_as_one_texel_and_white_makes_no_map(
    tmp_path: Path, grey: int
) -> None:
    scene = make_panels(tmp_path / "s")
    write_image(tmp_path / "s/orm.png", np.full((64, 64, 3), (grey, 128, 51), np.uint8))
    report, manifest = baked(scene, tmp_path / "out")
    metal = manifest["objects"][0]["materials"]["metal"]
    assert metal["occlusion_strength"] == 1.0
    if grey == 255:
        assert metal["maps"]["occlusion"] is None and metal["metalness"] == pytest.approx(0.2)
    else:
        (made,) = (one for one in report.artifacts if one.name == metal["maps"]["occlusion"])
        texture = decode_ktx2((tmp_path / "out" / made.file).read_bytes())
        assert (texture.width, texture.height) == (1, 1) and metal["metalness"] == 1.0
        assert decode_texels(texture, 0)[0, 0, :2] == pytest.approx([0.4, 0.2], abs=1e-6)
    found = list(check_paths([tmp_path / "out"]))
    assert not found, found


def require_gloss_widens_by_normals(scene: Path, out: Path) -> None:
    """Bakes the scene, whose wood has normals and gloss: it is rougher in its mips; no finding."""
    report, manifest = baked(scene, out)
    maps = manifest["objects"][0]["materials"]["wood"]["maps"]
    assert maps["normal"] and maps["gloss"]
    found = list(check_paths([out]))
    assert not found, found
    (gloss,) = (one for one in report.artifacts if one.name == maps["gloss"])
    assert max(level["width_mean_deg"] for level in gloss.levels) < 1.0
    texture = decode_ktx2((out / gloss.file).read_bytes())
    fine, coarse = (float(decode_texels(texture, level)[:, :, 1].mean()) for level in (0, 2))
    assert coarse < fine - 0.1


@pytest.mark.parametrize(
    ("picture", "size", "tiled"),
    sample([("height", 64, True), ("height", 48, False), ("color", 64, False)], every=3),
)
def test_drawn_gloss_widens_by_the_normals_that_are_made_beside_it(
    tmp_path: Path, picture: str, size: int, tiled: bool
) -> None:
    scene = make_panels(tmp_path / "s")
    grains = np.random.default_rng(7).normal(0.0, 60.0, (size, size, 1))
    grains = sum(np.roll(grains, (k // 3, k % 3), (0, 1)) for k in range(9)) / 3.0
    rough = np.clip(grains + 128.0, 0.0, 255.0).astype(np.uint8)
    made_of = "map_Kd bumps.png" if picture == "color" else "map_Bump -bm 0.02 bumps.png"
    write_image(tmp_path / "s/bumps.png", rough.repeat(3, axis=2))
    write_image(tmp_path / "s/smooth.png", noise(8, 1) // 8)
    (tmp_path / "s/panel.mtl").write_text(f"newmtl wood\n{made_of}\nmap_Pr smooth.png\nPm 1\n")
    uvs = {"low": 0.0, "high": 2.5} if tiled else {}
    (tmp_path / "s/panel.obj").write_text(squares(["wood"], "panel.mtl", **uvs))
    text = scene.read_text().split("[object.material.metal]")
    strength = "strength = 3.0\n" if picture == "color" else ""
    scene.write_text(text[0] + strength + "[[object.instance]]" + text[1].split("[[object.instance]]")[1])
    require_gloss_widens_by_normals(scene, tmp_path / "out")


@pytest.mark.parametrize("bumps", ["map_Bump -bm 0.02 bumps.png", "norm wood_n.png"])
@pytest.mark.parametrize(("size", "high"), sample([(64, 0.9), (48, 2.5)], every=2))
def test_gloss_made_of_the_colour_widens_by_the_normals_beside_it(
    tmp_path: Path, bumps: str, size: int, high: float
) -> None:
    scene = make_panels(tmp_path / "s")
    grains = np.random.default_rng(7).normal(0.0, 60.0, (size, size, 1))
    rough = np.clip(grains + 128.0, 0.0, 255.0).astype(np.uint8)
    write_image(tmp_path / "s/bumps.png", rough.repeat(3, axis=2))
    tilt = np.random.default_rng(8).uniform(-0.7, 0.7, (size, size, 2))
    normals = np.dstack([tilt, np.sqrt(1.0 - (tilt**2).sum(axis=2, keepdims=True))])
    write_image(tmp_path / "s/wood_n.png", np.asarray(np.round(127.5 * normals + 127.5), np.uint8))
    write_image(tmp_path / "s/wood.png", 255 - noise(1) // 8)
    (tmp_path / "s/panel.mtl").write_text(f"newmtl wood\nmap_Kd wood.png\n{bumps}\n")
    (tmp_path / "s/panel.obj").write_text(squares(["wood"], "panel.mtl", high=high))
    text = scene.read_text().split("[object.material.metal]")
    shine = "[object.material.wood]\nspecular = 0.8\n[[object.instance]]"
    scene.write_text(text[0] + shine + text[1].split("[[object.instance]]")[1])
    require_gloss_widens_by_normals(scene, tmp_path / "out")


@pytest.mark.deep  # of the cove: tests/pipeline/build/test_same_bytes.py
@pytest.mark.usefixtures("own_store")
def test_the_bytes_do_not_depend_on_the_number_of_workers(tmp_path: Path) -> None:
    scene = make_panels(tmp_path / "s", lods=2)
    names = []
    for jobs in (1, 2):
        shutil.rmtree(tmp_path / "store", ignore_errors=True)
        _, manifest = baked(scene, tmp_path / f"out{jobs}", jobs)
        names.append((tmp_path / f"out{jobs}" / "scene.json").read_bytes())
        assert manifest["artifacts"].keys() >= PANELS
    assert names[0] == names[1]


def test_of_packed_pictures_each_map_takes_its_channel(tmp_path: Path) -> None:
    """Occlusion in red, roughness in green, metalness in blue, as glTF packs them."""
    scene = make_panels(tmp_path / "s")
    _, manifest = baked(scene, tmp_path / "out")
    picture = decode_png(tmp_path / "s" / "orm.png").astype(np.float64) / 255.0

    def mean(name: str) -> Any:
        return level_0(tmp_path / "out", manifest, name)[20:44, 20:44].mean(axis=(0, 1))

    inside = picture[20:44, 20:44].mean(axis=(0, 1))
    assert mean("panel_metal_occlusion")[:2] == pytest.approx(inside[[0, 2]], abs=0.03)
    assert mean("panel_metal_gloss")[1] == pytest.approx(1.0 - inside[1], abs=0.03)


def test_a_picture_of_the_scene_counts_whole_whatever_the_factors_of_the_model(tmp_path: Path) -> None:
    """They are the factors of the maps that it replaces."""
    scene = make_panels(tmp_path / "s")
    _, first = baked(scene, tmp_path / "first")
    edited(tmp_path / "s" / "panel.mtl", "map_Kd metal.png\n", "map_Kd metal.png\nPm 0.0\nPr 0.0\n")
    _, second = baked(scene, tmp_path / "second")
    for name in ("panel_metal_gloss", "panel_metal_occlusion"):
        assert second["artifacts"][name]["file"] == first["artifacts"][name]["file"]


def test_an_exported_material_has_its_own_textures(tmp_path: Path) -> None:
    baked(make_panels(tmp_path / "s"), tmp_path / "out")
    export(tmp_path / "out", tmp_path / "out.glb")
    data = (tmp_path / "out.glb").read_bytes()
    tree = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    by_name = {one["name"]: one for one in tree["materials"]}
    wood, metal, leaf = (by_name[f"panel {name}"] for name in ("wood", "metal", "leaf"))
    colors = {one["pbrMetallicRoughness"]["baseColorTexture"]["index"] for one in (wood, metal, leaf)}
    assert len(colors) == 3
    assert "normalTexture" in wood and "normalTexture" not in metal
    look = metal["pbrMetallicRoughness"]
    assert "metallicRoughnessTexture" in look and "occlusionTexture" in metal
    assert look["metallicFactor"] == 1.0
    assert (leaf["alphaMode"], leaf["alphaCutoff"]) == ("MASK", 0.5)


@pytest.mark.parametrize(
    ("color", "table", "translucency"),
    [
        ((60, 140, 50), "two_sided = true", 0.55),
        (((60, 140, 50), (110, 100, 60)), "two_sided = true", 0.55),  # half of it is the stem
        (((255, 160, 0), (20, 150, 160)), "two_sided = true", 0.0),  # a parrot, green in the mean alone
        ((60, 140, 50), "", 0.0),  # a leaf of one side has no back
        ((60, 140, 50), "two_sided = true\nmetalness_factor = 1.0", 0.0),
        ((60, 140, 50), 'two_sided = true\nalpha_mode = "blend"', 0.0),
        ((60, 140, 50), "two_sided = true\ntranslucency = 0.2", 0.2),
        ((120, 120, 120), "two_sided = true", 0.0),  # a grate
        ((140, 100, 60), "two_sided = true", 0.0),  # a wooden fence
    ],
)
def test_light_passes_through_two_sided_green_masks_which_is_said_and_through_others_where_asked(
    tmp_path: Path, color: tuple[Any, ...], table: str, translucency: float
) -> None:
    path = make_panels(tmp_path / "s")
    picture = np.full((64, 64, 4), 255, np.uint8)
    picture[:, :, :3] = np.repeat(np.broadcast_to(color, (2, 3)), 32, axis=0)[:, None]
    picture[:, ::4] = (0, 255, 0, 0)  # what a hole would show is not a guess at what is there
    write_image(tmp_path / "s/leaf.png", picture)
    path = edited(path, "[[object.instance]]", f"[object.material.leaf]\n{table}\n[[object.instance]]")
    found = find_map_sets(load_scene(path), path)
    drawn = found.maps.objects["panel"].drawn
    assert {name: one.translucency for name, one in drawn.items()} == {
        "wood": 0.0, "metal": 0.0, "leaf": translucency,
    }  # fmt: skip
    message = [text for text in found.warnings if "taken as leaves" in text]
    assert len(message) == (translucency == 0.55)
    assert all("[object.material.leaf] translucency = 0" in text for text in message)


def test_a_material_is_lit_at_its_vertices_where_the_scene_asks_for_it(tmp_path: Path) -> None:
    path = make_panels(tmp_path / "s")
    path = edited(
        path, "[[object.instance]]", "[object.material.leaf]\nvertex_lit = true\n[[object.instance]]"
    )
    baked(path, tmp_path / "out")
    (panel,) = json.loads((tmp_path / "out/scene.json").read_text())["objects"]
    assert {name for name, one in panel["materials"].items() if one["vertex_lit"]} == {"leaf"}


def test_what_no_pass_reads_is_not_baked_and_named(tmp_path: Path) -> None:
    path = edited(make_panels(tmp_path / "s"), "lods = 1\n", 'lods = 1\nviews = ["shadow"]\n')
    edited(path, "[[object]]", "[shadow]\nextent_m = 10.0\n[[object]]")
    report, _ = baked(path, tmp_path / "out")
    assert {one.name for one in report.artifacts if one.kind == "texture"} == {"panel_leaf_color"}
    scene = load_scene(path)
    unread = unread_pictures(scene, find_map_sets(scene, path).maps)
    assert {(file.name, words.split()[0]) for file, words in unread} == {
        ("wood.png", "color"), ("wood_n.png", "normal"), ("metal.png", "color"),
        ("orm.png", "occlusion"), ("orm.png", "roughness"), ("orm.png", "metalness"),
    }  # fmt: skip
    assert explain(path, out=tmp_path / "out").as_json()["unread"]


@pytest.mark.usefixtures("own_store")
def test_maps_without_a_layout_are_baked_once_for_all_objects(tmp_path: Path) -> None:
    """By content: the second object's picture has another name and the same bytes."""
    folder = tmp_path / "s"
    path = make_panels(folder)
    for name, picture in (("a", "bricks.png"), ("b", "copy.png")):
        write_image(folder / picture, noise(7))
        (folder / f"{name}.mtl").write_text(f"newmtl wall\nmap_Kd {picture}\n")
        (folder / f"{name}.obj").write_text(squares(["wall"], f"{name}.mtl", low=0.0, high=3.0))
    text = path.read_text()
    more = "".join(
        f'[[object]]\nname = "{name}"\nmesh = "{name}.obj"\nlods = 1\n[[object.instance]]\n'
        f"position = [0.0, 0.0, {z}]\n"
        for name, z in (("a", -2.0), ("b", -4.0))
    )
    path.write_text(text.replace("[flight]", more + "[flight]"))
    report, manifest = baked(path, tmp_path / "out")
    textures = {one.name for one in report.artifacts if one.kind == "texture"}
    assert textures == PANELS | {"a_color", "a_normal"}
    walls = [item["materials"]["wall"] for item in manifest["objects"] if item["name"] in ("a", "b")]
    assert all(wall["wrap"] == ["repeat", "repeat"] and wall["maps"]["color"] == "a_color" for wall in walls)
    assert not list(check_paths([tmp_path / "out"]))


def test_a_damaged_map_of_one_material_is_found(tmp_path: Path) -> None:
    _, manifest = baked(make_panels(tmp_path / "s"), tmp_path / "out")
    file = tmp_path / "out" / manifest["artifacts"]["panel_metal_gloss"]["file"]
    data = bytearray(file.read_bytes())
    data[-40] ^= 0x5A
    file.write_bytes(data)
    found = list(check_paths([tmp_path / "out"]))
    assert found and all("panel_metal_gloss" in f"{one.file}{one.place}" for one in found)


def test_udim_tiles_are_refused_by_name(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    path = make_panels(folder)
    shutil.copy(folder / "wood.png", folder / "wood.1001.png")
    (folder / "panel.mtl").write_text("newmtl wood\nmap_Kd wood.1001.png\n")
    first = squares(["wood"], "panel.mtl")
    second = squares(["wood"], "panel.mtl", low=1.1, high=1.9).splitlines()
    count = sum(line.startswith("v ") for line in second)
    moved = [_moved(line, count) for line in second[2:]]
    (folder / "panel.obj").write_text(first + "\n".join(moved) + "\n")
    text = path.read_text()
    start, end = text.index("[object.material.metal]"), text.index("[[object.instance]]")
    path.write_text(text[:start] + text[end:])
    assert find_map_sets(load_scene(path), path).maps.sets  # a picture whose name has 1001 in it
    shutil.copy(folder / "wood.png", folder / "wood.1012.png")
    with pytest.raises(SceneError, match=r"UDIM.*1001"):
        find_map_sets(load_scene(path), path)


def two_tiles(folder: Path, picture: str, *files: str) -> Path:
    """A model whose squares lie in UDIM tiles 1001 and 1002."""
    folder.mkdir()
    for file in files:
        write_image(folder / file, noise(1))
    (folder / "panel.mtl").write_text(f"newmtl wood\nmap_Kd {picture}\n")
    first = squares(["wood"], "panel.mtl")
    second = squares(["wood"], "panel.mtl", low=1.1, high=1.9).splitlines()
    count = sum(line.startswith("v ") for line in second)
    moved = [_moved(line, count) for line in second[2:]]
    (folder / "panel.obj").write_text(first + "\n".join(moved) + "\n")
    return folder / "panel.obj"


@pytest.mark.parametrize(
    ("picture", "files"),
    [
        ("wood.<UDIM>.png", ("wood.1001.png", "wood.1012.png")),
        ("wood.<UVTILE>.png", ("wood.u1_v1.png",)),
        ("wood.1001.png", ("wood.1001.png", "wood.1012.png")),
        ("wood_1012.png", ("wood_1001.png", "wood_1012.png")),
        ("scan1500.1001.png", ("scan1500.1001.png", "scan1500.1012.png")),
    ],
)
def test_udim_tiles_are_refused_by_new_and_by_bake_with_what_to_do(
    tmp_path: Path, picture: str, files: tuple[str, ...]
) -> None:
    model = two_tiles(tmp_path / "m", picture, *files)
    with pytest.raises(SourceError, match=r"UDIM tiles.*join the tiles into one picture"):
        new_scene(tmp_path / "new", model)
    assert not (tmp_path / "new").exists()
    scene = make_panels(tmp_path / "m")
    for file in two_tiles(tmp_path / "again", picture, *files).parent.iterdir():
        shutil.copy(file, tmp_path / "m" / file.name)
    text = scene.read_text()
    start, end = text.index("[object.material.metal]"), text.index("[[object.instance]]")
    scene.write_text(text[:start] + text[end:])
    with pytest.raises(SceneError, match=r"UDIM tiles.*join the tiles into one picture"):
        find_map_sets(load_scene(scene), scene)


def test_a_picture_named_as_one_tile_of_several_warns_that_it_is_repeated(tmp_path: Path) -> None:
    model = two_tiles(tmp_path / "m", "wood.1001.png", "wood.1001.png")
    new = new_scene(tmp_path / "new", model).scene
    (message,) = [text for text in find_map_sets(load_scene(new), new).warnings if "UDIM" in text]
    assert "named as UDIM tile 1001" in message and "it is repeated" in message


def wall(folder: Path, picture: str, tiles: list[tuple[int, int]], *files: str) -> Path:
    """A model of a square for each tile of UVs, all with one picture."""
    folder.mkdir()
    for file in files:
        write_image(folder / file, noise(1))
    (folder / "wall.mtl").write_text(f"newmtl brick\nmap_Kd {picture}\n")
    lines = ["mtllib wall.mtl", "usemtl brick"]
    for k, (u, v) in enumerate(tiles):
        for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)):
            lines += [f"v {k + x} {y} 0", f"vt {u + x} {v + y}"]
        lines.append("f " + " ".join(f"{4 * k + i}/{4 * k + i}" for i in (1, 2, 3, 4)))
    (folder / "wall.obj").write_text("\n".join(lines) + "\n")
    return folder / "wall.obj"


@pytest.mark.parametrize(
    ("picture", "tiles", "beside"),
    [
        ("IMG_1500.png", [(0, 0), (1, 0), (2, 0)], ["IMG_1002.png", "IMG_1003.png"]),  # photos by a camera
        ("IMG_1001.png", [(0, 0), (1, 0), (2, 0)], ["IMG_1002.png"]),  # no tile 1003
        ("brick.1001.png", [(0, 0), (10, 0)], ["brick.1011.png"]),  # 1011 would be (0, 1) too
        ("brick.1001.png", [(0, 0), (-1, 1)], ["brick.1010.png"]),
        ("brick.1011.png", [(0, 1), (0, -1)], ["brick.991.png", "brick.1001.png"]),
    ],
)
def test_a_picture_with_a_number_that_is_no_udim_tile_for_certain_is_repeated(
    tmp_path: Path, picture: str, tiles: list[tuple[int, int]], beside: list[str]
) -> None:
    model = wall(tmp_path / "m", picture, tiles, picture, *beside)
    new = new_scene(tmp_path / "new", model).scene
    for name in beside:
        shutil.copy(tmp_path / "m" / name, new.parent / "model" / name)
    found = find_map_sets(load_scene(new), new)
    assert [one.name for one in found.maps.sets] == ["wall"]
    message = [text for text in found.warnings if "UDIM" in text]
    assert len(message) == (picture == "IMG_1001.png")
    assert all("UVs lie in 1001, 1002, 1003, and no picture of 1003 is beside it" in text for text in message)


def test_a_tiled_material_beside_one_with_a_layout_passes_check(tmp_path: Path) -> None:
    scene = make_panels(tmp_path / "s")
    lines = (tmp_path / "s/panel.obj").read_text().splitlines()
    start = lines.index("usemtl leaf")
    lines[start:] = [line.replace("vt 0.", "vt 3.") for line in lines[start:]]
    (tmp_path / "s/panel.obj").write_text("\n".join(lines) + "\n")
    _, manifest = baked(scene, tmp_path / "out")
    (item,) = manifest["objects"]
    assert [item["materials"][name]["wrap"] for name in ("leaf", "wood")] == [["repeat"] * 2, None]
    found = list(check_paths([tmp_path / "out"]))
    assert not found, found


def _moved(line: str, count: int) -> str:
    """A line of an OBJ as the second part of a file whose first has `count` vertices."""
    if not line.startswith("f "):
        return line
    corners = [int(word.split("/")[0]) + count for word in line.split()[1:]]
    return "f " + " ".join(f"{corner}/{corner}" for corner in corners)


def test_the_gutter_of_a_set_is_filled_from_its_own_materials_alone(tmp_path: Path) -> None:
    """Wood lies on the left of its picture, metal on the right of another: beside wood's islands its own
    colours go on, whatever metal covers there."""
    folder = tmp_path / "s"
    path = make_panels(folder)
    left, right = np.full((64, 64, 3), 200, np.uint8), np.full((64, 64, 3), 60, np.uint8)
    left[:, :24], right[:, 40:] = noise(1)[:, :24] // 4, noise(3)[:, 40:] // 4 + 180
    write_image(folder / "wood.png", left)
    write_image(folder / "metal.png", right)
    lines = (folder / "panel.obj").read_text().splitlines()
    at = {line: i for i, line in enumerate(lines) if line.startswith("usemtl")}
    for i, line in enumerate(lines):
        if line.startswith("vt ") and i < at["usemtl leaf"]:
            u, v = (float(word) for word in line.split()[1:])
            lines[i] = f"vt {0.3 * u + (0.02 if i < at['usemtl metal'] else 0.68):.6f} {v:.6f}"
    (folder / "panel.obj").write_text("\n".join(lines) + "\n")
    _, manifest = baked(path, tmp_path / "out")
    wood = level_0(tmp_path / "out", manifest, "panel_wood_color")[:, :, :3]
    metal = level_0(tmp_path / "out", manifest, "panel_metal_color")[:, :, :3]
    assert 255.0 * wood.max() < 100.0
    assert 255.0 * metal.min() > 150.0


def level_0(folder: Path, manifest: dict[str, Any], name: str) -> np.ndarray:
    file = folder / manifest["artifacts"][name]["file"]
    return decode_texels(decode_ktx2(file.read_bytes()))


@pytest.mark.parametrize("mode", ["blend", "mask"])
def test_a_blended_material_is_as_opaque_from_far_away_as_from_near(tmp_path: Path, mode: str) -> None:
    """A mask is not: it keeps the share of its texels, so that leaves do not become thin."""
    scene = make_panels(tmp_path / "s")
    panes = np.dstack([noise(6), np.kron([[90, 200], [220, 60]], np.ones((32, 32)))]).astype(np.uint8)
    write_image(scene.parent / "leaf.png", panes)
    table = f'[object.material.leaf]\nalpha_mode = "{mode}"\n[object.material.metal]'
    _, manifest = baked(edited(scene, "[object.material.metal]", table), tmp_path / "out")
    file = tmp_path / "out" / manifest["artifacts"]["panel_leaf_color"]["file"]
    texture = decode_ktx2(file.read_bytes())
    levels = [decode_texels(texture, k)[:, :, 3] for k in range(len(texture.levels))]
    opacities = [float(level.mean()) for level in levels]
    kept = opacities == pytest.approx([(90 + 200 + 220 + 60) / 4 / 255] * len(levels), abs=0.02)
    assert kept == (mode == "blend"), opacities


def test_an_opaque_material_shows_the_colours_under_transparent_texels_as_they_are(tmp_path: Path) -> None:
    scene = make_panels(tmp_path / "s")
    edited(scene, "[[object.instance]]", '[object.material.leaf]\nalpha_mode = "opaque"\n[[object.instance]]')
    report, manifest = baked(scene, tmp_path / "out")
    assert not report.warnings
    texels = level_0(tmp_path / "out", manifest, "panel_leaf_color")
    picture = decode_png(tmp_path / "s" / "leaf.png")[:, :, :3] / 255.0
    assert texels.shape[2] == 3 or bool((texels[:, :, 3] == 1.0).all())
    assert np.abs(texels[8:16, 8:16, :3] - picture[8:16, 8:16]).mean() < 0.02


@pytest.mark.parametrize("statement", ["map_Tr hole.png", "map_d -imfchan r hole.png"])
def test_the_picture_of_alpha_is_read_as_the_material_file_says(tmp_path: Path, statement: str) -> None:
    scene = make_panels(tmp_path / "s")
    opaque = np.zeros((64, 64), np.uint8)
    opaque[:, 20:] = 255
    seen = np.zeros((64, 64, 4), np.uint8)
    seen[:, :, 0] = opaque
    picture = 255 - opaque[:, :, None] if "Tr" in statement else seen
    write_image(tmp_path / "s/hole.png", picture)
    mtl = tmp_path / "s/panel.mtl"
    mtl.write_text(mtl.read_text().replace("map_Kd leaf.png", f"map_Kd wood.png\n{statement}"))
    _, manifest = baked(scene, tmp_path / "out")
    (item,) = manifest["objects"]
    assert item["materials"]["leaf"]["alpha_mode"] == "mask"
    alpha = level_0(tmp_path / "out", manifest, item["materials"]["leaf"]["maps"]["color"])[:, :, 3]
    assert alpha[:, :20].max() < 0.05 and alpha[:, 20:].min() > 0.95


def test_a_picture_of_alpha_without_one_of_colour_is_drawn(tmp_path: Path) -> None:
    scene = make_panels(tmp_path / "s")
    hole = np.full((64, 64, 1), 255, np.uint8)
    hole[:, :20] = 0
    write_image(tmp_path / "s/hole.png", hole)
    edited(tmp_path / "s/panel.mtl", "map_Kd leaf.png", "Kd 0.1 0.6 0.1\nmap_d hole.png")
    _, manifest = baked(scene, tmp_path / "out")
    leaf = manifest["objects"][0]["materials"]["leaf"]
    assert (leaf["alpha_mode"], leaf["color"]) == ("mask", pytest.approx([0.1, 0.6, 0.1]))
    texels = level_0(tmp_path / "out", manifest, leaf["maps"]["color"])
    assert (texels[:, :, :3] == 1.0).all()
    assert np.array_equal(texels[:, :, 3] * 255, hole[:, :, 0])
    found = list(check_paths([tmp_path / "out"]))
    assert not found, found


def test_a_colour_map_whose_alpha_would_hide_all_is_drawn_opaque_and_said(tmp_path: Path) -> None:
    scene = make_panels(tmp_path / "s")
    empty = np.full((64, 64, 4), 128, np.uint8)
    empty[:, :, 3] = 0
    write_image(tmp_path / "s/leaf.png", empty)
    report, manifest = baked(scene, tmp_path / "out")
    assert manifest["objects"][0]["materials"]["leaf"]["alpha_mode"] == "opaque"
    words = (
        "material 'leaf': nothing says what its alpha does; taken as opaque, since it would hide everything"
    )
    assert any(words in text for text in report.warnings)


@pytest.mark.parametrize(
    ("below", "mode"),
    [("bled", "mask"), ("plain", "mask"), ("as detailed", "mask"), ("detailed", "opaque")],
)
def test_alpha_of_a_colour_map_that_goes_on_below_the_holes_is_no_coverage(
    tmp_path: Path, below: str, mode: str
) -> None:
    """Characters of games keep gloss or a mask of paint in the alpha of their colour map."""
    rng = np.random.default_rng(5)
    scene = make_panels(tmp_path / "s")
    picture = np.full((64, 64, 4), (90, 120, 60, 255), np.uint8)
    picture[:, :, :3] += rng.integers(0, 12, (64, 64, 1), dtype=np.uint8)
    hole = picture[16:48, 16:48]
    hole[:, :, 3] = 0
    if below == "plain":
        hole[:, :, :3] = 200
    elif below == "bled":
        hole[:, :, :3] = picture[15, 16:48, :3]
    elif below == "detailed":
        hole[:, :, :3] += rng.integers(0, 60, (32, 32, 1), dtype=np.uint8)
    write_image(tmp_path / "s/leaf.png", picture)
    report, manifest = baked(scene, tmp_path / "out")
    assert manifest["objects"][0]["materials"]["leaf"]["alpha_mode"] == mode
    said = "taken as opaque, since the colours where it is 0 have detail of their own"
    assert any(said in text for text in report.warnings) == (mode == "opaque")


def test_a_picture_of_alpha_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    """Beside a plain colour nothing read it, and the material was opaque without a word."""
    scene = make_panels(tmp_path / "s")
    (tmp_path / "s/hole.png").write_bytes(b"no picture")
    edited(tmp_path / "s/panel.mtl", "map_Kd leaf.png", "Kd 0.1 0.6 0.1\nmap_d hole.png")
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
    assert [error.what for error in report.errors] == ["is text, not a picture"]


@pytest.mark.filterwarnings("error")
def test_floats_of_any_size_are_looked_at_without_overflow(tmp_path: Path) -> None:
    """numpy's warnings reached the user."""
    obj = make_panels(tmp_path / "s").with_name("panel.obj")
    far = np.linspace(-3e38, 3e38, 8 * 8 * 3, dtype=np.float32).reshape(8, 8, 3)
    write_image(tmp_path / "s/far.exr", far)
    edited(tmp_path / "s/panel.mtl", "map_Kd leaf.png", "map_Kd far.exr\nmap_Bump far.exr")
    assert read_model_facts(obj, obj.parent, {}, {})["facts"].materials
    assert bake_maps(tmp_path / "s/far.exr", only=("height",))


def test_the_table_that_a_warning_names_can_be_written_as_it_stands(tmp_path: Path) -> None:
    path = make_panels(tmp_path / "s")
    for name in ("panel.mtl", "panel.obj"):
        text = (tmp_path / "s" / name).read_text()
        (tmp_path / "s" / name).write_text(text.replace("leaf\n", "leaf.001\n"))
    (warning,) = find_map_sets(load_scene(path), path).warnings
    table = warning[warning.index("([") + 1 : warning.rindex("]") + 1]
    edited(path, "[[object.instance]]", f'{table}\nalpha_mode = "opaque"\n[[object.instance]]')
    assert not find_map_sets(load_scene(path), path).warnings


@pytest.mark.filterwarnings("error")
def test_far_uvs_are_looked_up_without_overflow(tmp_path: Path) -> None:
    path = make_panels(tmp_path / "s")
    obj = tmp_path / "s/panel.obj"
    text = obj.read_text()
    obj.write_text(text.replace("vt 0.100000 0.100000", "vt 1e30 -1e30", 1))
    assert read_model_facts(obj, path.parent, {}, {})["facts"].materials


def test_a_shared_texture_is_as_fine_as_its_nearest_user_needs(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    path = make_panels(folder)
    write_image(folder / "bricks.png", noise(7, size=512))
    (folder / "wall.mtl").write_text("newmtl wall\nmap_Kd bricks.png\n")
    (folder / "wall.obj").write_text(squares(["wall"], "wall.mtl", low=0.0, high=3.0))
    text = path.read_text()
    text = text[: text.index("[[object]]")] + "{walls}" + text[text.index("[flight]") :]
    left_out = {}
    for case, users in {"far": ["far"], "both": ["far", "near"], "near": ["near"]}.items():
        walls = "".join(
            f'[[object]]\nname = "{name}"\nmesh = "wall.obj"\nlods = 1\n[[object.instance]]\n'
            f"position = [0.0, 0.0, {-40.0 if name == 'far' else 0.0}]\n"
            for name in users
        )
        path.write_text(text.replace("{walls}", walls))
        _, manifest = baked(path, tmp_path / case)
        left_out[case] = manifest["artifacts"][f"{users[0]}_color"]["required_detail"]["left_out"]
    assert left_out["far"] > left_out["near"] == left_out["both"]


@pytest.mark.usefixtures("own_store")
@pytest.mark.parametrize(
    ("model", "library", "counts"),
    sample(
        [
            ("models/own/wall.obj", "../../far/wall.mtl", True),
            ("models/own/wall.obj", "../wall.mtl", True),
            ("wall.obj", "../wall.mtl", False),
        ],
        every=3,
    ),
)
def test_a_material_file_counts_in_every_artifact_where_it_lies_in_the_scenes_folder(
    tmp_path: Path, model: str, library: str, counts: bool
) -> None:
    """Else in none: what a bake did not look at when it chose what to bake anew decides no bytes."""
    folder = tmp_path / "s"
    obj = folder / model
    mtl = Path(os.path.normpath(obj.parent / library))
    for path in (obj, mtl):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_image(folder / "wood.png", noise(1))
    obj.write_text(squares(["wood"], library))
    scene = folder / "wall.toml"
    text = SCENE.replace('"panel.obj"', f'"{model}"\ncolor = "wood.png"')
    scene.write_text(
        text.partition("[object.material")[0]
        + "[[object.instance]]"
        + text.partition("[[object.instance]]")[2]
    )
    found = []
    for scale in (1, 3):
        mtl.write_text(
            f"newmtl wood\nmap_Kd -s {scale} {scale} 1 {os.path.relpath(folder / 'wood.png', mtl.parent)}\n"
        )
        report, _ = baked(scene, tmp_path / "out")
        mesh = next(one for one in report.artifacts if one.name == "panel_mesh")
        found.append((mesh.sha256, mesh.status))
    assert (found[0][0] != found[1][0]) is counts
    assert found[1][1] == ("baked" if counts else "reused")
    assert not bake(scene, tmp_path / "out", BuildOptions(jobs=1, force=True)).errors
    forced = json.loads((tmp_path / "out/scene.json").read_text())["artifacts"]["panel_mesh"]["sha256"]
    assert forced == found[1][0]


@pytest.mark.parametrize("specular", [None, 0.0, 0.25, 1.0, 2.0, 25.0])
def test_a_gloss_map_and_its_factor_reflect_together_what_the_material_does(specular: float | None) -> None:
    maps = {"roughness": MapSource(Picture(Path("rough.png")), "g")}
    material = Material("steel", specular=specular, maps=maps)
    map_holds = dict(authored_fields(material))["specular"]
    assert 0.0 <= map_holds <= 1.0
    mapped = drawn(material, ObjectMaterial(), None, gloss=True)
    alone = drawn(Material("steel", roughness=0.5, specular=specular), ObjectMaterial(), None, gloss=False)
    assert mapped.specular * map_holds == pytest.approx(alone.specular)
