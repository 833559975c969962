"""Palettes: kits whose triangles show swatches of one picture share it, as small as it can be."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.build.bake import bake
from paradize.build.materials.flat_colors import measure_palette
from paradize.build.materials.map_sets import find_map_sets
from paradize.build.options import BuildOptions
from paradize.checks import check_paths
from paradize.data import Group, Lod, Mesh, Texture
from paradize.explain.facts import explain
from paradize.formats.glb.encode import encode_glb
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.texels import decode_texels
from paradize.readers.image import read_image
from paradize.scene.settings import load_scene
from tests.pipeline.material_scene import noise
from tests.pipeline.readers.gltf.made import Made, shown
from tests.pipeline.scenes import write_image
from tests.sweeps import sample

SIDE, SWATCHES = 256, 8  # texels, swatches a side
COLORS = np.random.default_rng(3).integers(20, 236, (SWATCHES, SWATCHES, 3)).astype(np.uint8)
SCENE = """
[scene]
name = "kit"
{objects}
[flight]
duration_s = 4.0
eye = [{{ position = [3, 1, 4] }}, {{ position = [-3, 1, 4] }}, {{ position = [0, 2, 5] }}]
target = [{{ position = [0, 0.5, 0] }}, {{ position = [0, 0.5, 0] }}, {{ position = [0, 0.5, 0] }}]
"""


@pytest.fixture(autouse=True)
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))


def model(first: int, spread: float, times: int, size_m: float) -> str:
    """An OBJ of a row of squares. Each swatch is shown so many times. spread: of a square's UVs, as a share
    of the swatch (0: points)."""
    lines = ["mtllib kit.mtl", "usemtl colors"]
    for k in range(6 * times):
        column, row = (first + k % 6) % SWATCHES, (first + 3 * (k % 6)) // SWATCHES % SWATCHES
        for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)):
            lines.append(f"v {0.5 * size_m * (k - 3 + x):g} {size_m * y:g} {0.1 * size_m * k:g}")
            u, v = (at + 0.5 + spread * (corner - 0.5) for at, corner in ((column, x), (row, y)))
            lines.append(f"vt {u / SWATCHES:.6f} {1.0 - v / SWATCHES:.6f}")
        a = 4 * k + 1
        lines.append("f " + " ".join(f"{a + i}/{a + i}" for i in range(4)))
    return "\n".join(lines) + "\n"


def make_kit(
    folder: Path,
    picture: np.ndarray,
    *,
    spread: float = 0.4,
    count: int = 2,
    times: int = 1,
    size_m: float = 1.0,
) -> Path:
    folder.mkdir(parents=True)
    write_image(folder / "colors.png", picture)
    (folder / "kit.mtl").write_text("newmtl colors\nmap_Kd colors.png\n")
    objects = ""
    for k in range(count):
        (folder / f"piece{k}.obj").write_text(model(5 * k, spread, times, size_m))
        objects += f'[[object]]\nname = "piece{k}"\nmesh = "piece{k}.obj"\nlods = 1\n[[object.instance]]\n'
        objects += f"position = [0.0, {1.5 * k}, 0.0]\n"
    path = folder / "kit.toml"
    path.write_text(SCENE.format(objects=objects))
    return path


def swatches() -> np.ndarray:
    return np.repeat(np.repeat(COLORS, SIDE // SWATCHES, axis=0), SIDE // SWATCHES, axis=1)


def gradients() -> np.ndarray:
    """Swatches that darken evenly from top to bottom, to half."""
    step = SIDE // SWATCHES
    down = 1.0 - 0.5 * (np.arange(SIDE) % step + 0.5) / step
    return np.rint(swatches() * down[:, None, None]).astype(np.uint8)


def baked(scene: Path, out: Path) -> tuple[set[str], dict[str, Any]]:
    """Names of the textures, and the manifest of a scene without a finding."""
    report = bake(scene, out, BuildOptions(jobs=1))
    assert not report.errors, report.errors
    assert not list(check_paths([out]))
    return {one.name for one in report.artifacts if one.kind == "texture"}, json.loads(
        (out / "scene.json").read_text()
    )


@pytest.mark.parametrize(("spread", "size_m"), [(0.0, 1.0), (0.4, 0.3)])
def test_one_small_texture_serves_all_models_of_a_kit_and_loses_no_colour(
    tmp_path: Path, spread: float, size_m: float
) -> None:
    kit = make_kit(tmp_path / "s", swatches(), spread=spread, size_m=size_m)
    textures, manifest = baked(kit, tmp_path / "out")
    assert textures == {"piece0_color"}
    (facts,) = explain(kit, "piece0_color", tmp_path / "out").artifacts
    assert facts["reason"] == "the swatches of a palette on piece0 and piece1"
    maps = [one["materials"]["colors"]["maps"] for one in manifest["objects"]]
    assert all(one["color"] == "piece0_color" and one["normal"] is None for one in maps)
    entry = manifest["artifacts"]["piece0_color"]
    texture = decode_ktx2((tmp_path / "out" / entry["file"]).read_bytes())
    assert max(texture.width, texture.height) <= 4 * SWATCHES
    finest = decode_texels(texture)[:, :, :3]
    step = len(finest) // SWATCHES
    middles = finest[step // 2 :: step, step // 2 :: step]
    assert np.abs(255.0 * middles - COLORS).max() <= 1.0
    assert entry["max_level"] is not None and texture.width >> entry["max_level"] >= SWATCHES


def test_the_last_mip_that_is_sampled_still_keeps_swatches_apart(tmp_path: Path) -> None:
    _, manifest = baked(make_kit(tmp_path / "s", swatches()), tmp_path / "out")
    entry = manifest["artifacts"]["piece0_color"]
    texture = decode_ktx2((tmp_path / "out" / entry["file"]).read_bytes())
    last = decode_texels(texture, entry["max_level"])[:, :, :3]
    step = len(last) // SWATCHES
    middles = last[step // 2 :: step, step // 2 :: step]
    assert np.abs(255.0 * middles - COLORS).max() <= 16.0


def test_a_painted_picture_and_a_plain_one_are_no_palettes(tmp_path: Path) -> None:
    for name, picture, spread in (
        ("painted", noise(1, size=SIDE), 8.0 / SWATCHES),
        ("plain", np.full((64, 64, 3), 90, np.uint8), 0.4),
    ):
        path = make_kit(tmp_path / name, picture, spread=spread * (8.0 if name == "painted" else 1.0))
        found = find_map_sets(load_scene(path), path).maps.sets
        assert not any(one.palette for one in found), name
    path = make_kit(tmp_path / "kit", swatches())
    assert all(one.palette for one in find_map_sets(load_scene(path), path).maps.sets)


def test_a_painted_strip_beside_a_large_face_of_one_texel_is_no_palette(tmp_path: Path) -> None:
    kit = make_kit(tmp_path / "kit", noise(1, size=SIDE), count=1)
    corners = [(0, 0, 0, 0), (2, 0, 0, 0), (2, 2, 0, 0), (0, 2, 0, 0)]
    corners += [(3, 0, 0, 0), (5, 0, 1, 0), (5, 0.05, 1, 1), (3, 0.05, 0, 1)]
    lines = [f"v {x} {y} 0\nvt {u} {v}" for x, y, u, v in corners]
    faces = "f 1/1 2/2 3/3 4/4\nf 5/5 6/6 7/7 8/8\n"
    text = "mtllib kit.mtl\nusemtl colors\n" + "\n".join(lines) + "\n" + faces
    (tmp_path / "kit/piece0.obj").write_text(text)
    assert not any(one.palette for one in find_map_sets(load_scene(kit), kit).maps.sets)


def test_gradients_that_faces_share_are_a_palette_too(tmp_path: Path) -> None:
    kit = make_kit(tmp_path / "s", gradients(), spread=0.8, times=2)
    textures, manifest = baked(kit, tmp_path / "out")
    assert textures == {"piece0_color"}  # no bumps are made of them
    entry = manifest["artifacts"]["piece0_color"]
    finest = decode_texels(decode_ktx2((tmp_path / "out" / entry["file"]).read_bytes()))[:, :, :3]
    step = len(finest) // SWATCHES
    assert 8 <= len(finest) < SIDE // 2
    middles = (
        finest[step // 2 - 1 :: step, step // 2 :: step] / 2
        + finest[step // 2 :: step, step // 2 :: step] / 2
    )
    assert np.abs(255.0 * middles - 0.75 * COLORS).max() <= 2.0
    # what the mips that are left out cost counts too: they are finer than views need
    assert 45.0 < entry["errors"]["color_psnr_db"] < min(one["psnr_db"] for one in entry["levels"])


@pytest.mark.parametrize(("step", "decibels"), [(0, 120.0), (1, 20.0 * math.log10(255.0 / math.sqrt(0.5)))])
def test_the_psnr_of_a_palette_is_that_of_its_coarser_mip(step: int, decibels: float) -> None:
    """The mip is off by `step` codes on the left half, by none on the right; the last mip by far too much."""
    codes = [np.full((side, side, 4), 128, np.uint8) for side in (8, 4, 2, 1)]
    codes[1][:, :2, :3] += np.uint8(step)
    codes[2][:, :, :3] = codes[3][:, :, :3] = 255
    texture = Texture("RGBA8_SRGB", 8, 8, tuple(level.tobytes() for level in codes))
    # two squares, so that no sample between the halves is looked at
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    uvs = np.concatenate([corners * (0.25, 1.0), corners * (0.25, 1.0) + (0.75, 0.0)]).astype(np.float32)
    places = np.concatenate([uvs, np.zeros((8, 1))], axis=1).astype(np.float32)
    triangles = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], np.uint32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (8, 1))
    mesh = Mesh(places, triangles, normals, uvs=uvs, groups=(Group("kit", "colors", 0, 4),))
    glb = encode_glb([Lod(mesh, 0.0, 0.0)], "kit")
    facts = measure_palette("kit", glb, encode_ktx2(texture), None, ["colors"])
    assert (facts["level"], facts["max_level"]) == (1, 1)
    assert facts["level_psnr_db"] == pytest.approx(decibels, abs=0.01)


def test_gradients_are_no_palette_where_each_has_one_place_or_grain(tmp_path: Path) -> None:
    grain = np.random.default_rng(5).integers(-6, 7, (SIDE, SIDE, 1))
    rough = np.clip(gradients() + grain, 0, 255).astype(np.uint8)
    for name, picture, times in (("once", gradients(), 1), ("grain", rough, 2)):
        path = make_kit(tmp_path / name, picture, spread=0.8, times=times)
        assert not any(one.palette for one in find_map_sets(load_scene(path), path).maps.sets), name


def make_signs(folder: Path, count: int) -> Path:
    """A kit of gradients, of which each piece shows a drawn sign on 2.6 % of its surface."""
    picture = gradients()
    step = SIDE // SWATCHES
    picture[-step:, -step:] = noise(3, size=step)
    path = make_kit(folder, picture, spread=0.8, times=2, count=count)
    for obj in folder.glob("*.obj"):
        corners = "".join(
            f"v {0.4 * x:g} {3 + 0.4 * y:g} 0\nvt {(SWATCHES - 1 + x) / SWATCHES:g} {y / SWATCHES:g}\n"
            for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))
        )
        lines = obj.read_text()
        first = lines.count("v ") + 1
        face = " ".join(f"{first + i}/{first + i}" for i in range(4))
        obj.write_text(f"{lines}{corners}f {face}\n")
    return path


def test_something_drawn_on_the_sheet_of_a_kit_leaves_it_one_sheet_as_it_was_drawn(tmp_path: Path) -> None:
    path = make_signs(tmp_path / "s", 3)
    textures, manifest = baked(path, tmp_path / "out")
    assert textures == {"piece0_color"}
    entry = manifest["artifacts"]["piece0_color"]
    texture = decode_ktx2((tmp_path / "out" / entry["file"]).read_bytes())
    assert texture.width == SIDE and entry["gutter"] is None
    error = decode_texels(texture)[:, :, :3] - read_image(tmp_path / "s/colors.png").pixels
    assert 10.0 * math.log10(1.0 / (error**2).mean()) > 36.0
    alone = make_signs(tmp_path / "alone", 1)  # a model of its own, with gutters and bumps
    assert not any(one.palette for one in find_map_sets(load_scene(alone), alone).maps.sets)


CRATE = """mtllib kit.mtl
usemtl colors
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 5/1 6/2 7/3 8/4
f 2/1 1/2 4/3 3/4
f 6/1 2/2 3/3 7/4
f 1/1 5/2 8/3 4/4
f 8/1 7/2 3/3 4/4
f 1/1 2/2 6/3 5/4
"""


def make_crate(folder: Path, picture: np.ndarray) -> Path:
    """A cube whose faces all show the whole picture."""
    path = make_kit(folder, picture, count=1)
    (folder / "piece0.obj").write_text(CRATE)
    return path


def smooth() -> np.ndarray:
    """A picture that changes evenly from corner to corner."""
    y, x = np.mgrid[0:SIDE, 0:SIDE] / SIDE
    return np.rint(np.stack([40 + 150 * x, 160 - 90 * y, 90 + 60 * x], axis=2)).astype(np.uint8)


@pytest.mark.parametrize("at", sample([20, 40, 150, 217], every=4))
def test_thin_lines_on_a_smooth_picture_that_faces_share_stay_sharp(tmp_path: Path, at: int) -> None:
    picture = smooth()
    picture[:, at] = 10  # between the quarters of a face
    _, manifest = baked(make_crate(tmp_path / "s", picture), tmp_path / "out")
    entry = manifest["artifacts"]["piece0_color"]
    finest = decode_texels(decode_ktx2((tmp_path / "out" / entry["file"]).read_bytes()))[:, :, :3]
    assert finest.shape == picture.shape
    assert np.abs(255.0 * finest - picture).max() <= 24.0
    assert manifest["objects"][0]["materials"]["colors"]["maps"]["normal"] == "piece0_normal"
    smoothly = make_crate(tmp_path / "smooth", smooth())
    assert all(one.palette for one in find_map_sets(load_scene(smoothly), smoothly).maps.sets)


def test_stripes_that_faces_share_keep_their_normal_map(tmp_path: Path) -> None:
    picture = smooth()
    for first in range(5, SIDE, 32):
        if all(abs(first + 1 - quarter) > 4 for quarter in range(0, SIDE + 1, SIDE // 4)):
            picture[first : first + 3] = 10
    textures, _ = baked(make_crate(tmp_path / "s", picture), tmp_path / "out")
    assert textures == {"piece0_color", "piece0_normal"}


def test_a_picture_under_another_triangle_is_looked_at_too(tmp_path: Path) -> None:
    picture = smooth()
    picture[:, 150] = 10
    path = make_crate(tmp_path / "s", picture)
    small = "v 0 2 0\nv 0.01 2 0\nv 0.01 2.01 0\nv 0 2.01 0\nf 9/1 10/2 11/3 12/4\n"
    lines = CRATE.replace("f 5/1", small + "f 5/1", 1)  # it owns all texels
    path.with_name("piece0.obj").write_text(lines)
    assert not any(one.palette for one in find_map_sets(load_scene(path), path).maps.sets)


def test_a_strength_that_a_palette_does_not_use_is_said(tmp_path: Path) -> None:
    path = make_kit(tmp_path / "kit", swatches(), count=1)
    assert not find_map_sets(load_scene(path), path).warnings
    path.write_text(path.read_text().replace("lods = 1", "lods = 1\nstrength = 0.5"))
    (said,) = find_map_sets(load_scene(path), path).warnings
    assert "material 'colors'" in said and "strength = 0.5" in said and "palette" in said
    path.write_text(path.read_text().replace("lods = 1", 'lods = 1\nwrap = "repeat"'))
    found = find_map_sets(load_scene(path), path)
    assert not found.warnings and "normal" in found.maps.sets[0].derived


def test_the_palette_of_an_unlit_kit_is_one_small_texture_of_its_light(tmp_path: Path) -> None:
    scene = make_kit(tmp_path / "kit", swatches())
    for obj in scene.parent.glob("*.obj"):
        lines = [line.split() for line in obj.read_text().splitlines()]
        made = Made()
        places, uvs = (
            np.array([one[1:] for one in lines if one[0] == key], np.float32) for key in ("v", "vt")
        )
        quads = 4 * np.arange(len(places) // 4)[:, None] + [0, 1, 2, 0, 2, 3]
        uvs[:, 1] = 1.0 - uvs[:, 1]
        attributes = {"POSITION": made.array(places), "TEXCOORD_0": made.array(uvs)}
        texture = made.add("textures", source=made.add("images", uri="colors.png"))
        paint = made.add(
            "materials",
            pbrMetallicRoughness={"baseColorTexture": {"index": texture}},
            extensions={"KHR_materials_unlit": {}},
        )
        indices = made.array(quads.reshape(-1).astype(np.uint16))
        shown({"attributes": attributes, "indices": indices, "material": paint}, made)
        made.glb(obj.with_suffix(".glb"))
    scene.write_text(scene.read_text().replace(".obj", ".glb"))
    textures, manifest = baked(scene, tmp_path / "out")
    (name,) = textures  # colour and emission are one
    assert name.endswith("_color")
    entry = manifest["artifacts"][name]
    texture = decode_ktx2((tmp_path / "out" / entry["file"]).read_bytes())
    assert {one["materials"]["material_0"]["maps"]["emission"] for one in manifest["objects"]} == {name}
    assert texture.format == "RGBA8_SRGB" and max(texture.width, texture.height) <= 4 * SWATCHES
    assert entry["max_level"] is not None and entry["gutter"] is None


def test_a_reason_names_a_few_users_and_counts_the_others(tmp_path: Path) -> None:
    path = make_kit(tmp_path / "s", swatches(), count=12)
    rows = {facts["name"]: facts["reason"] for facts in explain(path, out=tmp_path / "no").artifacts}
    assert rows["piece0_color"] == ("the swatches of a palette on piece0, piece1, piece2, piece3 and 8 more")
