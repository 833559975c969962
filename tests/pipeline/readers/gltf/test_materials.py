"""The materials of a glTF model: factors, pictures, and the texture coordinates that they lie on."""

from __future__ import annotations

import base64
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.build.materials.placed_pictures import with_placed_pictures
from paradize.errors import SourceError
from paradize.material import Material
from paradize.readers.model import Model, read_model
from tests.pipeline.readers.gltf.made import PNG, Made, shown, square
from tests.processor_time import ratio

UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)


def read(tmp_path: Path, made: Made, primitive: dict[str, Any], **material: Any) -> tuple[Material, Model]:
    primitive["material"] = made.add("materials", **material)
    model = read_model(shown(primitive, made).glb(tmp_path / "a.glb"))
    return model.materials[model.mesh.groups[0].material], model


def textured(made: Made, **texture: Any) -> int:
    """A texture of the red picture, embedded."""
    image = made.add("images", bufferView=made.view(PNG), mimeType="image/png", name="red")
    return made.add("textures", **({"source": image} | texture))


def test_an_alpha_cutoff_above_one_hides_the_material(tmp_path: Path) -> None:
    """glTF allows it: nothing is drawn."""
    material, model = read(tmp_path, *square(), alphaMode="MASK", alphaCutoff=1.1)
    assert (material.alpha_mode, material.alpha_cutoff, material.opacity) == ("mask", 1.0, 0.0)
    assert any("alphaCutoff 1.1" in text for text in model.warnings)
    material, _ = read(tmp_path, *square(), alphaMode="OPAQUE", alphaCutoff=1.1)
    assert (material.alpha_mode, material.opacity) == ("opaque", 1.0)


def test_values_of_a_sampler_that_gltf_does_not_know_are_named(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    sampler = made.add("samplers", wrapS=10496, wrapT=33071, magFilter=9987, minFilter=5)
    texture = {"index": textured(made, sampler=sampler)}
    found, model = read(tmp_path, made, primitive, pbrMetallicRoughness={"baseColorTexture": texture})
    assert found.maps["color"].wrap == ("repeat", "clamp") and not found.maps["color"].nearest
    assert [text.split(": ", 1)[1] for text in model.warnings] == [
        "/samplers/0/wrapS: 10496 is none of 33071, 33648, 10497; taken as repeat",
        "/samplers/0/magFilter: 9987 is none of 9728, 9729; taken as linear",
        "/samplers/0/minFilter: 5 is none of 9728, 9729, 9984, 9985, 9986, 9987; taken as trilinear",
    ]


def test_factors_and_maps_fill_the_record(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    sampler = made.add("samplers", wrapS=33071, wrapT=33648)
    texture = {"index": textured(made, sampler=sampler)}
    found, _ = read(
        tmp_path,
        made,
        primitive,
        name="wood",
        alphaMode="MASK",
        alphaCutoff=0.25,
        doubleSided=True,
        emissiveFactor=[1, 0.5, 0],
        emissiveTexture=texture,
        normalTexture=texture | {"scale": 0.5},
        occlusionTexture=texture | {"strength": 0.75},
        pbrMetallicRoughness={
            "baseColorFactor": [0.5, 0.25, 1, 0.5],
            "baseColorTexture": texture,
            "metallicRoughnessTexture": texture,
            "metallicFactor": 0.25,
            "roughnessFactor": 0.125,
        },
        extensions={
            "KHR_materials_emissive_strength": {"emissiveStrength": 4},
            "KHR_materials_ior": {"ior": 1.25},
        },
    )
    assert (found.name, found.color, found.opacity) == ("wood", (0.5, 0.25, 1.0), 0.5)
    assert (found.alpha_mode, found.alpha_cutoff, found.two_sided) == ("mask", 0.25, True)
    assert (found.metalness, found.roughness, found.green_down) == (0.25, 0.125, False)
    assert (found.emission, found.normal_scale, found.occlusion_strength) == ((4.0, 2.0, 0.0), 0.5, 0.75)
    assert found.specular == pytest.approx(0.25 / 2.25**2 / 0.04 * 0.25)
    channels = {role: source.channel for role, source in found.maps.items()}
    assert channels == {
        **{"color": "rgb", "alpha": "a", "normal": "rgb", "emission": "rgb"},
        **{"roughness": "g", "metalness": "b", "occlusion": "r"},
    }
    color = found.maps["color"]
    assert color.wrap == ("clamp", "mirror") and color.picture.data == PNG
    assert color.picture == found.maps["normal"].picture


def test_an_opaque_material_has_no_alpha(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    base = {"baseColorTexture": {"index": textured(made)}, "baseColorFactor": [1, 1, 1, 0.5]}
    found, _ = read(tmp_path, made, primitive, pbrMetallicRoughness=base)
    assert (found.opacity, found.alpha_mode, "alpha" in found.maps) == (1.0, "opaque", False)


def test_a_primitive_without_a_material_has_gltfs_default(tmp_path: Path) -> None:
    made, primitive = square()
    model = read_model(shown(primitive, made).glb(tmp_path / "a.glb"))
    found = model.materials[model.mesh.groups[0].material]
    assert (found.color, found.metalness, found.roughness) == ((1.0, 1.0, 1.0), 1.0, 1.0)


def test_materials_of_one_name_or_none_stay_apart(tmp_path: Path) -> None:
    made, primitive = square()
    names = ["wood", "wood", None, "default", "two\nlines"]
    entries = [{} if name is None else {"name": name} for name in names]
    numbers = [made.add("materials", **entry) for entry in entries]
    made.show(made.add("nodes", mesh=made.mesh(*({**primitive, "material": k} for k in numbers))))
    model = read_model(made.glb(tmp_path / "a.glb"))
    assert [group.material for group in model.mesh.groups] == list(model.materials)
    assert list(model.materials) == ["wood", "wood_1", "material_2", "default_1", "two\\nlines"]


@pytest.mark.parametrize("form", ["beside", "data"])
def test_pictures_beside_and_in_the_text_are_read(form: str, tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    (tmp_path / "a red one.png").write_bytes(PNG)
    uri = (
        "a%20red%20one.png" if form == "beside" else f"data:image/png;base64,{base64.b64encode(PNG).decode()}"
    )
    texture = made.add("textures", source=made.add("images", uri=uri))
    found, _ = read(tmp_path, made, primitive, normalTexture={"index": texture})
    picture = found.maps["normal"].picture
    assert picture.file.name == ("a red one.png" if form == "beside" else "a.glb")
    assert picture.data == (None if form == "beside" else PNG)


@pytest.mark.parametrize(
    "uri", ["../../out.png", "/etc/passwd", "http://a.b/c.png", "file:///etc/passwd", "none.png"]
)
def test_a_picture_that_is_missing_or_outside_is_left_out_with_its_name(uri: str, tmp_path: Path) -> None:
    (tmp_path / "out.png").write_bytes(PNG)
    folder = tmp_path / "models/model"
    folder.mkdir(parents=True)
    made, primitive = square(TEXCOORD_0=UVS)
    texture = made.add("textures", source=made.add("images", uri=uri))
    found, model = read(folder, made, primitive, normalTexture={"index": texture})
    assert not found.maps and any(repr(uri) in text for text in model.warnings)
    assert [path.name for path in model.absent] == (["none.png"] if uri == "none.png" else [])


def test_a_transform_moves_the_coordinates_of_its_material_alone(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    moved = {"offset": [0.25, 0], "scale": [2, 1], "rotation": pi / 2}
    texture = {"index": textured(made), "extensions": {"KHR_texture_transform": moved}}
    plain = made.add("materials", name="plain")
    turned = made.add("materials", name="turned", pbrMetallicRoughness={"baseColorTexture": texture})
    meshes = [primitive | {"material": number} for number in (plain, turned)]
    made.show(made.add("nodes", mesh=made.mesh(*meshes)))
    mesh = read_model(made.glb(tmp_path / "a.glb")).mesh
    assert mesh.uvs is not None
    uvs = mesh.uvs[mesh.triangles.reshape(-1)]
    before = UVS[np.array([0, 1, 2, 0, 2, 3])]
    assert np.array_equal(uvs[:6], before)
    expected = np.stack([before[:, 1] + 0.25, -2 * before[:, 0]], axis=1)  # the rule of the extension
    assert np.abs(uvs[6:] - expected).max() < 1e-7


def test_maps_on_other_coordinates_than_the_colour_lie_on_second_ones(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS, TEXCOORD_1=UVS * np.float32(0.5))
    index = textured(made)
    base = {"baseColorTexture": {"index": index, "texCoord": 1}}
    found, model = read(
        tmp_path, made, primitive, pbrMetallicRoughness=base, occlusionTexture={"index": index}
    )
    assert list(found.maps) == ["color", "occlusion"] and found.second == ("occlusion",)
    assert not model.warnings and model.mesh.uvs is not None and model.mesh.uvs1 is not None
    assert np.array_equal(model.mesh.uvs, model.mesh.uvs1 * np.float32(0.5))


def test_a_map_on_third_coordinates_is_left_out_by_name(tmp_path: Path) -> None:
    sets = {f"TEXCOORD_{k}": UVS * np.float32(1 + k) for k in range(3)}
    made, primitive = square(**sets)
    index = textured(made)
    base = {"baseColorTexture": {"index": index}}
    emission = {"emissiveTexture": {"index": index, "texCoord": 1}, "emissiveFactor": [1, 1, 1]}
    occlusion = {"occlusionTexture": {"index": index, "texCoord": 2}}
    found, model = read(tmp_path, made, primitive, pbrMetallicRoughness=base, **emission, **occlusion)
    assert set(found.maps) == {"color", "emission"} and found.second == ("emission",)
    (said,) = model.warnings
    assert "its map of occlusion (TEXCOORD_2) left out" in said
    assert "where that of color does (TEXCOORD_0) or that of emission (TEXCOORD_1)" in said


def test_a_third_map_in_whole_tiles_of_the_colours_coordinates_is_drawn_anew(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    index = textured(made)
    made.tree["extensionsUsed"] = ["KHR_texture_transform"]

    def moved(**transform: Any) -> dict[str, Any]:
        return {"index": index, "extensions": {"KHR_texture_transform": transform}}

    found, model = read(
        tmp_path,
        made,
        primitive,
        pbrMetallicRoughness={
            "baseColorTexture": moved(scale=[2, 1], offset=[0.25, 0]),
            "metallicRoughnessTexture": moved(scale=[3, 1]),  # one and a half tiles
        },
        emissiveTexture=moved(scale=[-4, 3], offset=[0.5, 0.25]),
        emissiveFactor=[1, 1, 1],
    )
    assert found.second == ("roughness", "metalness") and not model.warnings
    placed = found.maps["emission"].placed
    assert placed is not None and np.allclose(placed, [(-2.0, 0.0), (3.0, 0.25)], atol=1e-12)
    drawn = with_placed_pictures(found).maps["emission"]
    assert (
        drawn.placed is None
        and drawn.picture.data
        and drawn.picture.data != found.maps["emission"].picture.data
    )


@pytest.mark.parametrize(
    ("transform", "moved"),
    [
        ({"scale": [4, 2], "offset": [0.5, 0]}, lambda u, v: (4 * u + 0.5, 2 * v)),
        ({"rotation": 0.5 * np.pi}, lambda u, v: (v, -u)),
        ({"scale": [-1, 1]}, lambda u, v: (-u, v)),
        ({"texCoord": 1}, lambda u, v: (0.5 * v, 0.25 * u)),
    ],
)
def test_a_normal_map_may_lie_on_second_coordinates_of_any_kind(
    transform: dict[str, Any], moved: Callable[..., Any], tmp_path: Path
) -> None:
    made, primitive = square(TEXCOORD_0=UVS, TEXCOORD_1=UVS[:, ::-1] * np.float32([0.5, 0.25]))
    index = textured(made)
    made.tree["extensionsUsed"] = ["KHR_texture_transform"]
    base = {"baseColorTexture": {"index": index}}
    normal = {"index": index, "extensions": {"KHR_texture_transform": transform}}
    found, model = read(tmp_path, made, primitive, pbrMetallicRoughness=base, normalTexture=normal)
    assert "normal" in found.maps and found.second == ("normal",) and not model.warnings
    assert model.mesh.uvs is not None and model.mesh.uvs1 is not None
    assert np.allclose(model.mesh.uvs1, np.stack(moved(*model.mesh.uvs.T), axis=1), atol=1e-6)


def test_a_second_set_of_coordinates_that_is_the_first_again_loses_no_map(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS, TEXCOORD_1=UVS)
    index = textured(made)
    occlusion = {"index": index, "texCoord": 1}
    base = {"baseColorTexture": {"index": index}}
    found, model = read(tmp_path, made, primitive, pbrMetallicRoughness=base, occlusionTexture=occlusion)
    assert set(found.maps) == {"color", "occlusion"} and not model.warnings
    moved = occlusion | {"extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}
    made.tree["materials"][0]["occlusionTexture"] = moved
    made.tree["extensionsUsed"] = ["KHR_texture_transform"]
    model = read_model(made.glb(tmp_path / "b.glb"))
    assert model.mesh.uvs is not None and model.mesh.uvs1 is not None and not model.warnings
    assert np.array_equal(model.mesh.uvs1, 2 * model.mesh.uvs)


@pytest.mark.parametrize(
    ("specular", "metalness", "color"),
    [
        ([0.0] * 3, 0.0, (0.5, 0.5, 0.5)),
        ([0.04] * 3, 0.0, (0.5, 0.5, 0.5)),
        ([1.0] * 3, 1.0, (1.0, 1.0, 1.0)),
    ],
)
def test_the_older_model_of_light_is_converted_and_said(
    specular: list[float], metalness: float, color: tuple[float, ...], tmp_path: Path
) -> None:
    made, primitive = square()
    older = {"diffuseFactor": [0.5, 0.5, 0.5, 1], "specularFactor": specular, "glossinessFactor": 0.75}
    found, model = read(tmp_path, made, primitive, extensions={"KHR_materials_pbrSpecularGlossiness": older})
    assert (found.metalness, found.roughness, *found.color) == pytest.approx((metalness, 0.25, *color))
    assert any("pbrSpecularGlossiness is converted" in text for text in model.warnings)
    beside = {"extensions": {"KHR_materials_pbrSpecularGlossiness": older}, "pbrMetallicRoughness": {}}
    assert read(tmp_path, *square(), **beside)[0] == found, "some exporters write an empty table"


def test_the_older_model_of_light_without_numbers_is_a_white_mirror(tmp_path: Path) -> None:
    found, _ = read(tmp_path, *square(), extensions={"KHR_materials_pbrSpecularGlossiness": {}})
    assert (*found.color, found.metalness, found.roughness) == pytest.approx((1.0, 1.0, 1.0, 1.0, 0.0))
    dull = {"KHR_materials_pbrSpecularGlossiness": {"specularFactor": [0, 0, 0]}}
    assert read(tmp_path, *square(), extensions=dull)[0].color == (1.0, 1.0, 1.0)


def test_a_glossiness_picture_that_is_missing_makes_no_metal(tmp_path: Path) -> None:
    """Its factor, white where none is said, is no colour of the material's own."""
    made, primitive = square(TEXCOORD_0=UVS)
    index = made.add("textures", source=made.add("images", uri="gone.png"))
    older = {"diffuseFactor": [0.5, 0.25, 1, 1], "specularGlossinessTexture": {"index": index}}
    found, _ = read(tmp_path, made, primitive, extensions={"KHR_materials_pbrSpecularGlossiness": older})
    assert (found.color, found.metalness, found.maps) == ((0.5, 0.25, 1.0), 0.0, {})


@pytest.mark.parametrize(("mode", "opacity"), [("OPAQUE", 1.0), ("BLEND", 0.25)])
def test_the_older_model_of_light_is_transparent_where_the_material_is(
    mode: str, opacity: float, tmp_path: Path
) -> None:
    extensions = {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.5, 0.5, 0.5, 0.25]}}
    assert read(tmp_path, *square(), alphaMode=mode, extensions=extensions)[0].opacity == opacity


def test_the_colour_of_a_glossiness_picture_is_kept_for_the_bake_where_the_colour_lies_there_too(
    tmp_path: Path,
) -> None:
    def older(**more: Any) -> tuple[Material, list[str]]:
        made, primitive = square(TEXCOORD_0=UVS, TEXCOORD_1=UVS[::-1])
        index = textured(made)
        table = {
            "diffuseFactor": [0.5, 0.25, 1, 1],
            "specularFactor": [1, 0.5, 0.25],
            "glossinessFactor": 0.75,
        }
        table |= {"specularGlossinessTexture": {"index": index} | more, "diffuseTexture": {"index": index}}
        extensions = {"KHR_materials_pbrSpecularGlossiness": table}
        found, model = read(tmp_path, made, primitive, extensions=extensions)
        return found, [text for text in model.warnings if "specularGlossinessTexture" in text]

    found, warnings = older()
    assert found.maps.keys() == {"color", "smoothness"} and not warnings
    assert (found.metalness, found.color) == (0.0, (0.5, 0.25, 1.0))
    assert (found.roughness, found.smoothness) == (1.0, 0.75), (
        "the factor multiplies the picture's glossiness"
    )
    assert found.reflected and found.reflected.color == (1.0, 0.5, 0.25)
    source = found.reflected.source
    assert (source.channel, source.srgb, source.picture) == ("rgb", True, found.maps["smoothness"].picture)
    found, (text,) = older(texCoord=1)
    assert found.reflected is None and found.maps.keys() == {"color", "smoothness"}
    assert "/materials/0/extensions/KHR_materials_pbrSpecularGlossiness" in text
    assert "lies elsewhere than the map of color, and its colour is left out: metal is drawn as no" in text


def test_a_glossiness_picture_of_a_material_that_no_light_changes_is_left_out(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    texture = {"index": textured(made)}
    older = {"diffuseTexture": texture, "specularGlossinessTexture": texture}
    extensions = {"KHR_materials_pbrSpecularGlossiness": older, "KHR_materials_unlit": {}}
    found, _ = read(tmp_path, made, primitive, extensions=extensions)
    assert found.reflected is None and found.maps.keys() == {"color", "emission"}


def test_a_material_that_no_light_changes_gives_off_its_colour(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    base = {"baseColorTexture": {"index": textured(made)}, "baseColorFactor": [0.5, 0.25, 1, 1]}
    unlit = {"KHR_materials_unlit": {}}
    found, model = read(tmp_path, made, primitive, pbrMetallicRoughness=base, extensions=unlit)
    assert (found.color, found.emission, found.specular) == ((0.0, 0.0, 0.0), (0.5, 0.25, 1.0), 0.0)
    assert found.maps["emission"] == found.maps["color"]
    assert not any("unlit" in text for text in model.warnings)


@pytest.mark.parametrize("name", ["KHR_texture_ktx", "EXT_texture_avif", "EXT_texture_webp"])
def test_pictures_of_extensions_are_read_or_left_out_by_their_name(name: str, tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    data = {
        "KHR_texture_ktx": b"\xabKTX 20\xbb\r\n\x1a\n\x2b\0\0\0",
        "EXT_texture_avif": b"\0\0\0\x1cftypavif",
        "EXT_texture_webp": b"RIFF\0\0\0\0WEBPVP8 ",
    }[name]
    image = made.add("images", bufferView=made.view(data), mimeType="image/x")
    texture = made.add("textures", extensions={name: {"source": image}})
    made.tree["extensionsUsed"] = made.tree["extensionsRequired"] = [name]
    found, model = read(tmp_path, made, primitive, normalTexture={"index": texture})
    assert bool(found.maps) == (name != "KHR_texture_ktx")
    assert any(name in text for text in model.warnings) == (not found.maps)


def test_a_ktx2_file_for_a_gpu_is_left_out_with_advice(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    (tmp_path / "a.ktx2").write_bytes(b"\xabKTX 20\xbb\r\n\x1a\n\x2b\0\0\0")
    texture = made.add("textures", source=made.add("images", uri="a.ktx2"))
    found, model = read(tmp_path, made, primitive, normalTexture={"index": texture})
    assert not found.maps
    assert any("'a.ktx2': KTX2 is not read; left out; npx" in text for text in model.warnings)


def test_an_extension_that_is_not_read_is_named_and_refused_only_where_it_is_required(tmp_path: Path) -> None:
    made, primitive = square()
    made.tree["extensionsUsed"] = ["KHR_materials_clearcoat", "ACME_gizmo"]
    model = read_model(shown(primitive, made).glb(tmp_path / "a.glb"))
    assert [text.partition(": ")[2] for text in model.warnings] == [
        "extension KHR_materials_clearcoat is left out: clear coats",
        "extension ACME_gizmo is left out",
    ]
    plain = ["FB_ngon_encoding", "VRM", "VRMC_vrm", "VRMC_springBone", "VRMC_node_constraint"]
    made.tree["extensionsRequired"] = plain
    told = read_model(made.glb(tmp_path / "b.glb")).warnings
    assert [text.partition(" extension ")[2].partition(" is left out: ")[0] for text in told[:5]] == plain
    made.tree["extensionsRequired"] = ["ACME_gizmo"]
    with pytest.raises(SourceError, match="needs the extension ACME_gizmo, which is not read"):
        read_model(made.glb(tmp_path / "b.glb"))


OUT_OF_RANGE: list[tuple[dict[str, Any], str, dict[str, Any]]] = [
    (
        {"pbrMetallicRoughness": {"metallicFactor": 7, "roughnessFactor": -2}},
        "/pbrMetallicRoughness/metallicFactor: 7, expected 0 to 1; read as 1",
        {"metalness": 1.0, "roughness": 0.0},
    ),
    (
        {"pbrMetallicRoughness": {"baseColorFactor": [2, -1, 0.5, 3]}},
        "/pbrMetallicRoughness/baseColorFactor: 2 -1 0.5 3, expected 0 to 1; read as 1 0 0.5 1",
        {"color": (1.0, 0.0, 0.5)},
    ),
    (
        {"alphaMode": "MASK", "alphaCutoff": -1},
        "/alphaCutoff: -1, expected 0 or more; read as 0",
        {"alpha_cutoff": 0.0},
    ),
    (
        {"emissiveFactor": [-1, 0, 1e30]},
        "/emissiveFactor: -1 0 1e+30, expected 0 to 1e+07; read as 0 0 1e+07",
        {"emission": (0.0, 0.0, 1e7)},
    ),
    (
        {"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": -4}}},
        "/extensions/KHR_materials_emissive_strength/emissiveStrength: -4, expected 0 or more; read as 0",
        {"emission": (0.0, 0.0, 0.0)},
    ),
    (
        {"extensions": {"KHR_materials_ior": {"ior": 0.5}}},
        "/extensions/KHR_materials_ior/ior: 0.5, expected 1 or more; read as 1",
        {"specular": 0.0},
    ),
    (
        {"extensions": {"KHR_materials_specular": {"specularColorFactor": [-1, 0, 0]}}},
        "/extensions/KHR_materials_specular/specularColorFactor: -1 0 0, expected 0 or more; read as 0 0 0",
        {"specular": 0.0},
    ),
    (
        {"extensions": {"KHR_materials_specular": {"specularFactor": 5}}},
        "/extensions/KHR_materials_specular/specularFactor: 5, expected 0 to 1; read as 1",
        {"specular": 1.0},
    ),
    (
        {"extensions": {"KHR_materials_pbrSpecularGlossiness": {"glossinessFactor": 9}}},
        "/extensions/KHR_materials_pbrSpecularGlossiness/glossinessFactor: 9, expected 0 to 1; read as 1",
        {"roughness": 0.0},
    ),
    (
        {"normalTexture": {"index": 0, "scale": 1e30}, "occlusionTexture": {"index": 0, "strength": 4}},
        "/occlusionTexture/strength: 4, expected 0 to 1; read as 1",
        {"normal_scale": 1e6, "occlusion_strength": 1.0},
    ),
]


@pytest.mark.parametrize(("entry", "said", "fields"), OUT_OF_RANGE)
def test_a_number_out_of_its_range_is_read_as_the_nearest_in_it_and_told(
    tmp_path: Path, entry: dict[str, Any], said: str, fields: dict[str, Any]
) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    textured(made)
    found, model = read(tmp_path, made, primitive, **entry)
    assert {name: getattr(found, name) for name in fields} == fields
    told = [text.removesuffix(": correct it in the model") for text in model.warnings]
    assert f"{tmp_path / 'a.glb'}: /materials/0{said}" in told


def test_a_number_that_rounding_took_out_of_its_range_is_not_told(tmp_path: Path) -> None:
    made, primitive = square()
    color = [1.0000001192092896, 0.5, -1e-7, 1]
    found, model = read(tmp_path, made, primitive, pbrMetallicRoughness={"baseColorFactor": color})
    assert found.color == (1.0, 0.5, 0.0)
    assert not model.warnings


@pytest.mark.parametrize(
    ("ior", "shine", "reflected"),
    [
        (1.45, {"specularColorFactor": [2.371357614441398] * 3}, 0.08),  # as Blender 4 writes it
        (2.42, {}, (1.42 / 3.42) ** 2),  # diamond
        (1.5, {"specularColorFactor": [2, 3, 4], "specularFactor": 0.5}, 0.06),
        (1.5, {"specularColorFactor": [100, 100, 100], "specularFactor": 0.5}, 0.5),
        (0, {"specularColorFactor": [0.25, 0.25, 0.25]}, 0.25),  # as converters write a mirror
        (0, {"specularColorFactor": [1e308, 1e308, 1e308]}, 1.0),
    ],
)
def test_the_reflection_is_that_of_ior_and_colour(
    tmp_path: Path, ior: float, shine: dict[str, Any], reflected: float
) -> None:
    """Source: The Khronos Group, "KHR_materials_specular", 2023: f0 = min(f0 of ior * colour, 1) * factor."""
    made, primitive = square()
    extensions = {"KHR_materials_ior": {"ior": ior}, "KHR_materials_specular": shine}
    found, model = read(tmp_path, made, primitive, extensions=extensions)
    assert found.specular == pytest.approx(reflected / 0.04)
    tinted = len(set(shine.get("specularColorFactor", [1]))) > 1
    assert tinted == any("KHR_materials_specular: its tint" in text for text in model.warnings)


@pytest.mark.parametrize(
    ("base", "glass", "volume", "color", "opacity"),
    [
        ({}, {"transmissionFactor": 1}, {}, (1.0, 1.0, 1.0), 0.08),  # what its two sides reflect
        ({"baseColorFactor": [0.5, 0, 1, 0.25]}, {"transmissionFactor": 0.5}, {}, (0.5, 0.0, 1.0), 0.77),
        ({"metallicFactor": 1}, {"transmissionFactor": 1}, {}, (1.0, 1.0, 1.0), 1.0),
        (
            {},
            {"transmissionFactor": 1},
            {"thicknessFactor": 1, "attenuationDistance": 0.5, "attenuationColor": [0.5, 1, 0]},
            (0.25, 1.0, 0.0),
            1.0 - 0.92 * 1.25 / 3.0,
        ),
        ({}, {"transmissionFactor": 1}, {"thicknessFactor": 1e300}, (1.0, 1.0, 1.0), 0.08),
    ],
)
def test_glass_is_blended_as_densely_as_it_is_dark(
    tmp_path: Path,
    base: dict[str, Any],
    glass: dict[str, Any],
    volume: dict[str, Any],
    color: tuple[float, ...],
    opacity: float,
) -> None:
    made, primitive = square()
    found, model = read(
        tmp_path,
        made,
        primitive,
        pbrMetallicRoughness={"metallicFactor": 0} | base,
        extensions={"KHR_materials_transmission": glass, "KHR_materials_volume": volume},
    )
    assert found.color == pytest.approx(color)
    assert (found.alpha_mode, found.opacity) == ("blend", pytest.approx(opacity))
    assert any("neither bent, blurred nor tinted" in text for text in model.warnings)


def test_glass_of_several_materials_is_told_once(tmp_path: Path) -> None:
    made, primitive = square()
    glass = {"KHR_materials_transmission": {"transmissionFactor": 1}}
    panes = [primitive | {"material": made.add("materials", name=n, extensions=glass)} for n in "ab"]
    made.show(made.add("nodes", mesh=made.mesh(*panes)))
    model = read_model(made.glb(tmp_path / "a.glb"))
    assert [material.alpha_mode for material in model.materials.values()] == ["blend", "blend"]
    assert sum("KHR_materials_transmission" in text for text in model.warnings) == 1


@pytest.mark.parametrize(
    "entry",
    [
        {"extensions": {"KHR_materials_transmission": {}}},
        {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0}}},
        {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}, "alphaMode": "BLEND"},
        {
            "extensions": {
                "KHR_materials_transmission": {"transmissionFactor": 1, "transmissionTexture": {"index": 0}}
            }
        },
    ],
)
def test_what_is_blended_already_or_clear_by_a_texture_stays_as_it_is(
    tmp_path: Path, entry: dict[str, Any]
) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    textured(made)
    found, _ = read(tmp_path, made, primitive, **entry)
    assert (found.opacity, found.color) == (1.0, (1.0, 1.0, 1.0))
    assert found.alpha_mode == entry.get("alphaMode", "OPAQUE").lower()


def test_a_rotation_that_is_no_unit_is_told(tmp_path: Path) -> None:
    made, primitive = square()
    model = read_model(shown(primitive, made, rotation=[0, 0, 0, 2]).glb(tmp_path / "a.glb"))
    assert any("/nodes/0/rotation: a rotation of length 2, expected 1" in text for text in model.warnings)
    assert model.mesh.positions.max() == 1.0


def test_a_node_whose_rotation_is_0_is_not_turned_and_told(tmp_path: Path) -> None:
    made, primitive = square()
    model = read_model(shown(primitive, made, rotation=[0, 0, 0, 0]).glb(tmp_path / "a.glb"))
    assert [text.partition(": ")[2] for text in model.warnings] == [
        "/nodes/0/rotation: a rotation of 0 0 0 0 is none; the node is not turned"
    ]
    plain = read_model(shown(primitive, made).glb(tmp_path / "b.glb"))
    assert np.array_equal(model.mesh.positions, plain.mesh.positions)


def test_a_transform_of_texture_coordinates_beyond_float32_is_told(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    moved = {"extensions": {"KHR_texture_transform": {"scale": [1e300, 1]}}, "index": textured(made)}
    _, model = read(tmp_path, made, primitive, pbrMetallicRoughness={"baseColorTexture": moved})
    assert any(
        "texture coordinates that KHR_texture_transform moves are not finite" in t for t in model.warnings
    )
    assert model.mesh.uvs is not None and np.isfinite(model.mesh.uvs).all()


@pytest.mark.deep
def test_ten_times_as_many_materials_take_some_ten_times_as_long(tmp_path: Path) -> None:
    """Each of one name was numbered from 1 on, and looked for its primitives among all: minutes for many."""

    def of_materials(count: int) -> Path:
        made, primitive = square(TEXCOORD_0=UVS, TEXCOORD_1=UVS)
        texture = {"index": textured(made)}
        base = {"baseColorTexture": texture}
        entry = {"name": "m", "pbrMetallicRoughness": base, "occlusionTexture": texture | {"texCoord": 1}}
        made.tree["materials"] = [entry] * count
        primitives = [{"attributes": {}, "material": k} for k in range(count - 1)]
        made.show(made.add("nodes", mesh=made.mesh(*primitives, {**primitive, "material": count - 1})))
        return made.glb(tmp_path / f"{count}.glb")

    few, many = of_materials(500), of_materials(5_000)
    models = []
    # 12; some 40 where the names alone are numbered from 1 on.
    assert ratio(lambda: models.append(read_model(many)), lambda: read_model(few), turns=2) < 22
    assert [group.material for group in models[0].mesh.groups] == ["m_4999"]
