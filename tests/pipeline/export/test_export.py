"""`paradize export`: one GLB that holds what the folder holds, and says what it cannot hold."""

from __future__ import annotations

import json
import shutil
import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.cli.main import main
from paradize.errors import ParadizeError
from paradize.export import scene as paradize_export
from paradize.export.flight import flight_keys, quaternion
from paradize.export.ground_shade import tone_of, toned, wetted
from paradize.export.heights import heights_of, smoothstep, under_water
from paradize.export.scene import export
from paradize.formats.png import decode_png
from paradize.preview.shade import to_srgb
from tests.pipeline.scenes import make_cove


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    top = tmp_path_factory.mktemp("cove")
    report = bake(make_cove(top / "scene"), top / "out", BuildOptions(jobs=1))
    assert not report.errors
    return top / "out"


def tree_of(glb: bytes) -> tuple[dict[str, object], bytes]:
    length = struct.unpack_from("<I", glb, 12)[0]
    return json.loads(glb[20 : 20 + length]), glb[28 + length :]


def test_the_file_holds_every_instance_map_and_key_and_names_nothing_outside(
    baked: Path, tmp_path: Path
) -> None:
    done = export(baked, tmp_path / "new" / "cove.glb")
    scene = json.loads((baked / "scene.json").read_text())
    data = done.file.read_bytes()
    tree, binary = tree_of(data)
    assert len(data) == done.bytes and "uri" not in json.dumps(tree)
    nodes = [node["name"] for node in tree["nodes"]]  # type: ignore[attr-defined]
    for item in scene["objects"]:
        assert sum(name.split()[0] == item["name"] for name in nodes) == len(item["instances"])
    materials = [material for item in scene["objects"] for material in item["materials"].values()]
    maps = len({one["maps"][kind] for one in materials for kind in ("color", "normal", "gloss")} - {None})
    pictures = tree["images"]
    assert isinstance(pictures, list) and len(pictures) == done.pictures >= maps
    for k, picture in enumerate(pictures):  # each is a PNG that another decoder reads
        view = tree["bufferViews"][picture["bufferView"]]  # type: ignore[index]
        path = tmp_path / f"{k}.png"
        path.write_bytes(binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
        assert decode_png(path).size


def edited(baked: Path, folder: Path, edit: Callable[[dict[str, Any]], Any]) -> Path:
    shutil.copytree(baked, folder)
    tree = json.loads((folder / "scene.json").read_text())
    edit(tree)
    (folder / "scene.json").write_text(json.dumps(tree))
    return folder


def test_metal_specular_occlusion_emission_and_blending_are_written_as_gltf_has_them(
    baked: Path, tmp_path: Path
) -> None:
    def edit(tree: dict[str, Any]) -> None:
        item = tree["objects"][0]
        material = next(one for one in item["materials"].values() if one["maps"]["gloss"])
        maps = material["maps"]
        maps["occlusion"], maps["emission"] = maps["gloss"], maps["color"]  # two channels, and colours
        material |= {"metalness": 0.75, "opacity": 0.5, "alpha_mode": "blend", "occlusion_strength": 0.25}
        material |= {"emission": [4.0, 1.0, 0.0], "specular": 0.5}  # reflects 4 %, as a factor of 1 does
        item["materials"] = dict.fromkeys(item["materials"], material)

    folder = edited(baked, tmp_path / "in", edit)
    tree, _ = tree_of(export(folder, tmp_path / "a.glb").file.read_bytes())
    made: Any = tree["materials"]
    (material,) = [one for one in made if "emissiveTexture" in one]
    look = material["pbrMetallicRoughness"]
    assert look["metallicFactor"] == 0.75 and look["baseColorFactor"][3] == 0.5
    assert material["alphaMode"] == "BLEND" and material["occlusionTexture"]["strength"] == 0.25
    assert material["emissiveFactor"] == [1.0, 0.25, 0.0]
    assert material["extensions"]["KHR_materials_specular"]["specularColorFactor"] == [1.0, 1.0, 1.0]
    assert material["extensions"]["KHR_materials_emissive_strength"] == {"emissiveStrength": 4.0}
    indices = [material["occlusionTexture"]["index"], look["metallicRoughnessTexture"]["index"]]
    assert len({*indices, look["baseColorTexture"]["index"]}) == 3
    assert "texCoord" not in look["baseColorTexture"]
    texture = tree["textures"][look["baseColorTexture"]["index"]]  # type: ignore[index]
    sampler: Any = tree["samplers"][texture["sampler"]]  # type: ignore[index]
    assert (sampler["wrapS"], sampler["wrapT"]) == (33071, 33071), "clamped where the scene says nothing"
    assert "KHR_materials_emissive_strength" in tree["extensionsUsed"]  # type: ignore[operator]


def test_maps_on_second_texture_coordinates_stand_in_place_of_those_on_the_first(
    baked: Path, tmp_path: Path
) -> None:
    """With their own wrap; metal goes with gloss, also where nothing but metal shines."""

    def edit(tree: dict[str, Any]) -> None:
        item = tree["objects"][0]
        (name,) = item["materials"]
        post = item["materials"][name]
        maps, none = post["maps"], dict.fromkeys(post["maps"])
        own = none | {"color": maps["color"], "normal": maps["normal"]}
        post |= {"wrap": ["repeat", "mirror"], "specular": 0.0, "metalness": 1.0}
        second = {"emission": None, "gloss": maps["gloss"], "occlusion": maps["gloss"]}
        second = {"maps": second | {"normal": maps["normal"]}, "wrap": ["mirror", "clamp"]}
        item["materials"] |= {"first": post | {"maps": own | {"gloss": maps["gloss"]}}}
        item["materials"] |= {"second": post | {"maps": own, "second": second}}

    folder = edited(baked, tmp_path / "in", edit)
    tree, _ = tree_of(export(folder, tmp_path / "a.glb").file.read_bytes())
    made: Any = tree
    parts = {one["name"]: one for one in made["materials"]}

    def shown(info: dict[str, Any]) -> tuple[str, int, int, int]:
        texture = made["textures"][info["index"]]
        sampler, image = made["samplers"][texture["sampler"]], made["images"][texture["source"]]
        return image["name"], info.get("texCoord", 0), sampler["wrapS"], sampler["wrapT"]

    repeat, mirror, clamp = 10497, 33648, 33071
    first, second = parts["post first"], parts["post second"]
    assert shown(first["normalTexture"]) == ("post normal", 0, repeat, mirror)
    looks = first["pbrMetallicRoughness"]
    assert shown(looks["metallicRoughnessTexture"]) == ("post gloss", 0, repeat, mirror)
    assert shown(second["normalTexture"]) == ("post normal", 1, mirror, clamp)
    looks = second["pbrMetallicRoughness"]
    assert shown(looks["metallicRoughnessTexture"]) == ("post gloss post gloss", 1, mirror, clamp)
    assert shown(looks["baseColorTexture"]) == ("post color", 0, repeat, mirror)
    assert shown(second["occlusionTexture"]) == ("post gloss", 1, mirror, clamp)


def test_each_material_keeps_its_smoothness_where_two_share_a_gloss_map(baked: Path, tmp_path: Path) -> None:
    """And one that does not shine has no such picture."""

    def edit(tree: dict[str, Any]) -> None:
        item = tree["objects"][0]
        (name,) = item["materials"]
        wood = item["materials"][name]
        assert wood["maps"]["gloss"] and wood["specular"] > 0.0
        item["materials"] |= {"tin": wood | {"smoothness": 0.8}, "felt": wood | {"specular": 0.0}}
        item["materials"]["twin"] = wood

    folder = edited(baked, tmp_path / "in", edit)
    tree, binary = tree_of(export(folder, tmp_path / "a.glb").file.read_bytes())
    made: Any = tree
    looks = {one["name"]: one["pbrMetallicRoughness"] for one in made["materials"]}
    assert "metallicRoughnessTexture" not in looks["post felt"]
    used = [looks[f"post {name}"]["metallicRoughnessTexture"]["index"] for name in ("wood", "twin", "tin")]
    assert used[0] == used[1] != used[2]
    means = []
    for index in used[1:]:
        view = made["bufferViews"][made["images"][made["textures"][index]["source"]]["bufferView"]]
        path = tmp_path / "map.png"
        path.write_bytes(binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
        means.append(1.0 - decode_png(path)[:, :, 1].mean() / 255.0)
    materials = json.loads((folder / "scene.json").read_text())["objects"][0]["materials"]
    assert means[1] / means[0] == pytest.approx(0.8 / materials["wood"]["smoothness"], rel=0.03)


def test_a_map_without_smaller_mips_has_none_in_other_programs(baked: Path, tmp_path: Path) -> None:
    """Swatches of a palette that is as small as it can be would run into each other."""

    def edit(tree: dict[str, Any]) -> None:
        for name, artifact in tree["artifacts"].items():
            artifact["max_level"] = 0 if name == "post_color" else artifact["max_level"]

    tree, _ = tree_of(export(edited(baked, tmp_path / "in", edit), tmp_path / "a.glb").file.read_bytes())
    made: Any = tree
    filters = {
        made["images"][one["source"]]["name"]: made["samplers"][one["sampler"]]["minFilter"]
        for one in made["textures"]
    }
    assert filters["post color"] == 9729 and filters["post normal"] == 9987  # LINEAR, and with mips


def rotation(quaternion: Sequence[float]) -> np.ndarray:
    """Of glTF's x, y, z, w."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_instances_sun_lamps_camera_and_sea_floor_stand_as_the_scene_says(
    baked: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The sun shines along its node's -Z, also from the zenith; sand repeats by the metre both ways."""
    repeats: list[tuple[float, float]] = []
    light = paradize_export.ground_light

    def spied(sand: Any, effect: Any, share: Any, repeat: tuple[float, float]) -> Any:
        repeats.append(repeat)
        return light(sand, effect, share, repeat)

    monkeypatch.setattr("paradize.export.scene.ground_light", spied)
    stands: list[dict[str, Any]] = [
        {"position": [1.0, 2.0, 3.0], "rotation": [0.0, 0.6, 0.0, 0.8], "scale": [2.5, 2.5, 2.5]},
        {"position": [-4.0, 0.0, 1.0], "rotation": [0.48, 0.64, 0.36, 0.48], "scale": [0.5, -1.0, 2.0]},
    ]
    lamp = {"name": "lamp", "position": [1.0, 2.0, 3.0], "color": [2.0, 1.0, 0.5], "intensity": 3.0}
    lamp |= {"radius_m": 0.1, "range_m": 8.0, "hours": None, "fade_s": 0.0, "flicker": 0.0}
    for k, direction in enumerate(([0.48, 0.6, -0.64], [0.0, 1.0, 0.0])):

        def edit(tree: dict[str, Any], direction: list[float] = direction) -> None:
            tree["objects"][0]["instances"] = stands
            tree["sun"] |= {"direction": direction, "color": [4.0, 2.0, 1.0], "intensity": 2.0}
            tree["terrain"]["size_m"] = [20.0, 40.0]
            tree |= {"lights": [lamp], "light_sets": [{"lights": [], "glow": None}]}

        folder = edited(baked, tmp_path / f"in{k}", edit)
        tree, _ = tree_of(export(folder, tmp_path / "a.glb").file.read_bytes())
        scene = json.loads((folder / "scene.json").read_text())
        nodes: dict[str, Any] = {node["name"]: node for node in tree["nodes"]}  # type: ignore[attr-defined]
        for number, stand in enumerate(stands, 1):
            node = nodes[f"post {number}"]
            assert np.allclose(rotation(node["rotation"]), rotation(stand["rotation"]), atol=1e-12)
            mirror = -1.0 if np.prod(stand["scale"]) < 0.0 else 1.0
            assert node["translation"] == stand["position"]
            assert node["scale"] == [mirror * stand["scale"][0], *stand["scale"][1:]]
        meshes = [tree["meshes"][nodes[f"post {n}"]["mesh"]]["primitives"][0] for n in (1, 2)]  # type: ignore[index]
        lows = [tree["accessors"][one["attributes"]["POSITION"]]["min"] for one in meshes]  # type: ignore[index]
        highs = [tree["accessors"][one["attributes"]["POSITION"]]["max"] for one in meshes]  # type: ignore[index]
        assert lows[1] == [-highs[0][0], *lows[0][1:]]
        assert np.allclose(rotation(nodes["sun"]["rotation"]) @ [0, 0, 1], direction, atol=1e-12)
        assert np.linalg.det(rotation(nodes["sun"]["rotation"])) == pytest.approx(1.0)
        assert nodes["lamp"]["translation"] == lamp["position"]
        sun, written = tree["extensions"]["KHR_lights_punctual"]["lights"]  # type: ignore[index]
        assert (sun["type"], sun["color"], sun["intensity"]) == ("directional", [1.0, 0.5, 0.25], 8.0)
        look = {"type": "point", "color": [1.0, 0.5, 0.25], "intensity": 6.0, "range": 8.0}
        assert written == {"name": "lamp"} | look
        (camera,) = tree["cameras"]  # type: ignore[misc]
        width, height = scene["viewport"]
        assert camera["perspective"]["aspectRatio"] == width / height
        assert camera["perspective"]["yfov"] == scene["flight"]["fov_rad"]
        mesh = tree["meshes"][nodes["sea floor"]["mesh"]]  # type: ignore[index]
        floor = tree["accessors"][mesh["primitives"][0]["attributes"]["POSITION"]]  # type: ignore[index]
        assert floor["max"][1] == pytest.approx(scene["terrain"]["height_range_m"][0] - 0.05)
    assert repeats == [(8.0, 16.0)] * 2


def test_ground_sea_and_sky_are_those_of_the_scene(
    baked: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The ground is shaded step by step from plain sand, whose share follows the height."""
    seen: dict[str, Any] = {}
    heights_of_patches = paradize_export.terrain_heights

    def heights(meshes: Any, shape: Any) -> Any:
        seen["heights"] = heights_of_patches(meshes, shape)
        return seen["heights"]

    def plain(sand: Any, effect: Any, share: Any, repeat: Any) -> Any:
        seen["share"] = share
        return np.full((*share.shape, 3), 0.25, np.float32)

    monkeypatch.setattr("paradize.export.scene.terrain_heights", heights)
    monkeypatch.setattr("paradize.export.scene.ground_light", plain)

    def edit(tree: dict[str, Any]) -> None:
        tree["terrain"] |= {"smoothness": 0.25, "specular": 0.5, "wet_high_m": 0.5, "wet_darkness": 0.4}
        tree["water"] |= {"level_m": 0.125, "smoothness": 0.75, "wave_repeat": 7.0, "size_m": 300.0}

    folder = edited(baked, tmp_path / "in", edit)
    scene = json.loads((folder / "scene.json").read_text())
    terrain, water = scene["terrain"], scene["water"]
    tree, binary = tree_of(export(folder, tmp_path / "a.glb").file.read_bytes())
    made: Any = tree

    def values(name: str, attribute: str) -> Any:
        (node,) = (node for node in made["nodes"] if node["name"] == name)
        accessor = made["accessors"][made["meshes"][node["mesh"]]["primitives"][0]["attributes"][attribute]]
        start = made["bufferViews"][accessor["bufferView"]]["byteOffset"] + accessor.get("byteOffset", 0)
        width = {"VEC2": 2, "VEC3": 3}[accessor["type"]]
        return np.frombuffer(binary, "<f4", accessor["count"] * width, start).reshape(-1, width)

    looks = {one["name"]: one for one in made["materials"]}
    ground, sea = looks["ground"], looks["water"]
    assert ground["pbrMetallicRoughness"]["roughnessFactor"] == 0.75
    assert ground["extensions"]["KHR_materials_specular"] == {"specularFactor": 0.5}
    assert ground["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] == 1
    assert ground.get("normalTexture", {"texCoord": 1})["texCoord"] == 1
    assert (sea["alphaMode"], sea["doubleSided"]) == ("BLEND", True)
    assert sea["pbrMetallicRoughness"]["roughnessFactor"] == 0.25
    assert (values("water", "POSITION")[:, 1] == 0.125).all() and values("water", "TEXCOORD_0").max() == 7.0
    edge = 0.57 * scene["flight"]["far_m"]
    corner = values("sky +x", "TEXCOORD_0").tolist().index([1.0, 0.0])  # the right end of the top
    assert values("sky +x", "POSITION")[corner] == pytest.approx([edge, edge, -edge])
    if terrain["effect_color"]:
        share = smoothstep(seen["heights"], terrain["mix_low_m"], terrain["mix_high_m"])
        assert np.array_equal(seen["share"], share)
    tone = tone_of(terrain["size_m"], seen["heights"].shape)
    light = toned(np.full((*tone.shape, 3), 0.25, np.float32), tone)
    light = under_water(wetted(light, tone, seen["heights"], terrain, 0.125), seen["heights"], water)
    image = made["images"][
        made["textures"][ground["pbrMetallicRoughness"]["baseColorTexture"]["index"]]["source"]
    ]
    view = made["bufferViews"][image["bufferView"]]
    (tmp_path / "a.png").write_bytes(binary[view["byteOffset"] :][: view["byteLength"]])
    assert np.array_equal(decode_png(tmp_path / "a.png"), to_srgb(light))


def test_the_camera_and_the_sky_of_a_flight_far_away_stand_there(
    baked: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flight = json.loads((baked / "scene.json").read_text())["flight"]
    for far in (False, True):
        if far:
            monkeypatch.setattr("paradize.export.flight._NEAR_M", 0.0)
        keys = flight_keys(flight)
        tree, _ = tree_of(export(baked, tmp_path / "a.glb").file.read_bytes())
        made: Any = tree
        nodes: dict[str, Any] = {node["name"]: node for node in made["nodes"]}
        assert nodes["camera"]["translation"] == pytest.approx(keys.places[0].tolist())
        assert nodes["camera"]["rotation"] == pytest.approx(keys.turns[0].tolist())
        assert ("camera's place" in nodes) == far == (keys.origin != (0.0, 0.0, 0.0))
        assert nodes["sky +y"].get("translation", [0.0, 0.0, 0.0]) == list(keys.origin)
        if far:
            place = nodes["camera's place"]
            assert place["translation"] == list(keys.origin)
            assert [made["nodes"][k]["name"] for k in place["children"]] == ["camera"]


def test_the_same_folder_gives_the_same_bytes(baked: Path, tmp_path: Path) -> None:
    once, twice = export(baked, tmp_path / "a.glb"), export(baked / "scene.json", tmp_path / "b.glb")
    assert once.file.read_bytes() == twice.file.read_bytes()


def test_keys_begin_and_end_alike_and_their_error_is_what_a_finer_look_finds(baked: Path) -> None:
    flight = json.loads((baked / "scene.json").read_text())["flight"]
    keys = flight_keys(flight)
    assert keys.times_s[0] == 0.0 and keys.times_s[-1] == np.float32(flight["duration_s"])
    assert np.allclose(keys.places[0], keys.places[-1], atol=1e-5)
    assert np.allclose(np.linalg.norm(keys.turns, axis=1), 1.0, atol=1e-6)
    assert (np.diff(keys.turns, axis=0) ** 2).sum(axis=1).max() < 0.1  # no key takes the long way round
    step = np.linalg.norm(np.diff(keys.places.astype(float), n=2, axis=0), axis=1).max()
    assert keys.errors["path_export_m_max"] < 0.2 * step + 1e-6  # an eighth of the second difference


@settings(deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 1e-3))
def test_a_rotation_and_its_quaternion_turn_alike(q: list[float]) -> None:
    x, y, z, w = np.array(q) / np.linalg.norm(q)
    matrix = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    assert abs(abs(quaternion(matrix) @ np.array([x, y, z, w])) - 1.0) < 1e-12


@settings(deadline=None)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(2, 6), st.integers(0, 1 << 30))
def test_heights_are_those_of_the_plane_that_the_triangles_lie_in(
    rows: int, columns: int, cells: int, seed: int
) -> None:
    random = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.linspace(0, 1, cells), np.linspace(0, 1, cells)), axis=-1).reshape(-1, 2)
    a, b, c = random.uniform(-5, 5, 3)
    k = np.arange(cells * cells).reshape(cells, cells)
    first = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:]], axis=-1).reshape(-1, 3)
    second = np.stack([k[:-1, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 3)
    triangles = np.concatenate([first, second]).astype(np.uint32)
    found = heights_of(
        grid.astype(np.float32),
        (a * grid[:, 0] + b * grid[:, 1] + c).astype(np.float32),
        triangles,
        (rows, columns),
    )
    u, v = (np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows
    assert np.allclose(found, a * u[None, :] + b * v[:, None] + c, atol=1e-4)  # NaN anywhere would fail


def test_a_folder_without_a_scene_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(ParadizeError, match=r"scene\.json"):
        export(tmp_path, tmp_path / "a.glb")
    assert not (tmp_path / "a.glb").exists()
    assert main(["export", str(tmp_path), "-o", str(tmp_path / "a.glb"), "--json"]) == 1


def test_what_was_baked_is_not_written_over(
    baked: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh = next(baked.glob("terrain_mesh-*.glb"))
    link = tmp_path / "link"
    link.symlink_to(baked)
    (tmp_path / "mesh.glb").symlink_to(mesh)
    before = {path.name: path.read_bytes() for path in baked.iterdir()}
    for out in (baked / "scene.json", mesh, link / mesh.name, tmp_path / "mesh.glb", tmp_path / "x.gltf"):
        assert main(["export", str(baked), "-o", str(out)]) == 1
        assert out.name in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in baked.iterdir()} == before
    assert not (tmp_path / "x.gltf").exists()


def test_a_damaged_map_is_refused_by_name(baked: Path, tmp_path: Path) -> None:
    shutil.copytree(baked, tmp_path / "in")
    broken = next((tmp_path / "in").glob("*_color-*.ktx2"))
    broken.write_bytes(broken.read_bytes()[:-7])
    with pytest.raises(ParadizeError, match=broken.name.split("-")[0]):
        export(tmp_path / "in", tmp_path / "a.glb")
