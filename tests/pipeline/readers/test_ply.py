"""PLY arrives whole, text and binary of either byte order, or is refused in one line."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.mesh.bake import bake_mesh
from paradize.bakers.mesh.prepare import prepare_mesh
from paradize.errors import SourceError
from paradize.kernels.math import srgb_to_linear
from paradize.readers.model import read_model
from paradize.scene.baker_settings import MeshSettings

CODES = {"float": "f", "double": "d", "uchar": "B", "int": "i", "ushort": "H"}
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
FORMS = ["ascii", *ORDERS]
COLORS = ("red", "green", "blue")
PLACES = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [1, 0.5, 0], [0, 2, 0]], np.float32)


def ply(
    form: str,
    vertex: dict[str, tuple[str, Any]],
    faces: list[list[int]],
    extra: str = "",
    uvs: Any = None,
    colors: Any = None,
) -> bytes:
    """A PLY. vertex: type and values by property. uvs: of each face's corners, as a list `texcoord`. colors:
    of faces, as bytes red green blue."""
    count = len(next(iter(vertex.values()))[1])
    head = f"ply\r\nformat {form} 1.0\ncomment made\n{extra}element vertex {count}\n"
    head += "".join(f"property {kind} {name}\n" for name, (kind, _) in vertex.items())
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    head += "property list uchar float texcoord\n" if uvs is not None else ""
    head += "".join(f"property uchar {name}\n" for name in COLORS) if colors is not None else ""
    rows: list[list[tuple[str, Any]]] = [
        [(kind, values[i]) for kind, values in vertex.values()] for i in range(count)
    ]
    for i, face in enumerate(faces):
        row: list[tuple[str, Any]] = [("uchar", len(face)), *(("int", one) for one in face)]
        if uvs is not None:
            flat = np.ravel(uvs[i])
            row += [("uchar", len(flat)), *(("float", one) for one in flat)]
        row += [("uchar", one) for one in ([] if colors is None else colors[i])]
        rows.append(row)
    if form == "ascii":
        body = "\n".join(
            " ".join(repr(float(one)) if kind in "float double" else str(int(one)) for kind, one in row)
            for row in rows
        )
        return (head + "end_header\n" + body + "\n").encode()
    order = ORDERS[form]
    packed = b"".join(struct.pack(order + CODES[kind], one) for row in rows for kind, one in row)
    return (head + "end_header\n").encode() + packed


def columns(kind: str, names: str, values: Any) -> dict[str, tuple[str, Any]]:
    return {name: (kind, np.asarray(values)[:, k]) for k, name in enumerate(names.split())}


@pytest.mark.parametrize("form", FORMS)
def test_what_is_not_read_may_be_there_twice(form: str, tmp_path: Path) -> None:
    vertex = columns("float", "qa qb x y z", np.hstack([PLACES[:, :2], PLACES]))
    text = (
        ply(form, vertex, [[0, 1, 2, 3, 4]]).replace(b"float qa", b"float q").replace(b"float qb", b"float q")
    )
    (tmp_path / "a.ply").write_bytes(text)
    assert (read_model(tmp_path / "a.ply").mesh.positions == PLACES.astype(np.float32)).all()


@pytest.mark.parametrize("form", FORMS)
def test_a_concave_polygon_arrives_with_normals_uvs_and_colours(form: str, tmp_path: Path) -> None:
    vertex = columns("float", "x y z", PLACES) | columns("double", "nx ny nz", [[0, 0, 4]] * 5)
    vertex |= columns("float", "s t", PLACES[:, :2] / 4)
    vertex |= columns("uchar", "red green blue alpha", [[255, 0, 188, 128]] * 5)
    (tmp_path / "a.PLY").write_bytes(ply(form, vertex, [[0, 1, 2, 3, 4]], "obj_info any\n"))
    model = read_model(tmp_path / "a.PLY")
    mesh = model.mesh
    assert mesh.normals is not None and mesh.uvs is not None and mesh.colors is not None
    assert model.counts["faces"] == 1 and model.counts["triangles"] == 3 and not model.warnings
    assert np.array_equal(np.unique(mesh.positions, axis=0), np.unique(PLACES, axis=0))
    a, b, c = (mesh.positions[mesh.triangles[:, k], :2] for k in range(3))
    twice = np.cross(np.c_[b - a, np.zeros(3)], np.c_[c - a, np.zeros(3)])[:, 2]
    assert (twice > 0).all() and twice.sum() == 2 * 2.5, "an ear at the dent would overlap"
    assert (mesh.normals == [0, 0, 1]).all()
    assert np.allclose(mesh.uvs, np.c_[mesh.positions[:, 0] / 4, 1 - mesh.positions[:, 1] / 4])
    assert np.allclose(mesh.colors, [1, 0, 0.503, 128 / 255], atol=1e-3)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("end", ["\r", "\n", "\r\n"])
def test_lines_may_end_as_on_any_machine(form: str, end: str, tmp_path: Path) -> None:
    data = ply(form, columns("float", "x y z", PLACES), [[0, 1, 2]]).replace(b"\r\n", b"\n")
    head, body = data.split(b"end_header\n")
    if form == "ascii":
        body = body.replace(b"\n", end.encode())
    data = head.replace(b"\n", end.encode()) + b"end_header" + end.encode() + body
    for mark in (b"", b"\x1a"):  # Ctrl-Z of old systems
        (tmp_path / "a.ply").write_bytes((data.rstrip() if form == "ascii" else data) + mark)
        model = read_model(tmp_path / "a.ply")
        assert np.array_equal(np.sort(model.mesh.positions, axis=0), np.sort(PLACES[:3], axis=0))


@pytest.mark.parametrize("form", FORMS)
def test_polygons_of_different_sizes_and_uvs_of_their_corners(form: str, tmp_path: Path) -> None:
    faces = [[0, 1], [0, 1, 2], [0, 2, 3, 4]]
    uvs = [[[0, 0], [0, 0]], [[0, 0], [1, 0], [1, 1]], [[0.5, 0], [1, 1], [0, 1], [0, 0.25]]]
    data = ply(form, columns("double", "x y z", PLACES), faces, "comment TextureFile bark.png\n", uvs)
    (tmp_path / "a.ply").write_bytes(data)
    model = read_model(tmp_path / "a.ply")
    assert model.mesh.uvs is not None
    assert model.counts["triangles"] == 3 and len(model.mesh.positions) == 6
    corner = {tuple(row) for row in np.c_[model.mesh.positions[:, :2], model.mesh.uvs].tolist()}
    assert (0.0, 0.0, 0.0, 1.0) in corner and (0.0, 0.0, 0.5, 1.0) in corner
    assert any("1 faces with fewer than three" in text for text in model.warnings)
    assert any("TextureFile: 'bark.png' does not exist" in text for text in model.warnings)
    assert model.absent == [tmp_path / "bark.png"]
    more = ply(form, columns("double", "x y z", PLACES), faces[1:], "", [uvs[1], [*uvs[2], [0, 0]]])
    (tmp_path / "a.ply").write_bytes(more)
    model = read_model(tmp_path / "a.ply")
    assert model.mesh.uvs is None
    assert f"{tmp_path / 'a.ply'}: texcoord does not fit all faces; left out" in model.warnings


@pytest.mark.parametrize("form", FORMS)
def test_a_ply_far_from_the_origin_keeps_its_places_and_doubled_vertices_are_one(
    form: str, tmp_path: Path
) -> None:
    places = np.concatenate([PLACES, PLACES[:3]]).astype(np.float64) + (1e6, 0, -3e6) + 1e-3
    (tmp_path / "a.ply").write_bytes(ply(form, columns("double", "x y z", places), [[0, 1, 2], [5, 7, 4]]))
    model = read_model(tmp_path / "a.ply")
    assert np.abs(model.mesh.positions).max() < 2.0 and len(model.mesh.positions) == 4
    assert np.allclose(model.mesh.positions + np.array(model.mesh.origin), model.source.positions, atol=1e-6)
    found = (model.mesh.positions + np.array(model.mesh.origin))[model.mesh.triangles]
    assert np.allclose(found, places[[[0, 1, 2], [5, 7, 4]]], atol=1e-6)
    assert model.counts["positions_unused"] == 2, "vertices 3 and 6"


@pytest.mark.parametrize("form", FORMS)
def test_numbers_that_are_none_refuse_a_ply_only_where_a_face_needs_them(form: str, tmp_path: Path) -> None:
    places = np.concatenate([PLACES, [[np.nan, 0, np.inf]]])
    vertex = columns("float", "x y z", places) | columns("float", "s t", [[0.5, 0.25]] * 5 + [[0, 0]])
    (tmp_path / "a.ply").write_bytes(ply(form, vertex, [[0, 1, 2], [2, 3, 4]]))
    model = read_model(tmp_path / "a.ply")
    assert np.array_equal(np.unique(model.mesh.positions, axis=0), np.unique(PLACES, axis=0))
    assert model.counts["positions_unused"] == 1 and not model.warnings
    (tmp_path / "a.ply").write_bytes(ply(form, vertex, [[0, 1, 2], [0, 2, 5]]))
    with pytest.raises(SourceError, match="vertex 5: x y z are nan 0 inf"):
        read_model(tmp_path / "a.ply")
    vertex |= columns("float", "s t", [[0.5, 0.25]] * 4 + [[np.nan, 0.5], [0, 0]])
    (tmp_path / "a.ply").write_bytes(ply(form, vertex, [[2, 3, 4]]))
    model = read_model(tmp_path / "a.ply")
    assert model.mesh.uvs is not None and sorted(model.mesh.uvs.tolist()) == [
        [0, 1],
        [0.5, 0.75],
        [0.5, 0.75],
    ]
    said = "texture coordinates that are no numbers, or beyond float32; read as 0 0 (1)"
    assert any(said in text for text in model.warnings)
    vertex |= columns("float", "nx ny nz", [[0, 3, 0]] * 4 + [[0, 0, np.nan], [0, 3, 0]])
    (tmp_path / "a.ply").write_bytes(ply(form, vertex, [[2, 3, 4]]))
    normals = read_model(tmp_path / "a.ply").mesh.normals
    assert normals is not None and sorted(normals.tolist()) == [[0, 0, 0], [0, 1, 0], [0, 1, 0]]


@pytest.mark.parametrize("form", FORMS)
def test_colours_of_faces_are_those_of_their_corners_where_vertices_have_none(
    form: str, tmp_path: Path
) -> None:
    faces, colors = [[0, 1, 2], [0, 1], [0, 2, 3, 4]], [[255, 0, 0], [9, 9, 9], [0, 188, 255]]
    places = columns("float", "x y z", PLACES)
    (tmp_path / "a.ply").write_bytes(ply(form, places, faces, colors=colors))
    mesh = read_model(tmp_path / "a.ply").mesh
    assert mesh.colors is not None and len(mesh.positions) == 7, "two corners lie at two colours"
    assert np.allclose(mesh.colors[mesh.triangles[0]], [1, 0, 0, 1])
    assert np.allclose(mesh.colors[mesh.triangles[1:]], [0, 0.503, 1, 1], atol=1e-3)
    assert np.array_equal(mesh.positions[mesh.triangles[0]], PLACES[[0, 1, 2]])
    both = places | columns("uchar", "red green blue", [[0, 255, 0]] * 5)
    short = {name[0] if name in COLORS else name: value for name, value in both.items()}  # r g b
    (tmp_path / "a.ply").write_bytes(ply(form, short, faces))
    assert np.allclose(read_model(tmp_path / "a.ply").mesh.colors, [0, 1, 0, 1])
    (tmp_path / "a.ply").write_bytes(ply(form, both, faces, colors=colors))
    model = read_model(tmp_path / "a.ply")
    assert np.allclose(model.mesh.colors, [0, 1, 0, 1])
    assert any("the colours of its faces are left out: its vertices have theirs" in w for w in model.warnings)


@pytest.mark.parametrize("form", FORMS)
def test_the_picture_of_a_comment_is_the_colour_map_instead_of_colours(form: str, tmp_path: Path) -> None:
    (tmp_path / "my bark.png").write_bytes(b"a picture")
    vertex = columns("float", "x y z", PLACES) | columns("uchar", "red green blue", [[192] * 3] * 5)
    named = "comment TextureFile my bark.png\n"
    laid = vertex | columns("float", "s t", PLACES)
    (tmp_path / "a.ply").write_bytes(ply(form, laid, [[0, 1, 2]], named))
    model = read_model(tmp_path / "a.ply")
    assert model.materials["default"].picture("color") == tmp_path / "my bark.png"
    assert model.mesh.groups[0].material == "default" and model.mesh.colors is None
    (said,) = model.warnings
    assert said.endswith("its colours are left out beside its picture")
    for wrong, bytes_, words in (
        (
            "without coordinates",
            ply(form, vertex, [[0, 1, 2]], named),
            "has no texture coordinates for its picture",
        ),
        ("several", ply(form, laid, [[0, 1, 2]], named * 2), "2 pictures (TextureFile) are not read"),
        ("outside", ply(form, laid, [[0, 1, 2]], "comment TextureFile ../../../x.png\n"), "lies outside"),
    ):
        (tmp_path / "a.ply").write_bytes(bytes_)
        model = read_model(tmp_path / "a.ply")
        assert not model.materials and model.mesh.colors is not None, wrong
        assert words in " ".join(model.warnings), wrong


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("large", [np.inf, 1e300])
def test_colours_that_are_no_float32_are_white_and_told(form: str, large: float, tmp_path: Path) -> None:
    colors = columns(
        "double", "red green blue alpha", [[1, 0, 0, 1], [0.5, np.nan, 0, 0.5], [0, 1, large, 1]]
    )
    data = ply(form, columns("float", "x y z", PLACES[:3]) | colors, [[0, 1, 2]])
    (tmp_path / "a.ply").write_bytes(data)
    model = read_model(tmp_path / "a.ply")
    assert model.mesh.colors is not None
    at = model.mesh.colors[model.mesh.triangles[0]]
    assert np.array_equal(at, np.array([[1, 0, 0, 1], [1, 1, 1, 1], [1, 1, 1, 1]], np.float32))
    (said,) = model.warnings
    assert said.endswith("2 colours that are no numbers, or beyond float32; read as white")


@pytest.mark.parametrize("large", ["nan", "1e300"])
def test_coordinates_of_corners_that_are_no_float32_are_left_out_and_told(large: str, tmp_path: Path) -> None:
    data = ply("ascii", columns("float", "x y z", PLACES[:3]), [[0, 1, 2]], uvs=[[[0, 0], [1, 0], [1, 7]]])
    (tmp_path / "a.ply").write_bytes(data.replace(b"7.0", large.encode()))
    model = read_model(tmp_path / "a.ply")
    assert model.mesh.uvs is None
    (said,) = model.warnings
    assert said.endswith("texcoord holds what is no number, or beyond float32; left out")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("kind", "values", "shares", "told"),
    [
        ("int", [200, 0, 255], [200 / 255, 0, 1], "whole numbers up to 255; read as codes, 255 is 1"),
        ("ushort", [200, 0, 255], [200 / 255, 0, 1], "whole numbers up to 255; read as codes, 255 is 1"),
        ("double", [200, 0, 7], [200 / 255, 0, 7 / 255], "whole numbers up to 200; read as codes, 255 is 1"),
        ("int", [51400, 0, 65535], [200 / 255, 0, 1], "up to 65535; read as codes, 65535 is 1"),
        ("int", [1, 0, 1], [1, 0, 1], "numbers up to 1 of 2.14748e+09; read as shares of 1"),
        ("ushort", [51400, 0, 65535], [200 / 255, 0, 1], ""),
        ("float", [0.5, 0, 1], [0.5, 0, 1], ""),
        ("uchar", [1, 0, 1], [1 / 255, 0, 1 / 255], ""),
    ],
)
def test_whole_numbers_of_wide_types_are_codes_of_colours_and_told(
    form: str, kind: str, values: list[float], shares: list[float], told: str, tmp_path: Path
) -> None:
    """As scripts write them, whose arrays are ints or floats."""
    colors = columns(kind, "red green blue", [values] * 3)
    (tmp_path / "a.ply").write_bytes(ply(form, columns("float", "x y z", PLACES[:3]) | colors, [[0, 1, 2]]))
    model = read_model(tmp_path / "a.ply")
    assert model.mesh.colors is not None
    assert np.allclose(model.mesh.colors[0], [*srgb_to_linear(shares), 1], atol=1e-6)
    assert len(model.warnings) == bool(told) and told in "".join(model.warnings)


def test_alpha_of_colours_in_codes_has_a_scale_of_its_own(tmp_path: Path) -> None:
    for kind, alpha, share in (("int", 128, 128 / 255), ("float", 1, 1.0), ("uchar", 128, 128 / 255)):
        colors = columns("int", "red green blue", [[255, 0, 0]] * 3) | columns(kind, "alpha", [[alpha]] * 3)
        vertex = columns("float", "x y z", PLACES[:3]) | colors
        (tmp_path / "a.ply").write_bytes(ply("ascii", vertex, [[0, 1, 2]]))
        model = read_model(tmp_path / "a.ply")
        assert model.mesh.colors is not None and len(model.warnings) == 1
        assert np.allclose(model.mesh.colors[0], [1, 0, 0, share])


def test_colours_beyond_their_range_are_clamped_and_told(tmp_path: Path) -> None:
    colors = columns("float", "red green blue", [[1.5, 0, 0], [-0.25, 0, 0], [0.5, 1, 1]])
    vertex = columns("float", "x y z", PLACES[:3]) | colors
    (tmp_path / "a.ply").write_bytes(ply("ascii", vertex, [[0, 1, 2]]))
    mesh, found = prepare_mesh(tmp_path / "a.ply", MeshSettings(), "fast")
    assert mesh.colors is not None and mesh.colors.min() >= 0.0 and mesh.colors.max() == 1.0
    assert any("vertex colours of -0.25 to 1.5, outside 0 to 1, clamped" in w for w in found.warnings)


def test_lines_with_more_numbers_than_the_header_names_are_read_and_told(tmp_path: Path) -> None:
    """As VCGLib writes colours of wedges: a list of floats where the header names single bytes."""
    data = ply("ascii", columns("float", "x y z", PLACES), [[0, 1, 2], [0, 2, 3, 4]])
    path = tmp_path / "a.ply"
    path.write_bytes(data)
    plain = read_model(path)
    for wide in (
        data.replace(b"3 0 1 2", b"3 0 1 2 9 1 1 1 1 1 1 1 1 1").replace(b"4 0 2 3 4", b"4 0 2 3 4 3 1 1 1"),
        data.replace(b"3 0 1 2", b"3 0 1 2 1 1").replace(b"4 0 2 3 4", b"4 0 2 3 4 1 1"),
    ):
        path.write_bytes(wide)
        model = read_model(path)
        assert np.array_equal(model.mesh.positions, plain.mesh.positions)
        assert np.array_equal(model.mesh.triangles, plain.mesh.triangles)
        (said,) = set(model.warnings) - set(plain.warnings)
        assert said.endswith("2 lines with more numbers than the header names; the rest left out")


@pytest.mark.parametrize("form", FORMS)
def test_strips_of_triangles_are_turned_as_their_first_triangle(form: str, tmp_path: Path) -> None:
    """-1 and the end of a list begin a strip anew; a corner twice in a row joins two strips."""
    strips = [[0, 1, 2, 3, 4, -1, 4, 3, 2, -1, 0, 1], [0, 2, 1, 1, 3, 3, 4, 0]]
    data = ply(form, columns("float", "x y z", PLACES), strips).replace(b"element face", b"element tristrips")
    (tmp_path / "a.ply").write_bytes(data)
    mesh = read_model(tmp_path / "a.ply").mesh
    wanted = [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 2], [0, 2, 1], [4, 3, 0]]
    assert np.array_equal(mesh.positions[mesh.triangles], PLACES[np.array(wanted)])


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 40), form=st.sampled_from(FORMS))
def test_any_triangles_are_read_back_equal(
    seed: int, count: int, form: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    rng = np.random.default_rng(seed)
    places = rng.normal(size=(12, 3)).astype(np.float32)
    faces = [rng.permutation(12)[:3].tolist() for _ in range(count)]
    path = tmp_path_factory.mktemp("ply") / "a.ply"
    path.write_bytes(ply(form, columns("float", "x y z", places), faces))
    mesh = read_model(path).mesh
    assert np.array_equal(mesh.positions[mesh.triangles], places[np.array(faces)])


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_a_box_of_another_program_is_baked(encoding: str, tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(trimesh.creation.box().export(file_type="ply", encoding=encoding))
    report = bake_mesh(tmp_path / "a.ply", lods=1).report
    assert report["closed"] and report["vertices"] == 24, "edges of a box are sharp"


def test_a_broken_ply_is_refused_in_one_line(tmp_path: Path) -> None:
    vertex = columns("float", "x y z", PLACES[:3])
    little, text = (ply(form, vertex, [[0, 1, 2]]) for form in ("binary_little_endian", "ascii"))
    infinite = columns("float", "x y z", [[0, 0, 0], [1, 0, 0], [0, np.inf, 0]])
    for data, words in (
        (little[:-1], "element face: cut"),
        (text[:-4], "element face: cut"),
        (text.replace(b"3 0 1 2", b"3 0 1"), "element face: cut"),
        (text.replace(b"3 0 1 2", b"inf 0 1 2"), "element face: cut"),
        (text.replace(b"3 0 1 2", b"nan 0 1 2"), "element face: cut"),
        (text.replace(b"3 0 1 2", b"1e300 0 1 2"), "element face: cut"),
        (text.replace(b"3 0 1 2", b"3.5 0 1 2"), "element face: cut"),
        (text.replace(b"3 0 1 2", b"-3 0 1 2"), "element face: cut"),
        (text.replace(b"3 0 1 2", b"3 0 1.5 2"), "face 0: names vertex 1.5 of 3"),
        (little.replace(b"list uchar", b"list float"), "line 9: 'property list float .*' is not a statement"),
        (text.replace(b"3 0 1 2", b"3 0 1 2 two"), "element vertex: cut, or holds what is not a number"),
        (text.replace(b"2.0", b"2_0.0"), "element vertex: cut, or holds what is not a number"),
        (text.replace(b"2.0", b"two"), "element vertex: cut, or holds what is not a number"),
        (text.replace(b"vertex 3", b"vertex 999999999999999999"), "element vertex: cut"),
        (little.replace(b"face 1", b"face 888888888888"), "element face: cut"),
        (little.replace(b"vertex 3", b"vertex 99999999999999999999"), "line 4: 'element vertex 9+' is no"),
        (little.replace(b"float x", b"quad x"), "line 5: 'property quad x' is not a statement"),
        (little.replace(b"end_header", b"end"), "its header has no end"),
        (little.replace(b"format", b"comment"), "its header has no format"),
        (little.replace(b"float y", b"float x"), "its header has a property of vertex twice"),
        (text.replace(b"float y", b"list uchar int x"), "its header has a property of vertex twice"),
        (little.replace(b"property float x\n", b"property float w\n"), "no vertices with x, y and z"),
        (ply("ascii", vertex, [[0, 1, 3]]), "face 0: names vertex 3 of 3"),
        (ply("ascii", vertex, [[0, 1, 2], [3, 1, 2]]), "face 1: names vertex 3 of 3"),
        (ply("binary_big_endian", vertex, [[0, -1, 2]]), "face 0: names vertex -1 of 3"),
        (ply("ascii", infinite, [[0, 1, 2]]), "vertex 2: x y z are 0 inf 0"),
        (ply("ascii", vertex, []), "holds no faces"),
        (ply("ascii", vertex, [[0, 1]]), "holds no faces"),
        (text.replace(b"element face", b"element tristrips").replace(b"3 0", b"2 0"), "holds no faces"),
        (
            text.replace(b"element face", b"element tristrips").replace(b"0 1 2", b"0 1 -2"),
            "face 0: names vertex -2 of 3",
        ),
        (b"", "is an empty file"),
        (b"ply\n", "its header has no end"),
        (b"junk, is no model " * 9, "is not a PLY: it begins with b'junk, is no mode', not with 'ply'"),
    ):
        (tmp_path / "a.ply").write_bytes(data)
        with pytest.raises(SourceError, match=words) as caught:
            read_model(tmp_path / "a.ply")
        assert "\n" not in str(caught.value) and "a.ply" in str(caught.value)


@pytest.mark.parametrize(
    "names",
    [
        "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3",
        "x y z red green blue scale_0 scale_1 rot_0 rot_1 rot_2 rot_3",
        "packed_position packed_rotation packed_scale packed_color",
    ],
)
def test_a_gaussian_splat_is_refused_as_one(names: str, tmp_path: Path) -> None:
    data = ply("ascii", columns("float", names, np.zeros((3, len(names.split())))), [])
    points = data.replace(b"element face 0\nproperty list uchar int vertex_indices\n", b"")
    assert b"face" not in points
    for each in (data, points):
        (tmp_path / "a.ply").write_bytes(each)
        with pytest.raises(SourceError, match="is a Gaussian splat, and Paradize reads only meshes; export"):
            read_model(tmp_path / "a.ply")


def test_a_mesh_with_properties_of_splats_is_read(tmp_path: Path) -> None:
    rows = np.pad(PLACES, ((0, 0), (0, 2)))
    (tmp_path / "a.ply").write_bytes(ply("ascii", columns("float", "x y z scale_0 rot_0", rows), [[0, 1, 2]]))
    assert len(read_model(tmp_path / "a.ply").mesh.triangles) == 1


@pytest.mark.parametrize("form", FORMS)
def test_a_header_line_that_is_no_statement_is_skipped_and_told(form: str, tmp_path: Path) -> None:
    """As Blender 2.4 wrote a comment without its word."""
    data = ply(form, columns("float", "x y z", PLACES), [[0, 1, 2]])
    for line, more in (("Created by Blender3D\n", ""), ("Made by me\nTwice\n", " (and 1 more)")):
        (tmp_path / "a.ply").write_bytes(data.replace(b"element v", line.encode() + b"element v", 1))
        model = read_model(tmp_path / "a.ply")
        assert np.array_equal(model.mesh.positions[model.mesh.triangles[0]], PLACES[:3])
        shown = line.partition("\n")[0]
        told = f"{tmp_path / 'a.ply'}: line 4: {shown!r} is not a statement of PLY; skipped{more}"
        assert model.warnings == [told]


def test_a_ply_of_another_name_is_read_as_one(tmp_path: Path) -> None:
    data = ply("ascii", columns("float", "x y z", PLACES), [[0, 1, 2]])
    (tmp_path / "scan.obj").write_bytes(data)
    assert read_model(tmp_path / "scan.obj").counts["triangles"] == 1
