"""A scene of glTF models: `new` makes it, its embedded pictures become maps, its buffers are sources."""

from __future__ import annotations

import io
import json
import shutil
import struct
import zlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from paradize.bakers.color import color_values
from paradize.bakers.mesh.bake import bake_mesh
from paradize.bakers.registry import make_color
from paradize.build.bake import bake
from paradize.build.materials.map_sets import find_map_sets
from paradize.build.options import BuildOptions
from paradize.build.work import files_read_by
from paradize.checks import check_paths
from paradize.errors import SourceError
from paradize.explain.facts import explain
from paradize.export.scene import export
from paradize.formats.glb.document import glb_document
from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.scene.manifest import read_scene
from paradize.metrics.texels import decode_texels
from paradize.new.scene import new_scene
from paradize.scene.requirements import require
from paradize.scene.settings import load_scene
from paradize.tradeoff import scene as tradeoff_scene
from paradize.tradeoff.curve import Group
from paradize.watch.rebake import bake_again
from tests.pipeline.bakes import bake_apart
from tests.pipeline.readers.gltf.made import SQUARE, Made, shown, square
from tests.pipeline.small_scenes import cut
from tests.sweeps import sweep

UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store that knows what stands around a model in a new scene."""
    top = tmp_path_factory.mktemp("known")
    bake_apart(new_scene(top / "s", panel().glb(top / "Other.glb")).scene, top)
    return top / "store"


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, known: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(shutil.copytree(known, tmp_path / "store")))
    monkeypatch.setenv("PARADIZE_REPORT", "")


def checker(shade: int = 200, edge: int = 16, *, alpha: int | None = None) -> bytes:
    """A PNG of edge x edge texels. alpha: of one of them."""
    texels = np.indices((edge, edge)).sum(axis=0) % 2 * shade
    texels = np.repeat(texels[:, :, None], 3, axis=2).astype(np.uint8)
    if alpha is not None:
        texels = np.dstack([texels, np.full((edge, edge), 255, np.uint8)])
        texels[3, 3, 3] = alpha
    file = io.BytesIO()
    Image.fromarray(texels).save(file, "png")
    return file.getvalue()


def panel(**image: object) -> Made:
    """A square with a colour map: a picture as given, else embedded."""
    made, primitive = square(TEXCOORD_0=UVS, NORMAL=np.tile(np.float32([0, 0, 1]), (4, 1)))
    entry = image or {"bufferView": made.view(checker()), "mimeType": "image/png"}
    texture = {"index": made.add("textures", source=made.add("images", **entry))}
    paint = {"baseColorTexture": texture, "metallicFactor": 0}
    primitive["material"] = made.add("materials", name="paint", pbrMetallicRoughness=paint)
    return shown(primitive, made)


def scene_of(folder: Path, model: Path) -> Path:
    """A new scene of a model, without the sky and the ground that stand around it."""
    return cut(new_scene(folder, model).scene, "[fog]", "[[object]]")


def states(scene: Path, out: Path) -> dict[str, str]:
    report = bake(scene, out, BuildOptions(jobs=1))
    assert not report.errors
    return {row.name: row.status for row in report.artifacts}


def test_a_scene_of_a_glb_bakes_the_pictures_inside_it(tmp_path: Path) -> None:
    made = new_scene(tmp_path / "s", panel().glb(tmp_path / "Panel.glb"))
    assert not made.notes and "model/Panel.glb" in made.files
    assert len(load_scene(made.scene).objects) == 1
    first = states(made.scene, tmp_path / "out")
    assert {"panel_mesh", "panel_color"} <= first.keys()
    assert set(states(made.scene, tmp_path / "out").values()) == {"reused"}


def test_bumps_are_made_of_the_colour_of_a_glb_only_where_the_scene_gives_their_strength(
    tmp_path: Path,
) -> None:
    scene = scene_of(tmp_path / "s", panel().glb(tmp_path / "Panel.glb"))
    assert "panel_normal" not in states(scene, tmp_path / "out")
    text = scene.read_text()
    scene.write_text(text.replace("[[object]]", "[[object]]\nstrength = 1.0", 1))
    assert "panel_normal" in states(scene, tmp_path / "out")


def tiled_panel(folder: Path, **sampler: int) -> Path:
    """The scene of a square that shows its colour map three times along each axis."""
    made = panel()
    made.tree["samplers"] = [sampler]
    made.tree["textures"][0]["sampler"] = 0
    paint = made.tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    paint["extensions"] = {"KHR_texture_transform": {"scale": [3.0, 3.0]}}
    made.tree["extensionsUsed"] = ["KHR_texture_transform"]
    folder.mkdir(exist_ok=True)
    return scene_of(folder / "s", made.glb(folder / "Panel.glb"))


CLAMP, MIRROR, REPEAT = 33071, 33648, 10497


@pytest.mark.parametrize(
    ("u", "v", "words", "wrap"),
    sweep(
        [
            (CLAMP, MIRROR, "", ["clamp", "mirror"]),
            (REPEAT, CLAMP, "", ["repeat", "clamp"]),
            (CLAMP, CLAMP, 'wrap = ["auto", "repeat"]', ["clamp", "repeat"]),
            (REPEAT, REPEAT, 'wrap = "mirror"', ["mirror", "mirror"]),
        ],
        test=[(CLAMP, CLAMP, 'wrap = ["auto", "repeat"]', ["clamp", "repeat"])],
    ),
)
def test_beyond_the_edges_of_a_map_lies_what_its_sampler_or_the_scene_says(
    u: int, v: int, words: str, wrap: list[str], tmp_path: Path
) -> None:
    scene = tiled_panel(tmp_path, wrapS=u, wrapT=v)
    scene.write_text(
        f"{scene.read_text()}\n[object.material.paint]\n{words}\n" if words else scene.read_text()
    )
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not report.errors and not any("wrap" in text for text in report.warnings)
    (item,) = read_scene(tmp_path / "out/scene.json")["objects"]
    assert item["materials"]["paint"]["wrap"] == wrap
    assert not [found for found in check_paths([tmp_path / "out"]) if found.code == "PZ231"]
    export(tmp_path / "out", tmp_path / "out.glb")
    tree = glb_document((tmp_path / "out.glb").read_bytes(), "out.glb")[0]
    codes = {"clamp": CLAMP, "mirror": MIRROR, "repeat": REPEAT}
    picture = next(k for k, one in enumerate(tree["images"]) if "panel" in one["name"])
    used = next(one["sampler"] for one in tree["textures"] if one["source"] == picture)
    assert [tree["samplers"][used][key] for key in ("wrapS", "wrapT")] == [codes[way] for way in wrap]


@pytest.mark.parametrize(
    ("opacity", "cutoff", "of_the_picture"), [(1.0, 0.6, 0.6), (0.75, 0.6, 0.8), (0.3, 0.6, 1.0)]
)
def test_mips_keep_the_holes_of_a_mask_whose_opacity_lowers_its_alpha(
    opacity: float, cutoff: float, of_the_picture: float, tmp_path: Path
) -> None:
    """The material compares opacity times alpha with its cutoff; mips know the picture's alpha alone."""
    made = panel()
    paint = made.tree["materials"][0]
    paint |= {"alphaMode": "MASK", "alphaCutoff": cutoff}
    made.tree["images"][0]["bufferView"] = made.view(checker(alpha=40))
    paint["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, opacity]
    scene = scene_of(tmp_path / "s", made.glb(tmp_path / "panel.glb"))
    (one,) = find_map_sets(load_scene(scene), scene).maps.sets
    assert one.alpha_cutoff == pytest.approx(of_the_picture)


@pytest.mark.parametrize("said", ["MASK", "BLEND"])
@pytest.mark.parametrize("see_through", ["nothing", "a texel", "the factor", "a vertex"])
def test_a_material_that_shows_nothing_behind_it_is_opaque_whatever_the_file_says(
    said: str, see_through: str, tmp_path: Path
) -> None:
    """Exporters call all materials of a model blended that has one of glass; blended walls hide each other in
    the order of their triangles."""
    made = panel()
    paint = made.tree["materials"][0]
    paint["alphaMode"] = said
    if see_through == "a texel":
        made.tree["images"][0]["bufferView"] = made.view(checker(alpha=40))
    elif see_through == "the factor":
        paint["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, 0.9]
    elif see_through == "a vertex":
        colors = made.array(np.float32([[1, 1, 1, 1]] * 3 + [[1, 1, 1, 0.5]]))
        made.tree["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colors
    scene = scene_of(tmp_path / "s", made.glb(tmp_path / "panel.glb"))
    (drawn,) = find_map_sets(load_scene(scene), scene).maps.objects["panel"].drawn.values()
    assert drawn.alpha_mode == ("opaque" if see_through == "nothing" else said.lower())


def test_a_map_that_is_clamped_is_not_filtered_over_its_edge(tmp_path: Path) -> None:
    sources = {}
    for name, code in (("clamp", CLAMP), ("mirror", MIRROR), ("repeat", REPEAT)):
        scene = tiled_panel(tmp_path / name, wrapS=code, wrapT=REPEAT)
        required = require(load_scene(scene), find_map_sets(load_scene(scene), scene).maps)
        sources[name] = next(job.settings["wrap"] for job in required.jobs if job.name == "panel colour")
    assert sources == {"clamp": ("clamp", "repeat"), "mirror": ("clamp", "repeat"), "repeat": "repeat"}


@pytest.mark.parametrize(
    ("code", "words", "nearest"), [(9728, "", True), (9729, "", False), (9728, "linear", False)]
)
def test_enlarged_texels_are_squares_where_the_sampler_or_the_scene_says_so(
    code: int, words: str, nearest: bool, tmp_path: Path
) -> None:
    scene = tiled_panel(tmp_path, magFilter=code)
    if words:
        scene.write_text(f'{scene.read_text()}\n[object.material.paint]\nfilter = "{words}"\n')
    (drawn,) = find_map_sets(load_scene(scene), scene).maps.objects["panel"].drawn.values()
    assert drawn.nearest is nearest


def test_colours_are_srgb_whatever_a_picture_of_a_gltf_says_of_them(tmp_path: Path) -> None:
    """glTF 2.0, 3.9.2. Programs of DirectX write a gamma of 1."""
    made = panel()
    gamma = b"gAMA" + struct.pack(">I", 100000)
    chunk = struct.pack(">I", 4) + gamma + struct.pack(">I", zlib.crc32(gamma))
    picture = checker(128)
    made.tree["images"][0]["bufferView"] = made.view(picture[:33] + chunk + picture[33:])
    texture = made.tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    made.tree["materials"][0] |= {"emissiveTexture": texture, "emissiveFactor": [1, 1, 1]}
    scene = scene_of(tmp_path / "s", made.glb(tmp_path / "panel.glb"))
    required = require(load_scene(scene), find_map_sets(load_scene(scene), scene).maps)
    jobs = {job.name: job for job in required.jobs}
    for name in ("panel colour", "panel emission"):
        (product,) = make_color(jobs[name].sources, jobs[name].settings, "balanced")
        assert not product.artifact.warnings
        texels = decode_texels(decode_ktx2(product.data))[:, :, :3]
        assert 255.0 * texels.max() == pytest.approx(128, abs=4), "not as linear light"
    light: Any = np.full((4, 4, 3), 0.5, np.float32)
    assert oiio.ImageBuf(light).write(str(tmp_path / "a.exr"))
    assert not color_values(tmp_path / "a.exr", None, (False, False), None, srgb=True)[1], "floats are light"


def test_maps_that_a_model_wraps_in_another_way_than_the_first_are_named(tmp_path: Path) -> None:
    made = panel()
    made.tree["samplers"] = [{}, {"wrapS": CLAMP}]
    made.tree["textures"] += [{"source": 0, "sampler": 1}]
    paint = made.tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    paint["extensions"] = {"KHR_texture_transform": {"scale": [3.0, 3.0]}}
    made.tree["materials"][0]["emissiveTexture"] = paint | {"index": 1}
    made.tree["extensionsUsed"] = ["KHR_texture_transform"]
    scene = scene_of(tmp_path / "s", made.glb(tmp_path / "Panel.glb"))
    (said,) = find_map_sets(load_scene(scene), scene).warnings
    assert said.endswith("the model says otherwise of emission: clamp, repeat")


def test_a_broken_picture_inside_a_model_is_named_by_the_model_and_not_by_the_store(tmp_path: Path) -> None:
    made = panel()
    half = made.view(checker()[:60])
    made.tree["images"][0] |= {"bufferView": half, "name": "bark"}
    scene = scene_of(tmp_path / "s", made.glb(tmp_path / "Panel.glb"))
    for _ in range(2):  # the second bake knows the model's materials from the store
        report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
        assert report.errors
        for text in (*map(str, report.errors), *report.warnings):
            assert str(tmp_path / "store") not in text
        assert any(error.file == f"{tmp_path}/s/model/Panel.glb: picture 'bark'" for error in report.errors)


def test_a_warning_of_a_picture_inside_a_model_names_the_model(tmp_path: Path) -> None:
    made = panel()
    rough, shade = (
        {"index": made.add("textures", source=made.add("images", bufferView=made.view(data), name=name))}
        for name, data in (("polish", checker()), ("hollow", checker(edge=8)))
    )
    (paint,) = made.tree["materials"]
    paint["pbrMetallicRoughness"] |= {"metallicRoughnessTexture": rough, "metallicFactor": 1}
    paint["occlusionTexture"] = shade
    scene = scene_of(tmp_path / "s", made.glb(tmp_path / "Panel.glb"))
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not report.errors
    assert any(f"{tmp_path}/s/model/Panel.glb: picture 'hollow'" in text for text in report.warnings)
    assert not any(str(tmp_path / "store") in text for text in report.warnings)


def test_explain_and_measure_name_a_picture_inside_a_model_by_the_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_of(tmp_path / "s", panel().glb(tmp_path / "Panel.glb"))
    name = f"{tmp_path}/s/model/Panel.glb: picture 'image 0'"
    (color,) = explain(scene, "panel_color").artifacts
    assert color["sources"]["image"] == name

    def broken(_: str, __: object, arguments: dict[str, Any], ___: Path) -> list[Group]:
        job = next(job for job in arguments["jobs"] if job.name == "panel colour")
        raise SourceError("is gone", file=job.sources["image"])

    monkeypatch.setattr(tradeoff_scene, "bake", lambda *_: SimpleNamespace(errors=[], rows=[]))
    monkeypatch.setattr(tradeoff_scene, "plan_in_worker", broken)
    with pytest.raises(SourceError) as caught:
        tradeoff_scene.measure_scene(scene)
    assert caught.value.file == name


def test_an_unlit_material_has_no_maps_made_of_its_colour_and_keeps_its_vertex_colours(
    tmp_path: Path,
) -> None:
    made = panel()
    made.tree["materials"][0]["extensions"] = {"KHR_materials_unlit": {}}
    made.tree["extensionsUsed"] = ["KHR_materials_unlit"]
    half = made.array(np.full((4, 4), 0.5, np.float32))
    made.tree["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = half
    scene = scene_of(tmp_path / "s", made.glb(tmp_path / "Panel.glb"))
    scene.write_text(scene.read_text().replace("[[object]]", "[[object]]\nstrength = 1.0", 1))
    found = find_map_sets(load_scene(scene), scene)
    assert [one.derived for one in found.maps.sets] == [()]
    assert not found.warnings
    (drawn,) = found.maps.objects["panel"].drawn.values()
    assert drawn.unlit and drawn.vertex_colors
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not report.errors
    export(tmp_path / "out", tmp_path / "all.glb")
    tree, _ = glb_document((tmp_path / "all.glb").read_bytes(), "all.glb")
    paint = next(one for one in tree["materials"] if one["name"].endswith("paint"))
    assert paint["extensions"] == {"KHR_materials_unlit": {}}
    assert paint["pbrMetallicRoughness"]["baseColorTexture"] and "emissiveTexture" not in paint
    (mesh,) = (one for one in tree["meshes"] if one["name"] == "panel")
    assert "COLOR_0" in mesh["primitives"][0]["attributes"]


def test_a_changed_buffer_or_picture_beside_bakes_what_is_made_of_it(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in/red one.png").write_bytes(checker())
    document = panel(uri="red%20one.png")
    (tmp_path / "in/points.bin").write_bytes(document.data)
    made = new_scene(tmp_path / "s", document.gltf(tmp_path / "in/panel.gltf", "points.bin"))
    folder = tmp_path / "s/model"
    assert {"model/points.bin", "model/red one.png"} <= {*made.files}
    states(made.scene, tmp_path / "out")
    data = bytearray((folder / "points.bin").read_bytes())
    data[: SQUARE.nbytes] = (SQUARE * np.float32(1.5)).tobytes()
    (folder / "points.bin").write_bytes(data)
    again = states(made.scene, tmp_path / "out")
    assert again["panel_mesh"] == "baked" and again["sand_color"] == "reused"
    (folder / "red one.png").write_bytes(checker(100))
    again = states(made.scene, tmp_path / "out")
    assert (again["panel_mesh"], again["panel_color"]) == ("reused", "baked")


def test_watch_waits_for_the_files_beside_a_model_and_a_cluster_is_sent_them(tmp_path: Path) -> None:
    document = panel()
    (tmp_path / "points.bin").write_bytes(document.data)
    model = document.gltf(tmp_path / "panel.gltf", "points.bin")
    scene = scene_of(tmp_path / "s", model)
    found = bake_again(scene, tmp_path / "out", 1, None, None, None, False)
    assert not found.errors
    assert tmp_path / "s/model/points.bin" in found.reads
    assert files_read_by([model], tmp_path) == {model: True, tmp_path / "points.bin": True}
    (tmp_path / "s/model/points.bin").unlink()
    lost = bake_again(scene, tmp_path / "out", 1, None, None, None, False)
    assert lost.errors and tmp_path / "s/model/points.bin" in lost.reads


def test_a_model_that_cannot_be_read_leaves_no_folder(tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps({"asset": {"version": "2.0"}}))
    with pytest.raises(SourceError, match="shows no triangles"):
        new_scene(tmp_path / "s", path)
    assert not (tmp_path / "s").exists()


def test_tangents_follow_the_coordinates_of_the_normal_map(tmp_path: Path) -> None:
    """On second ones that are turned against the first; of a scene's own normal map, on the first."""
    flat = np.tile(np.float32([0, 0, 1]), (4, 1))
    made, primitive = square(TEXCOORD_0=UVS, TEXCOORD_1=UVS[:, ::-1], NORMAL=flat)
    held = io.BytesIO()
    Image.new("RGB", (16, 16), (188, 128, 239)).save(held, "PNG")
    pictures = (checker(), held.getvalue())
    images = [made.add("images", bufferView=made.view(data), mimeType="image/png") for data in pictures]
    color, bumps = ({"index": made.add("textures", source=image)} for image in images)
    primitive["material"] = made.add(
        "materials",
        name="paint",
        pbrMetallicRoughness={"baseColorTexture": color},
        normalTexture=bumps | {"texCoord": 1},
    )
    model = shown(primitive, made).glb(tmp_path / "Panel.glb")
    scene = scene_of(tmp_path / "s", model)
    assert states(scene, tmp_path / "out").keys() >= {"panel_second_normal"}
    (mesh,) = (tmp_path / "out").glob("panel_mesh-*.glb")
    alone = bake_mesh(model, lods=1).lods[0].mesh
    for level in (decode_glb(mesh.read_bytes())[0].mesh, alone):
        assert level.tangents is not None and level.uvs is not None and level.uvs1 is not None
        assert np.allclose(level.tangents, [0, -1, 0, -1], atol=1e-2)  # UVS run down, u of the second too
    Image.new("RGB", (16, 16), (128, 128, 255)).save(scene.parent / "own.png")
    said = '[object.material.paint]\nnormal = "own.png"\n'
    scene.write_text(scene.read_text().replace("[[object.instance]]", said + "[[object.instance]]", 1))
    required = require(load_scene(scene), find_map_sets(load_scene(scene), scene).maps)
    assert [job.settings["second_frames"] for job in required.jobs if job.baker == "mesh"] == [[]]


def two_sets() -> Made:
    """A square whose occlusion lies on second texture coordinates, beside metalness on the first."""
    flat = np.tile(np.float32([0, 0, 1]), (4, 1))
    made, primitive = square(TEXCOORD_0=3 * UVS, TEXCOORD_1=UVS, NORMAL=flat)
    pictures = [
        made.add("images", bufferView=made.view(checker(k)), mimeType="image/png") for k in (200, 90, 40)
    ]
    color, metal, shade = ({"index": made.add("textures", source=image)} for image in pictures)
    primitive["material"] = made.add(
        "materials",
        name="paint",
        pbrMetallicRoughness={"baseColorTexture": color, "metallicRoughnessTexture": metal},
        occlusionTexture=shade | {"texCoord": 1},
    )
    return shown(primitive, made)


def test_a_map_on_second_coordinates_is_baked_drawn_and_exported_there(tmp_path: Path) -> None:
    scene = scene_of(tmp_path / "s", two_sets().glb(tmp_path / "Panel.glb"))
    out = tmp_path / "out"
    assert {"panel_occlusion", "panel_second_occlusion"} <= states(scene, out).keys()
    manifest = read_scene(out / "scene.json")
    (item,) = (one for one in manifest["objects"] if one["name"] == "panel")
    paint = item["materials"]["paint"]
    nothing = dict.fromkeys(("normal", "gloss", "emission"))
    assert paint["maps"]["occlusion"] == "panel_occlusion"
    assert paint["second"] == {
        "maps": nothing | {"occlusion": "panel_second_occlusion"},
        "wrap": ["repeat", "repeat"],
    }
    tree, _ = glb_document((out / manifest["artifacts"]["panel_mesh"]["file"]).read_bytes(), "mesh")
    attributes = tree["meshes"][0]["primitives"][0]["attributes"]
    assert {"TEXCOORD_0", "TEXCOORD_1"} <= attributes.keys()
    detail = {name: entry["required_detail"] for name, entry in manifest["artifacts"].items()}
    wide, narrow = (detail[name]["texels"] for name in ("panel_color", "panel_second_occlusion"))
    assert wide == pytest.approx(3 * narrow, rel=1e-4)
    found = check_paths([out])
    assert not [one for one in found if one.severity == "error"], found
    exported = export(out, tmp_path / "all.glb")
    tree, _ = glb_document(exported.file.read_bytes(), "all.glb")
    (material,) = (one for one in tree["materials"] if one["name"] == "panel paint")
    assert material["occlusionTexture"]["texCoord"] == 1
    assert "texCoord" not in material["pbrMetallicRoughness"]["metallicRoughnessTexture"]
