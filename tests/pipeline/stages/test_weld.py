"""Welding: only where asked, no place farther than the tolerance, nothing left to weld, and it is said."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from paradize.bakers.mesh.bake import bake_mesh
from paradize.cli.main import main
from paradize.data import Mesh
from paradize.errors import BakeError, SourceError
from paradize.kernels.mesh import number_rows, weld_points
from paradize.stages.validate import validate_mesh
from paradize.stages.weld import weld, welded_messages
from tests.pipeline.shapes import cube, sphere
from tests.sweeps import sample


def crumbled(mesh: Mesh, most: float, seed: int = 3) -> Mesh:
    """Every triangle with corners of its own, each moved by at most `most` along each axis."""
    rng = np.random.default_rng(seed)
    corners = mesh.positions[mesh.triangles.reshape(-1)]
    moved = corners + rng.uniform(-most, most, corners.shape)
    return Mesh(moved.astype(np.float32), np.arange(len(corners), dtype=np.uint32).reshape(-1, 3))


def test_nothing_is_welded_unless_asked() -> None:
    mesh = crumbled(cube(), 1e-6)
    same, done = weld(mesh, 0.0)
    assert same is mesh and done.joined == 0 and welded_messages(done) == []
    assert validate_mesh(same)[1].topology.components == 12


def test_a_crumbled_cube_is_closed_again() -> None:
    whole, done = weld(crumbled(cube(), 1e-4), 4e-4)
    sound, report = validate_mesh(whole)
    assert report.closed and len(sound.positions) == 8 and report.topology.components == 1
    assert done.joined == 28 and 0 < done.largest_m <= 4e-4
    assert "28 places joined" in welded_messages(done)[0]


@pytest.mark.parametrize("seed", range(4))
def test_how_far_a_place_went_at_most_is_told(seed: int) -> None:
    crumbs = crumbled(sphere(6), 1e-4, seed)
    whole, done = weld(crumbs, 4e-4)
    went = whole.positions[whole.triangles].astype(np.float64) - crumbs.positions[crumbs.triangles]
    assert done.largest_m == pytest.approx(np.linalg.norm(went, axis=2).max(), rel=1e-12)


@pytest.mark.parametrize(
    ("tolerance", "scale"), sample(product([1e-3, 0.05, 0.3], [1e-30, 1.0, 1e30]), every=8)
)
def test_no_point_goes_farther_than_the_tolerance_and_none_is_left_to_weld(
    tolerance: float, scale: float
) -> None:
    rng = np.random.default_rng(11)
    points = (rng.random((1500, 3)) * scale).astype(np.float32)
    target = weld_points(points, tolerance * scale)
    wide = points.astype(np.float64) / scale
    assert (np.linalg.norm(wide - wide[target], axis=1) <= tolerance * (1 + 1e-12)).all()
    assert (target <= np.arange(len(points))).all() and (target[target] == target).all()
    kept = wide[np.unique(target)]
    apart = np.linalg.norm(kept[:, None] - kept[None], axis=2)[np.triu_indices(len(kept), 1)]
    assert not len(apart) or apart.min() > tolerance * (1 - 1e-12)
    # By brute force: each point goes to the nearest of the earlier ones that stay.
    stay: list[int] = []
    for i, point in enumerate(wide):
        away = np.linalg.norm(wide[stay] - point, axis=1) if stay else np.array([np.inf])
        if away.min() > tolerance:
            stay.append(i)
        assert target[i] == (stay[int(away.argmin())] if away.min() <= tolerance else i)


@pytest.mark.parametrize("axis", range(3))
def test_of_two_places_as_near_the_earlier_is_taken(axis: int) -> None:
    for ends in ((0, 2), (2, 0)):
        points = np.zeros((3, 3), np.float32)
        points[:, axis] = [*ends, 1]
        assert weld_points(points, 1.5).tolist() == [0, 1, 0]


def test_a_tolerance_far_below_the_spacing_of_floats_changes_nothing() -> None:
    points = sphere(12, offset=(1e6, 0, 0)).positions
    points = points[number_rows(points)[1]]
    assert weld_points(points, 1e-30).tolist() == list(range(len(points)))


def test_attributes_keep_their_seams() -> None:
    ball = sphere(8)
    whole, done = weld(ball, 1e-5)
    assert done.joined == 0 and whole is ball
    joined, done = weld(replace(ball, positions=ball.positions.copy()), 0.2)
    assert done.joined > 0 and joined.uvs is not None and ball.uvs is not None
    before, after = ball.uvs[ball.triangles], joined.uvs[joined.triangles]
    assert np.array_equal(before, after)


@pytest.mark.parametrize("tolerance", [-1.0, float("nan"), float("inf")])
def test_a_tolerance_that_is_none_is_refused(tolerance: float) -> None:
    with pytest.raises(BakeError, match="tolerance"):
        weld(cube(), tolerance)


def test_a_bake_welds_where_asked_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mesh = crumbled(cube(), 1e-4)
    path = tmp_path / "crumbs.obj"
    rows = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in mesh.positions]
    path.write_text("".join(rows) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in mesh.triangles))
    loose = bake_mesh(path, lods=1).report
    assert loose["components"] == 12 and loose["repairs"]["welded"] == 0
    arguments = [
        "mesh",
        str(path),
        "-o",
        str(tmp_path / "a.glb"),
        "--lods",
        "1",
        "--weld",
        "0.0004",
        "--json",
    ]
    assert main(arguments) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["components"] == 1 and report["closed"] and report["repairs"]["welded"] == 28
    assert any("28 places joined" in warning for warning in report["warnings"])


def test_a_tolerance_that_leaves_nothing_is_named(tmp_path: Path) -> None:
    path = tmp_path / "one.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(SourceError, match="once places within 5 metres are joined; join with a smaller"):
        bake_mesh(path, weld_m=5.0)
