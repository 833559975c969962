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


def meshopt(made: Made, data: bytes, count: int, stride: int, mode: str, more: dict[str, Any]) -> int:
    """A view of bytes that meshopt packed; the buffer of its other form is not there."""
    packed = made.view(data)
    inner = made.tree["bufferViews"].pop(packed) | {"count": count, "byteStride": stride, "mode": mode}
    plain = {"buffer": 1, "byteLength": count * stride}
    return made.add("bufferViews", **plain, extensions={"EXT_meshopt_compression": inner | more})


def packed_ball(**changes: Any) -> Made:
    made = Made()
    vertices = meshoptimizer.encode_vertex_buffer(POSITIONS, len(POSITIONS), 12)
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


def test_a_model_that_meshopt_packed_is_read_equal(tmp_path: Path) -> None:
    model = read_model(packed_ball().glb(tmp_path / "a.glb"))
    assert same_surface(model.mesh.positions[model.mesh.triangles], POSITIONS[TRIANGLES])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"count": 1 << 30}, "values of 12 bytes from"),
        ({"mode": "OTHER"}, "mode 'OTHER' is not known"),
        ({"filter": "OTHER"}, "filter 'OTHER' is not known"),
        ({"byteStride": 7}, "not allowed for ATTRIBUTES"),
        ({"byteLength": 8}, "meshopt cannot unpack it"),
    ],
)
def test_packed_bytes_that_cannot_be_right_are_refused_in_one_line(
    change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    with pytest.raises(SourceError, match=words) as caught:
        read_model(packed_ball(**change).glb(tmp_path / "a.glb"))
    assert "extensions/EXT_meshopt_compression" in str(caught.value)


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
