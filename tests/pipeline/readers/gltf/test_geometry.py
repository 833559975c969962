"""The surface of a glTF model arrives whole: every way to say a triangle, a number or a place."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.mesh.bake import bake_mesh
from paradize.data import Lod, Mesh
from paradize.errors import SourceError
from paradize.formats.glb.encode import encode_glb
from paradize.readers.gltf.accessors import shares
from paradize.readers.model import Model, read_model
from tests.pipeline.readers.gltf.made import PNG, SQUARE, TWO, Made, shown, square
from tests.sweeps import tries

UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)


def triangles_of(model: Model) -> Any:
    """The corners (m, 3, 3) in world space, in double."""
    return model.source.positions[model.mesh.triangles]


@pytest.mark.parametrize("form", ["glb", "inside", "beside", "beside a blank"])
def test_a_buffer_is_read_wherever_it_lies(form: str, tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    shown(primitive, made)
    path = tmp_path / ("a.glb" if form == "glb" else "a.gltf")
    if form == "glb":
        made.glb(path)
    else:
        names = {"inside": None, "beside": "a.bin", "beside a blank": "a%20b.bin"}
        made.gltf(path, names[form])
        (tmp_path / (names[form] or "none").replace("%20", " ")).write_bytes(made.data)
    model = read_model(path)
    assert np.array_equal(triangles_of(model), SQUARE[TWO.reshape(-1, 3)])
    assert model.mesh.uvs is not None and np.array_equal(model.mesh.uvs, UVS)
    assert [p.name for p in model.libraries] == ([] if "beside" not in form else [model.libraries[0].name])


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.uint32, None])
def test_indices_of_every_kind_and_none_give_the_same_triangles(kind: Any, tmp_path: Path) -> None:
    made = Made()
    if kind is None:
        primitive: dict[str, Any] = {"attributes": {"POSITION": made.array(SQUARE[TWO])}}
    else:
        indices = made.array(TWO.astype(kind))
        primitive = {"attributes": {"POSITION": made.array(SQUARE)}, "indices": indices}
    model = read_model(shown(primitive, made).glb(tmp_path / "a.glb"))
    assert np.array_equal(triangles_of(model), SQUARE[TWO.reshape(-1, 3)])
    assert len(model.mesh.positions) == 4


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        (5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]),
        (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]]),
        (4, [0, 1, 2, 0], [[0, 1, 2]]),
    ],
)
def test_strips_and_fans_are_triangles_and_half_ones_are_left_out(
    mode: int, indices: list[int], expected: list[list[int]], tmp_path: Path
) -> None:
    made, primitive = square()
    primitive |= {"mode": mode, "indices": made.array(np.array(indices, np.uint16))}
    model = read_model(shown(primitive, made).glb(tmp_path / "a.glb"))
    assert np.array_equal(triangles_of(model), SQUARE[np.array(expected)])
    assert any("whole triangles" in text for text in model.warnings) == (mode == 4)


@pytest.mark.parametrize("empty", ["POSITION", "indices"])
def test_a_primitive_without_vertices_is_left_out_and_said(empty: str, tmp_path: Path) -> None:
    """As exporters write objects that hold nothing: its accessors have a count of 0 and no bytes."""
    made, primitive = square()
    none = made.add("accessors", componentType=5126 if empty == "POSITION" else 5123, count=0)
    made.tree["accessors"][none]["type"] = "VEC3" if empty == "POSITION" else "SCALAR"
    hollow = {**primitive, "attributes": dict(primitive["attributes"])}
    (hollow["attributes"] if empty == "POSITION" else hollow)[empty] = none
    made.show(made.add("nodes", mesh=made.mesh(primitive, hollow)))
    model = read_model(made.glb(tmp_path / "a.glb"))
    assert len(model.mesh.triangles) == 2
    (said,) = model.warnings
    assert said.endswith("/meshes/0/primitives/1: a primitive without vertices; left out")
    shown(hollow, made)
    with pytest.raises(SourceError, match=r"shows no triangles .*without vertices"):
        read_model(made.glb(tmp_path / "b.glb"))


def test_points_and_lines_are_left_out_and_said(tmp_path: Path) -> None:
    made, primitive = square()
    node = made.add("nodes", mesh=made.mesh(primitive, primitive | {"mode": 0}, primitive | {"mode": 3}))
    made.show(node)
    model = read_model(made.glb(tmp_path / "a.glb"))
    assert len(model.mesh.triangles) == 2
    assert [text.partition("primitives/")[2] for text in model.warnings] == [
        "1: points are not read; left out",
        "2: lines are not read; left out",
    ]
    shown(primitive | {"mode": 1}, made)
    with pytest.raises(SourceError, match=r"shows no triangles .*lines are not read"):
        read_model(made.glb(tmp_path / "b.glb"))


def test_a_warning_stands_once_with_its_count_and_hides_no_other(tmp_path: Path) -> None:
    made, primitive = square()
    lines = [primitive | {"mode": 1}] * 300
    made.show(made.add("nodes", mesh=made.mesh(primitive, *lines, primitive | {"attributes": {}})))
    path = made.glb(tmp_path / "a.glb")
    assert read_model(path).warnings == [
        f"{path}: /meshes/0/primitives/1: lines are not read; left out (in 300 places, this one first)",
        f"{path}: /meshes/0/primitives/301: a primitive without positions; left out",
    ]


def test_beyond_a_hundred_kinds_of_warnings_their_number_is_said(tmp_path: Path) -> None:
    made, primitive = square()
    made.tree["extensionsUsed"] = [f"NONE_{k}" for k in range(107)]
    warnings = read_model(shown(primitive, made).glb(tmp_path / "a.glb")).warnings
    assert len(warnings) == 101 and warnings[99].endswith("extension NONE_99 is left out")
    assert warnings[100] == f"{tmp_path / 'a.glb'}: 7 more kinds of warnings are not shown"


def test_nodes_turn_scale_and_move_what_hangs_on_them_and_a_mirror_keeps_the_outside(tmp_path: Path) -> None:
    made, primitive = square(NORMAL=np.tile(np.float32([0, 0, 1]), (4, 1)))
    mesh = made.mesh(primitive)
    half = float(np.sqrt(0.5))
    inner = made.add("nodes", mesh=mesh, rotation=[0, half, 0, half], name="inner")  # 90 degrees about Y
    column = [2, 0, 0, 0, 0, 3, 0, 0, 0, 0, -1, 0, 10, 20, 30, 1]  # mirrors z
    outer = made.add("nodes", matrix=column, children=[inner])
    made.show(outer)
    model = read_model(made.glb(tmp_path / "a.glb"))
    x, y = SQUARE[:, 0].astype(float), SQUARE[:, 1].astype(float)
    expected = np.stack([np.full(4, 10.0), 20 + 3 * y, 30 + x], axis=1)  # x turns to -z, which is mirrored
    found = triangles_of(model)
    order = TWO.reshape(-1, 3)[:, ::-1]
    assert np.abs(found - expected[order]).max() < 1e-12
    assert model.mesh.normals is not None
    outside = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
    assert (np.einsum("ij,ij->i", outside, model.mesh.normals[model.mesh.triangles[:, 0]]) > 0).all()
    assert model.mesh.groups[0].name == "inner"


def test_only_the_default_scene_is_read(tmp_path: Path) -> None:
    made, primitive = square()
    mesh = made.mesh(primitive)
    here = made.add("nodes", mesh=mesh)
    made.add("nodes", mesh=mesh, translation=[5, 0, 0])
    made.tree["scenes"] = [{"nodes": [1]}, {"nodes": [here]}]
    made.tree["scene"] = 1
    model = read_model(made.glb(tmp_path / "a.glb"))
    assert model.source.positions[:, 0].max() == 1.0
    assert any("1 other scene" in text for text in model.warnings)


def test_instances_of_a_node_stand_each_in_its_place(tmp_path: Path) -> None:
    made, primitive = square()
    places = np.float32([[0, 0, 0], [4, 0, 0]])
    several = {"attributes": {"TRANSLATION": made.array(places)}}
    shown(primitive, made, translation=[0, 1, 0], extensions={"EXT_mesh_gpu_instancing": several})
    made.tree["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    model = read_model(made.glb(tmp_path / "a.glb"))
    found = triangles_of(model)
    assert np.array_equal(found[:2] - [0, 1, 0], SQUARE[TWO.reshape(-1, 3)])
    assert np.array_equal(found[2:] - [4, 1, 0], SQUARE[TWO.reshape(-1, 3)])
    (message,) = model.warnings
    assert (
        "2 copies become triangles of one mesh" in message and "`paradize new FOLDER --from FILE`" in message
    )


def test_one_instance_of_a_node_is_no_copy(tmp_path: Path) -> None:
    made, primitive = square()
    several = {"attributes": {"TRANSLATION": made.array(np.float32([[4, 0, 0]]))}}
    shown(primitive, made, extensions={"EXT_mesh_gpu_instancing": several})
    assert read_model(made.glb(tmp_path / "a.glb")).warnings == []


def test_sparse_values_replace_those_below_them_or_zeros(tmp_path: Path) -> None:
    made, primitive = square()
    rows = made.view(np.array([1, 2], np.uint8).tobytes())
    values = made.view(np.float32([[9, 0, 0], [9, 9, 0]]).tobytes())
    sparse = {
        "count": 2,
        "indices": {"bufferView": rows, "componentType": 5121},
        "values": {"bufferView": values},
    }
    made.tree["accessors"][primitive["attributes"]["POSITION"]]["sparse"] = sparse
    model = read_model(shown(primitive, made).glb(tmp_path / "a.glb"))
    assert model.source.positions[:, 0].tolist() == [0, 9, 9, 0]
    del made.tree["accessors"][primitive["attributes"]["POSITION"]]["bufferView"]
    model = read_model(made.glb(tmp_path / "b.glb"))
    assert model.source.positions.sum() == 27 and len(model.mesh.positions) == 3


def test_quantised_values_and_strides_are_what_they_stand_for(tmp_path: Path) -> None:
    made = Made()
    padded = np.zeros((4, 4), np.int16)
    padded[:, :3] = SQUARE * 32767
    view = made.view(padded.tobytes(), byteStride=8)
    common = {"componentType": 5122, "count": 4, "type": "VEC3", "normalized": True}
    position = made.add("accessors", bufferView=view, **common)
    uv = made.array((UVS * 255).astype(np.uint8), normalized=True)
    color = made.array(np.full((4, 3), 51, np.uint8), normalized=True)
    primitive = {"attributes": {"POSITION": position, "TEXCOORD_0": uv, "COLOR_0": color}}
    primitive["indices"] = made.array(TWO)  # type: ignore[assignment]
    made.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    mesh = read_model(shown(primitive, made, scale=[2, 2, 2]).glb(tmp_path / "a.glb")).mesh
    assert np.array_equal(mesh.positions, 2 * SQUARE)
    assert mesh.uvs is not None and np.array_equal(mesh.uvs, UVS)
    assert mesh.colors is not None and np.array_equal(mesh.colors[0], np.float32([0.2, 0.2, 0.2, 1]))


def test_where_normals_are_missing_faces_are_flat(tmp_path: Path) -> None:
    box = trimesh.creation.box()
    made = Made()
    primitive = {
        "attributes": {"POSITION": made.array(box.vertices.astype(np.float32))},
        "indices": made.array(box.faces.astype(np.uint16).reshape(-1)),
    }
    path = shown(primitive, made).glb(tmp_path / "a.glb")
    assert not read_model(path).smoothing.any()
    assert bake_mesh(path, lods=1).report["vertices"] == 24


def test_a_model_far_from_zero_keeps_its_small_distances(tmp_path: Path) -> None:
    made, primitive = square()
    model = read_model(shown(primitive, made, translation=[1e8, 0, 0]).glb(tmp_path / "a.glb"))
    assert model.mesh.origin[0] != 0.0
    assert np.array_equal(model.mesh.absolute_positions, SQUARE + np.array([1e8, 0, 0]))


def test_a_skin_is_read_as_its_joints_stand_and_a_morph_at_its_default_weights(tmp_path: Path) -> None:
    made, primitive = square(
        JOINTS_0=np.array([[0, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]], np.uint8),
        WEIGHTS_0=np.tile(np.float32([1, 0, 0, 0]), (4, 1)),
    )
    still = np.eye(4, dtype=np.float32)
    bound = still.copy()
    bound[3, 0] = -1.0  # column by column: a translation
    inverse = made.array(np.stack([still.reshape(16), bound.reshape(16)]))
    primitive["targets"] = [{"POSITION": made.array(np.tile(np.float32([0, 0, 2]), (4, 1)))}]
    base = made.add("nodes")
    tip = made.add("nodes", translation=[1, 0, 5])
    skin = made.add("skins", joints=[base, tip], inverseBindMatrices=inverse)
    mesh = made.mesh(primitive, weights=[0.5])
    made.show(base, tip, made.add("nodes", mesh=mesh, skin=skin, translation=[100, 0, 0]))
    model = read_model(made.glb(tmp_path / "a.glb"))
    assert model.source.positions.tolist() == [[0, 0, 1], [1, 0, 6], [1, 1, 6], [0, 1, 1]]
    text = " ".join(model.warnings)
    assert "skins are read at rest" in text and "morph targets are read at their default weights" in text


def test_a_skin_whose_matrices_are_not_finite_is_refused_by_their_place(tmp_path: Path) -> None:
    made, primitive = square(
        JOINTS_0=np.zeros((4, 4), np.uint8), WEIGHTS_0=np.tile(np.float32([1, 0, 0, 0]), (4, 1))
    )
    bound = np.eye(4, dtype=np.float32)
    bound[3, 0] = np.inf
    joint = made.add("nodes")
    skin = made.add("skins", joints=[joint], inverseBindMatrices=made.array(bound.reshape(1, 16)))
    made.show(joint, made.add("nodes", mesh=made.mesh(primitive), skin=skin))
    with pytest.raises(SourceError, match="/skins/0/inverseBindMatrices: matrices that are not finite"):
        read_model(made.glb(tmp_path / "a.glb"))


def test_weights_of_joints_count_as_shares_of_their_sum(tmp_path: Path) -> None:
    made, primitive = square(
        JOINTS_0=np.tile(np.uint8([0, 1, 0, 0]), (4, 1)),
        WEIGHTS_0=np.tile(np.float32([0.2, 0.2, 0, 0]), (4, 1)),
    )
    joints = [made.add("nodes", translation=[1, 0, 5]) for _ in range(2)]
    node = made.add("nodes", mesh=made.mesh(primitive), skin=made.add("skins", joints=joints))
    made.show(*joints, node)
    model = read_model(made.glb(tmp_path / "a.glb"))
    assert np.abs(model.source.positions - SQUARE - [1, 0, 5]).max() < 1e-6


def test_weights_of_a_node_s_morph_take_the_place_of_its_mesh_s(tmp_path: Path) -> None:
    made, primitive = square()
    primitive["targets"] = [{"POSITION": made.array(np.tile(np.float32([0, 0, 2]), (4, 1)))}]
    made.show(made.add("nodes", mesh=made.mesh(primitive, weights=[0.5]), weights=[1.0]))
    assert read_model(made.glb(tmp_path / "a.glb")).source.positions[:, 2].tolist() == [2, 2, 2, 2]


@pytest.mark.parametrize("kind", [np.int8, np.int16])
def test_both_lowest_codes_of_a_normalized_integer_are_minus_one(kind: Any) -> None:
    low = np.iinfo(kind).min
    assert shares(np.array([low, low + 1], kind), True).tolist() == [-1.0, -1.0]


@pytest.mark.parametrize("skinned", [False, True])
def test_a_mirrored_rig_stays_right_side_out(skinned: bool, tmp_path: Path) -> None:
    """Half of it is bound to a joint that mirrors."""
    ball = trimesh.creation.icosphere(subdivisions=1)
    attributes = {"POSITION": ball.vertices.astype(np.float32), "NORMAL": ball.vertices.astype(np.float32)}
    made, node = Made(), {"scale": [-1, 1, 1]}
    mirror = made.add("nodes", **node)
    if skinned:
        attributes["JOINTS_0"] = np.repeat(np.uint8([[0, 0, 0, 0]]), len(ball.vertices), axis=0)
        attributes["WEIGHTS_0"] = np.repeat(np.float32([[1, 0, 0, 0]]), len(ball.vertices), axis=0)
        node = {"skin": made.add("skins", joints=[mirror])}
    primitive = {
        "attributes": {name: made.array(values) for name, values in attributes.items()},
        "indices": made.array(ball.faces.astype(np.uint16).reshape(-1)),
    }
    made.show(mirror, made.add("nodes", mesh=made.mesh(primitive), **node))
    mesh = read_model(made.glb(tmp_path / "a.glb")).mesh
    assert mesh.normals is not None
    outwards = np.einsum("ij,ij->i", mesh.positions, mesh.normals)
    assert outwards.min() > 0.9
    assert trimesh.Trimesh(mesh.positions, mesh.triangles, process=False).volume == pytest.approx(ball.volume)


def test_attributes_of_some_primitives_are_filled_in_for_the_others_and_said(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS, COLOR_0=np.zeros((4, 4), np.float32))
    bare = {"attributes": {"POSITION": made.array(SQUARE + np.float32(3))}, "indices": primitive["indices"]}
    made.show(made.add("nodes", mesh=made.mesh(primitive, bare)))
    model = read_model(made.glb(tmp_path / "a.glb"))
    assert model.mesh.colors is not None and model.mesh.colors[4:].min() == 1.0
    assert not model.warnings, "no material has a map, so nothing reads texture coordinates"
    made.add("images", bufferView=made.view(PNG), mimeType="image/png")
    texture = {"index": made.add("textures", source=0)}
    made.add("materials", pbrMetallicRoughness={"baseColorTexture": texture})
    primitive["material"] = 0
    assert not read_model(made.glb(tmp_path / "a.glb")).warnings, "that with the map has them"
    bare["material"] = 0
    told = read_model(made.glb(tmp_path / "a.glb")).warnings
    assert any("2 of 4 triangles without texture coordinates" in text for text in told)


def test_colours_that_are_not_finite_are_white_and_told(tmp_path: Path) -> None:
    colors = np.float32([[1, 0, 0], [0, np.nan, 0], [0, 0, 1], [np.inf, 1, 1]])
    made, primitive = square(COLOR_0=colors)
    made.show(made.add("nodes", mesh=made.mesh(primitive)))
    model = read_model(made.glb(tmp_path / "a.glb"))
    assert model.mesh.colors is not None
    assert model.mesh.colors[:, :3].tolist() == [[1, 0, 0], [1, 1, 1], [0, 0, 1], [1, 1, 1]]
    assert any(text.endswith("2 colours are not finite; read as 1") for text in model.warnings)


@settings(max_examples=tries(20), deadline=None)
@given(seed=st.integers(0, 2**32 - 1), faces=st.integers(1, 60))
def test_what_our_writer_and_trimesh_wrote_is_read_back_equal(
    seed: int, faces: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    random = np.random.default_rng(seed)
    positions = random.normal(size=(faces + 2, 3)).astype(np.float32)
    triangles = np.stack([random.permutation(faces + 2)[:3] for _ in range(faces)]).astype(np.uint32)
    used, triangles = np.unique(triangles, return_inverse=True)
    positions, triangles = positions[used], triangles.reshape(-1, 3).astype(np.uint32)
    uvs = random.random((len(positions), 2), dtype=np.float32)
    mesh = Mesh(positions, triangles, uvs=uvs)
    folder = tmp_path_factory.mktemp("made")
    (folder / "ours.glb").write_bytes(encode_glb([Lod(mesh, 0.0, 0.0)], "made"))
    theirs = trimesh.Trimesh(positions, triangles, process=False)
    (folder / "theirs.glb").write_bytes(theirs.export(file_type="glb"))
    ours = read_model(folder / "ours.glb").mesh
    assert np.array_equal(ours.positions[ours.triangles], positions[triangles])
    assert ours.uvs is not None and np.array_equal(ours.uvs[ours.triangles], uvs[triangles])
    other = read_model(folder / "theirs.glb").mesh
    assert np.array_equal(other.positions[other.triangles], positions[triangles])


def test_the_first_level_of_a_mesh_that_was_baked_here_is_read(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    (tmp_path / "a.glb").write_bytes(ball.export(file_type="glb"))
    (tmp_path / "b.glb").write_bytes(bake_mesh(tmp_path / "a.glb").glb)
    first, again = read_model(tmp_path / "a.glb"), read_model(tmp_path / "b.glb")
    assert len(again.mesh.triangles) == len(first.mesh.triangles)
    assert json.dumps(again.warnings) == "[]"


def test_tangents_of_another_kind_are_left_out_with_a_warning(tmp_path: Path) -> None:
    """Others are made in any case. Some exporters write three numbers, which the targets of a morph have."""
    made = Made()
    attributes = {"POSITION": made.array(SQUARE), "TANGENT": made.array(SQUARE)}
    shown({"attributes": attributes, "indices": made.array(TWO)}, made).glb(tmp_path / "a.glb")
    model = read_model(tmp_path / "a.glb")
    assert len(model.mesh.triangles) == 2
    assert [text for text in model.warnings if "its tangents are not read" in text and "'VEC3'" in text]
