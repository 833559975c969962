"""Our tangent frames are those of npm mikktspace, the reference compiled to WebAssembly, corner by corner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.data import Mesh
from paradize.kernels.reference import angles_deg, mikktspace_tangents
from paradize.readers.obj import read_obj
from paradize.stages.normals import complete_normals
from paradize.stages.validate import validate_mesh
from tests.bench import meshes
from tests.pipeline.shapes import corner_tangents, grid, sphere
from tests.sweeps import sweep

Node = Callable[[str, list[object]], Any]
Corners = npt.NDArray[np.float32]

FILES = [
    "made/tangent/made/vase",
    "corpus/tangent/Avocado/Avocado",
    "corpus/tangent/BoomBox/BoomBox",
    "corpus/tangent/Corset/Corset",
    "corpus/tangent/NormalTangentMirrorTest/NormalTangentMirrorTest",
    "corpus/tangent/NormalTangentTest/NormalTangentTest",
    "corpus/tangent/mikktspace/gltf-rs_cube",
]


def npm_tangents(node: Node, folder: Path, mesh: Mesh) -> Corners:
    """(m, 3, 4) of npm mikktspace, its sign turned: it runs on top-left UVs."""
    assert mesh.normals is not None and mesh.uvs is not None
    path = folder / "mesh.bin"
    corner = mesh.triangles.reshape(-1)
    path.write_bytes(b"".join(rows[corner].tobytes() for rows in (mesh.positions, mesh.normals, mesh.uvs)))
    node("mikktspace.mjs", [1, path])
    found = np.fromfile(f"{path}.out", np.float32).reshape(-1, 3, 4)
    return found * np.array([1, 1, 1, -1], np.float32)


def with_area(mesh: Mesh) -> npt.NDArray[np.bool_]:
    """(m,) triangles that have area in the image and in space: elsewhere npm's frames are no frames."""
    assert mesh.uvs is not None
    a, b, c = (mesh.uvs[mesh.triangles[:, k]] for k in range(3))
    image = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    p, q, r = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    flat = (p == q).all(axis=1) | (q == r).all(axis=1) | (r == p).all(axis=1)
    return (np.abs(image) > np.finfo(np.float32).tiny) & ~flat


def differences(mesh: Mesh, found: Corners, truth: Corners) -> tuple[npt.NDArray[np.float64], float]:
    """Degrees at each corner, and the share of the corners whose signs differ."""
    kept = with_area(mesh)
    a, b = found[kept].reshape(-1, 4), truth[kept].reshape(-1, 4)
    assert len(a) >= 3
    return angles_deg(a[:, :3], b[:, :3]), float((a[:, 3] != b[:, 3]).mean())


def made(name: str) -> Mesh:
    if name == "sphere":
        return sphere(24)
    if name == "mirrored grid":
        mesh = grid(12, height=0.2)
        assert mesh.uvs is not None
        return complete_normals(
            replace(mesh, uvs=np.abs(mesh.uvs - np.float32(0.5)), normals=None), crease_deg=45.0
        )[0]
    if name == "dense sphere, charts mirrored":
        return meshes.sphere(20_000, mirrored=True)
    if name == "dense torus, mirrored":
        return meshes.torus(20_000, mirrored=True)
    if name == "turned inside out":
        mesh = meshes.sphere(5_000)
        return replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))
    if name == "split images":
        # Every triangle its own mirrored or plain piece of the image: frames are joined by no edge.
        mesh = meshes.torus(3_000)
        corner = mesh.triangles.reshape(-1)
        random = np.random.default_rng(3)
        assert mesh.normals is not None
        return Mesh(
            mesh.positions[corner],
            np.arange(len(corner), dtype=np.uint32).reshape(-1, 3),
            normals=mesh.normals[corner],
            uvs=random.random((len(corner), 2), np.float32),
        )
    assert name == "image of noise"
    mesh = meshes.sphere(3_000)
    assert mesh.uvs is not None
    random = np.random.default_rng(5)
    return replace(mesh, uvs=random.random(mesh.uvs.shape, np.float32))


MADE = [
    "sphere",
    "mirrored grid",
    "dense sphere, charts mirrored",
    "dense torus, mirrored",
    "turned inside out",
    "split images",
    "image of noise",
]


@pytest.mark.parametrize("name", sweep(MADE, test=[*MADE[1:2], *MADE[-3:]]))
def test_frames_of_made_meshes_are_those_of_npm(tmp_path: Path, node: Node, name: str) -> None:
    assert_the_same(tmp_path, node, made(name))


@pytest.mark.parametrize("name", sweep(FILES, test=[*FILES[:1], *FILES[-3:-2], *FILES[-1:]]))
def test_frames_of_files_are_those_of_npm(
    tmp_path: Path, node: Node, source: Callable[[str], Path], name: str
) -> None:
    mesh = complete_normals(validate_mesh(read_obj(source(f"{name}.obj")).mesh)[0], crease_deg=45.0)[0]
    assert_the_same(tmp_path, node, mesh)


def assert_the_same(tmp_path: Path, node: Node, mesh: Mesh) -> None:
    assert mesh.normals is not None and mesh.uvs is not None
    theirs = npm_tangents(node, tmp_path, mesh)
    surface = (mesh.positions, mesh.normals, mesh.uvs, mesh.triangles)
    angles, signs = differences(mesh, corner_tangents(mesh), theirs)
    assert (angles > 1).mean() <= 1e-4 and signs <= 4e-5
    # The reference that metrics measure against is held to the same.
    angles, signs = differences(mesh, mikktspace_tangents(*surface), theirs)
    assert (angles > 1).mean() <= 1e-4 and signs <= 4e-5
