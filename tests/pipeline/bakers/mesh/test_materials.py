"""A mesh that is baked alone keeps what glTF says of its materials without pictures, and names these."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers.mesh.bake import bake_mesh
from paradize.bakers.mesh.prepare import prepare_mesh
from paradize.formats.glb.document import glb_document
from paradize.material import Material
from paradize.readers.model import read_model
from paradize.scene.baker_settings import MeshSettings
from tests.pipeline.readers.gltf.made import PNG, SQUARE, TWO, Made
from tests.pipeline.scenes import write_image

UVS = SQUARE[:, :2].copy()
MATERIALS: dict[str, dict[str, Any]] = {
    "metal": {
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.25, 0.75, 1.0],
            "metallicFactor": 0.75,
            "roughnessFactor": 0.25,
        }
    },
    "fence": {
        "alphaMode": "MASK",
        "alphaCutoff": 0.25,
        "doubleSided": True,
        "pbrMetallicRoughness": {"baseColorFactor": [1.0, 1.0, 1.0, 0.5]},
    },
    "glass": {
        "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"baseColorFactor": [1.0, 1.0, 1.0, 0.25], "metallicFactor": 0.0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0.5}},
    },
    "gem": {
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.0},
        "extensions": {"KHR_materials_specular": {"specularColorFactor": [4.0, 4.0, 4.0]}},
    },
    "lamp": {
        "emissiveFactor": [1.0, 0.5, 0.25],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8.0}},
    },
    "dim": {"emissiveFactor": [0.5, 0.25, 0.0]},
    "flat": {
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1.0, 1.0]},
        "extensions": {"KHR_materials_unlit": {}},
    },
}


def model(materials: dict[str, dict[str, Any]], path: Path) -> Path:
    """A square of each material."""
    made = Made()
    primitives = []
    for k, (name, fields) in enumerate(materials.items()):
        places, uvs = made.array(SQUARE + np.float32(2 * k)), made.array(UVS)
        paint = made.add("materials", name=name, **fields)
        attributes = {"POSITION": places, "TEXCOORD_0": uvs}
        primitives.append({"attributes": attributes, "indices": made.array(TWO), "material": paint})
    made.show(made.add("nodes", mesh=made.mesh(*primitives)))
    used = sorted({name for one in materials.values() for name in one.get("extensions", ())})
    if used:
        made.tree["extensionsUsed"] = used
    return made.glb(path)


def materials_of(glb: bytes, path: Path) -> dict[str, Material]:
    path.write_bytes(glb)
    return dict(read_model(path).materials)


def test_every_factor_of_a_material_is_read_back_as_it_was(tmp_path: Path) -> None:
    source = model(MATERIALS, tmp_path / "a.glb")
    made = bake_mesh(source, lods=1)
    found = materials_of(made.glb, tmp_path / "b.glb")
    assert found == dict(read_model(source).materials) and list(found) == list(MATERIALS)
    tree, _ = glb_document(made.glb, "b.glb")
    assert {name for one in MATERIALS.values() for name in one.get("extensions", ())} == set(
        tree["extensionsUsed"]
    )
    assert not any("pictures" in text for text in made.report["warnings"])


def test_pictures_are_left_out_by_name_and_nothing_shines_or_is_metal_in_their_place(tmp_path: Path) -> None:
    fields = {
        "emissiveFactor": [1.0, 1.0, 1.0],
        "emissiveTexture": {"index": 0},
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "metallicRoughnessTexture": {"index": 0},
            "roughnessFactor": 0.5,
        },
    }
    (tmp_path / "a.png").write_bytes(PNG)
    path = model({f"m{k}": fields for k in range(5)}, tmp_path / "a.glb")
    data = path.read_bytes()
    tree, start = glb_document(data, "a.glb")
    again = Made()
    again.tree = tree | {"images": [{"uri": "a.png"}], "textures": [{"source": 0}]}
    again.data = bytearray(data[start:])
    made = bake_mesh(again.glb(path), lods=1)
    found = materials_of(made.glb, tmp_path / "b.glb")
    assert len(found) == 5
    for one in found.values():
        assert (one.metalness, one.emission, one.roughness) == (0.0, (0.0, 0.0, 0.0), 0.5)
    (text,) = [text for text in made.report["warnings"] if "holds no pictures" in text]
    assert "of color, roughness, metalness, emission of 'm0', 'm1', 'm2' and 2 more materials" in text
    assert f"paradize new DIR --from {shlex.quote(str(path))}`" in text


@pytest.mark.parametrize("picture", ["", "map_Kd a.png\n"], ids=["factors", "picture"])
def test_a_material_of_an_mtl_keeps_its_roughness_opacity_and_light(picture: str, tmp_path: Path) -> None:
    write_image(tmp_path / "a.png", np.full((4, 4, 3), 200, np.uint8))
    text = f"newmtl wall\nKd 0.5 0.25 0.75\nPr 0.5\nPm 1.0\nd 0.5\nKe 2 1 0\nillum 2\n{picture}"
    (tmp_path / "a.mtl").write_text(text)
    corners = "".join(f"v {x} {y} {z}\nvt {x} {y}\n" for x, y, z in SQUARE)
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\nusemtl wall\n{corners}f 1/1 2/2 3/3 4/4\n")
    made = bake_mesh(tmp_path / "a.obj", lods=1)
    (found,) = materials_of(made.glb, tmp_path / "b.glb").values()
    color = (1.0, 1.0, 1.0) if picture else (0.5, 0.25, 0.75)
    wanted = replace(
        Material("wall"),
        color=color,
        opacity=0.5,
        alpha_mode="blend",
        roughness=0.5,
        metalness=1.0,
        emission=(2.0, 1.0, 0.0),
        specular=found.specular,
        two_sided=False,
        green_down=False,
    )
    assert found == wanted
    assert bool(picture) == any("the picture of color of 'wall'" in text for text in made.report["warnings"])


def test_triangles_without_area_in_the_texture_are_told_only_where_maps_are_laid_on_them(
    tmp_path: Path,
) -> None:
    """A scene lays maps that a model does not name."""
    path = tmp_path / "a.obj"
    (tmp_path / "a.png").write_bytes(PNG)
    (tmp_path / "m.mtl").write_text("newmtl mapped\nmap_Kd a.png\nnewmtl plain\n")
    text = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
    plain, mapped = "usemtl plain\nf 1/1 2/1 3/1\n", "usemtl mapped\nf 1/1 3/1 4/1\n"
    for faces, attributes, count in (
        (plain, None, 0),
        (plain, ["TEXCOORD_0"], 1),
        (plain, ["NORMAL"], 0),
        (plain + mapped, None, 1),
        (mapped, None, 1),
    ):
        path.write_text(text + faces)
        _, found = prepare_mesh(path, MeshSettings(attributes=attributes), "fast")
        assert found.validation.zero_area_uvs == count, (faces, attributes)
        told = [said for said in found.warnings if "without area in the texture" in said]
        assert len(told) == bool(count)
