"""OpenMesh behind its kernel: it counts what we count, its simplifier moves nothing, and bad arrays stop."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from paradize.kernels import openmesh
from paradize.kernels.mesh import topology

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
HALVES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)


def sphere(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed sphere of radius 1: poles and rows between."""
    theta = np.pi * np.arange(1, rows) / rows
    phi = 2 * np.pi * np.arange(columns) / columns
    ring = np.stack(
        [np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi)),
         np.outer(np.cos(theta), np.ones(columns))], 2,
    ).reshape(-1, 3)  # fmt: skip
    positions = np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])
    north, south = len(ring), len(ring) + 1
    triangles = []
    for k in range(columns):
        n = (k + 1) % columns
        triangles.append((north, k, n))
        triangles.append((south, (rows - 2) * columns + n, (rows - 2) * columns + k))
        for r in range(rows - 2):
            a, b = r * columns, (r + 1) * columns
            triangles += [(a + k, b + k, a + n), (a + n, b + k, b + n)]
    return positions, np.array(triangles, np.uint32)


def test_a_squares_triangles_edges_and_border_are_counted() -> None:
    assert openmesh.count(SQUARE, HALVES) == (2, 5, 4)


def test_its_count_of_a_sphere_is_ours() -> None:
    positions, triangles = sphere(12, 20)
    ours = topology(triangles, len(positions))
    assert openmesh.count(positions, triangles) == (len(triangles), ours.edges, ours.border.count)


def test_a_third_triangle_at_an_edge_is_left_out_of_the_count(capfd: pytest.CaptureFixture[str]) -> None:
    positions = np.concatenate([SQUARE, [[0, 0, 1], [0, 0, 2]]])
    faces, _, _ = openmesh.count(positions, [*HALVES.tolist(), [0, 2, 4], [2, 0, 5]])
    assert faces < 4
    assert capfd.readouterr() == ("", "")


def test_a_simplified_sphere_keeps_places_closure_and_radius() -> None:
    positions, triangles = sphere(24, 40)
    vertex, left = openmesh.simplify(positions, triangles, 400)
    assert abs(len(left) - 400) <= 1
    assert len(np.unique(vertex)) == len(vertex) == left.max() + 1
    found = topology(left, len(vertex))
    assert (found.border.count, found.turned.count, found.components) == (0, 0, 1)
    corners = positions[vertex][left]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert 0.9 < volume / (4 / 3 * np.pi) < 1  # still wound outwards, and still a sphere


def test_simplifying_twice_gives_the_same() -> None:
    mesh = sphere(16, 30)
    for a, b in zip(openmesh.simplify(*mesh, 200), openmesh.simplify(*mesh, 200), strict=True):
        assert np.array_equal(a, b)


def test_a_flat_square_of_many_triangles_becomes_few() -> None:
    x, y = np.meshgrid(np.arange(9.0), np.arange(9.0))
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    quads = np.stack([corner, corner + 1, corner + 10, corner + 9], 1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    positions = np.stack([x.ravel(), y.ravel(), np.zeros(81)], 1)
    _, left = openmesh.simplify(positions, triangles, 40)
    assert len(left) <= 40


@pytest.mark.parametrize(
    ("positions", "triangles", "words"),
    [
        (SQUARE[:, :2], HALVES, "floats, got"),
        (SQUARE, HALVES[:, :2], "indices, got"),
        (SQUARE * np.nan, HALVES, "not finite"),
        (SQUARE, HALVES + 1, "index 4 of 4"),
        (SQUARE, [[0, 1, 1]], "repeats"),
    ],
)
def test_arrays_that_are_no_mesh_are_refused(positions: object, triangles: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        openmesh.count(positions, triangles)
    with pytest.raises(ValueError, match=words):
        openmesh.simplify(positions, triangles, 1)


def test_no_manifold_and_no_target_are_refused() -> None:
    with pytest.raises(ValueError, match="no manifold"):
        openmesh.simplify(SQUARE, [*HALVES.tolist(), [0, 1, 2]], 1)
    with pytest.raises(ValueError, match="target 0, expected at least 1"):
        openmesh.simplify(SQUARE, HALVES, 0)


def test_without_openmesh_meshes_are_validated_and_the_call_says_what_is_missing() -> None:
    """As built where CMake finds no OpenMesh."""
    program = """
import sys
sys.modules["paradize.kernels.openmesh._openmesh"] = None  # is not there
import numpy as np
from paradize.data import Mesh
from paradize.kernels import openmesh
from paradize.stages.validate import validate_mesh
square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]], np.float32)
triangle = np.array([[0, 1, 2]], np.uint32)
mesh, report = validate_mesh(Mesh(square, triangle))
assert not report.counted_twice
try:
    openmesh.count(square, triangle)
except RuntimeError as error:
    print(error)
"""
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300)
    assert result.stderr == "" and result.stdout.startswith("Paradize was built without OpenMesh: install")
