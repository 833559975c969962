"""Data compressed by meshopt and Draco is unpacked, and no more than the packed bytes may hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import DracoPy
import meshoptimizer
import numpy as np
import pytest
import trimesh

from paradize.errors import SourceError
from paradize.readers.model import read_model
from tests.pipeline.readers.gltf.made import Made, shown

BALL = trimesh.creation.icosphere(subdivisions=2)
POSITIONS = BALL.vertices.astype(np.float32)
TRIANGLES = BALL.faces.astype(np.uint32)


def meshopt(
    made: Made, data: bytes, count: int, stride: int, mode: str, more: dict[str, Any], by: str = "EXT"
) -> int:
    """A view of bytes that meshopt packed; the buffer of its other form is not there."""
    packed = made.view(data)
    inner = made.tree["bufferViews"].pop(packed) | {"count": count, "byteStride": stride, "mode": mode}
    plain = {"buffer": 1, "byteLength": count * stride}
    return made.add("bufferViews", **plain, extensions={f"{by}_meshopt_compression": inner | more})


def packed_ball(version: int = 0, **changes: Any) -> Made:
    """version: of the codec of vertices."""
    made = Made()
    meshoptimizer.encode_vertex_version(version)
    vertices = meshoptimizer.encode_vertex_buffer(POSITIONS, len(POSITIONS), 12)
    meshoptimizer.encode_vertex_version(0)
    positions = meshopt(made, vertices, len(POSITIONS), 12, "ATTRIBUTES", changes)
    indices = meshoptimizer.encode_index_buffer(TRIANGLES.reshape(-1), TRIANGLES.size, len(POSITIONS))
    corners = meshopt(made, indices, TRIANGLES.size, 4, "TRIANGLES", {})
    attribute = made.add(
        "accessors", bufferView=positions, componentType=5126, count=len(POSITIONS), type="VEC3"
    )
    index = made.add("accessors", bufferView=corners, componentType=5125, count=TRIANGLES.size, type="SCALAR")
    made.tree["extensionsRequired"] = ["EXT_meshopt_compression"]
    return shown({"attributes": {"POSITION": attribute}, "indices": index}, made)


def same_surface(found: Any, expected: Any) -> bool:
    """Whether the triangles are equal, whatever their order and their first corners."""

    def key(corners: Any) -> Any:
        first = [sorted(map(tuple, triangle)) for triangle in corners.tolist()]
        return sorted(first)

    return bool(key(found) == key(expected))


@pytest.mark.parametrize("version", [0, 1])
def test_a_model_that_meshopt_packed_is_read_equal(version: int, tmp_path: Path) -> None:
    made = packed_ball(version)
    assert made.data[0] == 0xA0 + version
    model = read_model(made.glb(tmp_path / "a.glb"))
    assert same_surface(model.mesh.positions[model.mesh.triangles], POSITIONS[TRIANGLES])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"count": 1 << 30}, "values of 12 bytes from"),
        ({"mode": "OTHER"}, "mode 'OTHER' is not known"),
        ({"filter": "OTHER"}, "filter 'OTHER' is not known"),
        ({"byteStride": 7}, "not allowed for ATTRIBUTES"),
        ({"byteLength": 8}, "meshopt cannot unpack it"),
        *(({"filter": f}, f"12, not allowed for filter {f}") for f in ("OCTAHEDRAL", "QUATERNION", "COLOR")),
    ],
)
def test_packed_bytes_that_cannot_be_right_are_refused_in_one_line(
    change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    with pytest.raises(SourceError, match=words) as caught:
        read_model(packed_ball(**change).glb(tmp_path / "a.glb"))
    assert "extensions/EXT_meshopt_compression" in str(caught.value)


def mixed_colors(size: int) -> tuple[Any, Any]:
    """Colours of all numbers of bits that integers of `size` bytes may hold: RGBA, and Y, Co, Cg, alpha."""
    random = np.random.default_rng(size)
    bits = np.repeat(np.arange(2, 8 * size + 1), 60)
    top = (1 << bits) - 1
    r, g, b = random.integers(0, top + 1, (3, len(bits)))
    b ^= (r ^ b) & 1  # r + b is even, and r + 2 g + b divides by 4: Y, Co and Cg are whole
    g ^= (g ^ (r + b) // 2) & 1
    half = random.integers(0, top // 2 + 1)
    packed = np.stack([(r + 2 * g + b) // 4, (r - b) // 2, (2 * g - r - b) // 4, half + top // 2 + 1])
    packed[:, :2] = [[3, 0], [1, 1], [1, 0], [3, 2]]  # green 4 of 3, blue -1: clamped
    r[:2], g[:2], b[:2], half[:2] = (3, 1), (3, 0), (1, 0), (1, 0)
    colors = np.stack([r, g, b, 2 * half + half % 2]) * (256**size - 1) / top
    return np.rint(colors).T.astype(f"<u{size}", order="C"), packed.T.astype(f"<u{size}", order="C")


@pytest.mark.parametrize("size", [1, 2])
def test_colours_of_any_bits_that_meshopt_filtered_are_read_equal(size: int, tmp_path: Path) -> None:
    colors, packed = mixed_colors(size)
    count = len(colors)
    places = np.random.default_rng(3).random((count, 3), np.float32)
    found = []
    for filtered in (False, True):
        made = Made()
        attributes = {"POSITION": made.array(places), "COLOR_0": made.array(colors, normalized=True)}
        if filtered:
            data = meshoptimizer.encode_vertex_buffer(packed, count, 4 * size)
            view = meshopt(made, data, count, 4 * size, "ATTRIBUTES", {"filter": "COLOR"}, "KHR")
            made.tree["accessors"][attributes["COLOR_0"]]["bufferView"] = view
        mesh = read_model(shown({"attributes": attributes}, made).glb(tmp_path / "a.glb")).mesh
        assert mesh.colors is not None
        found.append(mesh.colors[mesh.triangles])
    assert len(found[0]) == count // 3 and np.array_equal(*found)


@pytest.mark.parametrize("alpha", [0, 1])
def test_a_filtered_colour_whose_bits_are_not_known_is_refused(alpha: int, tmp_path: Path) -> None:
    made = Made()
    data = meshoptimizer.encode_vertex_buffer(np.full((3, 4), alpha, np.uint8), 3, 4)
    colors = made.add("accessors", componentType=5121, count=3, type="VEC4", normalized=True)
    view = meshopt(made, data, 3, 4, "ATTRIBUTES", {"filter": "COLOR"}, "KHR")
    made.tree["accessors"][colors]["bufferView"] = view
    shown({"attributes": {"POSITION": made.array(POSITIONS[:3]), "COLOR_0": colors}}, made)
    with pytest.raises(SourceError, match="KHR_meshopt_compression: meshopt cannot unpack it: a colour that"):
        read_model(made.glb(tmp_path / "a.glb"))


def draco_ball(count: int = TRIANGLES.size, cut: int | None = None) -> Made:
    made = Made()
    data = DracoPy.encode(POSITIONS, TRIANGLES, quantization_bits=16)[:cut]
    extension = {"bufferView": made.view(data), "attributes": {"POSITION": 0}}
    primitive = {
        "attributes": {
            "POSITION": made.add("accessors", componentType=5126, count=len(POSITIONS), type="VEC3")
        },
        "indices": made.add("accessors", componentType=5123, count=count, type="SCALAR"),
        "extensions": {"KHR_draco_mesh_compression": extension},
    }
    made.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return shown(primitive, made)


def test_a_model_that_draco_packed_is_read_within_its_rounding(tmp_path: Path) -> None:
    model = read_model(draco_ball().glb(tmp_path / "a.glb"))
    assert len(model.mesh.triangles) == len(TRIANGLES)
    assert np.abs(np.linalg.norm(model.mesh.positions, axis=1) - 1.0).max() < 1e-4
    box = model.mesh.positions.max(axis=0) - model.mesh.positions.min(axis=0)
    assert np.abs(box - (POSITIONS.max(axis=0) - POSITIONS.min(axis=0))).max() < 1e-4


def test_triangles_that_draco_left_out_are_told(tmp_path: Path) -> None:
    """Exporters say how many they had before: its encoder drops those that name a vertex twice."""
    model = read_model(draco_ball(count=TRIANGLES.size + 6).glb(tmp_path / "a.glb"))
    assert len(model.mesh.triangles) == len(TRIANGLES)
    said = f"Draco's data hold {len(TRIANGLES)} of {len(TRIANGLES) + 2} triangles"
    assert len(model.warnings) == 1 and said in model.warnings[0]


def test_draco_data_that_are_cut_or_announce_other_counts_are_refused_in_one_line(tmp_path: Path) -> None:
    for made, words in (
        (draco_ball(count=3 << 24), "do not hold"),
        (draco_ball(count=TRIANGLES.size - 3), "do not hold"),
        (draco_ball(count=TRIANGLES.size + 1), "do not hold"),
        (draco_ball(cut=200), "Draco cannot unpack it"),
        (draco_ball(cut=4), "Draco cannot unpack it"),
    ):
        with pytest.raises(SourceError, match=words):
            read_model(made.glb(tmp_path / "a.glb"))
