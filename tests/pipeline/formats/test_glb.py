"""GLB: what is written is read back, and nothing else is accepted."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.mesh.bake import bake_mesh
from paradize.checks.meshes import check_mesh
from paradize.data import Group, Lod, Mesh
from paradize.errors import BakeError, FormatError
from paradize.formats.glb.cut import cut_glb
from paradize.formats.glb.document import glb_document
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.reader import decode_glb
from tests.pipeline.glb_json import document, with_document
from tests.pipeline.shapes import sphere
from tests.sweeps import tries


def card(size: float = 1.0) -> Mesh:
    """Two triangles with every attribute, in two groups."""
    positions = np.array([[0, 0, 0], [size, 0, 0], [size, size, 0], [0, size, 0]], np.float32)
    return Mesh(
        positions=positions,
        triangles=np.array([[0, 1, 2], [0, 2, 3]], np.uint32),
        normals=np.tile(np.array([0, 0, 1], np.float32), (4, 1)),
        tangents=np.tile(np.array([1, 0, 0, 1], np.float32), (4, 1)),
        uvs=np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32),
        uvs1=np.array([[0, 3], [3, 3], [3, 0], [0, 0]], np.float32),
        groups=(Group("left", "wood", 0, 1), Group("right", "leaf", 1, 1)),
    )


def triangle() -> Mesh:
    whole = card()
    return replace(whole, triangles=whole.triangles[:1], groups=(Group("left", "wood", 0, 1),))


def two_levels() -> bytes:
    return encode_glb([Lod(card(), 0.0, 0.0), Lod(triangle(), 0.25, 0.125)], "card", {"tier": "balanced"})


def same(a: Mesh, b: Mesh) -> bool:
    for name in ("positions", "triangles", "normals", "tangents", "uvs", "uvs1"):
        x, y = getattr(a, name), getattr(b, name)
        if (x is None) != (y is None) or (x is not None and not np.array_equal(x, y)):
            return False
    return a.groups == b.groups


def test_every_level_comes_back_as_it_went_in() -> None:
    fine, coarse = decode_glb(two_levels())
    assert same(fine.mesh, card())
    assert same(coarse.mesh, triangle())
    assert (fine.error_max, coarse.error_max, coarse.error_rms) == (0.0, 0.25, 0.125)


def test_absent_attributes_stay_absent() -> None:
    bare = replace(card(), normals=None, tangents=None, uvs=None, uvs1=None)
    (back,) = decode_glb(encode_glb([Lod(bare, 0, 0)], "bare"))
    assert same(back.mesh, bare)


def test_the_coarsest_level_comes_first_in_the_binary_and_only_the_finest_is_in_the_scene() -> None:
    found = document(two_levels())
    starts = [
        found["bufferViews"][found["accessors"][mesh["primitives"][0]["indices"]]["bufferView"]]["byteOffset"]
        for mesh in found["meshes"]
    ]
    assert starts[1] < starts[0]
    assert found["scenes"][0]["nodes"] == [0]
    assert found["nodes"][0]["extensions"]["MSFT_lod"]["ids"] == [1]


def test_error_m_is_the_fraction_times_the_diagonal() -> None:
    data = encode_glb([Lod(card(3.0), 0.0, 0.0), Lod(card(3.0), 0.5, 0.1)], "card")
    assert document(data)["nodes"][1]["extras"]["error_m"] == pytest.approx(0.5 * 3 * 2**0.5, rel=1e-5)


def test_error_m_is_the_slide_of_the_texture_where_that_is_larger_and_never_falls() -> None:
    slid = [{"uv_shift_p99": share} for share in (0.0, 0.25, 0.01)]
    errors = (0.0, 0.01, 0.02)
    data = encode_glb(
        [Lod(card(3.0), off, 0.0, more) for off, more in zip(errors, slid, strict=True)], "card"
    )
    message = [node["extras"]["error_m"] for node in document(data)["nodes"]]
    assert message == pytest.approx([0, 0.25 * 3 * 2**0.5, 0.25 * 3 * 2**0.5], rel=1e-5)


def test_every_view_is_aligned_in_the_file() -> None:
    data = two_levels()
    (length,) = struct.unpack_from("<I", data, 12)
    start = 28 + length
    assert start % 16 == 0
    assert all(view["byteOffset"] % 16 == 0 for view in document(data)["bufferViews"])


@pytest.mark.parametrize(("count", "component"), [(65535, 5123), (65536, 5125), (65537, 5125)])
def test_indices_take_16_bits_where_they_fit(count: int, component: int) -> None:
    positions = np.zeros((count, 3), np.float32)
    positions[:, 0] = np.arange(count)
    mesh = Mesh(positions, np.array([[0, 1, count - 1]], np.uint32))
    data = encode_glb([Lod(mesh, 0, 0)], "long")
    found = document(data)
    assert found["accessors"][found["meshes"][0]["primitives"][0]["indices"]]["componentType"] == component
    assert same(decode_glb(data)[0].mesh, replace(mesh, groups=(Group("default", "default", 0, 1),)))


def test_the_same_mesh_gives_the_same_bytes() -> None:
    assert two_levels() == two_levels()


def test_a_file_cut_at_any_byte_is_refused() -> None:
    data = two_levels()
    for length in range(len(data)):
        with pytest.raises(FormatError):
            decode_glb(data[:length], "cut.glb")


def test_any_changed_byte_is_refused_or_read_without_harm() -> None:
    data = two_levels()
    for at in range(0, len(data)):
        changed = bytearray(data)
        changed[at] ^= 0xFF
        try:
            levels = decode_glb(bytes(changed))
        except FormatError as error:
            assert error.place
            continue
        assert all(int(level.mesh.triangles.max()) < len(level.mesh.positions) for level in levels)
        assert all(np.isfinite(level.mesh.positions).all() for level in levels)


@given(st.binary(max_size=200))
@settings(max_examples=tries(200), deadline=None)
def test_arbitrary_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(FormatError):
        decode_glb(data)
    with pytest.raises(FormatError):
        decode_glb(struct.pack("<4sII", b"glTF", 2, 12 + len(data)) + data)


def edit(path: str, value: object) -> bytes:
    data = two_levels()
    found = document(data)
    *owners, last = path.split("/")
    owner: Any = found
    for step in owners:
        owner = owner[int(step)] if isinstance(owner, list) else owner[step]
    if isinstance(owner, list):
        owner[int(last)] = value
    else:
        owner[last] = value
    return with_document(data, found)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("asset/version", "1.0"),
        ("scenes/0/nodes", [0, 1]),
        ("nodes/0/mesh", 2),
        ("nodes/0/mesh", -1),
        ("nodes/0/mesh", True),
        ("nodes/0/mesh", 0.5),
        ("nodes/1/name", "lod7"),
        ("nodes/1/extras/error_max", -1),
        ("nodes/0/extensions/MSFT_lod/ids", [0]),
        ("nodes/0/extensions/MSFT_lod/ids", []),
        ("accessors/0/count", 10**18),
        ("accessors/0/count", -3),
        ("accessors/0/componentType", 5121),
        ("accessors/0/type", "MAT4"),
        ("accessors/0/byteOffset", 2),
        ("accessors/0/bufferView", 99),
        ("accessors/0/min", [0, 0, -1]),
        ("bufferViews/0/byteLength", 10**12),
        ("bufferViews/0/byteOffset", -16),
        ("bufferViews/0/byteStride", 12),
        ("buffers/0/byteLength", 1),
        ("buffers/0/uri", "file:///etc/passwd"),
        ("meshes/0/primitives", []),
        ("meshes/0/primitives/0/mode", 1),
        ("meshes/0/primitives/0/material", 5),
        ("meshes/0/primitives/0/attributes/POSITION", 3),
        ("meshes/0/primitives/1/attributes", {}),
        ("materials/0/extras", {}),
        ("materials/0/extras/center", [0, 0]),
        ("materials/0/extras/uv_per_m", -2.0),
        ("materials/0/extras/uv1_per_m", True),
        ("materials/0/extras/size", 1.0),
        ("materials/0/name", 7),
        ("materials/1/extras", {"center": [0, 0, 0]}),
    ],
)
def test_tables_that_do_not_fit_are_refused_with_their_place(path: str, value: object) -> None:
    with pytest.raises(FormatError) as raised:
        decode_glb(edit(path, value), "bad.glb")
    assert raised.value.place
    assert "bad.glb" in str(raised.value)


def test_an_index_beyond_the_vertices_is_refused() -> None:
    data = bytearray(two_levels())
    found = document(bytes(data))
    (length,) = struct.unpack_from("<I", data, 12)
    accessor = found["accessors"][found["meshes"][0]["primitives"][0]["indices"]]
    at = 28 + length + found["bufferViews"][accessor["bufferView"]]["byteOffset"]
    struct.pack_into("<H", data, at, 4)
    with pytest.raises(FormatError, match="index 4 of 4 vertices"):
        decode_glb(bytes(data))


def test_deeply_nested_json_is_refused() -> None:
    text = b"[" * 200_000
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", 0, b"BIN\0")
    with pytest.raises(FormatError):
        decode_glb(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)


@pytest.mark.parametrize(
    "broken",
    [
        replace(card(), triangles=np.array([[0, 1, 4]], np.uint32), groups=()),
        replace(card(), triangles=np.zeros((0, 3), np.uint32), groups=()),
        replace(card(), positions=np.full((4, 3), np.nan, np.float32)),
        replace(card(), normals=np.zeros((3, 3), np.float32)),
        replace(card(), uvs=np.zeros((4, 2), np.float64)),
        replace(card(), groups=(Group("left", "wood", 0, 1),)),
        replace(card(), colors=np.full((4, 4), 1.5, np.float32)),
    ],
)
def test_what_a_reader_would_refuse_is_never_written(broken: Mesh) -> None:
    with pytest.raises(BakeError):
        encode_glb([Lod(broken, 0, 0)], "broken")


def test_vertex_colours_come_back_and_every_level_of_a_bake_has_them(tmp_path: Path) -> None:
    colors = np.array([[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1], [0.5, 0.25, 0, 1]], np.float32)
    data = encode_glb([Lod(replace(card(), colors=colors), 0, 0)], "card")
    assert document(data)["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] == 5
    back = decode_glb(data)[0].mesh.colors
    assert back is not None and np.array_equal(back, colors)
    assert list(check_mesh(data, "card.glb")) == []
    ball = sphere(20)
    shades = ball.positions * 0.5 + 0.5
    rows = [f"v {a} {b} {c} {r} {g} {d}" for (a, b, c), (r, g, d) in zip(ball.positions, shades, strict=True)]
    rows += [f"f {a} {b} {c}" for a, b, c in (ball.triangles + 1).tolist()]
    (tmp_path / "ball.obj").write_text("\n".join(rows))
    for tier in ("fast", "balanced"):
        levels = bake_mesh(tmp_path / "ball.obj", lods=3, tier=tier).lods
        assert len(levels) == 3
        for level in levels:
            assert level.mesh.colors is not None
            written = level.mesh.positions * 0.5 + 0.5  # sRGB; a mesh holds linear light
            meant = np.where(written <= 0.04045, written / 12.92, ((written + 0.055) / 1.055) ** 2.4)
            off = np.abs(level.mesh.colors[:, :3] - meant).max()
            assert off < 0.03, tier


@pytest.mark.parametrize("count", [1, 2, 3, 40, 999])
def test_a_twentieth_of_a_material_s_area_has_fewer_texture_coordinates_per_metre(count: int) -> None:
    random = np.random.default_rng(7)
    width, height, across, up = random.uniform(0.1, 3.0, (4, count)).astype(np.float32).astype(np.float64)
    alike = np.arange(count) % 4 == 0
    across[alike], up[alike] = 1.0, (width * height)[alike].astype(np.float32)
    positions = np.zeros((count, 3, 3), np.float32)
    positions[..., 2], positions[:, 1, 0], positions[:, 2, 1] = 1.0, width, height
    uvs = np.zeros((count, 3, 2), np.float32)
    uvs[:, 1, 0], uvs[:, 2, 1] = across, up
    areas = width * height
    below, answer = 0.0, 0.0
    for density, area in sorted(zip(np.sqrt(across * up / areas), areas, strict=True)):
        below, answer = below + area, density
        if below >= 0.05 * areas.sum():
            break
    parts = (count + 1) // 2, count // 2  # a material may have several primitives
    groups = [Group(f"part {k}", "wood", k * parts[0], size) for k, size in enumerate(parts) if size]
    indices = np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)
    flat = positions.reshape(-1, 3), uvs.reshape(-1, 2)
    mesh = Mesh(flat[0], indices, uvs=flat[1], uvs1=2 * flat[1], groups=tuple(groups))
    extras = document(encode_glb([Lod(mesh, 0, 0)], "m"))["materials"][0]["extras"]
    assert extras["uv_per_m"] == pytest.approx(answer, rel=1e-5)
    assert extras["uv1_per_m"] == pytest.approx(2 * answer, rel=1e-5)
    assert extras["center"] == pytest.approx([width.max() / 2, height.max() / 2, 1.0], rel=1e-5)


def test_measures_are_those_of_the_coarsest_level_that_is_left() -> None:
    large = replace(card(3.0), groups=(Group("left", "wood", 0, 2),))
    data = encode_glb([Lod(large, 0, 0), Lod(triangle(), 0.25, 0.125)], "card")
    kept = {"center": [0.5, 0.5, 0.0], "uv_per_m": 1.0, "uv1_per_m": 3.0}
    assert document(cut_glb(data, finer=1))["materials"][0]["extras"] == kept
    one = cut_glb(data, coarser=1)
    assert document(one)["materials"][0]["extras"]["center"] == [1.5, 1.5, 0.0]
    assert decode_glb(one) and not list(check_mesh(one, "card.glb"))
    bare = cut_glb(data, attributes=("POSITION", "TEXCOORD_0"))
    assert decode_glb(bare) and not list(check_mesh(bare, "card.glb"))


def test_a_material_without_area_has_no_texture_coordinates_per_metre() -> None:
    flat = replace(card(), positions=np.zeros((4, 3), np.float32), tangents=None, groups=())
    (entry,) = document(encode_glb([Lod(flat, 0, 0)], "flat"))["materials"]
    assert entry["extras"] == {"center": [0, 0, 0], "uv_per_m": 0, "uv1_per_m": 0}


def test_materials_hold_their_colour_within_its_range_and_are_no_metal() -> None:
    names = ("red", "bright", "mapped")
    mesh = replace(sphere(6), groups=tuple(Group(name, name, 20 * at, 20) for at, name in enumerate(names)))
    mesh = replace(mesh, triangles=mesh.triangles[:60])
    colors = {"red": (0.5, 0, 0), "bright": (2.0, -1.0, 0.25)}
    found = document(encode_glb([Lod(mesh, 0, 0)], "m", base_colors=colors))["materials"]
    assert [material["name"] for material in found] == list(names)
    result = [material.get("pbrMetallicRoughness") for material in found]
    assert result[0] == {"baseColorFactor": [0.5, 0, 0, 1], "metallicFactor": 0}
    assert result[1]["baseColorFactor"] == [1, 0, 0.25, 1] and result[2] is None


def test_the_document_alone_is_the_reader_s_and_anything_else_is_no_glb() -> None:
    data = two_levels()
    tree, start = glb_document(data, "a.glb")
    assert tree == document(data) and data[start - 4 : start] == b"BIN\0"
    for broken in (b"", data[:19], b"glTX" + data[4:], data[:16] + b"BIN\0" + data[20:]):
        with pytest.raises(FormatError, match=r"a\.glb: is not a GLB"):
            glb_document(broken, "a.glb")
