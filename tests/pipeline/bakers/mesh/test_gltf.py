"""Baked glTF models: their tangents are measured, its triangles are named by number."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from paradize.bakers.mesh.bake import bake_mesh
from paradize.data import Lod, Mesh
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.reader import decode_glb
from paradize.stages.normals import complete_normals
from paradize.stages.tangents import tangent_frames
from tests.pipeline.readers.gltf.made import SQUARE, TWO, Made, shown


def ball() -> Mesh:
    """A ball with normals, texture coordinates and MikkTSpace's tangents."""
    surface = trimesh.creation.icosphere(subdivisions=2)
    positions = surface.vertices.astype(np.float32)
    uvs = positions[:, :2] * np.float32(0.5) + np.float32(0.5)
    mesh = Mesh(positions, surface.faces.astype(np.uint32), normals=positions, uvs=uvs)
    return tangent_frames(complete_normals(mesh, crease_deg=45.0)[0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("none", []),
        ("turned", ["degrees (99 %) from those of MikkTSpace"]),
        ("mirrored", ["its tangents are mirrored against those of MikkTSpace in 100.0% of corners"]),
    ],
)
def test_tangents_of_a_file_are_measured_and_those_of_others_are_said(
    change: str, words: list[str], tmp_path: Path
) -> None:
    mesh = ball()
    assert mesh.tangents is not None and mesh.normals is not None
    along, side = mesh.tangents[:, :3], mesh.tangents[:, 3:]
    if change == "turned":
        along = np.cross(mesh.normals, along)
    if change == "mirrored":
        side = -side
    written = np.concatenate([along, side], axis=1).astype(np.float32)
    changed = Mesh(mesh.positions, mesh.triangles, mesh.normals, written, mesh.uvs)
    (tmp_path / "a.glb").write_bytes(encode_glb([Lod(changed, 0.0, 0.0)], "made"))
    made = bake_mesh(tmp_path / "a.glb", lods=1)
    found = [text for text in made.report["warnings"] if "its tangents are" in text]
    assert len(found) == len(words) and all(word in found[0] for word in words)
    assert not any(" 0 degrees" in text for text in found)
    assert decode_glb(made.glb)[0].mesh.tangents is not None
    assert made.report["lods"][0]["tangent_p99_deg"] < 0.1


def test_rounding_that_moves_vertices_names_the_triangle_of_a_file_without_lines(tmp_path: Path) -> None:
    made = Made()
    small = {"attributes": {"POSITION": made.array(SQUARE)}, "indices": made.array(TWO)}
    mesh = made.mesh(small)
    made.show(made.add("nodes", mesh=mesh, translation=[1e8, 0, 0]), made.add("nodes", mesh=mesh))
    report = bake_mesh(made.glb(tmp_path / "a.glb"), lods=1).report
    assert any("triangle" in text and "rounding moves vertices" in text for text in report["warnings"])
    shown(small, made)
    assert not bake_mesh(made.glb(tmp_path / "b.glb"), lods=1).report["repairs"]["doubled"]["line"]
